//! `lanternfish replay`, end to end on the software adapter.

use std::{fs, path::Path, process::Output};

use serde_json::{Value, json};

use lanternfish_metrics::read_png;

use crate::support::{lanternfish, names};

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

fn replay(folder: &Path, words: &[&str]) -> Output {
    lanternfish(folder).args(["replay", "walk.toml", "--adapter", "cpu"]).args(words).output().unwrap()
}

fn report(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(name).join("report.json")).unwrap()).unwrap()
}

#[test]
fn gpu_two_replays_have_equal_counters_and_images() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.toml"), SHOT).unwrap();
    for name in ["first", "second"] {
        let output = replay(folder.path(), &["--runs", "2", "-o", name]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(said.lines().last(), Some(format!("{name}/report.html").as_str()));
        assert_eq!(names(&folder.path().join(name)), ["counts.csv", "passes.csv", "report.html", "report.json"]);
    }
    let (first, second) = (report(folder.path(), "first"), report(folder.path(), "second"));
    assert_eq!(first["frames"], second["frames"]);
    let counts = |name: &str| fs::read_to_string(folder.path().join(name).join("counts.csv")).unwrap();
    assert_eq!(counts("first"), counts("second"));
    // Every frame differs, because camera and rain move; and has statistics of its clusters.
    let frames = first["frames"].as_array().unwrap();
    let mut renderings: Vec<&str> = frames.iter().map(|frame| frame["image"].as_str().unwrap()).collect();
    renderings.sort_unstable();
    renderings.dedup();
    assert_eq!((frames.len(), renderings.len()), (4, 4));
    for frame in frames {
        let clusters = &frame["clusters"];
        assert!(
            clusters["visible"].as_u64() > Some(0) && clusters["lighting_operations"].as_u64() > Some(0),
            "{frame}"
        );
    }
    // Every run has every frame, with passes that took time.
    let passes = first["passes"].as_array().unwrap();
    assert!(passes.iter().any(|pass| pass["name"] == "shading/forward" && pass["category"] == "shading"), "{passes:?}");
    for pass in passes.iter().chain(first["host"].as_array().unwrap()) {
        let runs = pass["samples"].as_array().unwrap();
        assert!(runs.len() == 2 && runs.iter().all(|run| run.as_array().unwrap().len() == 4), "{pass}");
    }
    let page = fs::read_to_string(folder.path().join("first/report.html")).unwrap();
    assert!(page.matches("<svg").count() == 8 && !page.contains("NaN") && !page.contains("<script"));

    // Against a replay that seemingly took a quarter of the time, everything is slower now. Other frames cannot be compared.
    let mut faster = first;
    quarter(&mut faster);
    let words = ["--runs", "4", "--frames", "4", "-o", "third", "--compare", "old.json", "--matters", "20"];
    // 2 and 4 runs are too few for so many passes.
    fs::write(folder.path().join("old.json"), faster.to_string()).unwrap();
    let few = replay(folder.path(), &words);
    assert_eq!(few.status.code(), Some(2), "{}", String::from_utf8_lossy(&few.stdout));
    assert!(String::from_utf8_lossy(&few.stderr).contains("--runs "), "{}", String::from_utf8_lossy(&few.stderr));
    let eight_times = |series: &mut Value| {
        let runs = series["samples"].as_array().unwrap().clone();
        series["samples"] = runs.iter().cycle().take(8).cloned().collect();
    };
    for list in ["passes", "host"] {
        faster[list].as_array_mut().unwrap().iter_mut().for_each(eight_times);
    }
    faster["runs"] = json!(8);
    fs::write(folder.path().join("old.json"), faster.to_string()).unwrap();
    let slower = replay(folder.path(), &words);
    let said = String::from_utf8_lossy(&slower.stdout);
    assert_eq!(slower.status.code(), Some(1), "{said}{}", String::from_utf8_lossy(&slower.stderr));
    assert!(said.contains("  slower") && said.contains("became slower"), "{said}");
    let other = replay(folder.path(), &["--runs", "1", "--frames", "3", "-o", "other", "--compare", "old.json"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("another choice of frames"));
}

/// A quarter of the times, as from a machine four times as fast.
fn quarter(report: &mut Value) {
    for list in ["passes", "host"] {
        for series in report[list].as_array_mut().unwrap() {
            for run in series["samples"].as_array_mut().unwrap() {
                run.as_array_mut().unwrap().iter_mut().for_each(|ms| *ms = json!(0.25 * ms.as_f64().unwrap()));
            }
        }
    }
}

#[test]
fn what_cannot_be_replayed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.toml"), SHOT).unwrap();
    for (words, expected) in [
        (&["--compare", "nothing.json"][..], "nothing.json"),
        (&["--matters", "-1"], "expected 0 to 1000 percent"),
        (&["--runs", "0"], "0"),
        (&["--time", "1"], "unexpected argument"),
    ] {
        let output = replay(folder.path(), words);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(expected), "{words:?}: {stderr}");
    }
    assert_eq!(names(folder.path()), ["walk.toml"]);
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

#[test]
fn gpu_a_recording_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.toml"), RECORDED).unwrap();
    let output = replay(folder.path(), &["--runs", "1", "--lights", "rain:61", "-o", "whole"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let whole = report(folder.path(), "whole");
    assert_eq!(whole["moments"], json!([0.0, 0.1, 0.2, 0.3, 0.4]));
    assert_eq!((&whole["width"], &whole["source"]), (&json!(48), &json!("walk.toml")));
    // It is rendered like a shot: numbered images, which differ because the camera and the rain move.
    let words = ["render", "walk.toml", "--frames", "1-2", "--fps", "10", "--adapter", "cpu"];
    let output = lanternfish(folder.path()).args(words).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let image = |name: &str| read_png(&folder.path().join(name)).unwrap();
    let (first, second) = (image("walk.0001.png"), image("walk.0002.png"));
    assert!((first.width, first.height) == (48, 27) && first.pixels != second.pixels);
    // A flag overrides the recording's.
    let rain = |report: &Value| report["lights"].as_u64().unwrap();
    let output = replay(folder.path(), &["--runs", "1", "--frames", "2-3", "-o", "part"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let part = report(folder.path(), "part");
    assert_eq!((part["moments"].as_array().unwrap().len(), rain(&whole) - rain(&part)), (2, 1));
    // A shot with the same camera and time gives the same image.
    let shot = SHOT
        .replace("frames = 4", "")
        .replace("0, 1, 3.4]", "0, 1, 3.2]")
        .replace("[output]", "[view]\nfov-y = 45.836624\n[output]");
    fs::write(
        folder.path().join("walk.toml"),
        format!("{}[indirect]\nindirect = \"none\"\n", shot.split("[track]").next().unwrap()),
    )
    .unwrap();
    let words =
        ["--runs", "1", "--frames", "2-2", "--fps", "10", "--eye", "0,1,3.2", "--target", "0,1,0", "-o", "shot"];
    let output = replay(folder.path(), &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let clusters = |report: &Value| report["frames"][0]["clusters"]["fragments"].clone();
    assert_eq!(clusters(&report(folder.path(), "shot")), clusters(&part));

    fs::write(folder.path().join("walk.toml"), RECORDED.replace("lights\"", "light\"")).unwrap();
    let output = replay(folder.path(), &[]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && stderr.contains("\"light\"") && stderr.contains("lights"), "{stderr}");
}

#[test]
fn gpu_cluster_depth_changes_clusters_and_not_images() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("walk.toml"), SHOT).unwrap();
    let of = |depth: &str, shape: &str| {
        let direct = ["--indirect", "none"];
        let words = ["--runs", "1", "--frames", "1", "--clusters", shape, "--cluster-depth", depth, "-o", "out"];
        let output = replay(folder.path(), &[&direct[..], &words].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let frame = &report(folder.path(), "out")["frames"][0];
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
