//! A folder in which the program runs, and what it says.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use lanternfish_metrics::{RgbImage, read_exr, read_png};
use serde_json::Value;

/// The program in a folder, without input, with the log variables of the test's environment removed.
pub fn lanternfish(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish"));
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Exit code and texts of a program.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    pub fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    #[track_caller]
    pub fn succeeded(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self
    }

    /// Asserts one error that contains each of these, a failure, no panic and no results.
    #[track_caller]
    pub fn was_refused(&self, parts: &[&str]) {
        assert!(self.code.is_some_and(|code| code > 0) && self.stdout.is_empty(), "{self:?}");
        assert_eq!(self.stderr.lines().filter(|line| line.starts_with("error")).count(), 1, "{}", self.stderr);
        for bug in ["panicked", "internal error", "RUST_BACKTRACE"] {
            assert!(!self.stderr.contains(bug), "{}", self.stderr);
        }
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is not in: {}", self.stderr);
        }
    }
}

pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with these files.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self::new();
        files.iter().for_each(|(name, text)| folder.write(name, text));
        folder
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

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    pub fn exr(&self, name: &str) -> RgbImage {
        read_exr(&self.path(name)).unwrap()
    }

    pub fn png(&self, name: &str) -> RgbImage {
        read_png(&self.path(name)).unwrap()
    }

    /// Sorted names of the files in the folder, or in one of its folders.
    pub fn names(&self, inner: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(inner)).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    pub fn program(&self) -> Command {
        lanternfish(self.0.path())
    }

    pub fn run(&self, words: &str) -> Ran {
        Ran::of(self.program().args(words.split_whitespace()))
    }

    /// Runs the program, which succeeds.
    #[track_caller]
    pub fn done(&self, words: &str) -> Ran {
        self.run(words).succeeded()
    }

    /// Renders small images on the software adapter. Warnings about old drivers are the same for every run, and left out.
    #[track_caller]
    pub fn render(&self, words: &str) -> Ran {
        let size = if words.contains("--size") { "" } else { "--size 48x32" };
        let mut ran = self.done(&format!("render {words} --adapter cpu {size}"));
        let said = ran.stderr.split_inclusive('\n').filter(|line| !line.starts_with("warning: Mesa "));
        ran.stderr = said.collect();
        ran
    }
}

/// Writes a scene of this name: a triangle in the plane z = 0 with its right angle at the origin and legs of 1 m. Its animation "fly" moves it along x by
/// `distance`, m, in the first second.
pub fn write_flying(folder: &Path, name: &str, distance: f32) {
    let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let data = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 1., 0., 0., 0., distance, 0., 0.]);
    fs::write(folder.join(format!("{name}.bin")), data).unwrap();
    let accessor = |view: usize, count: usize, shape: &str| {
        format!(r#"{{"bufferView": {view}, "componentType": 5126, "count": {count}, "type": "{shape}"}}"#)
    };
    let (positions, times, values) = (accessor(0, 3, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3"));
    let scene = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"name": "{name}", "mesh": 0, "extras": {{"semantic": 8}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}], "accessors": [{positions}, {times}, {values}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 8}},
        {{"buffer": 0, "byteOffset": 44, "byteLength": 24}}], "buffers": [{{"byteLength": 68, "uri": "{name}.bin"}}],
        "animations": [{{"name": "fly", "samplers": [{{"input": 1, "output": 2}}],
        "channels": [{{"sampler": 0, "target": {{"node": 0, "path": "translation"}}}}]}}]}}"#
    );
    fs::write(folder.join(format!("{name}.gltf")), scene).unwrap();
}
