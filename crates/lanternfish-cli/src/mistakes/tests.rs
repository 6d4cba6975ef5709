//! Mistakes in command lines and files: each is one error that names the fault and its remedy, before any work, and no
//! file is left. `tests/command_line/mistakes.rs` has what needs a process.

use lanternfish::settings::{AnyParameter, Settings};

use super::is_of_papers;
use crate::testing::{self, Place};

/// A program without the papers tells their names from those that nothing has.
#[test]
fn names_of_the_papers_are_known_without_them() {
    // Registration is global: with a shared process other tests may come first.
    if std::env::var_os("NEXTEST").is_none() {
        return;
    }
    let names = || {
        let is_choice = |entry: &AnyParameter| entry.info.name == entry.kind || entry.info.name == "shadows";
        let values = |entry: &AnyParameter| if is_choice(entry) { entry.names() } else { Vec::new() };
        let all = Settings::parameters();
        let values = all.iter().flat_map(values).map(|(name, _)| name);
        values.chain(all.iter().map(|entry| entry.info.name)).collect::<Vec<_>>()
    };
    let of_library = names();
    testing::know_papers();
    let all = names();
    assert!(all.len() > of_library.len() + 30, "{} and {}", all.len(), of_library.len());
    for name in all {
        assert_eq!(is_of_papers(name), !of_library.contains(&name), "{name}");
    }
}

#[test]
fn scenes_that_cannot_be_read() {
    let place = Place::with(&[
        ("box.gltf", r#"{ "asset": { "version": "2.0" }, "buffers": [{ "uri": "box.bin", "byteLength": 4 }] }"#),
        ("scene.fbx", "x"),
        ("far.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 -3.4e38\nf 1 2 3\nf 1 3 4\n"),
        ("bad.obj", "v 0 0\n"),
    ]);
    place.refuses(&[
        ("render %nowhere.glb -o %a.png", "nowhere.glb | No such file | hint: check the path"),
        ("info %nowhere.gltf", "nowhere.gltf | No such file | hint: check the path"),
        ("render %box.gltf -o %a.png", "box.bin | No such file | hint: the scene consists of several files"),
        ("render %scene.fbx -o %a.png", "scene.fbx | .glb"),
        ("render demo:moonbase", "demo:moonbase | there are"),
        ("info demo:moonbase", "demo:moonbase"),
        ("render %far.obj -o %a.png", "far.obj: instance 0 ( | 3.4e38 m from the origin | hint: "),
        ("reference %far.obj -o %a.exr", "far.obj: instance 0 ( | 3.4e38 m from the origin | hint: "),
        ("info %far.obj", "far.obj: instance 0 ( | 3.4e38 m from the origin | hint: "),
        ("info %bad.obj", "line 1"),
    ]);
    assert!(!place.run("info %bad.obj").unwrap_err().contains("glTF validator"));
    for (name, content) in [
        ("text.glb", &b"this is not a scene"[..]),
        ("empty.glb", b""),
        ("half.gltf", b"{ \"asset\": { \"version\": \"2.0\" }, \"meshes\": [ {"),
        ("far.gltf", b"{ \"asset\": { \"version\": \"2.0\" }, \"scene\": 0, \"scenes\": [ { \"nodes\": [ 7 ] } ] }"),
        ("binary.gltf", b"\xff\xfe\x00\x01"),
    ] {
        place.write(name, content);
        place.refuses(&[(&format!("render %{name} -o %a.png"), name), (&format!("info %{name}"), name)]);
    }
}

/// Regression: the file was read until memory ran out.
#[test]
#[cfg(unix)]
fn inputs_without_an_end() {
    let place = Place::new();
    std::os::unix::fs::symlink("/dev/zero", place.path("zeros.glb")).unwrap();
    place.refuses(&[
        ("render %zeros.glb -o %a.png", "zeros.glb | no file"),
        ("info %zeros.glb", "zeros.glb | no file"),
        ("info /dev/null", "/dev/null | no file"),
        ("doctor --read /dev/zero", "/dev/zero: this is no file"),
    ]);
}

/// Texts of a file cannot move the cursor of a terminal, set its title, fake lines or hints of the program, or fill the
/// screen.
#[test]
fn texts_of_files_are_escaped_and_cut() {
    let gltf = |members: &str| format!(r#"{{"asset":{{"version":"2.0"}},{members}}}"#);
    let long = "b".repeat(1 << 20);
    let place = Place::new();
    place.write("extension.gltf", gltf(r#""extensionsRequired":["\u001b]0;title\u0007\nerror: none"]"#));
    place.write("buffer.gltf", gltf(&format!(r#""buffers":[{{"byteLength":4,"uri":"a://{long}"}}]"#)));
    let hint = "a.bin%0A%0A%20%20hint%3A%20run%20this%E2%80%8B";
    place.write("hint.gltf", gltf(&format!(r#""buffers":[{{"byteLength":4,"uri":"{hint}"}}]"#)));
    place.write("key.toml", "scene = \"demo:cornell\"\n\"\\u001b[31mkey\" = 1\n");
    place.write(
        "cone.gltf",
        gltf(
            r#""extensionsUsed":["KHR_lights_punctual"],"scenes":[{"nodes":[0]}],
            "nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}}}],
            "extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"outerConeAngle":1e-45}}]}}"#,
        ),
    );
    place.write("none.gltf", gltf(r#""scenes":[{}]"#));
    for words in ["info %extension.gltf", "info %buffer.gltf", "info %hint.gltf", "render %key.toml -o %a.png"] {
        let text = place.run(words).unwrap_err();
        assert!(text.chars().all(|character| character == '\n' || !character.is_control()), "{words}: {text:?}");
        assert!(!text.lines().any(|line| line == "error: none") && text.len() < 3000, "{words}: {text}");
        assert!(text.matches("\n  hint: ").count() <= 1 && !text.contains('\u{200b}'), "{words}: {text}");
    }
    place.refuses(&[
        ("info %cone.gltf", "lights[0] | cone angles"),
        ("info %none.gltf --variant red", "hint: leave --variant out"),
    ]);
}

#[test]
fn environments() {
    let place = Place::with(&[("sky.hdr", "this is no image"), ("sky.exr", "nor this")]);
    place.refuses(&[
        ("render demo:cornell -o %a.png --environment %nowhere.hdr", "nowhere.hdr | No such file | hint"),
        ("render demo:cornell -o %a.png --environment %sky.hdr", "sky.hdr: not a Radiance image | --environment"),
        ("render demo:cornell -o %a.png --environment %sky.png", "sky.png | .hdr or .exr | --sky"),
        ("render demo:cornell -o %a.png --environment %sky.hdr --report %sky.hdr", "both --environment and --report"),
        // Regression: the environment was overwritten by the image without a warning.
        ("render demo:cornell --environment %sky.exr -o %./sky.exr", "./sky.exr: both --environment and the image"),
        ("render demo:cornell --environment-rotation wide", "-3600 to 3600"),
        ("render demo:cornell --environment-scale 0", "above 0"),
        ("render demo:cornell --light-rig studio --sky 1,1,1", "--light-rig studio | --sky | hint"),
    ]);
    // The largest number of the format, and one beyond it.
    place.write("sky.hdr", b"#?RADIANCE\n\n-Y 1 +X 1\n\xff\xff\xff\xff");
    let bright = "render demo:cornell -o %a.png --environment %sky.hdr --environment-scale 3";
    place.refuses(&[(bright, "--environment-scale 3 | smaller")]);
}

/// What other programs call otherwise, what was removed, and a file without a command.
#[test]
fn flags_and_forms_of_other_programs() {
    let place = Place::new();
    for (words, tip) in [
        ("render demo:cornell --width 640", "tip: --size WIDTHxHEIGHT sets both sides"),
        ("render demo:cornell --spp 64", "--accumulate N"),
        ("reference demo:cornell -s 64", "--size"),
        ("render demo:cornell --samples 16", "--accumulate N averages N frames"),
        ("render demo:cornell --eye 1 2 3", "joined by commas: 1,2,3"),
        ("render demo:cornell --camera-position 1,2,3", "--eye X,Y,Z is the camera's position"),
        ("render demo:cornell --animation-time 1", "--time SECONDS"),
        ("render demo:cornell --bg white", "--background COLOR"),
        ("reference demo:cornell --background white", "the path tracer shows the environment"),
        ("render demo:cornell --denoiser off", "indirect light is always denoised"),
        ("render demo:cornell --threads 4", "only `lanternfish reference` traces on CPU threads"),
        ("turntable box.glb", "`lanternfish render SCENE --orbit N`"),
        ("deep-images demo:cornell", "`lanternfish-bench deep-images SCENE`"),
        ("render demo:cornell --cluster-test planes", "tip: leave it out: every light is tested"),
        ("render demo:cornell --indirect path", "`lanternfish reference SCENE` is the path tracer"),
        ("frames shot.toml --frames 1-4", "`lanternfish frames SHOT A-B`"),
        ("render demo:cornell out.png", "-o FILE names the image"),
        ("--size 64x64 render demo:cornell", "flags go after the command"),
        ("box.glb", "`lanternfish view box.glb` opens a window"),
        ("box.png", "`lanternfish info box.png` prints how it was made"),
        ("demo:cornell", "`lanternfish render demo:cornell` writes an image"),
        // Neither a flag of ours nor of others.
        ("render demo:cornell --xyzzy", "--xyzzy"),
        ("bench quality --only cornell", "error: bench: benches | `lanternfish-bench quality --only cornell`"),
        ("help beauty", "lanternfish beauty | there are: render, view"),
        ("help render quality", "lanternfish render quality"),
        ("doctor --filter nothing", "no check has such a group"),
        // Gone.
        ("doctor --read a.json --page", "--read FILE prints a report as a table"),
        ("doctor --only ab", "`lanternfish replay SCENE --pair A B`"),
        ("doctor --seconds 9", "`lanternfish-bench walks` times frames"),
        ("replay demo:cornell --compare before/report.json", "`lanternfish replay SCENE --pair A B`"),
    ] {
        place.refuses(&[(words, tip)]);
        assert!(!place.run(words).unwrap_err().contains("as a value"), "{words}");
    }
}

/// The error names the flag, the value, and what is known instead.
#[test]
fn values_of_flags() {
    let place = Place::new();
    for (flag, value, known) in [
        ("--shadows", "soft", "ray-query"),
        ("--culling", "nonsense", "tiled"),
        ("--tile-size", "12", "16"),
        ("--aabb", "nonsense", "off"),
        ("--samples", "nonsense", "8"),
        ("--anisotropy", "nonsense", "16"),
        ("--textures", "nonsense", "per-material"),
        ("--stereo", "nonsense", "vive"),
        ("--stereo-layout", "nonsense", "layers"),
        ("--clusters", "nonsense", "displ:"),
        ("--cluster-views", "nonsense", "enclosed"),
        ("--light-assignment", "nonsense", "hierarchy"),
        ("--attenuation", "nonsense", "physical_smooth_2"),
        ("--materials", "nonsense", "lambert"),
        ("--debug-view", "nonsense", "light-count"),
        ("--deep-builder", "nonsense", "single_pass"),
        ("--deep-directions", "ball:9", "zonal:169, stacks:13x13 or cube:5"),
        ("--deep-directions", "cube:99", "29403 directions: expected 1 to 4096"),
        ("--ray-culling", "nonsense", "improved"),
        ("--ray-range-culling", "nonsense", "off"),
        ("--tone-map", "film", "neutral"),
        ("--size", "0x0", "from 1 to 16384"),
        ("--size", "-5x5", "from 1 to 16384"),
        ("--point", "1,2", "x,y,z,cd"),
        ("--disk", "0,1,0,0,-1,0,0,1", "radius 0"),
        ("--rectangle", "0,1,0,0,-1,0,1,1", "width,height,nits"),
        ("--sun", "0,0,0,1", "direction"),
        ("--lights", "snow:5", "rain:N"),
        // Regression: it ran out of memory and aborted.
        ("--lights", "rain:4000000000", "at most 2097152"),
        ("--lights", "rain:5:inf", "radius"),
        ("--fov-y", "180", "179"),
        ("--fov-y", "0", "0.1"),
        ("--eye", "here", "x,y,z"),
        ("--eye", "1e30,0,0", "1e12 m"),
        ("--target", "1,NaN,0", "x,y,z"),
        ("--view", "side", "front, back, left, right, top, iso"),
        ("--pose", "1,0,0,0", "16 numbers"),
        ("--intrinsics", "0,1,2,3", "fx,fy,cx,cy"),
        ("--seed", "-1", "--seed"),
        ("--accumulate", "0", "a whole number from 1"),
        ("--accumulate", "-4", "a whole number from 1"),
        ("--accumulate", "many", "--accumulate"),
        ("--exposure", "NaN", "stops"),
        ("--light-rig", "lamp", "studio, sun, none"),
    ] {
        place.refuses(&[(&format!("render demo:atrium {flag} {value}"), &format!("{flag} | {value} | {known}"))]);
    }
    place.refuses(&[
        ("render demo:atrium --shadow none", "--shadow | --shadows"),
        ("render", "SCENE"),
        ("info", "SCENE"),
        ("render ''", "SCENE"),
        ("render demo:atrium -o ''", "--output"),
    ]);
}

#[test]
fn cameras() {
    Place::new().refuses(&[
        ("render demo:cornell --camera 99", "99 | by its number or name: 0"),
        ("render demo:cornell --view top --eye 1,2,3", "--view | --eye | cannot be used with"),
        ("render demo:cornell --view top --camera 0", "--view | --camera | cannot be used with"),
        ("render demo:cornell --view top --target 0,0,0", "--view | --target | cannot be used with"),
        ("render demo:cornell --pose-convention opencv", "--pose-convention without --pose"),
        ("render demo:cornell --eye 1,2,3 --target 1,2,3", "look at itself"),
        ("render demo:cornell --pose 2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1", "scales"),
        ("render demo:cornell --pose 1,0,0,0,0,1,0,0,0,0,1,0,1,2,3,1", "last row"),
    ]);
}

/// The scene does not exist either: the output is checked first.
#[test]
fn outputs() {
    let place = Place::with(&[("triangle.gltf", "{}"), ("keep.png", "dear"), ("classes.json", r#"{"a": "b"}"#)]);
    let mut permissions = std::fs::metadata(place.path("keep.png")).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(place.path("keep.png"), permissions).unwrap();
    let long = "n".repeat(252) + ".png";
    place.refuses(&[
        ("render nowhere.glb -o %a.gif", "a.gif | .png | .exr"),
        ("render nowhere.glb -o %a", "a: | .png | .exr"),
        ("render nowhere.glb -o %missing/a.png", "missing/a.png | no folder | missing"),
        ("render nowhere.glb -o %a.png/", "a.png/: this is a folder"),
        ("render nowhere.glb -o %a.png --report %missing/a.json", "missing/a.json | no folder"),
        ("render nowhere.glb -o %a.png --report %./a.png", "a.png | --report"),
        // Regression: it wrote the radiance instead of the requested debug view.
        ("render nowhere.glb -o %a.exr --debug-view normal", "a.exr | --debug-view normal | .png"),
        ("render %triangle.gltf -o %a.png --report %./triangle.gltf", "triangle.gltf | --report"),
        ("render nowhere.glb -o %keep.png", "keep.png: this file is read-only"),
        ("render nowhere.glb -o %a.png --report %keep.png", "keep.png: this file is read-only"),
        ("reference nowhere.glb -o %keep.png", "keep.png: this file is read-only"),
        ("compare nowhere.png nowhere.png --map %keep.png", "keep.png: this file is read-only"),
        ("compare nowhere.png nowhere.png --json %keep.png", "keep.png: this file is read-only"),
        (&format!("render nowhere.glb -o %{long}"), "File name too long | choose a shorter name"),
        (&format!("reference nowhere.glb -o %{long}"), "File name too long | choose a shorter name"),
        // An image that holds less, or many.
        ("render demo:cornell --background transparent -o %a.jpg", "a.jpg"),
        ("render demo:cornell --timings -o -", "one image alone goes to standard output"),
        ("render demo:cornell --orbit 4 -o -", "one image alone goes to standard output"),
        ("render demo:cornell --open -o -", "one image alone goes to standard output"),
        ("render demo:cornell -o %turn.gif", ".gif is for --orbit and --frames"),
        ("render demo:cornell -o %turn.gif --orbit 3 --skip-existing", "a file for each frame"),
        ("render demo:cornell -o %turn.gif --orbit 3 --background transparent", "no alpha"),
        ("render demo:cornell -o %a.exr --outputs depth,norml", "distance, position, normal | did you mean \"normal\""),
        ("render demo:cornell -o %a.png --outputs position", "position | .exr or .npz"),
        ("render demo:cornell -o %a.exr --outputs depth --stereo vive", "--stereo"),
        ("render demo:cornell -o %a.exr --outputs semantic --classes %classes.json", "classes.json | whole numbers"),
        ("render demo:cornell -o %a.exr --classes %classes.json", "--outputs"),
    ]);
}

#[test]
fn folders_of_scenes() {
    let place = Place::with(&[("a.gltf", "{}")]);
    for folder in ["images", "models/more"] {
        std::fs::create_dir_all(place.path(folder)).unwrap();
    }
    std::fs::copy(place.path("a.gltf"), place.path("models/more/a.gltf")).unwrap();
    place.refuses(&[
        ("render %. -o %one.png", "no folder"),
        ("render %. --report %a.json", "--report"),
        ("render %images", "this is a folder, without a scene"),
        ("render %models", "name them: | models/more"),
        ("render %. --outputs position", "with several scenes: their images are .png files"),
        ("render %. -o %missing/images", "missing"),
    ]);
}

#[test]
fn shots() {
    let place = Place::with(&[
        ("key.toml", "scene = \"demo:cornell\"\n\n[look]\nexposre = 1\n"),
        ("gone.toml", "scene = \"demo:cornell\"\n[technique]\ncluster-test = \"planes\"\n"),
        ("nowhere.toml", "scene = \"nowhere.glb\""),
        ("report.toml", "scene = \"demo:cornell\"\n[run]\nreport = \"report.toml\""),
        (
            "walk.toml",
            "scene = \"demo:cornell\"\n[output]\noutput = \"walk.png\"\n[track]\nframes = 3\n\
             keyframes = [{ time = 0, eye = [0, 1, 3] }, { time = 1, eye = [0.5, 1, 3] }]\n",
        ),
        (
            "two.gltf",
            r#"{ "asset": { "version": "2.0" }, "scenes": [ { "name": "day" }, { "name": "night" } ],
            "extensions": { "KHR_materials_variants": { "variants": [{ "name": "clay" }, { "name": "glass" }] } } }"#,
        ),
        ("two.toml", "scene = \"two.gltf\"\n[view]\nvariant = \"wood\"\n"),
    ]);
    place.write("binary.toml", b"\xff\xfe");
    for folder in ["folder.toml", "shots"] {
        std::fs::create_dir(place.path(folder)).unwrap();
    }
    let (key, variant) = (
        "key.toml:4:1: unknown key `exposre` | `exposure`",
        "no variant \"wood\"; there are: 0 \"clay\", 1 \"glass\" | --variant",
    );
    place.refuses(&[
        ("render %key.toml", key),
        ("shot %key.toml", key),
        ("render %gone.toml", "gone.toml:3:1: unknown key `cluster-test` | leave it out"),
        ("render %nowhere.toml", "nowhere.glb"),
        ("shot %nowhere.toml", "nowhere.glb"),
        ("render %report.toml", "both the shot and --report"),
        ("render %walk.toml --time 7", "from 0 to 1 s"),
        ("render %walk.toml --report %walk.0003.png", "both the image and --report"),
        ("render %missing.toml", "missing.toml"),
        ("render %folder.toml", "no shot"),
        ("render %binary.toml", "binary.toml"),
        ("render demo:cornell --frames 2", "no camera track"),
        ("shot demo:cornell -o %shots/night.toml", "without a folder"),
        ("render %two.gltf --scene dusk", "\"dusk\" | night | --scene"),
        ("info %two.gltf --scene dusk", "\"dusk\" | night | --scene"),
        ("shot %two.gltf --scene dusk", "\"dusk\" | night | --scene"),
        ("info %two.gltf --variant wood", variant),
        ("render %two.gltf --variant wood", variant),
        ("render %two.toml", variant),
        ("reference %two.toml", variant),
        ("frames %walk.toml", "A-B"),
        ("frames %walk.toml 3-1", "3-1"),
        ("frames %walk.toml x", "x"),
        ("frames %missing.toml 1-2", "missing.toml"),
        ("replay %walk.toml --pair --shadows", "2 values required"),
        ("replay %walk.toml --pair --shadows=soft --shadows=bvh", "--pair --shadows=soft | soft"),
        ("replay %walk.toml --pair --runs=3 --shadows=bvh", "--pair --runs=3 | --runs"),
        ("replay %walk.toml --runs 0", "0"),
        ("replay %walk.toml --time 1", "unexpected argument"),
        ("doctor --read %key.toml", "key.toml | lanternfish doctor --json"),
        ("doctor --read %missing.json", "missing.json | lanternfish doctor --json"),
    ]);
    std::fs::create_dir(place.path("walk.0002.png")).unwrap();
    place.refuses(&[("render %walk.toml", "walk.0002.png: this is a folder")]);
}

#[test]
fn windows_of_images_and_scenes() {
    Place::with(&[("a.png", "no image")]).refuses(&[
        ("view demo:cornell %a.png", "a.png | tip: `lanternfish compare A B --map difference.png`"),
        ("view %a.exr %b.exr --exposure 1", "b.exr | tip: `lanternfish compare A B --map difference.png`"),
        ("view %a.png", "a.png: the window shows a scene | hint: `lanternfish compare A B | system's viewer"),
        ("view demo:cornell %b.glb", "b.glb | tip: the window shows one scene"),
        ("view demo:cornell --eye 1 2 3", "tip: numbers of one flag are joined by commas"),
    ]);
}

#[test]
fn references() {
    Place::new().refuses(&[
        ("reference demo:cornell --integrator obscurance -o %a.exr", "--max-distance"),
        ("reference demo:cornell --max-distance 1 -o %a.exr", "--integrator obscurance"),
        ("reference demo:cornell -o %a.jpg", ".exr (linear"),
        ("reference demo:cornell -o %missing/a.exr", "no folder"),
        ("reference demo:cornell -o %a.exr --variance %a.png", "EXR only"),
        ("reference demo:cornell -o %a.exr --variance %./a.exr", "both the image and --variance"),
        ("reference demo:cornell --environment %a.exr -o %a.exr", "both read and written"),
        ("reference demo:cornell --shadows none", "--shadows"),
        ("reference demo:cornell --spp 0", "--spp"),
        ("reference demo:cornell --threads 0", "--threads"),
        ("reference demo:nothing -o %a.exr", "demo:nothing"),
        ("reference %nowhere.glb -o %a.exr", "nowhere.glb"),
        ("reference %nowhere.toml", "nowhere.toml"),
        ("reference demo:cornell --frames 3", "--frames"),
        ("reference demo:cornell --samples 3-1", "samples A-B"),
        ("reference demo:cornell --samples 1-2 --spp 4", "--spp"),
        ("reference demo:cornell --samples 1-2 -o %a.png", "which PNG does not hold"),
        ("merge -o %o.exr", "PART.exr"),
        ("merge %a.exr", "--output"),
    ]);
}
