//! `lanternfish replay`, end to end on the software adapter.

use serde_json::{Value, json};

use crate::support::{Folder, Ran};

const SHOT: &str = r#"
scene = "demo:cornell"
[output]
size = [48, 27]
[lights]
lights = "rain:60"
[track]
frames = 4
[[track.keyframes]]
time = 0
eye = [0, 1, 3.4]
target = [0, 1, 0]
[[track.keyframes]]
time = 0.5
eye = [0.2, 1.2, 3]
target = [0, 0.9, 0]
[indirect]
indirect-rays = 1
first-rays = 1
glossy-rays = 1
cache-samples = 2
"#;

fn replay(folder: &Folder, words: &str) -> Ran {
    folder.run(&format!("replay walk.toml --adapter cpu {words}"))
}

/// The report of a replay that succeeds.
#[track_caller]
fn report(folder: &Folder, name: &str, words: &str) -> Value {
    replay(folder, &format!("{words} -o {name}")).succeeded();
    folder.json(&format!("{name}/report.json"))
}

/// A recording of five steps as `view --record` writes it: three moves forwards, then a look to the right.
const RECORDED: &str = r#"
recording = 1
scene = "demo:cornell"
flags = [["lights", "rain:60"], ["size", "48x27"], ["indirect", "none"]]
step = 0.1
speed = 1.0
reach = 2.0
first = ["perspective", 0.8, 0.05, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 3.4]
steps = [
    [],
    [["fly", 0, 0, 1, 0.1]],
    2,
    [["look", 40, 0]],
]
"#;

/// A flag overrides the recording's.
#[test]
fn gpu_a_recording_is_replayed() {
    let folder = Folder::with(&[("walk.toml", RECORDED)]);
    let ran = replay(&folder, "--runs 1 --lights rain:61 -o whole").succeeded();
    assert_eq!(ran.stdout.lines().last(), Some("whole/report.html"));
    assert_eq!(folder.names("whole"), ["counts.csv", "passes.csv", "report.html", "report.json"]);
    let page = String::from_utf8(folder.read("whole/report.html")).unwrap();
    assert!(page.matches("<svg").count() == 8 && !page.contains("NaN") && !page.contains("<script"));
    let whole = folder.json("whole/report.json");
    assert_eq!(whole["moments"], json!([0.0, 0.1, 0.2, 0.3, 0.4]));
    assert_eq!((&whole["width"], &whole["source"]), (&json!(48), &json!("walk.toml")));
    let rain = |report: &Value| report["lights"].as_u64().unwrap();
    let part = report(&folder, "part", "--runs 1 --frames 2-3");
    assert_eq!((part["moments"].as_array().unwrap().len(), rain(&whole) - rain(&part)), (2, 1));
}

#[test]
#[ignore = "full"]
fn gpu_a_recording_is_rendered_like_a_shot() {
    let folder = Folder::with(&[("walk.toml", RECORDED)]);
    // Numbered images, which differ because the camera and the rain move.
    folder.done("render walk.toml --frames 1-2 --fps 10 --adapter cpu");
    let (first, second) = (folder.png("walk.0001.png"), folder.png("walk.0002.png"));
    assert!((first.width, first.height) == (48, 27) && first.pixels != second.pixels);
    // A shot with the same camera and time gives the same image.
    let part = report(&folder, "part", "--runs 1 --frames 2-3");
    let shot = SHOT
        .replace("frames = 4", "")
        .replace("0, 1, 3.4]", "0, 1, 3.2]")
        .replace("[output]", "[view]\nfov-y = 45.836624\n[output]");
    folder.write("walk.toml", format!("{}[indirect]\nindirect = \"none\"\n", shot.split("[track]").next().unwrap()));
    let shot = report(&folder, "shot", "--runs 1 --frames 2-2 --fps 10 --eye 0,1,3.2 --target 0,1,0");
    let clusters = |report: &Value| report["frames"][0]["clusters"]["fragments"].clone();
    assert_eq!(clusters(&shot), clusters(&part));
}

#[test]
#[ignore = "full"]
fn gpu_cluster_depth_changes_clusters_and_not_images() {
    let folder = Folder::with(&[("walk.toml", SHOT)]);
    let of = |depth: &str, shape: &str| {
        let words = format!("--runs 1 --frames 1 --indirect none --clusters {shape} --cluster-depth {depth}");
        let frame = report(&folder, "out", &words)["frames"][0].clone();
        let clusters = frame["counters"]["light_culling/clusters"].as_u64().unwrap();
        (clusters, frame["clusters"]["visible"].clone(), frame["image"].clone())
    };
    let (near, far) = (of("0", "persp:8"), of("100", "persp:8"));
    assert!(far.0 > near.0, "{} clusters for {}", far.0, near.0);
    assert_eq!(far.2, near.2);
    // The scene is deeper than 1 m, but clusters of a view end at the requested depth.
    assert_eq!(of("1", "persp:8"), near);
    // With a depth of 100 m, displaced views use other clusters and give the same image.
    let (near, far) = (of("0", "displ:8:4"), of("100", "displ:8:4"));
    assert!(far.0 != near.0 && far.2 == near.2, "{} clusters for {}", far.0, near.0);
}
