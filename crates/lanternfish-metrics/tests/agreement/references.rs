//! Reads the reference images that are stored outside the repository.

use std::{fs::OpenOptions, io::Write, path::PathBuf};

use lanternfish_metrics::{RelativeError, read_exr};

/// `LANTERNFISH_SHARED`, or `shared` beside the workspace.
fn shared() -> PathBuf {
    std::env::var_os("LANTERNFISH_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")), PathBuf::from)
}

/// Reports a skipped test on the terminal and in the file that `cargo xtask test` reads.
fn leave_out(test: &str, reason: &str) {
    let line = format!("LEFT OUT (shared): {test}: {reason}\n");
    eprint!("{line}");
    if let Some(list) = std::env::var_os("LANTERNFISH_LEFT_OUT") {
        let mut file = OpenOptions::new().create(true).append(true).open(list).unwrap();
        file.write_all(line.as_bytes()).unwrap();
    }
}

#[test]
fn a_reference_is_read_and_agrees_with_itself() {
    let path = shared().join("references/cornell-point-direct.exr");
    if !path.exists() {
        leave_out(
            "a_reference_is_read_and_agrees_with_itself",
            "no references/cornell-point-direct.exr in the shared folder (LANTERNFISH_SHARED)",
        );
        return;
    }
    let image = read_exr(&path).unwrap();
    assert_eq!((image.width, image.height), (256, 256));
    let error = RelativeError::measure(&image, &image, 1e-3).unwrap();
    assert_eq!((error.median(), error.energy_ratio()), (0.0, 1.0));
    // The box fills the image and the lamp reaches most of it.
    assert!(error.lit_count() > 256 * 256 / 2, "only {} pixels are lit", error.lit_count());

    // The comparison detects a flipped image.
    let mut flipped = image.clone();
    flipped.pixels.reverse();
    assert!(RelativeError::measure(&flipped, &image, 1e-3).unwrap().median() > 0.02);
}
