//! Comparison of all files of the conformance suite with the verdicts of the Khronos validator.

use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use super::samples::asset;
use crate::import::load;

/// Time without a result after which loading counts as hanging: over 100 times that of the slowest file on two slow cores.
const HANGS: Duration = Duration::from_secs(120);

/// Result of loading a file.
enum Outcome {
    /// The file loads, and the scene is valid.
    Sound,
    /// The file loads, but the scene violates this invariant.
    Unsound(String),
    /// The file does not load, for this reason.
    Refused(String),
    Panicked,
}

fn try_file(path: &Path) -> Outcome {
    let name = path.to_str().expect("UTF-8");
    match catch_unwind(|| load(name).map(|scene| scene.validate())) {
        Ok(Ok(Ok(()))) => Outcome::Sound,
        Ok(Ok(Err(fault))) => Outcome::Unsound(fault.to_string()),
        Ok(Err(error)) => Outcome::Refused(error.to_string()),
        Err(_) => Outcome::Panicked,
    }
}

/// Outcome and time of each file, on all cores. Panics if files hang, with their names.
fn try_all(folder: &Path, files: Vec<String>) -> BTreeMap<String, (Outcome, Duration)> {
    let (sender, outcomes) = channel();
    let mut pending: std::collections::BTreeSet<_> = files.iter().cloned().collect();
    for file in files {
        let (sender, path) = (sender.clone(), folder.join(&file));
        rayon::spawn(move || {
            let start = Instant::now();
            let outcome = try_file(&path);
            // The receiver is gone if other files have hung.
            let _ = sender.send((file, outcome, start.elapsed()));
        });
    }
    drop(sender);
    let mut results = BTreeMap::new();
    loop {
        match outcomes.recv_timeout(HANGS) {
            Ok((file, outcome, time)) => {
                pending.remove(&file);
                results.insert(file, (outcome, time));
            }
            Err(RecvTimeoutError::Disconnected) => return results,
            Err(RecvTimeoutError::Timeout) => panic!("nothing for {HANGS:?}; still pending: {pending:?}"),
        }
    }
}

#[test]
fn files_that_the_validator_accepts_load() {
    let Some(folder) = asset("conformance", "conformance") else { return };
    let table = std::fs::read_to_string(folder.join("VALIDATOR.tsv")).expect("the validator's verdicts");
    let rows = table.lines().skip(1).map(|line| {
        let mut columns = line.split('\t');
        let (file, errors) = (columns.next().expect("a file"), columns.next().expect("a count"));
        (file.to_owned(), errors == "0")
    });
    let verdicts: BTreeMap<String, bool> = rows.collect();
    // Only some of the files have verdicts; the others must not panic.
    let mut files = scene_files(&folder);
    files.extend(verdicts.keys().cloned());
    files.sort();
    files.dedup();
    let results = try_all(&folder, files);

    let mut failures = Vec::new();
    let (mut accepted, mut accepted_loaded, mut loaded, mut refused) = (0, 0, 0, 0);
    for (file, (outcome, _)) in &results {
        let is_accepted = verdicts.get(file) == Some(&true);
        accepted += usize::from(is_accepted);
        match outcome {
            Outcome::Sound if is_accepted => accepted_loaded += 1,
            Outcome::Sound => loaded += 1,
            Outcome::Refused(message) if !is_accepted => {
                refused += 1;
                assert!(message.len() < 2000, "{file}: an endless message: {message}");
            }
            Outcome::Panicked => failures.push(format!("{file}: panicked")),
            Outcome::Unsound(what) => failures.push(format!("{file}: loads, but {what}")),
            Outcome::Refused(message) => failures.push(format!("the validator accepts what is refused: {message}")),
        }
    }
    let (slowest, (_, time)) = results.iter().max_by_key(|(_, (_, time))| *time).expect("there are files");
    println!(
        "conformance: {} files; {accepted} without errors, of which {accepted_loaded} load; of the others {loaded} load and \
         {refused} are refused; slowest {slowest} with {:.2} s",
        results.len(),
        time.as_secs_f64()
    );
    assert!(accepted > 200 && refused > 20, "the suite is incomplete, or nothing is refused");
    assert!(failures.is_empty(), "{} files:\n{}", failures.len(), failures.join("\n"));
}

/// The paths of all scene files below `folder`, relative to it.
fn scene_files(folder: &Path) -> Vec<String> {
    let (mut files, mut folders) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = folders.pop() {
        for entry in std::fs::read_dir(folder.join(&inner)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = inner.join(entry.file_name());
            let ending = path.extension().unwrap_or_default();
            if entry.file_type().expect("a type").is_dir() {
                folders.push(path);
            } else if ending == "gltf" || ending == "glb" {
                files.push(path.to_str().expect("UTF-8").to_owned());
            }
        }
    }
    files
}
