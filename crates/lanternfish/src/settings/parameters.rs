//! What settings say of themselves that belong to no room: for panels and lists of all that can be chosen.

use lanternfish_scene::Setting;

use super::{Exposure, Settings};
use crate::technique::{Parameter, Range};

impl Setting for Exposure {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = match text.trim() {
            "auto" => Self::Auto,
            number => match number.parse() {
                Ok(ev) if f32::is_finite(ev) => Self::Ev(ev),
                _ => return Err("expected auto or a number of stops".to_owned()),
            },
        };
        Ok(())
    }
}

impl Settings {
    /// The settings that belong to no room, in the order in which panels show them. Their names are those of the command line's flags.
    pub const PARAMETERS: &[Parameter<Self>] = &[
        Parameter::new("exposure", "auto|EV", Range::Text, "Stops: 1 doubles, -1 halves; auto: as much as shows most of the image.", |s: &mut Self| &mut s.exposure)
        .with_default(),
        Parameter::new("tone-map", "NAME", Range::Names, "From radiance to what a display shows.", |s: &mut Self| &mut s.tone_map).with_default(),
        Parameter::new("materials", "NAME", Range::Names, "Material model.", |s: &mut Self| &mut s.materials).with_default(),
        Parameter::new("samples", "N", Range::Names, "Samples per pixel at triangle edges (MSAA) of triangles. More: smoother edges, slower.", |s: &mut Self| &mut s.samples)
        .with_default(),
        Parameter::new("shadows", "NAME", Range::Names, "Shadow technique.", |s: &mut Self| &mut s.shadows).with_default(),
        Parameter::new("shadow-rays", "N", Range::Count(1, 255), "Rays to each light that has a size. More: less noise, slower.", |s: &mut Self| &mut s.shadow_rays)
        .with_default(),
        Parameter::new(
            "history",
            "ON|OFF",
            Range::Names,
            "Temporal accumulation of indirect light and soft shadows. On: less noise while the view moves; changes of light lag.",
            |s: &mut Self| &mut s.history,
        )
        .with_default(),
        Parameter::new("ray-culling", "NAME", Range::Names, "Which shadow rays are not traced because the surface faces away.", |s: &mut Self| &mut s.ray_culling)
        .with_default(),
        Parameter::new("attenuation", "NAME", Range::Names, "How light falls off with distance.", |s: &mut Self| &mut s.attenuation).with_default(),
        Parameter::new(
            "range-threshold",
            "CD/M2",
            Range::Positive,
            "Intensity at which a light without a stated range ends. Lower: larger ranges, less light lost, more lights a pixel.",
            |s: &mut Self| &mut s.range_threshold,
        )
        .with_default(),
        Parameter::new("anisotropy", "N", Range::Names, "Samples along the long side of a pixel's footprint in a texture, at most.", |s: &mut Self| &mut s.anisotropy)
        .with_default(),
        Parameter::new("debug-view", "NAME", Range::Names, "Shows a quantity of the frame instead of the image.", |s: &mut Self| &mut s.debug_view),
    ];

    /// [`crate::technique::AnyTechnique::get`], of [`Self::PARAMETERS`].
    pub fn get(&self, parameter: &str) -> Option<String> {
        let found = Self::PARAMETERS.iter().find(|known| known.info.name == parameter)?;
        (found.of)(&mut self.clone()).text()
    }

    /// Sets one of [`Self::PARAMETERS`] from text, or says what was expected. There must be one of this name.
    pub fn set(&mut self, parameter: &str, text: &str) -> Result<(), String> {
        let found = Self::PARAMETERS.iter().find(|known| known.info.name == parameter);
        (found.ok_or_else(|| format!("there is no setting {parameter}"))?.of)(self).read(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said can be read again, and every named value reaches the settings.
    #[test]
    fn every_setting_is_said_and_read() {
        for parameter in Settings::PARAMETERS {
            let (name, usual) = (parameter.info.name, Settings::default());
            let mut settings = usual.clone();
            if let Some(text) = usual.get(name) {
                settings.set(name, &text).unwrap();
            }
            assert!(settings == usual, "{name}");
            for (value, _) in (parameter.of)(&mut settings.clone()).names() {
                settings.set(name, value).unwrap();
                assert_eq!(settings.get(name).as_deref().unwrap_or("none"), value, "{name}");
            }
            let mistaken = settings.set(name, "no such thing").unwrap_err();
            assert!(mistaken.starts_with("expected"), "{name}: {mistaken}");
        }
        assert!(Settings::default().set("colour", "1").is_err());
    }
}
