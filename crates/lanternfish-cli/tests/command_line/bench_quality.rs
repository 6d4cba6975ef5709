//! `lanternfish bench quality`, end to end on the software adapter.

use std::{fs, path::Path, process::Command};

use serde_json::Value;

/// Runs the bench on the smallest shot; gives its report and what it said meanwhile.
#[track_caller]
fn bench(folder: &Path) -> (Value, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_lanternfish"))
        .current_dir(folder)
        .args(["bench", "quality", "--output", "out", "--adapter", "cpu", "--commit", "test"])
        .args(["--only", "cornell", "--size", "32x32", "--spp", "64", "--runs", "1"])
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert_eq!(stdout.lines().last(), Some("out/report.html"));
    (serde_json::from_slice(&fs::read(folder.join("out/report.json")).unwrap()).unwrap(), stderr)
}

fn truth_files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder.join("out/truths")).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> =
        entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect();
    files.sort();
    files
}

#[test]
fn gpu_every_technique_is_judged_and_truths_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (first, said) = bench(folder.path());
    assert!(said.contains("truth direct: tracing 512 samples"), "{said}");
    let shot = &first["shots"][0];
    let row = |name: &str| {
        let rows = shot["rows"].as_array().unwrap();
        rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no row {name}: {rows:?}"))
    };
    let error = |name: &str, figure: &str| row(name)["figures"]["errors"][figure].as_f64().unwrap();

    // The default is the truth up to the truth's noise, and to 16 samples a pixel. The light is 5 cm below the ceiling's lamp,
    // where few paths carry much: noise of more than one per cent in so small a picture.
    let noise = shot["truths"][0]["noise_energy"].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 0.03, "{noise}");
    for name in ["default", "culling all", "culling tiled 32, aabb off", "shadows bvh", "materials lambert"] {
        let energy = error(name, "energy_ratio");
        assert!((energy - 1.0).abs() < 0.01 + 4.0 * noise, "{name}: energy {energy}, noise {noise}");
    }
    assert_eq!(row("shadows bvh")["figures"]["differing_pixels"], 0);
    assert_eq!(row("shadows bvh")["figures"]["picture"], row("default")["figures"]["picture"]);
    // The harness can fail: without shadows, or without what is reflected more than once, a picture is another.
    for figure in ["flip", "hdr_flip", "relative_mse"] {
        for worse in ["shadows none", "indirect none"] {
            let (worse_error, best) = (error(worse, figure), error("default", figure));
            assert!(worse_error > 2.0 * best, "{worse}: {figure} {worse_error}, default {best}");
        }
    }
    let energy = |name| error(name, "energy_ratio");
    assert!(energy("shadows none") > energy("default") + 0.01 && energy("indirect none") < 0.8 * energy("default"));
    assert_eq!(row("shadows none")["figures"]["rays"], 0);
    assert!(row("default")["figures"]["rays"].as_u64().unwrap() > 1000);

    // Deep images know what occludes from afar better than the view's depth does, and that better than nothing.
    for truth in ["occlusion", "obscurance-far"] {
        let [deep, hbao, none] =
            ["deep 128", "hbao", "none"].map(|technique| error(&format!("{truth} {technique}"), "flip"));
        assert!(deep < 0.6 * hbao && hbao < 0.7 * none, "{truth}: {deep} {hbao} {none}");
    }
    for technique in ["deep 256", "hbao"] {
        let energy = error(&format!("obscurance-near {technique}"), "energy_ratio");
        assert!((energy - 1.0).abs() < 0.02, "{technique}: {energy}");
    }

    // So they know which light of the surroundings arrives, under whichever of the two skies.
    let [deep, hbao, none] =
        ["deep 128", "hbao", "none"].map(|technique| error(&format!("environment {technique}"), "flip"));
    assert!(deep < 0.4 * hbao && deep < 0.4 * none, "{deep} {hbao} {none}");
    let energy = error("environment deep 256", "energy_ratio");
    assert!((energy - 1.0).abs() < 0.06, "{energy}");

    // One bounce: its light is there, by whatever its rays are traced through.
    let energy = |technique| error(&format!("one-bounce {technique}"), "energy_ratio");
    assert!(energy("none") < 0.9, "{}", energy("none"));
    for technique in ["bvh", "bvh half", "across-texels 128", "within-texel 128"] {
        assert!((energy(technique) - 1.0).abs() < 0.05, "{technique}: {}", energy(technique));
    }
    assert!(error("one-bounce bvh", "flip") < 0.7 * error("one-bounce none", "flip"));

    // Lights with a size are not points, and deep images' shadows are better than none.
    let [point, disk] =
        ["0", "0.1, shadow-rays 64"].map(|radius| error(&format!("light-radius {radius}"), "relative_mse"));
    assert!(disk < point, "{disk} {point}");
    assert!(error("shadows deep-image", "relative_mse") < 0.3 * error("shadows none", "relative_mse"));

    // Three reports, which name what is there.
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let (markdown, html) = (read("report.md"), read("report.html"));
    for row in shot["rows"].as_array().unwrap() {
        let name = row["name"].as_str().unwrap();
        assert!(markdown.contains(&format!("| {name} |")), "{name}\n{markdown}");
        let Some(figures) = row["figures"].as_object() else {
            assert!(markdown.contains(row["left_out"].as_str().unwrap()), "{row}");
            continue;
        };
        for picture in [&figures["picture"], &figures["map"]] {
            let picture = picture.as_str().unwrap();
            assert!(html.contains(&format!("src=\"{picture}\"")), "{picture}");
            assert!(folder.path().join("out").join(picture).is_file(), "{picture}");
        }
    }
    assert_eq!(first["commit"], "test");

    // Again: truths that are there are read, one that is broken is traced to the same bytes.
    let truths = truth_files(folder.path());
    let full = truths.iter().position(|(name, _)| name.starts_with("cornell-full-")).unwrap();
    fs::write(folder.path().join("out/truths").join(&truths[full].0), "broken").unwrap();
    let (second, said) = bench(folder.path());
    assert!(said.contains("truth direct: reused") && said.contains("truth full: tracing"), "{said}");
    assert!(truth_files(folder.path()) == truths, "the same truths, byte for byte");
    for truth in second["shots"][0]["truths"].as_array().unwrap() {
        assert_eq!(truth["reused"], truth["name"] != "full", "{truth}");
    }
    for (a, b) in shot["rows"].as_array().unwrap().iter().zip(second["shots"][0]["rows"].as_array().unwrap()) {
        assert_eq!(a["figures"]["errors"], b["figures"]["errors"], "{}", a["name"]);
    }
}

#[test]
fn a_shot_that_is_not_known_is_refused_with_the_list() {
    let output = Command::new(env!("CARGO_BIN_EXE_lanternfish"))
        .args(["bench", "quality", "--only", "bistro"])
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && stderr.contains("cornell") && stderr.contains("sponza-ten"), "{stderr}");
}
