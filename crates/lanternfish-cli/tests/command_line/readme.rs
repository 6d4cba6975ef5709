//! The commands of the README, at a small size: they run, and reach the passes that their rows name.

use std::{
    fs,
    path::{Path, PathBuf},
};

use lanternfish_gpu::testing;
use lanternfish_gpu_test::gpu_test;
use lanternfish_metrics::{RgbImage, write_exr};

use crate::support::{lanternfish, write_flying};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

fn readme() -> String {
    fs::read_to_string(repository().join("README.md")).unwrap()
}

/// The program's commands in a text: lines of code that start with its name, and such code within lines.
fn commands(text: &str) -> Vec<&str> {
    let is_command = |code: &&str| code.starts_with("lanternfish ");
    let lines = text.lines().map(|line| line.split(" #").next().unwrap_or(line).trim_end()).filter(is_command);
    lines.chain(text.split('`').filter(is_command)).collect()
}

/// The words of a command after the program's name, with files that are in the test's folder, and so small that it ends
/// in seconds.
fn small(command: &str) -> Vec<String> {
    let least =
        [("--size", "32x18"), ("--accumulate", "2"), ("--orbit", "2"), ("--until-error", "0.5"), ("--spp", "1")];
    let mut words: Vec<String> = command.split_whitespace().skip(1).map(str::to_owned).collect();
    for at in 0..words.len() {
        let last = at.checked_sub(1).map(|before| words[before].clone()).unwrap_or_default();
        if let Some((_, value)) = least.iter().find(|(flag, _)| *flag == last) {
            words[at] = (*value).to_owned();
        }
        match words[at].as_str() {
            "scene.glb" | "FILE" => words[at] = "scene.gltf".to_owned(),
            "sky.hdr" => words[at] = "sky.exr".to_owned(),
            name if name.starts_with("docs/") => words[at] = repository().join(name).to_string_lossy().into_owned(),
            _ => {}
        }
    }
    let has = |word: &str| words.iter().any(|other| other == word);
    let mut more = Vec::new();
    if ["render", "reference", "replay", "papers"].contains(&words[0].as_str()) && !has("--size") {
        more.extend(["--size", "32x18"]);
    }
    if words.iter().any(|word| word.ends_with("walk.toml") || word.ends_with("atrium.toml")) {
        words.retain(|word| word != "--frames" && word != "1-30");
        more.extend(["--frames", "1-2"]);
    }
    if words[0] != "reference" && words[0] != "compare" && words[0] != "help" && words[0] != "info" {
        more.extend(["--adapter", "cpu"]);
    }
    words.extend(more.into_iter().map(str::to_owned));
    words
}

/// Runs a command of the README in this folder. Returns what it has printed.
fn run(folder: &Path, words: &[String]) -> String {
    let output = lanternfish(folder).args(words).output().unwrap();
    assert!(output.status.success(), "lanternfish {}\n{}", words.join(" "), String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[gpu_test(full)]
fn gpu_the_readmes_commands_run(_gpu: &Gpu) {
    let folder = tempfile::tempdir().unwrap();
    write_flying(folder.path(), "scene", 1.0);
    let sky = RgbImage::new(8, 4, vec![[1.0, 2.0, 3.0]; 32]).unwrap();
    write_exr(&folder.path().join("sky.exr"), &sky).unwrap();
    let readme = readme();
    let commands = commands(&readme);
    assert!(commands.len() >= 15, "{commands:?}");
    for command in commands {
        let words = small(command);
        match words[0].as_str() {
            // A window has tests of its own.
            "view" => {}
            "papers" if testing::shared("gpu_the_readmes_commands_run", "assets/sponza/Sponza.glb").is_none() => {}
            _ => drop(run(folder.path(), &words)),
        }
    }
}

/// A row that says "all light" must not name a track without shadows.
#[gpu_test(full)]
fn gpu_the_moving_camera_of_the_readme_has_shadows_and_indirect_light(_gpu: &Gpu) {
    let folder = tempfile::tempdir().unwrap();
    let readme = readme();
    let row = readme.lines().find(|line| line.starts_with("| moving camera")).expect("the README has the row");
    for quality in ["draft", "good"] {
        let mut words = small(commands(row)[0]);
        let at = words.iter().position(|word| word == "--quality").expect("the row chooses a quality") + 1;
        words[at] = quality.to_owned();
        words.extend(["-o".to_owned(), quality.to_owned()]);
        run(folder.path(), &words);
        let passes = fs::read_to_string(folder.path().join(quality).join("passes.csv")).unwrap();
        let of_shadows = if quality == "draft" { "direct_light/trace" } else { "shadows/" };
        for pass in [of_shadows, "indirect/", "history"] {
            assert!(passes.contains(pass), "{quality}: no pass {pass}\n{passes}");
        }
    }
}

/// The README says that every check passes; some tests of the doctor run one.
#[gpu_test(full)]
fn gpu_every_check_of_the_doctor_passes(_gpu: &Gpu) {
    let folder = tempfile::tempdir().unwrap();
    let said = run(folder.path(), &["doctor", "--only", "checks", "--adapter", "cpu"].map(str::to_owned));
    assert!(said.contains("0 failed"), "{said}");
    let readme = readme();
    let row =
        readme.lines().find(|line| line.starts_with("| checks of every technique")).expect("the README has the row");
    let passed = said.lines().find_map(|line| line.split_once(" checks passed")).expect("it counts the checks").0;
    assert!(row.contains(&format!("| {passed} of {passed} |")), "{row}\n{said}");
}
