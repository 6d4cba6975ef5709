//! Shots from file to image, on the software adapter.

use std::{fs, path::Path, process::Output};

use lanternfish_metrics::read_exr;

use crate::support::{lanternfish, names};

fn output(folder: &Path, words: &str) -> Output {
    lanternfish(folder).args(words.split_whitespace()).output().unwrap()
}

/// Standard output of a successful run.
#[track_caller]
fn run(folder: &Path, words: &str) -> String {
    let output = output(folder, words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Standard error of a run that fails and prints nothing.
#[track_caller]
fn refused(folder: &Path, words: &str) -> String {
    let output = output(folder, words);
    let error = String::from_utf8(output.stderr.clone()).unwrap();
    assert!(!output.status.success() && output.stdout.is_empty(), "{output:?}");
    assert_eq!(error.lines().filter(|line| line.starts_with("error")).count(), 1, "{error}");
    error
}

const FLAGS: &str = "--adapter cpu --size 48x32 --lights rain:20 --seed 3 --point 0.3,1,0.1,20,1,.9,0.7 --sky 0,0.1,.2 \
                     --eye 0.1,1,3.3 --fov-y 41.7 --exposure -.3 --tone-map aces --aabb off --attenuation smooth --indirect none";

#[test]
fn gpu_a_written_shot_renders_the_same_image() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    run(folder.path(), &format!("render demo:cornell {FLAGS} -o flags.png"));
    run(folder.path(), &format!("render demo:cornell {FLAGS} -o flags.exr"));
    let shot = run(folder.path(), &format!("shot demo:cornell {FLAGS}"));
    fs::write(folder.path().join("night.toml"), &shot).unwrap();

    assert_eq!(run(folder.path(), "render night.toml"), "night.png\n");
    assert_eq!(read("night.png"), read("flags.png"));
    run(folder.path(), "render night.toml -o night.exr");
    assert_eq!(read("night.exr"), read("flags.exr"));
    // A shot of a shot is the same shot, except for the flags.
    assert_eq!(run(folder.path(), "shot night.toml --seed 4").replace("seed = 4", "seed = 3"), shot);
    // Negative control: the comparison detects another seed.
    run(folder.path(), "render night.toml --seed 4 -o other.exr");
    let pixels = |name: &str| read_exr(&folder.path().join(name)).unwrap();
    assert_ne!(pixels("other.exr"), pixels("flags.exr"));
}

/// A shot is written to a .toml file that is named as output; the image has its usual name then.
#[test]
fn a_shot_is_written_to_a_named_file() {
    let folder = tempfile::tempdir().unwrap();
    let printed = run(folder.path(), "shot demo:cornell --seed 3");
    assert_eq!(run(folder.path(), "shot demo:cornell --seed 3 -o night.toml"), "night.toml\n");
    assert_eq!(fs::read_to_string(folder.path().join("night.toml")).unwrap(), printed);
    assert!(run(folder.path(), "shot demo:cornell -o night.png").contains("output = \"night.png\""));
    fs::create_dir(folder.path().join("shots")).unwrap();
    assert!(refused(folder.path(), "shot demo:cornell -o shots/night.toml").contains("without a folder"));
    assert_eq!(names(&folder.path().join("shots")), [""; 0]);
}

const TRACK: &str = "scene = \"demo:cornell\"
[output]
output = \"walk.png\"
size = [24, 16]
[look]
exposure = 0
[indirect]
indirect = \"none\"
[track]
frames = 3
keyframes = [
    { time = 0, eye = [0, 1, 3], target = [0, 1, 0], fov-y = 40 },
    { time = 1, eye = [0.5, 1, 3], target = [0, 1, 0], fov-y = 50 },
]
[run]
adapter = \"cpu\"
";

#[test]
fn gpu_a_track_becomes_numbered_images_beside_the_shot() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    fs::create_dir(&inner).unwrap();
    fs::write(inner.join("walk.toml"), TRACK).unwrap();
    let stdout = run(folder.path(), "render inner/walk.toml --report run.json");
    let renderings = ["walk.0001.png", "walk.0002.png", "walk.0003.png"];
    assert_eq!(stdout.lines().collect::<Vec<_>>(), renderings.map(|name| format!("inner/{name}")));
    assert_eq!(names(&inner), [&renderings[..], &["walk.toml"]].concat());
    let report: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("run.json")).unwrap()).unwrap();
    assert_eq!(report["frames"], 3);

    // A single image equals the sequence's image of that time, with the exposure given: each run would meter its first image.
    let still = |time: &str| {
        run(&inner, &format!("render walk.toml --time {time} -o still.png"));
        fs::read(inner.join("still.png")).unwrap()
    };
    for (name, time) in renderings.into_iter().zip(["0", "0.5", "1"]) {
        assert_eq!(still(time), fs::read(inner.join(name)).unwrap(), "{name}");
    }
    assert_ne!(fs::read(inner.join(renderings[0])).unwrap(), fs::read(inner.join(renderings[1])).unwrap());
}

#[test]
fn mistakes_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let write = |text: &str| fs::write(folder.path().join("a.toml"), text).unwrap();
    write("scene = \"demo:cornell\"\n\n[look]\nexposre = 1\n");
    for command in ["render", "shot"] {
        let error = refused(folder.path(), &format!("{command} a.toml"));
        assert!(
            error.starts_with("error: a.toml:4:1: unknown key `exposre`") && error.contains("`exposure`"),
            "{error}"
        );
    }
    write("scene = \"nowhere.glb\"");
    assert!(refused(folder.path(), "render a.toml").contains("nowhere.glb"));
    assert!(refused(folder.path(), "shot a.toml").contains("nowhere.glb"));
    write("scene = \"demo:cornell\"\n[run]\nreport = \"a.toml\"");
    assert!(refused(folder.path(), "render a.toml").contains("both the shot and --report"));
    write(TRACK);
    assert!(refused(folder.path(), "render a.toml --time 7").contains("from 0 to 1 s"));
    assert!(refused(folder.path(), "render a.toml --report walk.0003.png").contains("both the image and --report"));
    fs::create_dir(folder.path().join("walk.0002.png")).unwrap();
    assert!(refused(folder.path(), "render a.toml").contains("walk.0002.png: this is a folder"));
    fs::remove_dir(folder.path().join("walk.0002.png")).unwrap();
    assert!(refused(folder.path(), "render b.toml").contains("b.toml"));
    assert!(refused(folder.path(), "render demo:cornell --frames 2").contains("no camera track"));
    fs::create_dir(folder.path().join("c.toml")).unwrap();
    assert!(refused(folder.path(), "render c.toml").contains("no shot"));
    fs::write(folder.path().join("d.toml"), b"\xff\xfe").unwrap();
    assert!(refused(folder.path(), "render d.toml").contains("d.toml"));
    assert_eq!(names(folder.path()), ["a.toml", "c.toml", "d.toml"]);
}

#[test]
fn a_scene_of_a_file_is_chosen_by_name_or_index() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"{ "asset": { "version": "2.0" }, "scene": 0,
        "scenes": [ { "name": "day", "nodes": [] }, { "name": "night", "nodes": [ 0 ] } ],
        "cameras": [ { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } } ],
        "nodes": [ { "name": "door", "camera": 0 } ] }"#;
    fs::write(folder.path().join("two.gltf"), text).unwrap();
    for (flags, cameras) in [("", "0"), ("--scene night", "1"), ("--scene 1", "1"), ("--scene day", "0")] {
        let info = run(folder.path(), &format!("info two.gltf {flags}"));
        assert!(info.contains(&format!("cameras      {cameras}")), "{flags}: {info}");
    }
    let shot = run(folder.path(), "shot two.gltf --scene night");
    assert!(shot.contains("[view]\n") && shot.contains("\nscene = \"night\"\n"), "{shot}");
    for command in ["render", "info", "shot"] {
        let error = refused(folder.path(), &format!("{command} two.gltf --scene dusk"));
        assert!(error.contains("\"dusk\"") && error.contains("night") && error.contains("--scene"), "{error}");
    }
}

#[test]
fn a_variant_of_the_materials_is_chosen_by_name_or_index() {
    let folder = tempfile::tempdir().unwrap();
    // Of the variants only `glass` is transparent.
    let text = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "extensions": { "KHR_materials_variants": { "variants": [{ "name": "clay" }, { "name": "glass" }] } },
        "materials": [{}, { "alphaMode": "BLEND" }],
        "accessors": [{ "componentType": 5126, "count": 3, "type": "VEC3" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0, "extensions": {
            "KHR_materials_variants": { "mappings": [{ "material": 1, "variants": [1] }] } } }] }] }"#;
    fs::write(folder.path().join("shoe.gltf"), text).unwrap();
    for (flags, kind) in
        [("", "opaque"), ("--variant clay", "opaque"), ("--variant glass", "blend"), ("--variant 1", "blend")]
    {
        let info = run(folder.path(), &format!("info shoe.gltf {flags}"));
        assert!(info.contains(&format!("materials    1 (1 {kind})")), "{flags}: {info}");
        assert!(info.contains("variants     2 of the materials\n  0          clay\n  1          glass\n"), "{info}");
    }
    let shot = run(folder.path(), "shot shoe.gltf --variant glass");
    assert!(shot.contains("\nvariant = \"glass\"\n"), "{shot}");
    fs::write(folder.path().join("shoe.toml"), "scene = \"shoe.gltf\"\n[view]\nvariant = \"wood\"\n").unwrap();
    for line in
        ["info shoe.gltf --variant wood", "render shoe.gltf --variant wood", "render shoe.toml", "reference shoe.toml"]
    {
        let error = refused(folder.path(), line);
        assert!(error.contains("no variant \"wood\"; there are: 0 \"clay\", 1 \"glass\""), "{line}: {error}");
        assert!(error.contains("--variant"), "{line}: {error}");
    }
}

#[test]
fn help_names_every_demo() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), "help render");
    for name in ["demo:atrium", "demo:cornell", "demo:street", ".toml"] {
        assert!(help.contains(name), "{help}");
    }
}
