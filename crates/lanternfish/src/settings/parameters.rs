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

impl Settings {
    /// The settings that belong to no technique, in the order of the panels. Their names are those of the command line's flags and of a
    /// shot's keys.
    pub const PARAMETERS: &[Parameter<Self>] = &[
        Parameter::new(
            "exposure",
            "auto|EV",
            Range::Text,
            "Exposure in stops: 1 doubles, -1 halves; auto: metered.\n\n\
             0 leaves the image as it is. auto meters the image to show most of it, and prints the value; of a sequence, it meters \
             the first frame and applies the value to all. PNG only.",
            |s: &mut Self| &mut s.image.exposure,
        )
        .with_default()
        .everyday(),
        Parameter::new(
            "tone-map",
            "NAME",
            Range::Names,
            "Tone map, from radiance to display.\n\nPNG only.",
            |s: &mut Self| &mut s.image.tone_map,
        )
        .with_default()
        .everyday(),
        Parameter::new(
            "background",
            "COLOR",
            Range::Text,
            "Behind the surfaces: transparent, white, black, #RRGGBB, environment.\n\n\
             It lights nothing and is not metered. transparent: the image has alpha, straight in .png, premultiplied in .exr: \
             the share of opaque surfaces, the alpha of blended ones, what glass does not let through. A colour is for .png; an \
             .exr file has alpha then. Without it: environment.",
            |s: &mut Self| &mut s.image.background,
        )
        .everyday()
        .without_panel(),
        Parameter::new("materials", "NAME", Range::Names, "Material model.", |s: &mut Self| &mut s.materials.model)
            .with_default(),
        Parameter::new(
            "samples",
            "N",
            Range::Names,
            "Samples per pixel at edges.\n\n\
             Multisampling of triangle edges. More: smoother edges. Every adapter supports 4. Without it: 4, \
             where they cost a small part of the frame; 1 with `quality draft`, `indirect none`, debug views, and \
             images of `accumulate 8` or more, whose edges are smooth without.",
            |s: &mut Self| &mut s.image.samples,
        )
        .everyday(),
        Parameter::new(
            "accumulate",
            "N",
            Range::Count(1, u32::MAX),
            "Averages N frames: smooth edges, less noise.\n\n\
             Each frame jitters the sample position in the pixel. N times as slow.",
            |s: &mut Self| &mut s.image.accumulate,
        )
        .with_default()
        .everyday()
        .without_panel(),
        Parameter::new(
            "shadows",
            "NAME",
            Range::Names,
            "Technique of shadows.\n\n\
             The images of the techniques differ in a few pixels at silhouettes; with deep images, within one \
             texel of them.",
            |s: &mut Self| &mut s.shadows.technique,
        )
        .with_default(),
        Parameter::new(
            "shadow-rays",
            "N",
            Range::Count(1, 255),
            "Shadow rays per pixel to each light with a `light-radius` or `sun-diameter`, a `disk` or a `rectangle`. \
             More: less noise, slower.\n\n\
             At most 32 to a disk or rectangle; `accumulate` adds to them.",
            |s: &mut Self| &mut s.shadows.rays,
        )
        .with_default(),
        Parameter::new(
            "history",
            "ON|OFF",
            Range::Names,
            "Temporal accumulation of indirect light and area-light shadows.\n\n\
             On: less noise while the camera moves, and changes of light show with a delay. The first image, and \
             its mean, are the same with either. Without it: off, but on in a window and with `quality realtime`.",
            |s: &mut Self| &mut s.history,
        ),
        Parameter::new(
            "antialiasing",
            "NAME",
            Range::Names,
            "Antialiasing over the frames of a moving view.\n\n\
             The first image is the same with either; later ones depend on those before. Without it: none, but \
             temporal with `quality realtime`.",
            |s: &mut Self| &mut s.image.antialiasing,
        ),
        Parameter::new(
            "ray-culling",
            "NAME",
            Range::Names,
            "Shadow rays to skip where the surface faces away from the light.",
            |s: &mut Self| &mut s.shadows.ray_culling,
        )
        .with_default(),
        Parameter::new(
            "ray-range-culling",
            "ON|OFF",
            Range::Names,
            "Shadow rays only from within a light's range, tested for each pixel. The image is the same.",
            |s: &mut Self| &mut s.shadows.ray_range_culling,
        )
        .with_default(),
        Parameter::new(
            "attenuation",
            "NAME",
            Range::Names,
            "Distance attenuation of lights. R is the light's range.",
            |s: &mut Self| &mut s.lights.attenuation,
        )
        .with_default(),
        Parameter::new(
            "attenuation-near-radius",
            "METRES",
            Range::Positive,
            "Near radius of the attenuation, m: nearer than this, a light is as bright as at this distance.\n\n\
             Larger: no bright spots around lights.",
            |s: &mut Self| &mut s.lights.near_radius,
        )
        .with_default(),
        Parameter::new(
            "attenuation-coefficients",
            "C0,C1,C2",
            Range::Text,
            "Coefficients of `attenuation clq`, intensity / (c0 + c1 d + c2 d²). Larger: less light.",
            |s: &mut Self| &mut s.lights.coefficients,
        )
        .with_default(),
        Parameter::new(
            "range-threshold",
            "X",
            Range::Positive,
            "Intensity that defines the range of a light without a stated one. Lower: larger ranges, less light \
             lost, more work.",
            |s: &mut Self| &mut s.lights.range_threshold,
        )
        .with_default(),
        Parameter::new(
            "light-radius",
            "METRES",
            Range::Number(0.0, f32::INFINITY),
            "Radius of point and spot lights, m: soft shadows.\n\n0: point lights.",
            |s: &mut Self| &mut s.lights.radius,
        )
        .with_default()
        .everyday()
        .without_panel(),
        Parameter::new(
            "sun-diameter",
            "DEGREES",
            Range::Number(0.0, 90.0),
            "Angular diameter of directional lights, degrees: soft shadows; the sun's is 0.53.\n\n0: hard shadows.",
            |s: &mut Self| &mut s.lights.sun_diameter,
        )
        .with_default()
        .without_panel(),
        Parameter::new(
            "textures",
            "NAME",
            Range::Names,
            "Binding of textures to shaders. The image is the same.",
            |s: &mut Self| &mut s.materials.textures,
        )
        .with_default()
        .without_panel(),
        Parameter::new(
            "anisotropy",
            "N",
            Range::Names,
            "Anisotropic texture filtering: most samples along the long axis of a pixel's footprint. More: \
             sharper at grazing angles, slower.",
            |s: &mut Self| &mut s.materials.anisotropy,
        )
        .with_default(),
        Parameter::new(
            "debug-view",
            "NAME",
            Range::Names,
            "Shows a quantity of the frame instead of the image, with its colour scale below. PNG only.",
            |s: &mut Self| &mut s.image.debug_view,
        ),
    ];
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
