//! The named choices of virtual lights.

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
    /// How the reflective shadow map is made.
    MapSource {
        /// A ray through every texel.
        Rays = "rays": "A ray through every texel: any number of lights",
        /// The scene is drawn from each of the strongest lights, through the middle of each texel in every frame; what others see is traced.
        Raster = "raster": "The scene is drawn from each of the strongest lights; what others see is traced",
    }
}

named_enum! {
    /// Where the range of a virtual light comes from.
    Ranges {
        /// The average distance that six rays go [Archer2019, §3.2].
        Average = "average": "The average distance that six rays go",
        /// The greatest of them.
        Maximum = "maximum": "The greatest distance of six rays",
        /// A random number, as in stochastic methods, which [Archer2019, §4] compares with.
        Random = "random": "A random number",
        /// Where the light falls to the cut-off intensity [VanGelderen2020, app. A]: `range-threshold` over the number of virtual lights,
        /// so that all together leave out no more than one light may.
        Threshold = "threshold": "Where a light falls to `range-threshold` over the number of virtual lights",
        /// None: every light reaches everything.
        Unlimited = "unlimited": "None: every light reaches everything",
    }
}

named_enum! {
    /// What the rays that find a range are cast about.
    RangeAxis {
        /// The surface's normal.
        Normal = "normal": "The surface's normal",
        /// The mirror direction of the light that falls on the surface.
        Reflection = "reflection": "The mirror direction of the light that falls on the surface",
    }
}

named_enum! {
    /// Angular emission of a virtual light.
    Emission {
        /// By the cosine, as a diffuse surface does.
        Cosine = "cosine": "By the cosine, as a diffuse surface does",
        /// By the root of the cosine [VanGelderen2020, app. B], with the same flux.
        Root = "root": "By the root of the cosine, with the same flux",
    }
}

named_enum! {
    /// What is done about the flux that ranges cut off.
    Residual {
        /// It is lost.
        Lost = "lost": "It is lost",
        /// Lights are brighter by as much.
        Scaled = "scaled": "Lights are brighter by as much: right in sum, too bright near them",
        /// A few lights carry it over the whole scene.
        FarLights = "far-lights": "A few lights, chosen by how much of theirs is cut off, carry it over the whole scene",
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
    assert!(texels.eq(MapSize::ALL.iter().map(|size| size.name().to_owned())));
}
