//! Output files: long names, links and pipes. Tests `reference` and `compare`, which need no adapter; `render` writes with the same
//! functions.

use std::{fs, process::Command};

use crate::support::Folder;

/// Writes an image of 4 × 4 pixels.
#[track_caller]
fn trace(folder: &Folder, file: &str) {
    folder.done(&format!("reference demo:cornell --size 4x4 --spp 2 -o {file}"));
}

#[test]
fn names_may_have_the_longest_length() {
    let folder = Folder::new();
    let name = |ending: &str| "n".repeat(255 - ending.len()) + ending;
    for ending in [".exr", ".png"] {
        trace(&folder, &name(ending));
    }
    assert_eq!(folder.names(""), [name(".exr"), name(".png")]);
    assert_eq!((folder.exr(&name(".exr")).width, folder.png(&name(".png")).width), (4, 4));
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_pipes_are_written_to_but_not_compared() {
    let folder = Folder::new();
    fs::create_dir(folder.path("disk")).unwrap();
    std::os::unix::fs::symlink("disk/truth.exr", folder.path("truth.exr")).unwrap();
    for spp in ["1", "2"] {
        folder.done(&format!("reference demo:cornell --size 4x4 --spp {spp} --resume -o truth.exr"));
        assert!(fs::symlink_metadata(folder.path("truth.exr")).unwrap().is_symlink());
    }
    assert_eq!((folder.exr("disk/truth.exr").width, folder.names("disk")), (4, vec!["truth.exr".to_owned()]));

    let path = folder.path("pipe.exr");
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    let reader = std::thread::spawn(move || fs::read(path).unwrap());
    trace(&folder, "pipe.exr");
    trace(&folder, "file.exr");
    assert!(reader.join().unwrap() == folder.read("file.exr"));
    // Regression: it waited forever for a writer.
    for words in ["pipe.exr file.exr", "file.exr pipe.exr", "file.exr file.exr --variance-a pipe.exr"] {
        folder.run(&format!("compare {words}")).was_refused(&["pipe.exr", "a pipe"]);
    }
    assert_eq!(folder.names(""), ["disk", "file.exr", "pipe.exr", "truth.exr"]);
}
