//! The shaders of a source tree, polled for saved changes.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    time::{Duration, Instant, SystemTime},
};

use lanternfish_gpu::{ShaderTexts, shader_files};

/// Period of the polls.
pub const PERIOD: Duration = Duration::from_millis(250);

/// A folder with WESL files, and their state at the last poll.
#[derive(Debug)]
pub struct SourceTree {
    folder: PathBuf,
    /// Modification time, size in bytes and module path of each file.
    files: BTreeMap<PathBuf, (Option<SystemTime>, u64, String)>,
    looked: Option<Instant>,
}

impl SourceTree {
    /// Creates a tree of the files below a folder. The first poll reports all of them.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder, files: BTreeMap::new(), looked: None }
    }

    /// The texts of all files by module path, if any file has changed since the last call. `None` within [`PERIOD`] of the last call, and
    /// without changes.
    pub fn look(&mut self) -> Option<ShaderTexts> {
        if self.looked.is_some_and(|last| last.elapsed() < PERIOD) {
            return None;
        }
        self.looked = Some(Instant::now());
        let current = shader_files(&self.folder).into_iter().filter_map(|(path, module)| {
            let about = path.metadata().ok()?;
            Some((path, (about.modified().ok(), about.len(), module)))
        });
        let mut present: BTreeMap<_, _> = current.collect();
        // An empty tree is missing, or is being replaced.
        if present == self.files || present.is_empty() {
            return None;
        }
        let mut texts = ShaderTexts::new();
        // A file that cannot be read, for example during a write, is retried at the next call.
        present.retain(|path, (_, _, module)| match lanternfish_scene::read_text(path) {
            Ok(text) => {
                texts.insert(module.clone(), text);
                true
            }
            Err(_) => false,
        });
        self.files = present;
        Some(texts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_files_are_reported_once() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("module")).unwrap();
        let file = folder.path().join("module/kernel.wesl");
        std::fs::write(&file, "const A = 1;").unwrap();
        std::fs::write(folder.path().join("module/README.md"), "no shader").unwrap();
        let mut tree = SourceTree::new(folder.path().to_owned());
        let look = |tree: &mut SourceTree| {
            tree.looked = None;
            tree.look()
        };
        let first = look(&mut tree).unwrap();
        assert_eq!(first, ShaderTexts::from([("module/kernel".to_owned(), "const A = 1;".to_owned())]));
        assert_eq!(look(&mut tree), None, "nothing was written");
        std::fs::write(&file, "const A = 22;").unwrap();
        assert_eq!(tree.look(), None, "the period is not over");
        assert_eq!(look(&mut tree).unwrap()["module/kernel"], "const A = 22;");
        let other = folder.path().join("other.wesl");
        std::fs::write(&other, [0xff]).unwrap();
        assert_eq!(look(&mut tree).unwrap().len(), 1, "unreadable files are left out");
        std::fs::write(&other, "const B = 1;").unwrap();
        assert_eq!(look(&mut tree).unwrap().len(), 2);
        std::fs::remove_file(&file).unwrap();
        assert_eq!(look(&mut tree).unwrap().len(), 1);
        std::fs::remove_file(&other).unwrap();
        assert_eq!(look(&mut tree), None, "the tree is being replaced");
    }
}
