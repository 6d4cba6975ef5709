//! `lanternfish compare` as a process. `src/compare/tests.rs` has its measures.

use crate::support::Folder;

/// Images with reference values from the FLIP authors' evaluator.
const PAIRS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../lanternfish-metrics/tests/pairs/");

#[test]
fn the_figures_are_a_table_a_file_and_an_exit_code() {
    let folder = Folder::new();
    let both = format!("{PAIRS}scene-noise.exr {PAIRS}scene.exr");
    let ran = folder.done(&format!("compare {both} --json figures.json --max-flip 0.14"));
    let words: Vec<_> = ran.stdout.split_whitespace().collect();
    assert!(words.join(" ").contains("HDR-FLIP 0.13164") && ran.stderr.is_empty(), "{ran:?}");
    let mean = folder.json("figures.json")["linear"]["hdr_flip"]["mean"].as_f64().unwrap();
    assert!((mean - 0.131_647_4).abs() < 1e-5, "{mean}");
    // No files except the requested ones, and the table where a limit is exceeded.
    assert_eq!(folder.names(""), ["figures.json"]);
    let ran = folder.run(&format!("compare {both} --max-flip 0.13 --max-relmse 0.001"));
    assert!(ran.code == Some(1) && ran.stdout.contains("HDR-FLIP"), "{ran:?}");
    for part in ["HDR-FLIP 0.1316", "--max-flip", "relMSE", "--max-relmse"] {
        assert!(ran.stderr.contains(part), "{ran:?}");
    }
}

/// A stream is written to, and what a file before it holds stays.
#[cfg(target_os = "linux")]
#[test]
fn json_can_go_to_standard_output() {
    let folder = Folder::with(&[("both.txt", "before\n")]);
    let both = std::fs::OpenOptions::new().append(true).open(folder.path("both.txt")).unwrap();
    let words = format!("compare {PAIRS}scene.exr {PAIRS}scene.exr --json /dev/stdout");
    assert!(folder.program().args(words.split(' ')).stdout(both).status().unwrap().success());
    let said = String::from_utf8(folder.read("both.txt")).unwrap();
    assert!(said.starts_with("before\n{") && said.contains("relMSE"), "the figures, and then the table: {said}");
}
