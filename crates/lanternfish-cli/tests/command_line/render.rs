//! From the command line to an image, on the software adapter.

use std::{fs, path::Path};

use serde_json::Value;

use crate::support::{Folder, Ran};

#[test]
fn gpu_a_png_a_table_and_a_report() {
    let folder = Folder::with(&[("cornell.png", "not an image")]);
    let ran = folder.render("demo:cornell --lights rain:20 --timings --report run.json");
    // The default name is the scene's, and an old file is replaced.
    assert_eq!(
        (ran.stdout.lines().last(), folder.names("")),
        (Some("cornell.png"), vec!["cornell.png".to_owned(), "run.json".to_owned()])
    );
    assert!(ran.stdout.lines().any(|line| line.starts_with("counter")), "{ran:?}");
    let said: Vec<_> = ran.stderr.lines().filter(|line| !line.starts_with("note: shown at ")).collect();
    assert!(said.is_empty(), "a faultless run without a terminal only notes the exposure: {said:?}");

    let png = folder.read("cornell.png");
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    // IHDR: width and height, big-endian.
    assert_eq!((&png[16..20], &png[20..24]), (&48u32.to_be_bytes()[..], &32u32.to_be_bytes()[..]));

    let report = folder.json("run.json");
    assert_eq!((&report["width"], &report["height"]), (&48.into(), &32.into()));
    assert_eq!(report["settings"]["culling"], "clustered");
    assert_eq!(report["output"], "cornell.png");
    for text in ["adapter", "driver", "scene"] {
        assert!(report[text].as_str().is_some_and(|text| !text.is_empty()), "{text}: {report}");
    }
    for pass in report["passes"].as_array().unwrap() {
        assert!(pass["name"].is_string() && pass["ms"].is_f64(), "{pass}");
    }
    let counters = report["counters"].as_object().unwrap();
    assert!(!counters.is_empty() && counters.values().all(Value::is_u64), "{report}");
    for step in ["load", "upload", "render", "write", "total"] {
        assert!(report["seconds"][step].is_f64(), "{step}: {report}");
    }
    #[cfg(target_os = "linux")]
    assert!(report["peak_memory_bytes"].as_u64().unwrap() > 1 << 20);
}

/// An EXR file is linear and the same every time; exposure and tone map affect display images only. A PNG image goes to
/// a file or to standard output.
#[test]
fn gpu_every_format_holds_the_image() {
    let folder = Folder::new();
    let light = "demo:cornell --size 24x16 --indirect none --point 0,1,0,20";
    assert_eq!(folder.render(&format!("{light} -o a.exr")).stdout, "a.exr\n");
    let image = folder.exr("a.exr");
    assert_eq!((image.width, image.height), (24, 16));
    let brightest = image.pixels.iter().flatten().copied().fold(0.0, f32::max);
    assert!(brightest.is_finite() && brightest > 0.0, "an image of something: brightest {brightest}");
    assert!(image.pixels.iter().any(|pixel| *pixel != image.pixels[0]));
    let told = folder.render(&format!("{light} --tone-map aces --exposure 3 -o b.exr")).stderr;
    assert!(told.contains("note: --exposure does not change an .exr file"), "{told}");
    assert_eq!(folder.read("b.exr"), folder.read("a.exr"));
    folder.render(&format!("{light} -o a.jpg"));
    assert!(folder.read("a.jpg").starts_with(b"\xff\xd8\xff"));
    // A PNG image is metered to be visible, and the exposure that was chosen repeats it.
    let said = folder.render(&format!("{light} -o a.png")).stderr;
    let pixels = folder.png("a.png").pixels;
    let mean = pixels.as_flattened().iter().sum::<f32>() / (3 * pixels.len()) as f32;
    let ev = said.split("--exposure ").nth(1).and_then(|rest| rest.split(' ').next()).expect("what was chosen is said");
    assert!((0.15..0.4).contains(&mean), "{mean} at {ev} EV");
    let words = format!("render {light} --adapter cpu --exposure {ev} -o -");
    let output = folder.program().args(words.split(' ')).output().unwrap();
    assert!(output.status.success() && output.stdout == folder.read("a.png"));
}

#[test]
fn gpu_a_folder_of_scenes_becomes_a_folder_of_thumbnails() {
    let folder = Folder::with(&[("both.toml", "scene = \"models/a.gltf\"\n[view]\neye = [1, 2, 3]\nview = \"top\"\n")]);
    fs::create_dir_all(folder.path("models/more/textures")).unwrap();
    let warned = r#"{ "asset": { "version": "2.0" }, "extensionsUsed": ["EXT_one"],
                      "animations": [ { "channels": [ { "sampler": 0, "target": { "path": "pointer" } } ], "samplers": [] } ] }"#;
    folder.write("models/b.gltf", warned);
    for name in ["a.gltf", "more/a.gltf", "notes.txt"] {
        folder.write(&format!("models/{name}"), r#"{ "asset": { "version": "2.0" } }"#);
    }
    let ran = folder.run("render --adapter cpu --sky 1,0,0 --indirect none --shadows none both.toml models missing.glb --thumbnails -o images");
    // The others are rendered, and the failures are not forgotten.
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(1), "images/a.png\nimages/b.png\n"));
    let errors = ran.stderr;
    assert!(errors.contains("both.toml:4:1: `view` cannot be used with `eye`"), "{errors}");
    assert!(errors.ends_with("2 of 4 scenes failed: both.toml, missing.glb\n"), "{errors}");
    assert!(errors.contains("note: not rendered, unless named: scenes in models/more\n"), "{errors}");
    assert!(errors.contains("missing.glb") && folder.names("images") == ["a.png", "b.png"], "{errors}");
    let image = folder.png("images/b.png");
    assert_eq!((image.width, image.height), (256, 256));
    // `info` has the warnings of `render`.
    let warnings =
        |stderr: &str| stderr.lines().filter(|line| line.contains("WARN")).map(str::to_owned).collect::<Vec<_>>();
    let info = warnings(&folder.done("info models/b.gltf").stderr);
    assert!(info.len() == 2 && info[0].contains("EXT_one") && info[1].contains("animations"), "{info:?}");
    assert_eq!(warnings(&errors), info);
}

#[test]
#[ignore = "full"]
fn gpu_a_track_and_two_eyes_have_one_exposure() {
    // From in front of the lamp into a corner.
    let track = "scene = 'demo:cornell'\n[output]\noutput = 'a.png'\n[indirect]\nindirect = 'none'\n[view]\ntarget = [0, 1, 0]\n[track]\nframes = 2\nkeyframes = \
                 [{ time = 0, eye = [0, 1, 3.6] }, { time = 1, eye = [0.3, 0.2, 0.3] }]\n";
    let folder = Folder::with(&[("track.toml", track)]);
    let said = folder.render("track.toml --report a.json").stderr;
    assert_eq!(said.matches("shown at").count(), 1, "{said}");
    let report = folder.json("a.json");
    let ev = report["exposure_ev"].as_f64().unwrap();
    assert!(said.contains(&format!("--exposure {ev} ")) && said.contains("metered in the first image"), "{said}");
    assert_eq!(report["settings"]["exposure"], "auto");
    let last = folder.read("a.0002.png");
    folder.render(&format!("track.toml --exposure {ev}"));
    assert!(folder.read("a.0002.png") == last);
    // Negative control: the second image alone is metered differently. Two eyes are metered together, and their frames
    // are counted once.
    let alone = folder.render("track.toml --time 1 --stereo parallel:1 --accumulate 3 --report b.json").stderr;
    assert!(!alone.contains(&format!("--exposure {ev} ")) && alone.matches("shown at").count() == 1, "{alone}");
    let report = folder.json("b.json");
    assert_eq!(
        (&report["counters"]["progressive/frames"], &report["settings"]["accumulate"]),
        (&3.into(), &"3".into())
    );
}

#[test]
#[ignore = "full"]
fn gpu_a_heat_map_has_a_scale_below_it_and_in_a_note() {
    let folder = Folder::new();
    let said = folder.render("demo:cornell --lights rain:20 --debug-view light-count -o a.png").stderr;
    assert!(said.contains("note: scale of light-count: listed lights, linear: 0 is black, 10 and more red"), "{said}");
    let rendering = folder.png("a.png");
    assert!(rendering.width >= 48 && rendering.height > 32, "{} x {}", rendering.width, rendering.height);
    // Red, the last colour of the bar, occurs only at its right end.
    let is_red = |pixel: &[f32; 3]| *pixel == [1.0, 0.0, 0.0];
    let below = rendering.pixels[32 * rendering.width..].chunks(rendering.width);
    let reds: Vec<usize> = below.flat_map(|row| (0..row.len()).filter(|x| is_red(&row[*x]))).collect();
    assert!(!reds.is_empty() && reds.iter().all(|x| *x > rendering.width / 2), "{reds:?} of {}", rendering.width);
    // A direction has no scale, and a scale may be left out.
    for words in ["--debug-view normal", "--debug-view depth --legend off"] {
        folder.render(&format!("demo:cornell {words} -o b.png"));
        let plain = folder.png("b.png");
        assert_eq!((plain.width, plain.height), (48, 32), "{words}");
    }
}

#[test]
#[ignore = "full"]
fn gpu_occlusion_without_effect_is_noted() {
    let folder = Folder::new();
    let exr = |words: &str| {
        let said = folder.render(&format!("demo:cornell --size 24x16 --sky 1,1,1 -o a.exr {words}")).stderr;
        (folder.exr("a.exr").pixels, said.contains("--occlusion has no effect on this image"))
    };
    let (rays, said) = exr("");
    assert!(!said);
    assert!(exr("--occlusion deep") == (rays, true), "the note is true");
    let (alone, said) = exr("--occlusion deep --indirect none");
    assert!(!said && alone != exr("--indirect none").0, "without rays it does something");
    let view = folder.render("demo:cornell --occlusion deep --debug-view occlusion -o view.png").stderr;
    assert!(!view.contains("has no effect"), "{view}");
}

#[test]
#[ignore = "full"]
fn gpu_a_hidden_background_gives_files_alpha() {
    let folder = Folder::new();
    let bytes = |words: &str| {
        folder.render(&format!("demo:furnace --size 8x8 --indirect none {words}"));
        folder.read(words.split(' ').next_back().unwrap())
    };
    // The colour type of a PNG file, and channel A of half floats.
    let color_type = |words: &str| bytes(words)[25];
    let has_alpha = |words: &str| bytes(words).windows(6).any(|bytes| bytes == b"A\0\x01\0\0\0");
    assert_eq!((color_type("-o a.png"), color_type("--background transparent -o b.png")), (2, 6));
    assert_eq!((color_type("--background white -o c.png"), folder.png("c.png").pixels[0]), (2, [1.0; 3]));
    assert!(!has_alpha("-o a.exr") && has_alpha("--background #010203 -o c.exr"));
    assert!(has_alpha("--background transparent -o b.exr") && folder.exr("b.exr").pixels[0] == [0.0; 3]);
}

/// The image is there already, so nothing is rendered.
#[test]
#[cfg(target_os = "linux")]
fn the_systems_viewer_opens_the_image() {
    use std::os::unix::fs::PermissionsExt;

    use lanternfish_metrics::{ColorType, write_png};

    let folder = Folder::with(&[("xdg-open", "#!/bin/sh\nprintf %s \"$1\" > opened\n")]);
    fs::set_permissions(folder.path("xdg-open"), fs::Permissions::from_mode(0o755)).unwrap();
    write_png(&folder.path("-.png"), [4, 4], ColorType::Rgb, &[7; 4 * 4 * 3]).unwrap();
    let words = "render demo:cornell --size 4x4 -o-.png --skip-existing --open";
    let open = |programs: &Path| Ran::of(folder.program().args(words.split(' ')).env("PATH", programs));
    assert_eq!(open(&folder.path("")).succeeded().stdout, "-.png\n");
    assert_eq!(Path::new(&String::from_utf8(folder.read("opened")).unwrap()), folder.path("-.png"));
    let ran = open(Path::new("/nonexistent"));
    assert!(ran.code == Some(1) && ran.stderr.contains("`xdg-open` has not opened -.png"), "{ran:?}");
}
