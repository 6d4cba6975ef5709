//! From the command line to an image, on the software adapter.

use std::{fs, path::Path};

use lanternfish_metrics::{RgbImage, read_exr, read_png, write_exr};
use serde_json::Value;

use crate::support::{lanternfish, names};

/// Runs `lanternfish render` in `folder`. Returns its standard output and standard error.
#[track_caller]
fn render_scene(folder: &Path, scene: &str, words: &str) -> (String, String) {
    let output = lanternfish(folder)
        .args(["render", scene, "--adapter", "cpu", "--size", "48x32"])
        .args(words.split_whitespace())
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    // Warnings about old drivers are the same for every run.
    let said = stderr.split_inclusive('\n').filter(|line| !line.starts_with("warning: Mesa ")).collect();
    (String::from_utf8(output.stdout).unwrap(), said)
}

/// Runs `lanternfish render demo:cornell` in `folder`. Returns its standard output.
#[track_caller]
fn render(folder: &Path, words: &str) -> String {
    let (stdout, stderr) = render_scene(folder, "demo:cornell", words);
    let said: Vec<_> = stderr.lines().filter(|line| !line.starts_with("note: shown at ")).collect();
    assert!(said.is_empty(), "a faultless run without a terminal only notes the exposure: {stderr}");
    stdout
}

#[test]
fn gpu_a_png_a_table_and_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let stdout = render(folder.path(), "--lights rain:20 --timings --report run.json -o image.png");
    assert_eq!(stdout.lines().last(), Some("image.png"));
    assert!(stdout.lines().any(|line| line.starts_with("counter")), "{stdout}");
    assert_eq!(names(folder.path()), ["image.png", "run.json"]);

    let png = fs::read(folder.path().join("image.png")).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    // IHDR: width and height, big-endian.
    assert_eq!((&png[16..20], &png[20..24]), (&48u32.to_be_bytes()[..], &32u32.to_be_bytes()[..]));

    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("run.json")).unwrap()).unwrap();
    assert_eq!((&report["width"], &report["height"]), (&48.into(), &32.into()));
    assert_eq!(report["settings"]["culling"], "clustered");
    assert_eq!(report["output"], "image.png");
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

#[test]
fn gpu_an_exr_is_linear_and_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let exr = |name: &str, words: &str| {
        assert_eq!(render(folder.path(), &format!("--point 0,1,0,20 -o {name} {words}")), format!("{name}\n"));
        (fs::read(folder.path().join(name)).unwrap(), read_exr(&folder.path().join(name)).unwrap())
    };
    let (bytes, image) = exr("a.exr", "");
    assert_eq!((image.width, image.height), (48, 32));
    let brightest = image.pixels.iter().flatten().copied().fold(0.0, f32::max);
    assert!(brightest.is_finite() && brightest > 0.0, "an image of something: brightest {brightest}");
    assert!(image.pixels.iter().any(|pixel| *pixel != image.pixels[0]));
    assert_eq!(exr("b.exr", "").0, bytes, "same command, same bytes");

    // Exposure and tone map affect the display image only, not the scene's radiance.
    let direct = exr("c.exr", "--indirect none").0;
    assert_eq!(exr("d.exr", "--indirect none --tone-map aces").0, direct);
    let words = "render demo:furnace --size 4x4 --indirect none --adapter cpu --exposure 3 -o f.exr";
    let told = lanternfish(folder.path()).args(words.split_whitespace()).output().unwrap().stderr;
    assert!(String::from_utf8(told).unwrap().contains("note: --exposure does not change an .exr file"));
    // Negative control: the comparison detects an added light.
    assert_ne!(exr("e.exr", "--indirect none --point 0,1,0.2,20").0, direct);
}

#[test]
fn gpu_frames_are_averaged() {
    let folder = tempfile::tempdir().unwrap();
    let exr = |name: &str, words: &str| {
        render(folder.path(), &format!("--point 0,1,0,20 --indirect none --report run.json -o {name} {words}"));
        let report: Value = serde_json::from_slice(&fs::read(folder.path().join("run.json")).unwrap()).unwrap();
        let frames = report["counters"].get("progressive/frames").map(|frames| frames.as_u64().unwrap());
        (read_exr(&folder.path().join(name)).unwrap().pixels, frames, report["settings"]["accumulate"].clone())
    };
    let plain = exr("plain.exr", "");
    assert_eq!((plain.1, &plain.2), (None, &"1".into()));
    assert_eq!(exr("one.exr", "--accumulate 1"), plain);
    let many = exr("many.exr", "--accumulate 3");
    assert_eq!((many.1, &many.2), (Some(3), &"3".into()));
    assert_ne!(many.0, plain.0, "edges are smoother");
    assert_eq!(exr("again.exr", "--accumulate 3"), many);
    // The frames of two eyes are counted once.
    assert_eq!(exr("eyes.exr", "--accumulate 3 --stereo parallel").1, Some(3));
}

#[test]
fn gpu_images_are_metered_to_be_visible() {
    let folder = tempfile::tempdir().unwrap();
    let png = |name: &str, words: &str| {
        let (_, said) = render_scene(folder.path(), "demo:cornell", &format!("--indirect none -o {name} {words}"));
        let ev = said.split("--exposure ").nth(1).and_then(|rest| rest.split(' ').next()).map(str::to_owned);
        (read_png(&folder.path().join(name)).unwrap().pixels, ev)
    };
    let mean = |pixels: &[[f32; 3]]| pixels.iter().flatten().sum::<f32>() / (3 * pixels.len()) as f32;
    // Seventeen doublings: from a lamp that is negligible beside the box's own lamp to one beside which that is negligible; and
    // the sun of a bright day, through the open side.
    let lamps = ["0,1,0,1", "0,1,0,100", "0,1,0,10000", "0,1,0,100000"].map(|point| format!("--point {point}"));
    let mut evs = Vec::new();
    for light in lamps.into_iter().chain(["--sun 0.2,-0.3,-1,100000".to_owned()]) {
        let (pixels, ev) = png("a.png", &light);
        assert!((0.15..0.4).contains(&mean(&pixels)), "{light} at {ev:?} EV: {}", mean(&pixels));
        assert!(png("b.png", &light) == (pixels.clone(), ev.clone()), "{light}: metered otherwise a second time");
        let ev = ev.expect("what was chosen is said");
        let (again, said) = png("b.png", &format!("{light} --exposure {ev}"));
        assert!(again == pixels && said.is_none(), "{light} at {ev} EV");
        evs.push(ev.parse::<f32>().unwrap());
    }
    assert!(evs[0] - evs[3] > 10.0 && evs[0] - evs[4] > 10.0, "{evs:?}");
    // Negative control: at 0 EV, a lamp of 100,000 cd turns more than half of the image white.
    assert!(mean(&png("a.png", "--point 0,1,0,100000 --exposure 0 --indirect sampled").0) > 0.5);
}

#[test]
fn gpu_a_track_and_two_eyes_have_one_exposure() {
    let folder = tempfile::tempdir().unwrap();
    // From in front of the lamp into a corner.
    let track = "scene = 'demo:cornell'\n[output]\noutput = 'a.png'\n[indirect]\nindirect = 'none'\n[view]\ntarget = [0, 1, 0]\n[track]\nframes = 2\nkeyframes = \
                 [{ time = 0, eye = [0, 1, 3.6] }, { time = 1, eye = [0.3, 0.2, 0.3] }]\n";
    fs::write(folder.path().join("track.toml"), track).unwrap();
    let said = render_scene(folder.path(), "track.toml", "--report a.json").1;
    assert_eq!(said.matches("shown at").count(), 1, "{said}");
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let ev = report["exposure_ev"].as_f64().unwrap();
    assert!(said.contains(&format!("--exposure {ev} ")) && said.contains("metered in the first image"), "{said}");
    assert_eq!(report["settings"]["exposure"], "auto");
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let last = bytes("a.0002.png");
    render_scene(folder.path(), "track.toml", &format!("--exposure {ev}"));
    assert!(bytes("a.0002.png") == last);
    // Negative control: the second image alone is metered differently.
    let alone = render_scene(folder.path(), "track.toml", "--time 1").1;
    assert!(!alone.contains(&format!("--exposure {ev} ")), "{alone}");
    // Two eyes are metered together.
    assert_eq!(
        render_scene(folder.path(), "track.toml", "--time 1 --stereo parallel:1").1.matches("shown at").count(),
        1
    );
}

#[test]
fn gpu_a_heat_map_has_a_scale_below_it_and_in_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let (_, said) = render_scene(folder.path(), "demo:cornell", "--lights rain:20 --debug-view light-count -o a.png");
    assert!(said.contains("note: scale of light-count: listed lights, linear: 0 is black, 10 and more red"), "{said}");
    let rendering = read_png(&folder.path().join("a.png")).unwrap();
    assert!(rendering.width >= 48 && rendering.height > 32, "{} x {}", rendering.width, rendering.height);
    // Red, the last colour of the bar, occurs only at its right end.
    let is_red = |pixel: &[f32; 3]| *pixel == [1.0, 0.0, 0.0];
    let below = rendering.pixels[32 * rendering.width..].chunks(rendering.width);
    let reds: Vec<usize> = below.flat_map(|row| (0..row.len()).filter(|x| is_red(&row[*x]))).collect();
    assert!(!reds.is_empty() && reds.iter().all(|x| *x > rendering.width / 2), "{reds:?} of {}", rendering.width);
    // A direction has no scale.
    render_scene(folder.path(), "demo:cornell", "--debug-view normal -o b.png");
    let normals = read_png(&folder.path().join("b.png")).unwrap();
    assert_eq!((normals.width, normals.height), (48, 32));
}

#[test]
fn gpu_occlusion_without_effect_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let exr = |name: &str, words: &str| {
        let said = render_scene(folder.path(), "demo:cornell", &format!("--sky 1,1,1 -o {name} {words}")).1;
        (read_exr(&folder.path().join(name)).unwrap().pixels, said.contains("--occlusion has no effect on this image"))
    };
    let (rays, said) = exr("rays.exr", "");
    assert!(!said);
    let (both, said) = exr("both.exr", "--occlusion deep");
    assert!(said && both == rays, "the note is true");
    let (alone, said) = exr("alone.exr", "--occlusion deep --indirect none");
    assert!(!said && alone != exr("none.exr", "--indirect none").0, "without rays it does something");
    let view = render_scene(folder.path(), "demo:cornell", "--occlusion deep --debug-view occlusion -o view.png").1;
    assert!(!view.contains("has no effect"), "{view}");
}

#[test]
fn gpu_the_default_name_is_the_scenes_and_replaces_an_old_file() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cornell.png"), "not an image").unwrap();
    assert_eq!(render(folder.path(), "--quiet"), "cornell.png\n");
    assert_eq!(names(folder.path()), ["cornell.png"]);
    assert!(fs::read(folder.path().join("cornell.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn gpu_an_image_is_a_jpeg_or_goes_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path(), "--indirect none -o a.jpg");
    assert!(fs::read(folder.path().join("a.jpg")).unwrap().starts_with(b"\xff\xd8\xff"));
    render(folder.path(), "--indirect none -o a.png");
    let words = "render demo:cornell --adapter cpu --size 48x32 --indirect none -o -";
    let output = lanternfish(folder.path()).args(words.split(' ')).output().unwrap();
    assert!(output.status.success() && output.stdout == fs::read(folder.path().join("a.png")).unwrap());
    for words in ["--background transparent -o a.jpg", "--timings -o -", "--orbit 4 -o -"] {
        let refused =
            lanternfish(folder.path()).args(["render", "demo:cornell"]).args(words.split(' ')).output().unwrap();
        assert_eq!(refused.status.code(), Some(1), "{words}");
    }
}

#[test]
fn gpu_a_hidden_background_gives_files_alpha() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |words: &str| {
        render_scene(folder.path(), "demo:furnace", &format!("--indirect none {words}"));
        fs::read(folder.path().join(words.split(' ').next_back().unwrap())).unwrap()
    };
    // The colour type of a PNG file, and channel A of half floats.
    let color_type = |words: &str| bytes(words)[25];
    let has_alpha = |words: &str| bytes(words).windows(6).any(|bytes| bytes == b"A\0\x01\0\0\0");
    assert_eq!((color_type("-o a.png"), color_type("--background transparent -o b.png")), (2, 6));
    assert_eq!(color_type("--background white -o c.png"), 2);
    let white = read_png(&folder.path().join("c.png")).unwrap();
    assert_eq!(white.pixels[0], [1.0; 3]);
    assert!(
        !has_alpha("-o a.exr")
            && has_alpha("--background transparent -o b.exr")
            && has_alpha("--background #010203 -o c.exr")
    );
    let hidden = read_exr(&folder.path().join("b.exr")).unwrap();
    assert_eq!(hidden.pixels[0], [0.0; 3]);
}

#[test]
fn gpu_a_folder_of_scenes_becomes_a_folder_of_thumbnails() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("models")).unwrap();
    for name in ["b.gltf", "a.gltf", "notes.txt"] {
        fs::write(folder.path().join("models").join(name), r#"{ "asset": { "version": "2.0" } }"#).unwrap();
    }
    let run = |words: &str| {
        let output = lanternfish(folder.path())
            .args(["render", "--adapter", "cpu", "--sky", "1,0,0"])
            .args(words.split(' '))
            .output();
        let output = output.unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    fs::create_dir_all(folder.path().join("models/more/textures")).unwrap();
    fs::copy(folder.path().join("models/a.gltf"), folder.path().join("models/more/a.gltf")).unwrap();
    let shot = "scene = \"models/a.gltf\"\n[view]\neye = [1, 2, 3]\nview = \"top\"\n";
    fs::write(folder.path().join("both.toml"), shot).unwrap();
    let (code, said, errors) = run("both.toml models missing.glb --thumbnails -o images");
    // The others are rendered, and the failures are not forgotten.
    assert_eq!((code, said.as_str()), (Some(1), "images/a.png\nimages/b.png\n"));
    assert!(errors.contains("both.toml: the argument '--eye <x,y,z>' cannot be used with"), "{errors}");
    assert!(errors.ends_with("2 of 4 scenes failed: both.toml, missing.glb\n"), "{errors}");
    assert!(errors.contains("note: not rendered, unless named: scenes in models/more\n"), "{errors}");
    assert!(errors.contains("missing.glb") && names(&folder.path().join("images")) == ["a.png", "b.png"], "{errors}");
    let image = read_png(&folder.path().join("images/b.png")).unwrap();
    assert_eq!((image.width, image.height), (256, 256));
    for (words, why) in [
        ("models -o one.png", "no folder"),
        ("models --report a.json", "--report"),
        ("images", "without a scene"),
        (".", "name them: ./models"),
        ("models --outputs position", "with several scenes: their images are .png files"),
        ("models -o missing/images", "missing"),
    ] {
        let (code, _, errors) = run(words);
        assert!(code == Some(1) && errors.contains(why), "{words}: {errors}");
    }
}

#[test]
fn gpu_empty_scenes_render() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("empty.gltf"), r#"{ "asset": { "version": "2.0" } }"#).unwrap();
    let (stdout, stderr) = render_scene(folder.path(), "empty.gltf", "--sky 0.25,0.5,1 -o sky.exr");
    assert_eq!(stdout, "sky.exr\n");
    // Regression: the note said that the scene was dark, although its sky is not.
    assert_eq!(stderr, "note: the scene has no geometry: only its environment is visible\n");
    let sky = read_exr(&folder.path().join("sky.exr")).unwrap();
    assert!(sky.pixels.iter().all(|pixel| *pixel == [0.25, 0.5, 1.0]), "{:?}", sky.pixels[0]);

    // Two columns: the view ahead is their mean; rotated by a quarter to the left, it is the right one.
    let pixels = vec![[1.0, 0.0, 4.0], [0.0, 2.0, 0.0]];
    write_exr(&folder.path().join("env.exr"), &RgbImage::new(2, 1, pixels).unwrap()).unwrap();
    let seen = |name: &str, words: &str| {
        let words =
            format!("--environment env.exr --sky 9,9,9 --fov-y 0.1 --eye 0,0,0 --target 0,0,-1 -o {name} {words}");
        render_scene(folder.path(), "empty.gltf", &words);
        let rendering = read_exr(&folder.path().join(name)).unwrap();
        rendering.pixels[16 * 48 + 24]
    };
    let near = |actual: [f32; 3], expected: [f32; 3]| {
        let is_near = actual.iter().zip(expected).all(|(actual, expected)| (actual - expected).abs() < 0.01);
        assert!(is_near, "{actual:?}, not {expected:?}");
    };
    near(seen("ahead.exr", ""), [0.5, 1.0, 2.0]);
    near(seen("turned.exr", "--environment-rotation 90 --environment-scale 0.5"), [0.0, 1.0, 0.0]);

    assert_eq!(render_scene(folder.path(), "empty.gltf", "--quiet -o quiet.png").1, "");
    render_scene(folder.path(), "empty.gltf", "--lights rain:10 --culling all -o rain.png");
}

/// A cube of 2 m whose faces point outwards or inwards.
fn cube(inwards: bool) -> String {
    let corners = (0..8).map(|i| format!("v {} {} {}\n", 2 * (i & 1) - 1, (i & 2) - 1, (i >> 1 & 2) - 1));
    let faces = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    let face = |[a, b, c, d]: [u32; 4]| match inwards {
        false => format!("f {a} {b} {c} {d}\n"),
        true => format!("f {d} {c} {b} {a}\n"),
    };
    corners.chain(faces.map(face)).collect()
}

/// Mean of all channels in the middle of the image and in its upper right corner.
fn middle_and_corner(path: &Path) -> (f32, f32) {
    let rendering = read_exr(path).unwrap();
    let mean = |x: usize, y: usize| {
        let block = (0..16).map(|i| rendering.pixels[(y + i / 4) * rendering.width + x + i % 4]);
        block.flatten().sum::<f32>() / 48.0
    };
    (mean(22, 14), mean(44, 0))
}

#[test]
fn gpu_a_file_without_light_is_lit() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cube.obj"), cube(false)).unwrap();
    fs::write(folder.path().join("room.obj"), cube(true)).unwrap();
    let seen = |scene: &str, words: &str| {
        let (_, stderr) = render_scene(folder.path(), scene, &format!("{words} -o a.exr"));
        (middle_and_corner(&folder.path().join("a.exr")), stderr)
    };
    // Regression: the image was black, with a hint whose sun shone from behind.
    let ((cube, backdrop), stderr) = seen("cube.obj", "");
    assert!(stderr.starts_with("note: ") && stderr.contains("studio") && stderr.contains("--light-rig"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!((0.2..1.2).contains(&cube) && (0.1..0.4).contains(&backdrop), "{cube} before {backdrop}");
    assert_eq!(seen("cube.obj", "--quiet"), ((cube, backdrop), String::new()));
    for side in ["back", "top"] {
        let ((cube, backdrop), _) = seen("cube.obj", &format!("--view {side}"));
        assert!((0.2..1.2).contains(&cube) && (0.1..0.4).contains(&backdrop), "{side}: {cube} before {backdrop}");
    }
    // An environment that reaches no surface does not count as light.
    let ((cube, sky), stderr) = seen("cube.obj", "--indirect none");
    assert!(stderr.contains("built-in sun") && (0.2..1.2).contains(&cube) && sky > 0.2, "{stderr}{cube} {sky}");

    let (dark, stderr) = seen("cube.obj", "--light-rig none");
    assert!(dark == (0.0, 0.0) && stderr.contains("little or no light"), "{dark:?} {stderr}");
    let sun = stderr.split_whitespace().skip_while(|word| *word != "--sun").nth(1).expect("a sun is suggested");
    let ((cube, black), stderr) = seen("cube.obj", &format!("--sun {sun}"));
    assert!(cube > 0.2 && black == 0.0 && stderr.is_empty(), "{sun}: {cube}, {black}, {stderr}");

    let ((walls, _), stderr) = seen("room.obj", "");
    assert!(stderr.contains("closed interior") && stderr.contains("--eye") && stderr.contains("studio"), "{stderr}");
    assert!(walls > 0.1, "the rig lights a closed interior: {walls}");
}

#[test]
fn gpu_an_object_beside_a_weak_light_gets_a_dim_studio() {
    let folder = tempfile::tempdir().unwrap();
    // A square of 4 m, 2 m in front of a spot light that lights a disk on it.
    let corners: [[f32; 3]; 4] = [[-2.0, -2.0, -2.0], [2.0, -2.0, -2.0], [-2.0, 2.0, -2.0], [2.0, 2.0, -2.0]];
    let mut bytes: Vec<u8> = corners.into_iter().flatten().flat_map(f32::to_le_bytes).collect();
    bytes.extend([0_u16, 1, 2, 2, 1, 3].into_iter().flat_map(u16::to_le_bytes));
    fs::write(folder.path().join("square.bin"), bytes).unwrap();
    let text = |outer: f32| {
        format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {{ "KHR_lights_punctual": {{ "lights": [
                {{ "type": "spot", "intensity": 4, "spot": {{ "outerConeAngle": {outer} }} }} ] }} }},
            "scenes": [ {{ "nodes": [0, 1] }} ],
            "nodes": [ {{ "mesh": 0 }}, {{ "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }} ],
            "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "indices": 1 }} ] }} ],
            "buffers": [ {{ "uri": "square.bin", "byteLength": 60 }} ],
            "bufferViews": [ {{ "buffer": 0, "byteLength": 48 }}, {{ "buffer": 0, "byteOffset": 48, "byteLength": 12 }} ],
            "accessors": [
                {{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-2, -2, -2], "max": [2, 2, -2] }},
                {{ "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }} ] }}"#
        )
    };
    fs::write(folder.path().join("night.gltf"), text(0.1)).unwrap();
    fs::write(folder.path().join("lit.gltf"), text(1.2)).unwrap();
    // Fraction of the image that is black, and the note about added light.
    let seen = |scene: &str, words: &str| {
        let (_, stderr) = render_scene(folder.path(), scene, &format!("{words} -o a.png"));
        let rendering = read_png(&folder.path().join("a.png")).unwrap();
        let black = rendering.pixels.iter().filter(|pixel| pixel.iter().all(|value| *value < 0.005)).count();
        let said = stderr.lines().find(|line| line.contains("most of the image black")).map(str::to_owned);
        (black as f64 / rendering.pixels.len() as f64, said)
    };
    let (black, said) = seen("night.gltf", "");
    let said = said.expect("a studio was added");
    assert!(black < 0.1, "{black}");
    let first = fs::read(folder.path().join("a.png")).unwrap();
    let (_, flags) = said.split_once("added (").expect("flags are named");
    let (flags, _) = flags.split_once(" repeats it").expect("flags are named");
    assert_eq!(seen("night.gltf", flags).1, None);
    assert_eq!(fs::read(folder.path().join("a.png")).unwrap(), first, "{flags} repeats the image");
    // Flags that set the light prevent it.
    for words in ["--light-rig none", "--exposure 0"] {
        let (black, said) = seen("night.gltf", words);
        assert!(black > 0.8 && said.is_none(), "{words}: {black} {said:?}");
    }
    // A lit object in front of nothing is black on black, too.
    let (black, said) = seen("lit.gltf", "");
    assert!(black < 0.1 && said.is_some(), "{black} {said:?}");
}

#[test]
fn gpu_info_has_the_warnings_of_render() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"{ "asset": { "version": "2.0" }, "extensionsUsed": ["EXT_one"],
                    "animations": [ { "channels": [ { "sampler": 0, "target": { "path": "pointer" } } ], "samplers": [] } ] }"#;
    fs::write(folder.path().join("moves.gltf"), text).unwrap();
    let info = lanternfish(folder.path()).args(["info", "moves.gltf"]).output().unwrap();
    let warnings =
        |stderr: &str| stderr.lines().filter(|line| line.contains("WARN")).map(str::to_owned).collect::<Vec<_>>();
    let info = warnings(std::str::from_utf8(&info.stderr).unwrap());
    assert!(info.len() == 2 && info[0].contains("EXT_one") && info[1].contains("animations"), "{info:?}");
    assert_eq!(warnings(&render_scene(folder.path(), "moves.gltf", "-o a.png").1), info);
}
