//! `KHR_materials_variants`: selection of one of a file's variants, and the materials that it gives primitives.

use super::fault::{Fault, Result};
use super::schema::{Primitive, Root};

/// The index of the variant with the name `requested`, else with that index; `None` for the file's default materials.
pub(super) fn select(root: &Root, requested: Option<&str>) -> Result<Option<usize>> {
    let Some(requested) = requested else { return Ok(None) };
    let variants = &root.extensions.variants.variants;
    let named = variants.iter().position(|variant| !requested.is_empty() && variant.name == requested);
    let numbered = || requested.parse().ok().filter(|index| *index < variants.len());
    match named.or_else(numbered) {
        Some(variant) => Ok(Some(variant)),
        None => Err(Fault::NoSuchVariant { variant: requested.to_owned(), known: list(root) }),
    }
}

/// The material of a primitive in a variant. A variant without a material for it leaves the default one.
pub(super) fn material(primitive: &Primitive, variant: Option<usize>) -> Option<usize> {
    let mappings = &primitive.extensions.variants.mappings;
    let mapping = mappings.iter().find(|mapping| variant.is_some_and(|variant| mapping.variants.contains(&variant)));
    mapping.map(|mapping| mapping.material).or(primitive.material)
}

/// The file's variants for messages: indices and names.
fn list(root: &Root) -> String {
    let variants = root.extensions.variants.variants.iter().enumerate();
    let entries: Vec<_> = variants.map(|(i, variant)| format!("{i} {:?}", variant.name)).collect();
    if entries.is_empty() { "none".to_owned() } else { entries.join(", ") }
}
