//! Names, ranges and help of the settings that belong to no technique, for panels and for lists of all settings.

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
    /// The settings that belong to no technique, in the order of the panels. Their names are those of the command line's flags.
    pub const PARAMETERS: &[Parameter<Self>] = &[
        Parameter::new("exposure", "auto|EV", Range::Text, "Exposure, EV: 1 doubles, -1 halves; auto: from the image's radiance.", |s: &mut Self| &mut s.image.exposure)
        .with_default(),
        Parameter::new("tone-map", "NAME", Range::Names, "From radiance to what a display shows.", |s: &mut Self| &mut s.image.tone_map).with_default(),
        Parameter::new("materials", "NAME", Range::Names, "Material model.", |s: &mut Self| &mut s.materials.model).with_default(),
        Parameter::new("samples", "N", Range::Names, "Samples per pixel at triangle edges (MSAA) of triangles. More: smoother edges, slower.", |s: &mut Self| &mut s.image.samples)
        .with_default(),
        Parameter::new("shadows", "NAME", Range::Names, "Shadow technique.", |s: &mut Self| &mut s.shadows.technique).with_default(),
        Parameter::new("shadow-rays", "N", Range::Count(1, 255), "Rays to each light that has a size. More: less noise, slower.", |s: &mut Self| &mut s.shadows.rays)
        .with_default(),
        Parameter::new(
            "history",
            "ON|OFF",
            Range::Names,
            "Temporal accumulation of indirect light and soft shadows. On: less noise while the view moves; changes of light lag.",
            |s: &mut Self| &mut s.history,
        )
        .with_default(),
        Parameter::new(
            "antialiasing",
            "NAME",
            Range::Names,
            "Antialiasing over frames. Temporal: smooth edges while the view moves, a little blur.",
            |s: &mut Self| &mut s.image.antialiasing,
        )
        .with_default(),
        Parameter::new("ray-culling", "NAME", Range::Names, "Which shadow rays are skipped because the surface faces away.", |s: &mut Self| &mut s.shadows.ray_culling)
        .with_default(),
        Parameter::new("ray-range-culling", "ON|OFF", Range::Names, "Whether shadow rays from beyond a light's range are skipped.", |s: &mut Self| {
            &mut s.shadows.ray_range_culling
        })
        .with_default(),
        Parameter::new("attenuation", "NAME", Range::Names, "How light falls off with distance.", |s: &mut Self| &mut s.lights.attenuation).with_default(),
        Parameter::new(
            "attenuation-near-radius",
            "METRES",
            Range::Positive,
            "Nearer than this, a light is as bright as at this distance. Larger: no bright spots around lights.",
            |s: &mut Self| &mut s.lights.near_radius,
        )
        .with_default(),
        Parameter::new(
            "attenuation-coefficients",
            "C0,C1,C2",
            Range::Text,
            "Coefficients of `attenuation clq`. Larger: less light.",
            |s: &mut Self| &mut s.lights.coefficients,
        )
        .with_default(),
        Parameter::new(
            "range-threshold",
            "CD/M2",
            Range::Positive,
            "Intensity at which a light without a stated range ends. Lower: larger ranges, less light lost, more lights per pixel.",
            |s: &mut Self| &mut s.lights.range_threshold,
        )
        .with_default(),
        Parameter::new("anisotropy", "N", Range::Names, "Maximum samples along the long axis of a pixel's texture footprint.", |s: &mut Self| &mut s.materials.anisotropy)
        .with_default(),
        Parameter::new("debug-view", "NAME", Range::Names, "Shows a quantity of the frame instead of the image.", |s: &mut Self| &mut s.image.debug_view),
    ];

    /// [`crate::technique::AnyTechnique::get`], for [`Self::PARAMETERS`].
    pub fn get(&self, parameter: &str) -> Option<String> {
        let entry = Self::PARAMETERS.iter().find(|entry| entry.info.name == parameter)?;
        (entry.of)(&mut self.clone()).text()
    }

    /// Sets one of [`Self::PARAMETERS`] from text, or returns the expected values. A parameter of this name must exist.
    pub fn set(&mut self, parameter: &str, text: &str) -> Result<(), String> {
        let entry = Self::PARAMETERS.iter().find(|entry| entry.info.name == parameter);
        entry.ok_or_else(|| format!("there is no setting {parameter}"))?.read(self, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every setting can be read back from its text, and every named value is accepted.
    #[test]
    fn every_setting_is_written_and_parsed() {
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
