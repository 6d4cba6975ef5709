//! Window state that persists between windows: size, position, visibility of panels.
//!
//! It is a small file of lines `name = value`. Errors of reading and writing are logged and otherwise ignored.

use std::{fs, io, path::Path};

use lanternfish_metrics::write_aside;

/// The persistent state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowState {
    /// Width and height, points.
    pub size: Option<[u32; 2]>,
    /// Position of the window frame's top left corner on the desktop, pixels.
    pub position: Option<[i32; 2]>,
    /// True if panels were shown.
    pub shows_panels: bool,
}

impl Default for WindowState {
    fn default() -> Self {
        Self { size: None, position: None, shows_panels: true }
    }
}

/// Smallest valid side, points.
const MIN_SIDE: u32 = 100;
/// Largest valid side, points.
const MAX_SIDE: u32 = 16_384;

impl WindowState {
    /// Reads the state of the last window; the default if there is none.
    pub fn read(path: &Path) -> Self {
        match lanternfish_scene::read_text(path) {
            Ok(text) => Self::of(&text),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Self::default(),
            Err(error) => {
                tracing::warn!("{}: {error}", path.display());
                Self::default()
            }
        }
    }

    fn of(text: &str) -> Self {
        let mut state = Self::default();
        for line in text.lines() {
            let Some((name, value)) = line.split_once('=') else { continue };
            let value = value.trim();
            match name.trim() {
                "size" => {
                    let is_size = |size: &[u32; 2]| size.iter().all(|side| (MIN_SIDE..=MAX_SIDE).contains(side));
                    state.size = pair(value).filter(is_size);
                }
                "position" => state.position = pair(value),
                "panels" => state.shows_panels = value != "false",
                _ => {}
            }
        }
        state
    }

    /// Writes the state for the next window.
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

/// Parses two numbers in brackets.
fn pair<T: std::str::FromStr>(text: &str) -> Option<[T; 2]> {
    let (first, second) = text.strip_prefix('[')?.strip_suffix(']')?.split_once(',')?;
    Some([first.trim().parse().ok()?, second.trim().parse().ok()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_state_is_read_back_and_invalid_values_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lanternfish/window.toml");
        assert_eq!(WindowState::read(&path), WindowState::default());
        let state = WindowState { size: Some([800, 600]), position: Some([-7, 30]), shows_panels: false };
        state.write(&path);
        assert_eq!(WindowState::read(&path), state);
        for nonsense in ["size = [1, 99999999]", "size = 8", "position = [a, b]", "\u{0}", "panels"] {
            assert_eq!(WindowState::of(nonsense), WindowState::default(), "{nonsense}");
        }
        // A folder in place of the file is logged.
        state.write(folder.path());
        assert_eq!(WindowState::read(folder.path()), WindowState::default());
    }
}
