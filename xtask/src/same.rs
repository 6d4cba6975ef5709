//! `cargo xtask same`: whether sixteen images are equal to the bit to stored ones, or to those of another commit.
//!
//! `same.txt` holds the driver, and for each image its name, a hash of its linear radiance, and its command. Hashes of different drivers are
//! not comparable: drivers round differently.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    command::{self, cargo, workspace},
    files, program,
};

/// The list, from the workspace's folder.
const LIST: &str = "xtask/src/same.txt";

/// The stored images.
#[derive(Clone, Debug, PartialEq)]
struct List {
    driver: String,
    images: Vec<Image>,
}

/// An image of the list.
#[derive(Clone, Debug, PartialEq)]
struct Image {
    name: String,
    hash: String,
    flags: String,
}

/// Renders the list and compares it. `words`: nothing for the stored hashes, `--write` to store them, or a commit.
pub fn run(words: &[String], may_install: bool) -> Result<(), String> {
    let path = workspace().join(LIST);
    let list = List::parse(&files::read(&path)?)?;
    let program = program::ready_as_tests(may_install)?;
    let own = list.render(&program, "this")?;
    match words {
        [] if own.driver != list.driver => {
            println!("LEFT OUT: same: the stored images are of {}, this driver is {}", list.driver, own.driver);
            Ok(())
        }
        [] => own.compare(&list, "the stored ones"),
        [word] if word == "--write" => {
            files::write(&path, own.to_string())?;
            let changed = own.differences(&list).len();
            println!("{LIST}: {changed} of {} hashes changed", own.images.len());
            Ok(())
        }
        [commit] => own.compare(&list.render(&built(commit)?, "other")?, commit),
        [_, other, ..] => Err(format!("same takes one commit, not {other:?} too")),
    }
}

/// Builds the command line of another commit in a work tree of its own.
fn built(commit: &str) -> Result<PathBuf, String> {
    let tree = workspace().join("target/same/tree");
    let git = |words: &[&str]| {
        let mut git = Command::new("git");
        git.current_dir(workspace()).args(words);
        git
    };
    if tree.exists() {
        command::run(git(&["-C"]).arg(&tree).args(["checkout", "--detach", commit]))?;
    } else {
        command::run(git(&["worktree", "add", "--detach"]).arg(&tree).arg(commit))?;
    }
    let target = workspace().join("target/same/build");
    command::run(cargo(["build", "--package", "lanternfish-cli"]).current_dir(tree).env("CARGO_TARGET_DIR", &target))?;
    Ok(target.join("debug/lanternfish"))
}

impl List {
    fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines();
        let driver =
            lines.next().and_then(|line| line.strip_prefix("driver ")).ok_or("no line starts with \"driver \"")?;
        let image = |line: &str| {
            let [name, hash, flags] = line.splitn(3, ' ').collect::<Vec<_>>().try_into().ok()?;
            Some(Image { name: name.to_owned(), hash: hash.to_owned(), flags: flags.to_owned() })
        };
        let images = lines.map(|line| image(line).ok_or(format!("not NAME HASH FLAGS: {line:?}")));
        Ok(Self { driver: driver.to_owned(), images: images.collect::<Result<_, _>>()? })
    }

    /// The list with the hashes of a program's images.
    fn render(&self, program: &Path, folder: &str) -> Result<Self, String> {
        let mut list = self.clone();
        list.driver = driver(&command::run_for_output(&mut program::called(program, &["info", "--adapters"]))?)?;
        for image in &mut list.images {
            let folder = workspace().join("target/same").join(folder).join(&image.name);
            files::make_empty(&folder)?;
            let words: Vec<&str> = image.flags.split(' ').collect();
            let render = &mut program::called(program, &["render", "--quiet"]);
            command::run_for_output(render.args(words).arg("--output").arg(folder.join("image.exr")))?;
            image.hash = files::at(&folder, hash_of(&folder))?;
        }
        Ok(list)
    }

    /// An error that names the images that differ.
    fn compare(&self, other: &Self, what: &str) -> Result<(), String> {
        match self.differences(other)[..] {
            [] => {
                println!("{} images are equal to {what} to the bit ({})", self.images.len(), self.driver);
                Ok(())
            }
            ref names => {
                Err(format!("{} of {} images differ from {what}: {}", names.len(), self.images.len(), names.join(", ")))
            }
        }
    }

    /// Names of the images whose hashes differ.
    fn differences<'a>(&'a self, other: &Self) -> Vec<&'a str> {
        let pairs = self.images.iter().zip(&other.images);
        pairs.filter(|(own, other)| own.hash != other.hash).map(|(own, _)| own.name.as_str()).collect()
    }
}

impl std::fmt::Display for List {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "driver {}", self.driver)?;
        self.images.iter().try_for_each(|Image { name, hash, flags }| writeln!(f, "{name} {hash} {flags}"))
    }
}

/// Name and driver of the first adapter that `lanternfish info --adapters` lists.
fn driver(adapters: &str) -> Result<String, String> {
    let value =
        |name: &str| adapters.lines().find_map(|line| Some(line.trim_start().strip_prefix(name)?.trim().to_owned()));
    Option::zip(value("adapter "), value("driver "))
        .map(|(name, driver)| format!("{name}, {driver}"))
        .ok_or("no adapter".to_owned())
}

/// Hash (FNV-1a) of the pixels of all images of a folder, in the order of their names.
fn hash_of(folder: &Path) -> std::io::Result<String> {
    let mut paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    paths.sort();
    let images = paths.iter().map(fs::read).collect::<std::io::Result<Vec<_>>>()?;
    let no_image = || std::io::Error::other(format!("{}: a file that is no EXR image", folder.display()));
    let pixels = images.iter().map(|file| pixels(file).ok_or_else(no_image)).collect::<std::io::Result<Vec<_>>>()?;
    Ok(format!("{:016x}", files::hash(pixels)))
}

/// The compressed pixels of an EXR file of one part: what follows header and offsets, since the header names the settings.
fn pixels(file: &[u8]) -> Option<&[u8]> {
    let text = |at: usize| Some(at + file.get(at..)?.iter().position(|byte| *byte == 0)? + 1);
    let mut at = 8;
    // Attributes: name, type, size, value.
    while *file.get(at)? != 0 {
        let size = text(text(at)?)?;
        at = size + 4 + u32::from_le_bytes(file.get(size..size + 4)?.try_into().ok()?) as usize;
    }
    // The first offset is that of the first block of pixels.
    let first = u64::from_le_bytes(file.get(at + 1..at + 9)?.try_into().ok()?);
    file.get(usize::try_from(first).ok()?..)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "driver llvmpipe, Mesa 25\ndefault 00ff demo:atrium --size 8x8\nmean 11aa demo:cornell\n";

    #[test]
    fn a_list_is_read_as_written() {
        let list = List::parse(TEXT).unwrap();
        assert_eq!(list.to_string(), TEXT);
        assert_eq!(list.images[0].flags, "demo:atrium --size 8x8");
        assert!(List::parse("default 00ff demo:atrium").is_err());
        assert!(List::parse("driver x\ndefault 00ff\n").unwrap_err().contains("default 00ff"));
        assert_eq!(List::parse(include_str!("same.txt")).unwrap().images.len(), 16);
    }

    #[test]
    fn one_other_hash_is_an_error_that_names_the_image() {
        let list = List::parse(TEXT).unwrap();
        let mut other = list.clone();
        assert_eq!(list.compare(&other, "x"), Ok(()));
        other.images[1].hash = "11ab".to_owned();
        assert_eq!(list.compare(&other, "x"), Err("1 of 2 images differ from x: mean".to_owned()));
    }

    #[test]
    fn a_hash_depends_on_pixels_and_not_on_the_header() {
        let file = |comment: &[u8], pixels: &[u8]| {
            let mut file = b"v/1\x01\x02\0\0\0comment\0string\0".to_vec();
            file.extend((comment.len() as u32).to_le_bytes().iter().chain(comment).chain(&[0]));
            let first = file.len() as u64 + 8;
            file.extend(first.to_le_bytes().iter().chain(pixels));
            file
        };
        assert_eq!(pixels(&file(b"a", b"1234")), Some(&b"1234"[..]));
        assert_eq!(pixels(&file(b"longer", b"1234")), pixels(&file(b"", b"1234")));
        assert_ne!(pixels(&file(b"a", b"1234")), pixels(&file(b"a", b"1235")));
        assert_eq!(pixels(b"not an image"), None);
    }

    #[test]
    fn a_driver_is_named_with_its_version() {
        let adapters = "adapter      llvmpipe (256 bits)\n  kind       Cpu\n  driver     Mesa 25.0.7\n";
        assert_eq!(driver(adapters).as_deref(), Ok("llvmpipe (256 bits), Mesa 25.0.7"));
        assert!(driver("none").is_err());
    }
}
