//! The named options of virtual lights.

use lanternfish_scene::named_enum;

named_enum! {
    /// Texels along an edge of the reflective shadow map.
    MapSize {
        /// 64 × 64.
        Texels64 = "64": "4,096 texels",
        /// 128 × 128.
        Texels128 = "128": "16,384 texels",
        /// 256 × 256, as in [Archer2019, §4].
        Texels256 = "256": "65,536 texels",
        /// 512 × 512.
        Texels512 = "512": "262,144 texels",
        /// 1024 × 1024.
        Texels1024 = "1024": "1,048,576 texels",
        /// 2048 × 2048.
        Texels2048 = "2048": "4,194,304 texels",
    }
}

impl MapSize {
    /// Texels along an edge.
    pub const fn texels(self) -> u32 {
        64 << self as u32
    }
}

named_enum! {
    /// How the reflective shadow map is computed.
    MapSource {
        /// One ray through every texel.
        Rays = "rays": "One ray through every texel, for any number of lights",
        /// The scene is rasterized from each of the strongest lights, through the middle of each texel in every frame; the views of the
        /// others are traced.
        Raster = "raster": "Rasterization from each of the strongest lights; the views of the others are traced",
    }
}

named_enum! {
    /// The source of a virtual light's range.
    Ranges {
        /// The average distance of six rays [Archer2019, §3.2].
        Average = "average": "The average hit distance of six rays",
        /// Their maximum distance.
        Maximum = "maximum": "The maximum hit distance of six rays",
        /// A random number, as in stochastic methods, with which [Archer2019, §4] compares.
        Random = "random": "A random number",
        /// The distance at which the light falls to the cut-off intensity [VanGelderen2020, app. A]: `range-threshold` over the number of
        /// virtual lights, so that all of them together lose no more than one light may.
        Threshold = "threshold": "The distance at which a light falls to `range-threshold` over the number of virtual lights",
        /// The same with `range-threshold` itself, for each light alone, as in the text: R1 = √(I / I0). The lights together lose more than
        /// one may, and far contributions are lost [VanGelderen2020, §2.5.2].
        ThresholdEach = "threshold-each": "The distance at which each light alone falls to `range-threshold`",
        /// Unlimited: every light reaches every surface.
        Unlimited = "unlimited": "Unlimited: every light reaches every surface",
    }
}

named_enum! {
    /// The axis of the rays that measure a range.
    RangeAxis {
        /// The surface's normal.
        Normal = "normal": "The surface's normal",
        /// The mirror direction of the light that arrives at the surface.
        Reflection = "reflection": "The mirror direction of the light that arrives at the surface",
    }
}

named_enum! {
    /// Angular emission of a virtual light.
    Emission {
        /// By the cosine, as a diffuse surface.
        Cosine = "cosine": "By the cosine, as a diffuse surface",
        /// By the square root of the cosine [VanGelderen2020, app. B], with the same flux.
        Root = "root": "By the square root of the cosine, with the same flux",
    }
}

named_enum! {
    /// Treatment of the flux that ranges cut off.
    Residual {
        /// It is lost.
        Lost = "lost": "It is lost",
        /// Each light is scaled by its loss.
        Scaled = "scaled": "Each light is scaled by its loss: correct in total, too bright nearby",
        /// A few lights carry it over the complete scene.
        FarLights = "far-lights": "A few lights, selected by their loss, carry it over the complete scene",
    }
}

#[cfg(test)]
#[test]
fn choices_are_the_shaders_constants() {
    let constant =
        |file: &str, name| crate::shaders::SHADERS.constant(&format!("indirect/virtual_lights/{file}"), name) as u32;
    assert_eq!(constant("rays", "NORMAL_AXIS"), RangeAxis::Normal as u32);
    assert_eq!(constant("rays", "REFLECTION_AXIS"), RangeAxis::Reflection as u32);
    assert_eq!(["LOST", "SCALED", "FAR_LIGHTS"].map(|name| constant("scatter", name)), [0, 1, 2]);
    assert_eq!([Residual::Lost, Residual::Scaled, Residual::FarLights].map(|r| r as u32), [0, 1, 2]);
    assert_eq!(constant("scatter", "ROOT_OF_COSINE"), Emission::Root as u32);
    let texels = MapSize::ALL.iter().map(|size| size.texels().to_string());
    assert!(texels.eq(MapSize::ALL.iter().map(|size| size.to_string())));
}
