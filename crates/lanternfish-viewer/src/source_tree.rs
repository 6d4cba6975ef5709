//! The shaders of a source tree, which are looked at again and again: what is saved there is seen.

use std::{
    collections::BTreeMap,
    fs,
    path::PathBuf,
    time::{Duration, Instant, SystemTime},
};

use lanternfish_gpu::{ShaderTexts, shader_files};

/// How often the files are looked at.
pub const PERIOD: Duration = Duration::from_millis(250);

/// A folder with WESL files, and what of them has been seen.
#[derive(Debug)]
pub struct SourceTree {
    folder: PathBuf,
    /// When each file was written last, its bytes, and its module path.
    viewport: BTreeMap<PathBuf, (Option<SystemTime>, u64, String)>,
    looked: Option<Instant>,
}

impl SourceTree {
    /// The files below a folder, of which none has been seen.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder, viewport: BTreeMap::new(), looked: None }
    }

    /// The texts of all files by their module paths, where any is another than at the last look. None before [`PERIOD`] is over, and where
    /// nothing was written.
    pub fn look(&mut self) -> Option<ShaderTexts> {
        if self.looked.is_some_and(|last| last.elapsed() < PERIOD) {
            return None;
        }
        self.looked = Some(Instant::now());
        let files = shader_files(&self.folder).into_iter().filter_map(|(path, module)| {
            let about = path.metadata().ok()?;
            Some((path, (about.modified().ok(), about.len(), module)))
        });
        let mut found: BTreeMap<_, _> = files.collect();
        // Without any the tree is not there, or is about to become another.
        if found == self.viewport || found.is_empty() {
            return None;
        }
        let mut texts = ShaderTexts::new();
        // A file that cannot be read, since it is just being written, is another at the next look.
        found.retain(|path, (_, _, module)| match fs::read_to_string(path) {
            Ok(text) => {
                texts.insert(module.clone(), text);
                true
            }
            Err(_) => false,
        });
        self.viewport = found;
        Some(texts)
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
