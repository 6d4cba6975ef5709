//! Every file of the conformance suite, against the Khronos validator's verdict.

use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use super::samples::asset;
use crate::import::load;

/// A file that takes longer counts as hanging: over a hundred times what the slowest takes on two slow cores.
const HANGS: Duration = Duration::from_secs(120);

/// What came of a file.
enum Outcome {
    /// It loads, and the scene keeps its promises.
    Sound,
    /// It loads, and the scene breaks this promise.
    Unsound(String),
    /// It does not load, for this reason.
    Refused(String),
    Panicked,
}

fn try_file(path: &Path) -> Outcome {
    let name = path.to_str().expect("UTF-8");
    match catch_unwind(|| load(name).map(|scene| scene.validate())) {
        Ok(Ok(Ok(()))) => Outcome::Sound,
        Ok(Ok(Err(fault))) => Outcome::Unsound(fault),
        Ok(Err(error)) => Outcome::Refused(error.to_string()),
        Err(_) => Outcome::Panicked,
    }
}

/// Outcome and time of each file, tried on all cores. Panics, with the files' names, when some hang.
fn try_all(folder: &Path, files: Vec<String>) -> BTreeMap<String, (Outcome, Duration)> {
    let (sender, outcomes) = channel();
    let mut open: std::collections::BTreeSet<_> = files.iter().cloned().collect();
    for file in files {
        let (sender, path) = (sender.clone(), folder.join(&file));
        rayon::spawn(move || {
            let start = Instant::now();
            let outcome = try_file(&path);
            // Nobody listens any more once others have hung.
            let _ = sender.send((file, outcome, start.elapsed()));
        });
    }
    drop(sender);
    let mut results = BTreeMap::new();
    loop {
        match outcomes.recv_timeout(HANGS) {
            Ok((file, outcome, time)) => {
                open.remove(&file);
                results.insert(file, (outcome, time));
            }
            Err(RecvTimeoutError::Disconnected) => return results,
            Err(RecvTimeoutError::Timeout) => panic!("nothing for {HANGS:?}; still open: {open:?}"),
        }
    }
}

#[test]
fn what_the_validator_accepts_loads() {
    let Some(folder) = asset("conformance", "conformance") else { return };
    let table = std::fs::read_to_string(folder.join("VALIDATOR.tsv")).expect("the validator's verdicts");
    let rows = table.lines().skip(1).map(|line| {
        let mut columns = line.split('\t');
        let (file, errors) = (columns.next().expect("a file"), columns.next().expect("a count"));
        (file.to_owned(), errors == "0")
    });
    let verdicts: BTreeMap<String, bool> = rows.collect();
    // The verdicts are of some of the files that are there; the others are only not to panic.
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
    assert!(accepted > 200 && refused > 20, "the suite is not whole, or nothing is refused");
    assert!(failures.is_empty(), "{} files:\n{}", failures.len(), failures.join("\n"));
}

/// The paths of all scene files below `folder`, relative to it.
fn scene_files(folder: &Path) -> Vec<String> {
    let (mut files, mut open) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = open.pop() {
        for entry in std::fs::read_dir(folder.join(&inner)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = inner.join(entry.file_name());
            let ending = path.extension().unwrap_or_default();
            if entry.file_type().expect("a type").is_dir() {
                open.push(path);
            } else if ending == "gltf" || ending == "glb" {
                files.push(path.to_str().expect("UTF-8").to_owned());
            }
        }
    }
    files
}
