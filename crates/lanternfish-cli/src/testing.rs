//! Command lines in this process: what they refuse, and the files that they write.

use std::{collections::BTreeMap, fs, path::PathBuf, time::Instant};

use lanternfish_scene::printable;

use crate::{
    cli::{self, Cli, Command},
    paper, program,
};

/// Makes the techniques of the papers known, for tests that list techniques before they parse a command line.
pub fn know_papers() {
    paper::register();
}

/// The command of a command line, without the program's name.
pub fn parsed(words: &str) -> Result<Command, clap::Error> {
    Ok(program::parse::<Cli>(words.split_whitespace().map(Into::into).collect())?.0.command)
}

/// A folder in which command lines find their files. `%` in their words stands for it.
pub struct Place(tempfile::TempDir);

impl Place {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with these files.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let place = Self::new();
        files.iter().for_each(|(name, text)| place.write(name, text));
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Everything in the folder by name; folders, links and pipes without their contents.
    pub fn contents(&self) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(self.0.path()).unwrap().map(Result::unwrap);
        let content = |entry: &fs::DirEntry| match entry.file_type().unwrap().is_file() {
            true => fs::read(entry.path()).unwrap(),
            false => Vec::new(),
        };
        entries.map(|entry| (entry.file_name().into_string().unwrap(), content(&entry))).collect()
    }

    /// Runs a command line and returns its exit code, or what the program prints where it fails. `''` is an empty word.
    pub fn run(&self, words: &str) -> Result<u8, String> {
        let folder = format!("{}/", self.0.path().display());
        let words = words.split_whitespace().map(|word| word.replace("''", "").replace('%', &folder).into());
        let (cli, matches) = program::parse(words.collect()).map_err(|error| error.to_string())?;
        cli::run(cli, &matches, Instant::now()).map_err(|error| printable(&error.to_string()))
    }

    /// Runs a command line that succeeds.
    #[track_caller]
    pub fn done(&self, words: &str) {
        assert_eq!(self.run(words), Ok(0), "{words}");
    }

    /// Runs command lines that fail: each is one error that has all of these parts, between bars, and leaves the folder as it is.
    #[track_caller]
    pub fn refuses(&self, rows: &[(&str, &str)]) {
        let before = self.contents();
        for (words, parts) in rows {
            let error = self.run(words).expect_err(words);
            assert_eq!(error.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{words}: {error}");
            for part in parts.split(" | ") {
                assert!(error.contains(part), "{words}: {part:?} is not in: {error}");
            }
            assert!(self.contents() == before, "{words}: it left files");
        }
    }
}
