//! `KHR_materials_variants`.

use serde::Deserialize;

#[derive(Default, Deserialize)]
#[serde(default)]
pub(in super::super) struct Variants {
    pub variants: Vec<Variant>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(in super::super) struct Variant {
    pub name: String,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(in super::super) struct VariantMappings {
    pub mappings: Vec<VariantMapping>,
}

/// The material that a primitive has in some of the variants.
#[derive(Deserialize)]
pub(in super::super) struct VariantMapping {
    pub material: usize,
    #[serde(default)]
    pub variants: Vec<usize>,
}
