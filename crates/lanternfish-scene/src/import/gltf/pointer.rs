//! `KHR_animation_pointer`: animated properties that are named by a JSON pointer.

use super::schema::AnimationTarget;
use crate::motion::Property;

/// The file's node and its property that a channel animates, by the format's own target or by a pointer to the same. The
/// error names the kind of another property, a phrase in the plural.
pub(super) fn resolve(target: &AnimationTarget) -> Result<(usize, Property), &'static str> {
    let path = target.path.as_str();
    let pointer = target.extensions.pointer.as_ref().filter(|_| path == "pointer");
    let (node, property) = match pointer {
        None => (target.node, property(path)),
        Some(pointer) => match pointer.pointer.splitn(5, '/').collect::<Vec<_>>()[..] {
            ["", "nodes", node, path] => (node.parse().ok(), property(path)),
            _ => (None, None),
        },
    };
    let kind = || pointer.map_or("animations of targets that are not nodes", |pointer| kind(&pointer.pointer));
    node.zip(property).ok_or_else(kind)
}

fn property(path: &str) -> Option<Property> {
    Some(match path {
        "translation" => Property::Translation,
        "rotation" => Property::Rotation,
        "scale" => Property::Scale,
        "weights" => Property::Weights,
        _ => return None,
    })
}

/// The kind of a property that is not animated.
fn kind(pointer: &str) -> &'static str {
    let has = |extension: &str| pointer.split('/').any(|part| part == extension);
    match pointer.split('/').nth(1) {
        Some("nodes") if has("KHR_node_visibility") => "animations of the visibility of nodes",
        Some("nodes") => "animations of other properties of nodes",
        Some("materials") if has("KHR_texture_transform") => "animations of texture transforms",
        Some("materials") => "animations of materials",
        Some("meshes") => "animations of meshes",
        Some("cameras") => "animations of cameras",
        Some("extensions") if has("KHR_lights_punctual") || has("EXT_lights_area") => "animations of lights",
        _ => "animations of other properties",
    }
}
