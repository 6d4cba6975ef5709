//! State that the next window takes over: size, position, visibility of panels.
//!
//! A small file of lines `name = value`. What cannot be read or written is said in the log, and changes nothing else.

use std::{fs, io, path::Path};

use lanternfish_metrics::write_aside;

/// What is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowState {
    /// Points across and down.
    pub size: Option<[u32; 2]>,
    /// Where its frame's left top corner is on the desktop, pixels.
    pub position: Option<[i32; 2]>,
    /// True if panels were shown.
    pub shows_panels: bool,
}

impl Default for WindowState {
    fn default() -> Self {
        Self { size: None, position: None, shows_panels: true }
    }
}

/// Least points of a side that is taken up again.
const LEAST: u32 = 100;
/// Most.
const MOST: u32 = 16_384;

impl WindowState {
    /// What the last window has left; nothing where there was none.
    pub fn read(path: &Path) -> Self {
        match fs::read_to_string(path) {
            Ok(text) => Self::of(&text),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Self::default(),
            Err(error) => {
                tracing::warn!("{}: {error}", path.display());
                Self::default()
            }
        }
    }

    fn of(text: &str) -> Self {
        let mut kept = Self::default();
        for line in text.lines() {
            let Some((name, value)) = line.split_once('=') else { continue };
            let value = value.trim();
            match name.trim() {
                "size" => {
                    let is_size = |size: &[u32; 2]| size.iter().all(|side| (LEAST..=MOST).contains(side));
                    kept.size = pair(value).filter(is_size);
                }
                "position" => kept.position = pair(value),
                "panels" => kept.shows_panels = value != "false",
                _ => {}
            }
        }
        kept
    }

    /// Leaves it for the next window.
    pub fn write(&self, path: &Path) {
        let mut text = String::new();
        if let Some([width, height]) = self.size {
            text += &format!("size = [{width}, {height}]\n");
        }
        if let Some([x, y]) = self.position {
            text += &format!("position = [{x}, {y}]\n");
        }
        text += &format!("panels = {}\n", self.shows_panels);
        let made = path.parent().map_or(Ok(()), fs::create_dir_all);
        let written = made.and_then(|()| write_aside(path, |file| io::Write::write_all(file, text.as_bytes())));
        if let Err(error) = written {
            tracing::warn!("{}: {error}", path.display());
        }
    }
}

/// Two numbers in brackets.
fn pair<T: std::str::FromStr>(text: &str) -> Option<[T; 2]> {
    let (first, second) = text.strip_prefix('[')?.strip_suffix(']')?.split_once(',')?;
    Some([first.trim().parse().ok()?, second.trim().parse().ok()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_found_again_and_nonsense_is_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lanternfish/window.toml");
        assert_eq!(WindowState::read(&path), WindowState::default());
        let kept = WindowState { size: Some([800, 600]), position: Some([-7, 30]), shows_panels: false };
        kept.write(&path);
        assert_eq!(WindowState::read(&path), kept);
        for nonsense in ["size = [1, 99999999]", "size = 8", "position = [a, b]", "\u{0}", "panels"] {
            assert_eq!(WindowState::of(nonsense), WindowState::default(), "{nonsense}");
        }
        // A folder in a file's place: it is said in the log.
        kept.write(folder.path());
        assert_eq!(WindowState::read(folder.path()), WindowState::default());
    }
}
