//! What an image shows where it shows no surface.

use std::fmt;

use lanternfish_scene::Setting;

/// What an image shows where no surface covers it. It lights nothing, and automatic exposure does not meter it; the environment lights surfaces
/// and is mirrored as before.
///
/// With any value but [`Environment`](Self::Environment), alpha is opacity: 1 at opaque surfaces, the alpha of blended ones, and what glass does not
/// let through, of light from where the image shows no surface. Radiance has the background black and is premultiplied by opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Background {
    /// The environment or the sky; display images are opaque.
    #[default]
    Environment,
    /// Nothing: display images have straight alpha. Light that is too bright for its opacity, as a highlight on clear glass, raises it.
    Transparent,
    /// This colour, sRGB-encoded, exactly. Display images are opaque.
    Color([u8; 3]),
}

impl Background {
    /// True if the environment is not shown.
    pub(crate) fn hides_environment(self) -> bool {
        self != Self::Environment
    }
}

impl fmt::Display for Background {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Environment => f.write_str("environment"),
            Self::Transparent => f.write_str("transparent"),
            Self::Color([r, g, b]) => write!(f, "#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

impl Setting for Background {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        let hexadecimal = |digits: &str| match u32::from_str_radix(digits, 16) {
            Ok(number) if digits.len() == 6 && !digits.starts_with('+') => {
                Some(Self::Color([number >> 16, number >> 8, number].map(|v| v as u8)))
            }
            _ => None,
        };
        let found = match text.trim() {
            "environment" => Some(Self::Environment),
            "transparent" => Some(Self::Transparent),
            "white" => Some(Self::Color([255; 3])),
            "black" => Some(Self::Color([0; 3])),
            color => color.strip_prefix('#').and_then(hexadecimal),
        };
        *self = found.ok_or("expected environment, transparent, white, black, or a colour such as #ff8000")?;
        Ok(())
    }
}

#[cfg(test)]
#[test]
fn backgrounds_are_named_or_hexadecimal() {
    let read = |text: &str| {
        let mut value = Background::default();
        value.read(text).map(|()| value)
    };
    assert_eq!(read("white"), Ok(Background::Color([255; 3])));
    assert_eq!(read("#Ff8000"), Ok(Background::Color([255, 128, 0])));
    for value in [Background::Environment, Background::Transparent, Background::Color([1, 2, 255])] {
        assert_eq!(read(&value.to_string()), Ok(value));
    }
    for wrong in ["", "#fff", "#12345", "#+12345", "1,1,1", "red "] {
        assert!(read(wrong).unwrap_err().contains("#ff8000"), "{wrong}");
    }
}
