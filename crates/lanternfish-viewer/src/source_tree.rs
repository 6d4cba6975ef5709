//! The shaders of a source tree, which are looked at again and again: what is saved there is seen.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant, SystemTime},
};

use lanternfish_gpu::ShaderTexts;

/// How often the files are looked at.
pub const PERIOD: Duration = Duration::from_millis(250);

/// A folder with WESL files, and what of them has been seen.
#[derive(Debug)]
pub struct SourceTree {
    folder: PathBuf,
    /// When each file was written last, and its bytes.
    seen: BTreeMap<PathBuf, (Option<SystemTime>, u64)>,
    looked: Option<Instant>,
}

impl SourceTree {
    /// The files below a folder, of which none has been seen.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder, seen: BTreeMap::new(), looked: None }
    }

    /// The texts of all files by their module paths, where any is another than at the last look. None before [`PERIOD`] is over, and where
    /// nothing was written.
    pub fn look(&mut self) -> Option<ShaderTexts> {
        if self.looked.is_some_and(|last| last.elapsed() < PERIOD) {
            return None;
        }
        self.looked = Some(Instant::now());
        let mut found = BTreeMap::new();
        collect(&self.folder, &mut found);
        // Without any the tree is not there, or is about to become another.
        if found == self.seen || found.is_empty() {
            return None;
        }
        let mut texts = ShaderTexts::new();
        // A file that cannot be read, since it is just being written, is another at the next look.
        found.retain(|path, _| match (fs::read_to_string(path), path.strip_prefix(&self.folder)) {
            (Ok(text), Ok(module)) => {
                let module = module.with_extension("");
                let module = module.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
                texts.insert(module, text);
                true
            }
            _ => false,
        });
        self.seen = found;
        Some(texts)
    }
}

/// Every `.wesl` file below a folder.
fn collect(folder: &Path, found: &mut BTreeMap<PathBuf, (Option<SystemTime>, u64)>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "wesl")
            && let Ok(about) = path.metadata()
        {
            found.insert(path, (about.modified().ok(), about.len()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_saved_is_seen_once() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("room")).unwrap();
        let file = folder.path().join("room/kernel.wesl");
        fs::write(&file, "const A = 1;").unwrap();
        fs::write(folder.path().join("room/README.md"), "no shader").unwrap();
        let mut tree = SourceTree::new(folder.path().to_owned());
        let look = |tree: &mut SourceTree| {
            tree.looked = None;
            tree.look()
        };
        let first = look(&mut tree).unwrap();
        assert_eq!(first, ShaderTexts::from([("room/kernel".to_owned(), "const A = 1;".to_owned())]));
        assert_eq!(look(&mut tree), None, "nothing was written");
        fs::write(&file, "const A = 22;").unwrap();
        assert_eq!(tree.look(), None, "it was looked just now");
        assert_eq!(look(&mut tree).unwrap()["room/kernel"], "const A = 22;");
        let other = folder.path().join("other.wesl");
        fs::write(&other, [0xff]).unwrap();
        assert_eq!(look(&mut tree).unwrap().len(), 1, "what cannot be read is left out");
        fs::write(&other, "const B = 1;").unwrap();
        assert_eq!(look(&mut tree).unwrap().len(), 2);
        fs::remove_file(&file).unwrap();
        assert_eq!(look(&mut tree).unwrap().len(), 1);
        fs::remove_file(&other).unwrap();
        assert_eq!(look(&mut tree), None, "the tree is about to become another");
    }
}
