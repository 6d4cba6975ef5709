//! The parts of materials that are rendered. Their lobes select the shaders that draw them.

/// The parts of a material that are rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shading {
    /// All of it.
    File,
    /// Base colour as a two-sided diffuse albedo, alpha mask, emission.
    Lambert,
    /// Base colour as radiance: a debug view.
    BaseColor,
}

/// The settings with which materials are packed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialStorage {
    /// The parts of materials that are packed.
    pub shading: Shading,
    /// [`crate::GpuScene::light_unit`], nits.
    pub light_unit: f32,
}

/// The lobes of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Lobes {
    /// Those of the metallic-roughness model.
    MetallicRoughness,
    /// More, but no clear coat ([`lanternfish_scene::Material::is_layered`]).
    Layered,
    /// A clear coat, and maybe more.
    Coated,
}

impl Lobes {
    pub(in crate::gpu_scene) fn of(material: &lanternfish_scene::Material, shading: Shading) -> Self {
        match shading {
            Shading::File if material.is_coated() => Self::Coated,
            Shading::File if material.is_layered() => Self::Layered,
            _ => Self::MetallicRoughness,
        }
    }

    /// True if draws use the `layered` variants of shaders.
    pub fn are_layered(self) -> bool {
        self != Self::MetallicRoughness
    }
}
