//! `lanternfish reference`, from the command line to files.

mod parts;
mod renderings;
#[cfg(unix)]
mod signals;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use lanternfish_metrics::{RgbImage, exr_layers, read_exr, read_exr_attributes, read_exr_layer};

use crate::support::{lanternfish, names};

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn output(folder: &Path, words: &str) -> Output {
    lanternfish(folder).args(words.split_whitespace()).output().unwrap()
}

/// Standard output and standard error of a successful run of `reference demo:cornell` at 32 × 32, without the result's line and
/// the estimate of the time left, which slow machines print.
#[track_caller]
fn cornell(folder: &Path, words: &str) -> (String, String) {
    let output = output(folder, &format!("reference demo:cornell --size 32x32 {words}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    (text(&output.stdout).to_owned(), more_than_usual(text(&output.stderr)))
}

/// Lines of standard error without the estimate and the result's line, which must occur exactly once.
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

/// Standard error of a run that fails with one error and leaves the folder's files unchanged.
#[track_caller]
fn refused(folder: &Path, words: &str) -> String {
    let before = contents(folder);
    let output = output(folder, &format!("reference {words}"));
    let error = text(&output.stderr).to_owned();
    assert!(!output.status.success() && output.stdout.is_empty(), "{output:?}");
    assert_eq!(error.lines().filter(|line| line.starts_with("error")).count(), 1, "{error}");
    assert!(!error.contains("internal error"), "{error}");
    assert!(contents(folder) == before, "{error}");
    error
}

fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), fs::read(path).unwrap_or_default())).collect()
}

fn samples(path: &Path) -> u64 {
    read_exr_attributes(path).unwrap()["lanternfish.samples"].parse().unwrap()
}

fn values(image: &RgbImage) -> impl Iterator<Item = f32> {
    image.pixels.iter().flatten().copied()
}

#[test]
fn the_file_has_mean_variance_and_settings() {
    let folder = tempfile::tempdir().unwrap();
    let (stdout, stderr) = cornell(folder.path(), "--spp 8 --seed 3 --max-depth 3 -o a.exr --variance v.exr");
    assert_eq!((stdout.as_str(), stderr.as_str()), ("a.exr\n", ""));
    assert_eq!(names(folder.path()), ["a.exr", "v.exr"]);
    let path = folder.path().join("a.exr");
    assert_eq!(exr_layers(&path).unwrap(), ["", "variance"]);
    let attributes = read_exr_attributes(&path).unwrap();
    for (name, value) in [
        ("samples", "8"),
        ("seed", "3"),
        ("dropped", "0"),
        ("scene", "demo:cornell"),
        ("size", "32x32"),
        ("integrator", "path"),
        ("max-depth", "3"),
        ("light-choice", "tree"),
        ("light-paths", "on"),
    ] {
        assert_eq!(attributes[&format!("lanternfish.{name}")], value, "{name}");
    }
    assert_eq!(attributes["lanternfish.fingerprint"].len(), 16);
    let (mean, variance) = (read_exr(&path).unwrap(), read_exr_layer(&path, "variance").unwrap());
    assert_eq!((mean.width, mean.height), (32, 32));
    for image in [&mean, &variance] {
        assert!(values(image).all(|value| value.is_finite() && value >= 0.0) && values(image).any(|value| value > 0.0));
    }
    assert_eq!(read_exr(&folder.path().join("v.exr")).unwrap(), variance);
}

#[test]
fn each_seed_gives_one_image() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |words: &str| {
        cornell(folder.path(), &format!("--spp 4 -o a.exr {words}"));
        fs::read(folder.path().join("a.exr")).unwrap()
    };
    let first = bytes("--seed 1");
    // Threads and display settings do not affect the file.
    assert!(bytes("--seed 1 --threads 1 --exposure 2") == first);
    let mean = |bytes: &[u8]| {
        fs::write(folder.path().join("b.exr"), bytes).unwrap();
        read_exr(&folder.path().join("b.exr")).unwrap()
    };
    assert_ne!(mean(&bytes("--seed 2")), mean(&first));
}

#[test]
fn a_resumed_run_equals_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, layer: &str| read_exr_layer(&folder.path().join(name), layer).unwrap();
    cornell(folder.path(), "--spp 64 -o whole.exr");
    let (_, stderr) = cornell(folder.path(), "--spp 1 --resume -o parts.exr");
    assert!(stderr.starts_with("note: parts.exr: no such file yet"), "{stderr}");
    for spp in [32, 64] {
        assert_eq!(cornell(folder.path(), &format!("--spp {spp} --resume -o parts.exr")).1, "");
    }
    assert_eq!(samples(&folder.path().join("parts.exr")), 64);
    // The mean is rounded to 24 bits twice. The variance is a difference of squares, so the mean's rounding errors grow by the
    // ratio of mean to variance.
    for ((whole, part), variance) in
        values(&read("whole.exr", "")).zip(values(&read("parts.exr", ""))).zip(values(&read("whole.exr", "variance")))
    {
        assert!((whole - part).abs() <= 1e-5 * whole, "{whole} {part} {variance}");
    }
    for (whole, part) in values(&read("whole.exr", "variance")).zip(values(&read("parts.exr", "variance"))) {
        assert!((whole - part).abs() <= 1e-3 * whole + 1e-9, "variance {whole} {part}");
    }
    // The file has enough samples already.
    let before = fs::read(folder.path().join("parts.exr")).unwrap();
    cornell(folder.path(), "--spp 10 --resume -o parts.exr");
    assert!(fs::read(folder.path().join("parts.exr")).unwrap() == before);
}

#[test]
fn a_run_with_other_settings_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |words: &str| refused(folder.path(), &format!("{words} --resume"));
    cornell(folder.path(), "--spp 2 --seed 5 -o a.exr");
    for (words, why) in [
        ("demo:cornell --size 32x16 -o a.exr", "size is 32x32 there and 32x16 here"),
        ("demo:cornell --size 32x32 --max-depth 2 -o a.exr", "max-depth is unlimited there and 2 here"),
        ("demo:cornell --size 32x32 --eye 0,1,3 -o a.exr", "eye is"),
        ("demo:cornell --size 32x32 --point 0,1,0,5 -o a.exr", "content differs"),
        ("demo:cornell --size 32x32 --seed 6 -o a.exr", "its seed is 5, not 6"),
    ] {
        let error = refused(words);
        assert!(error.contains(why) && error.contains("hint"), "{why:?} is not in: {error}");
    }
    // Without a seed, the file's is used.
    cornell(folder.path(), "--spp 4 -o a.exr --resume");
    assert_eq!(read_exr_attributes(&folder.path().join("a.exr")).unwrap()["lanternfish.seed"], "5");

    lanternfish_metrics::write_exr(&folder.path().join("b.exr"), &read_exr(&folder.path().join("a.exr")).unwrap())
        .unwrap();
    assert!(refused("demo:cornell -o b.exr").contains("not an image of `lanternfish reference`"));
    fs::write(folder.path().join("c.exr"), "no image").unwrap();
    assert!(refused("demo:cornell -o c.exr").contains("c.exr"));
    assert!(refused("demo:cornell -o d.png").contains("end the name with .exr"));
}

#[test]
fn mistakes_are_reported_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    for (words, what) in [
        ("demo:cornell --integrator obscurance -o a.exr", "--max-distance"),
        ("demo:cornell --max-distance 1 -o a.exr", "--integrator obscurance"),
        ("demo:cornell -o a.jpg", ".exr (linear"),
        ("demo:cornell -o missing/a.exr", "no folder"),
        ("demo:cornell -o a.exr --variance a.png", "EXR only"),
        ("demo:cornell -o a.exr --variance ./a.exr", "both the image and --variance"),
        ("demo:cornell --environment a.exr -o a.exr", "both read and written"),
        ("demo:cornell --shadows none", "--shadows"),
        ("demo:cornell --spp 0", "--spp"),
        ("demo:cornell --threads 0", "--threads"),
        ("demo:nothing", "demo:nothing"),
        ("nowhere.glb", "nowhere.glb"),
        ("nowhere.toml", "nowhere.toml"),
        ("demo:cornell --frames 3", "--frames"),
        ("demo:cornell --samples 3-1", "samples A-B"),
        ("demo:cornell --samples 1-2 --spp 4", "--spp"),
        ("demo:cornell --samples 1-2 -o a.png", "which PNG does not hold"),
    ] {
        let error = refused(folder.path(), words);
        assert!(error.contains(what), "{words}: {error}");
    }
}

#[test]
fn it_stops_at_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| cornell(folder.path(), &format!("--max-depth 2 -o a.exr {words}")).1;
    let noise =
        || read_exr_attributes(&folder.path().join("a.exr")).unwrap()["lanternfish.noise"].parse::<f64>().unwrap();
    let count = || samples(&folder.path().join("a.exr"));
    run("--until-error 0.2");
    assert!(noise() <= 0.2 && count() >= 16, "{} {}", noise(), count());
    let few = count();
    run("--until-error 0.1");
    assert!(noise() <= 0.1 && count() > few, "{} {}", noise(), count());
    // The result does not depend on the machine's speed.
    let bytes = fs::read(folder.path().join("a.exr")).unwrap();
    run("--until-error 0.1 --threads 1");
    assert!(fs::read(folder.path().join("a.exr")).unwrap() == bytes);
    // A sample count limits the run.
    let stderr = run("--until-error 1e-6 --spp 20");
    assert!(stderr.contains("after 20 samples per pixel, not yet") && count() == 20, "{stderr}");
}

/// Two rows of many pixels that all see walls: each row takes longer than the time limit.
#[test]
fn a_time_limit_binds_within_a_row() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| {
        let line = format!("reference demo:cornell --size 16384x2 --eye 0,1,0.5 --target 0,1,-1 {words}");
        let output = output(folder.path(), &line);
        assert!(output.status.success(), "{}", text(&output.stderr));
        more_than_usual(text(&output.stderr))
    };
    // No machine traces sixteen thousand paths on a core in two milliseconds.
    let stderr = run("--time-limit 0.002 -o cut.exr");
    assert_eq!(samples(&folder.path().join("cut.exr")), 0);
    let black = "2 of 2 rows have no samples yet and are black; the same command with --resume";
    assert!(stderr.contains(black), "{stderr}");
    assert!(run("--time-limit 0.002 -o cut.png").ends_with("and are black\n"));
    // Resumed, it equals a single run.
    run("--spp 1 --resume -o cut.exr");
    run("--spp 1 -o whole.exr");
    let [cut, whole] = ["cut.exr", "whole.exr"].map(|name| read_exr(&folder.path().join(name)).unwrap());
    assert!(cut == whole && samples(&folder.path().join("cut.exr")) == 1);
}

#[test]
fn the_result_line_states_samples_and_error() {
    let folder = tempfile::tempdir().unwrap();
    let line = |words: &str| {
        let output = output(folder.path(), &format!("reference demo:cornell --size 8x8 {words}"));
        text(&output.stderr).to_owned()
    };
    let said = line("--spp 9 -o a.exr");
    assert!(said.starts_with("a.exr: 9 samples per pixel in ") && said.ends_with(" %\n"), "{said}");
    assert!(line("--spp 1 -o a.exr").ends_with("expected error unknown below 2 samples\n"));
    assert_eq!(line("--spp 9 --quiet -o a.exr"), "");
}

#[test]
fn noise_and_rain_have_separate_seeds() {
    let folder = tempfile::tempdir().unwrap();
    let fingerprint = |words: &str| {
        let stderr = cornell(folder.path(), &format!("--lights rain:9 --spp 1 -o a.exr {words}")).1;
        (read_exr_attributes(&folder.path().join("a.exr")).unwrap()["lanternfish.fingerprint"].clone(), stderr)
    };
    let (first, stderr) = fingerprint("");
    assert_eq!(stderr, "");
    let (same, stderr) = fingerprint("--seed 4");
    assert!(same == first && stderr.contains("--rain-seed"), "{stderr}");
    assert_ne!(fingerprint("--rain-seed 4").0, first);
}

#[test]
fn a_shots_background_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.toml"), "scene = \"demo:cornell\"\n[look]\nbackground = \"white\"\n").unwrap();
    let said = output(folder.path(), "reference a.toml --size 4x4 --spp 1 -o a.exr").stderr;
    assert!(text(&said).contains("the path tracer shows the environment"), "{}", text(&said));
}

#[test]
fn the_table_lists_the_counters() {
    let folder = tempfile::tempdir().unwrap();
    let (stdout, _) = cornell(folder.path(), "--spp 2 --timings -o a.png");
    for line in ["triangles", "samples per pixel", "samples dropped", "expected error", "trace", "total"] {
        assert!(stdout.lines().any(|l| l.starts_with(line)), "{line}: {stdout}");
    }
    assert!(stdout.lines().any(|line| line.split_whitespace().eq(["samples,", "this", "run", "2,048"])), "{stdout}");
    assert_eq!(stdout.lines().last(), Some("a.png"));
}
