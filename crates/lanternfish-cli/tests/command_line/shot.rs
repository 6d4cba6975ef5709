//! Shots from file to image, on the software adapter.

use std::fs;

use crate::support::Folder;

const FLAGS: &str = "--adapter cpu --size 48x32 --lights rain:20 --seed 3 --point 0.3,1,0.1,20,1,.9,0.7 --sky 0,0.1,.2 \
                     --eye 0.1,1,3.3 --fov-y 41.7 --exposure -.3 --tone-map aces --aabb off --attenuation smooth --indirect none";

/// A shot is printed, or written to a .toml file that is named as output; else the output is the image's.
#[test]
fn gpu_a_written_shot_renders_the_same_image() {
    let folder = Folder::new();
    folder.done(&format!("render demo:cornell {FLAGS} -o flags.exr"));
    let shot = folder.done(&format!("shot demo:cornell {FLAGS} -o a.png")).stdout;
    assert!(shot.contains("output = \"a.png\""), "{shot}");
    assert_eq!(folder.done(&format!("shot demo:cornell {FLAGS} -o night.toml")).stdout, "night.toml\n");
    // A shot of a shot is the same shot, except for the flags.
    let again = folder.done("shot night.toml --seed 4 -o a.png").stdout;
    assert_eq!(again.replace("seed = 4", "seed = 3"), shot);
    folder.done("render night.toml -o night.exr");
    assert_eq!(folder.read("night.exr"), folder.read("flags.exr"));
    // Negative control: the comparison detects another seed. Without a name the image has the shot's.
    assert_eq!(folder.done("render night.toml --seed 4 -o other.exr").stdout, "other.exr\n");
    assert_ne!(folder.exr("other.exr"), folder.exr("flags.exr"));
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
    let folder = Folder::new();
    fs::create_dir(folder.path("inner")).unwrap();
    folder.write("inner/walk.toml", TRACK);
    let stdout = folder.done("render inner/walk.toml --report run.json").stdout;
    let renderings = ["walk.0001.png", "walk.0002.png", "walk.0003.png"];
    assert_eq!(stdout.lines().collect::<Vec<_>>(), renderings.map(|name| format!("inner/{name}")));
    assert_eq!(folder.names("inner"), [&renderings[..], &["walk.toml"]].concat());
    assert_eq!(folder.json("run.json")["frames"], 3);
    // A single image equals the sequence's image of that time, with the exposure given: each run would meter its first image.
    folder.done("render inner/walk.toml --time 0.5 -o still.png");
    let [first, second] = [0, 1].map(|i| folder.read(&format!("inner/{}", renderings[i])));
    assert!(folder.read("still.png") == second && first != second);
}

/// Scenes and variants are chosen by name or number: by `info`, and as a shot's keys.
#[test]
fn a_scene_and_a_variant_of_a_file_are_chosen() {
    // Of the scenes only `night` has a camera and a surface, and of the variants only `glass` is transparent.
    let text = r#"{ "asset": { "version": "2.0" }, "scene": 0,
        "scenes": [{ "name": "day", "nodes": [] }, { "name": "night", "nodes": [0] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],
        "nodes": [{ "name": "door", "camera": 0, "mesh": 0 }],
        "extensions": { "KHR_materials_variants": { "variants": [{ "name": "clay" }, { "name": "glass" }] } },
        "materials": [{}, { "alphaMode": "BLEND" }],
        "accessors": [{ "componentType": 5126, "count": 3, "type": "VEC3" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0, "extensions": {
            "KHR_materials_variants": { "mappings": [{ "material": 1, "variants": [1] }] } } }] }] }"#;
    let folder = Folder::with(&[("two.gltf", text)]);
    for (flags, cameras, kind) in [("--scene night", 1, "opaque"), ("--scene 1 --variant glass", 1, "blend")] {
        let info = folder.done(&format!("info two.gltf {flags}")).stdout;
        assert!(info.contains(&format!("cameras      {cameras}")), "{flags}: {info}");
        assert!(info.contains(&format!("materials    1 (1 {kind})")), "{flags}: {info}");
        assert!(info.contains("variants     2 of the materials\n  0          clay\n  1          glass\n"), "{info}");
    }
    let shot = folder.done("shot two.gltf --scene night --variant glass").stdout;
    assert!(shot.contains("\nscene = \"night\"\n") && shot.contains("\nvariant = \"glass\"\n"), "{shot}");
}
