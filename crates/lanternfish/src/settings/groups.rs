//! The groups of [`Settings`], each setting declared once: its help, type, default, flag and values.

use lanternfish_scene::shading::{Falloff, NEAR_RADIUS};
use serde::{Deserialize, Serialize};

use super::{
    Anisotropy, Antialiasing, Attenuation, Background, Caustics, Coefficients, Culling, DebugView, Direct, Exposure,
    History, Indirect, Materials, Occlusion, RayCulling, RayRangeCulling, Samples, Settings, Shadows, Structure,
    TextureBinding, ToneMap,
};
use crate::technique::{Parameter, Range};

/// Declares groups of settings: their structs with default values, and in [`Settings`] a row of
/// [`Settings::PARAMETERS`] and a function that returns the settings with another value, for each. A setting's comment
/// is its help: a sentence, then paragraphs for long help.
///
/// `field: Type = default, setter(values), "flag" "VALUE" range, marks;`. Under `Settings` are fields outside the
/// groups, under `choices` setters alone.
macro_rules! settings {
    (
        Settings { $(
            $(#[doc = $own_help:literal])*
            $own:ident, $own_setter:ident($OwnGiven:ty), $own_flag:literal $own_value:literal $own_range:expr;
        )+ }
        choices { $($choice:ident, $choice_setter:ident($Choice:ty);)+ }
        $($(#[doc = $about:literal])* $group:ident: $Group:ident { $(
            $(#[doc = $help:literal])* $(#[serde($($serde:tt)*)])?
            $field:ident: $Type:ty = $default:expr, $setter:ident($Given:ty),
                $flag:literal $value:literal $range:expr $(, $mark:ident)*;
        )+ })+
    ) => {
        $(
            $(#[doc = $about])*
            #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
            #[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
            #[non_exhaustive]
            pub struct $Group { $(
                $(#[doc = $help])* $(#[serde($($serde)*)])?
                pub $field: $Type,
            )+ }

            impl Default for $Group {
                fn default() -> Self {
                    Self { $($field: $default),+ }
                }
            }
        )+

        impl Settings {
            /// The settings that belong to no technique, in the order of the panels. Their names are those of the
            /// command line's flags and of a shot's keys.
            pub const PARAMETERS: &[Parameter<Self>] = &[
                $($(
                    Parameter::new($flag, $value, $range, concat!($($help, "\n"),*), |s: &mut Self| &mut s.$group.$field)
                        $(.$mark())*,
                )+)+
                $(Parameter::new(
                    $own_flag, $own_value, $own_range, concat!($($own_help, "\n"),*), |s: &mut Self| &mut s.$own
                ),)+
            ];

            $($(
                #[doc = concat!("The settings with another `", stringify!($group), ".", stringify!($field), "`.")]
                #[must_use]
                pub fn $setter(mut self, value: $Given) -> Self {
                    self.$group.$field = value.into();
                    self
                }
            )+)+
            settings!(@setters $($own, $own_setter($OwnGiven);)+ $($choice, $choice_setter($Choice);)+);
        }
    };
    (@setters $($field:ident, $setter:ident($Given:ty);)+) => { $(
        #[doc = concat!("The settings with another `", stringify!($field), "`.")]
        #[must_use]
        pub fn $setter(mut self, value: $Given) -> Self {
            self.$field = value.into();
            self
        }
    )+ };
}

settings! {
    Settings {
        /// Temporal accumulation of indirect light and area-light shadows.
        ///
        /// On: less noise while the camera moves, and changes of light show with a delay. The first image, and its
        /// mean, are the same with either. Without it: off, but on in a window and with `quality realtime`.
        history, with_history(History), "history" "ON|OFF" Range::Names;
    }

    choices {
        direct, with_direct(impl Into<Direct>);
        culling, with_culling(impl Into<Culling>);
        indirect, with_indirect(impl Into<Indirect>);
        caustics, with_caustics(impl Into<Caustics>);
        occlusion, with_occlusion(impl Into<Occlusion>);
        structure, with_structure(impl Into<Structure>);
    }

    /// From radiance to an image.
    image: ImageSettings {
        /// Exposure in stops: 1 doubles, -1 halves; auto: metered.
        ///
        /// 0 leaves the image as it is. auto meters the image to show most of it, and prints the value; of a sequence,
        /// it meters the first frame and applies the value to all. PNG only.
        #[serde(with = "crate::technique::data::text")]
        exposure: Exposure = Exposure::Auto, with_exposure(Exposure),
            "exposure" "auto|EV" Range::Text, with_default, everyday;
        /// Tone map, from radiance to display.
        ///
        /// PNG only.
        tone_map: ToneMap = ToneMap::Neutral, with_tone_map(ToneMap),
            "tone-map" "NAME" Range::Names, with_default, everyday;
        /// Behind the surfaces: transparent, white, black, #RRGGBB, environment.
        ///
        /// It lights nothing and is not metered. transparent: the image has alpha, straight in .png, premultiplied in
        /// .exr: the share of opaque surfaces, the alpha of blended ones, what glass does not let through. A colour is
        /// for .png; an .exr file has alpha then. Without it: environment.
        #[serde(with = "crate::technique::data::text")]
        background: Background = Background::Environment, with_background(Background),
            "background" "COLOR" Range::Text, everyday, without_panel;
        /// Shows a quantity of the frame instead of the image, with its colour scale below. PNG only.
        debug_view: Option<DebugView> = None, with_debug_view(impl Into<Option<DebugView>>),
            "debug-view" "NAME" Range::Names;
        /// Antialiasing over the frames of a moving view.
        ///
        /// The first image is the same with either; later ones depend on those before. Without it: none, but temporal
        /// with `quality realtime`.
        antialiasing: Antialiasing = Antialiasing::None, with_antialiasing(Antialiasing),
            "antialiasing" "NAME" Range::Names;
        /// Samples per pixel at edges.
        ///
        /// Multisampling of triangle edges. More: smoother edges. Every adapter supports 4. Without it: 4, where they
        /// cost a small part of the frame; 1 with `quality draft`, `indirect none`, debug views, and images of
        /// `accumulate 8` or more, whose edges are smooth without.
        samples: Samples = Samples::Four, with_samples(Samples),
            "samples" "N" Range::Names, everyday;
        /// Averages N frames: smooth edges, less noise.
        ///
        /// Each frame jitters the sample position in the pixel. N times as slow.
        accumulate: u32 = 1, with_accumulate(u32),
            "accumulate" "N" Range::Count(1, u32::MAX), with_default, everyday, without_panel;
    }

    /// Material model and textures.
    materials: MaterialSettings {
        /// Material model.
        model: Materials = Materials::File, with_materials(Materials),
            "materials" "NAME" Range::Names, with_default;
        /// Binding of textures to shaders. The image is the same.
        textures: TextureBinding = TextureBinding::Auto, with_textures(TextureBinding),
            "textures" "NAME" Range::Names, with_default, without_panel;
        /// Anisotropic texture filtering: most samples along the long axis of a pixel's footprint. More: sharper at
        /// grazing angles, slower.
        anisotropy: Anisotropy = Anisotropy::Auto, with_anisotropy(Anisotropy),
            "anisotropy" "N" Range::Names, with_default;
    }

    /// Shadows of all lights.
    shadows: ShadowSettings {
        /// Technique of shadows.
        ///
        /// The images of the techniques differ in a few pixels at silhouettes; with deep images, within one texel of
        /// them.
        technique: Shadows = Shadows::Auto, with_shadows(Shadows),
            "shadows" "NAME" Range::Names, with_default;
        /// Shadow rays per pixel to each light with a `light-radius` or `sun-diameter`, a `disk` or a `rectangle`.
        /// More: less noise, slower.
        ///
        /// At most 32 to a disk or rectangle; `accumulate` adds to them.
        rays: u32 = 16, with_shadow_rays(u32),
            "shadow-rays" "N" Range::Count(1, 255), with_default;
        /// Shadow rays to skip where the surface faces away from the light.
        ray_culling: RayCulling = RayCulling::Surface, with_ray_culling(RayCulling),
            "ray-culling" "NAME" Range::Names, with_default;
        /// Shadow rays only from within a light's range, tested for each pixel. The image is the same.
        ray_range_culling: RayRangeCulling = RayRangeCulling::On, with_ray_range_culling(RayRangeCulling),
            "ray-range-culling" "ON|OFF" Range::Names, with_default;
    }

    /// Falloff, range and size of lights.
    lights: LightSettings {
        /// Distance attenuation of lights. R is the light's range.
        attenuation: Attenuation = Attenuation::Gltf, with_attenuation(Attenuation),
            "attenuation" "NAME" Range::Names, with_default;
        /// Near radius of the attenuation, m: nearer than this, a light is as bright as at this distance.
        ///
        /// Larger: no bright spots around lights.
        near_radius: f32 = NEAR_RADIUS, with_attenuation_near_radius(f32),
            "attenuation-near-radius" "METRES" Range::Positive, with_default;
        /// Coefficients of `attenuation clq`, intensity / (c0 + c1 d + c2 d²). Larger: less light.
        #[serde(with = "crate::technique::data::text")]
        coefficients: Coefficients = Coefficients::default(), with_attenuation_coefficients(Coefficients),
            "attenuation-coefficients" "C0,C1,C2" Range::Text, with_default;
        /// Intensity that defines the range of a light without a stated one. Lower: larger ranges, less light lost,
        /// more work.
        range_threshold: f32 = 0.02, with_range_threshold(f32),
            "range-threshold" "X" Range::Positive, with_default;
        /// Radius of point and spot lights, m: soft shadows.
        ///
        /// 0: point lights.
        radius: f32 = 0.0, with_light_radius(f32),
            "light-radius" "METRES" Range::Number(0.0, f32::INFINITY), with_default, everyday, without_panel;
        /// Angular diameter of directional lights, degrees: soft shadows; the sun's is 0.53.
        ///
        /// 0: hard shadows.
        sun_diameter: f32 = 0.0, with_sun_diameter(f32),
            "sun-diameter" "DEGREES" Range::Number(0.0, 90.0), with_default, without_panel;
    }
}

impl LightSettings {
    /// The attenuation with its parameters.
    pub fn falloff(&self) -> Falloff {
        Falloff { attenuation: self.attenuation, near_radius: self.near_radius, coefficients: self.coefficients }
    }
}
