//! `lanternfish reference` and `merge` as processes: what they say, and signals. `src/reference/tests.rs` has the files.

#[cfg(unix)]
mod signals;

use crate::support::Folder;

/// Lines of standard error without the result's, which must occur exactly once, and the estimate of the time left, which slow machines
/// print.
#[track_caller]
fn more_than_usual(stderr: &str) -> String {
    let is_result = |line: &&str| line.contains(" samples per pixel in ") && line.contains(", expected error ");
    assert_eq!(stderr.lines().filter(is_result).count(), 1, "{stderr}");
    let rest = stderr.lines().filter(|line| !is_result(line) && !is_estimate(line));
    rest.map(|line| format!("{line}\n")).collect()
}

fn is_estimate(line: &str) -> bool {
    line.starts_with("note: about ") && line.contains(" left, after ")
}

/// The image's name and the notes of each run, between bars.
#[test]
fn runs_say_what_they_did() {
    let folder = Folder::with(&[
        ("night.toml", "scene = \"demo:cornell\"\n[output]\nsize = [8, 8]\n[look]\nbackground = \"white\"\n"),
        ("sheet.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n"),
    ]);
    for (words, image, parts) in [
        ("night.toml --spp 9", "night.reference.exr", "9 samples per pixel in  |  % | tracer shows the environment"),
        ("demo:cornell --size 8x8 --spp 1 --resume -o a.exr", "a.exr", "no such file yet | unknown below 2 samples"),
        ("demo:cornell --size 8x8 --until-error 1e-6 --spp 20 -o a.exr", "a.exr", "after 20 samples per pixel, not"),
        ("demo:cornell --size 8x8 --spp 1 --lights rain:9 --seed 4 -o a.exr", "a.exr", "--rain-seed"),
        // No machine traces two rows of sixteen thousand paths on a core in two milliseconds.
        (
            "demo:cornell --size 16384x2 --eye 0,1,0.5 --target 0,1,-1 --time-limit 0.002 -o cut.exr",
            "cut.exr",
            "2 of 2 rows have no samples yet and are black; the same command with --resume",
        ),
        ("sheet.obj --size 8x8 --spp 2 -o a.exr", "a.exr", "studio"),
        ("sheet.obj --size 8x8 --spp 2 --light-rig none -o a.exr", "a.exr", "little or no light"),
    ] {
        let ran = folder.done(&format!("reference {words}"));
        assert_eq!(ran.stdout.lines().last(), Some(image), "{words}");
        for part in parts.split(" | ") {
            assert!(ran.stderr.contains(part), "{words}: {part:?} is not in: {}", ran.stderr);
        }
        assert!(!words.starts_with("sheet.obj --size 8x8 --spp 2 -o") || !ran.stderr.contains("little or no light"));
    }
    // Threads do not affect the file, whose parts are merged.
    let cornell = "reference demo:cornell --size 8x8 --samples";
    let table = folder.done(&format!("{cornell} 1-2 --threads 1 --timings -o one.exr"));
    for line in ["triangles", "samples per pixel", "samples dropped", "expected error", "trace", "total"] {
        assert!(table.stdout.lines().any(|other| other.starts_with(line)), "{line}: {table:?}");
    }
    assert!(
        table.stdout.lines().any(|line| line.split_whitespace().eq(["samples,", "this", "run", "128"])),
        "{table:?}"
    );
    assert_eq!(more_than_usual(&table.stderr), "");
    assert_eq!(folder.done(&format!("{cornell} 1-2 --quiet -o two.exr")).stderr, "");
    assert!(folder.read("one.exr") == folder.read("two.exr"));
    folder.done(&format!("{cornell} 3-4 -o more.exr"));
    let merged = folder.done("merge more.exr one.exr -o merged.exr");
    let said = "merged.exr: samples 1-4 of a pixel, of 2 parts, expected error ";
    assert!(merged.stdout == "merged.exr\n" && merged.stderr.contains(said), "{merged:?}");
    let late = folder.done("merge more.exr -o late.exr");
    assert!(late.stderr.contains("samples 1-2 are missing before it"), "{late:?}");
}

#[test]
#[ignore = "full"]
fn gpu_a_png_has_the_colours_of_render() {
    let folder = Folder::with(&[("empty.gltf", r#"{ "asset": { "version": "2.0" } }"#)]);
    for (curve, sky, exposure) in [
        ("none", "0.02,0.3,0.9", "0"),
        ("neutral", "1,0.5,0.001", "1.5"),
        ("reinhard", "40,3,0", "-1"),
        ("aces", "0.0001,0.7,0.1", "-0.3"),
    ] {
        let words =
            format!("empty.gltf --quiet --size 4x4 --sky {sky} --tone-map {curve} --exposure {exposure} -o a.png");
        folder.done(&format!("reference {words} --spp 1"));
        let ours = folder.png("a.png").pixels;
        folder.render(&format!("{words} --indirect none"));
        // One step of 255, where half-precision floats round the other way.
        for (a, b) in ours.as_flattened().iter().zip(folder.png("a.png").pixels.as_flattened()) {
            assert!((a - b).abs() <= 1.01 / 255.0, "{words}: {a} {b}");
        }
    }
}

#[test]
#[ignore = "full"]
fn gpu_a_png_has_the_exposure_of_render() {
    let folder = Folder::new();
    let ev = |line: &str| {
        let said = folder.done(&format!("{line} --size 64x48 -o a.png")).stderr;
        let ev = said.split("shown at ").nth(1).and_then(|rest| rest.split(' ').next()).map(str::parse::<f32>);
        ev.unwrap_or_else(|| panic!("{said}")).unwrap()
    };
    // Lamps beside which the box's own lamp, which only the reference includes, is negligible.
    for point in ["0,1,0,20", "0,1,0,100000"] {
        let render = ev(&format!("render demo:cornell --adapter cpu --indirect none --point {point}"));
        let reference = ev(&format!("reference demo:cornell --max-depth 2 --spp 64 --point {point}"));
        // Two metering steps, for noise and edges.
        assert!((render - reference).abs() <= 0.25, "{point}: {render} {reference}");
    }
}
