//! Exposure of the display image.

use std::fmt;

use lanternfish_scene::Setting;

/// Exposure of the display image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// Metered from the radiance of the image, one value for all views of a frame ([`crate::output`]).
    #[default]
    Auto,
    /// Fixed, in stops: radiance is multiplied by 2^EV before tone mapping.
    Ev(f32),
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Ev(ev) => ev.fmt(f),
        }
    }
}

impl Setting for Exposure {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = match text.trim() {
            "auto" => Self::Auto,
            number => match number.parse() {
                Ok(ev) if f32::abs(ev) <= 64.0 => Self::Ev(ev),
                _ => {
                    let what = "expected auto, or stops from -64 to 64, e.g. -1.5 (0: unchanged, 1: twice as bright)";
                    return Err(what.to_owned());
                }
            },
        };
        Ok(())
    }
}
