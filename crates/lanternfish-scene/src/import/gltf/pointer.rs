//! `KHR_animation_pointer`: animated properties that are named by a JSON pointer.

use super::schema::AnimationTarget;
use crate::motion::Property;

/// What a channel animates.
pub(super) enum Target {
    /// A property of one of the file's nodes.
    Node(usize, Property),
    /// A property of one of the lights of `KHR_lights_punctual`.
    Light(usize, Property),
}

/// What a channel animates, by the format's own target or by a pointer. The error names the kind of another property, a
/// phrase in the plural.
pub(super) fn resolve(target: &AnimationTarget) -> Result<Target, &'static str> {
    let path = target.path.as_str();
    let Some(pointer) = target.extensions.pointer.as_ref().filter(|_| path == "pointer") else {
        let resolved = target.node.zip(property(path)).map(|(node, property)| Target::Node(node, property));
        return resolved.ok_or("animations of targets that are not nodes");
    };
    let resolved = match pointer.pointer.splitn(7, '/').collect::<Vec<_>>()[..] {
        ["", "nodes", node, path] => {
            node.parse().ok().zip(property(path)).map(|(node, property)| Target::Node(node, property))
        }
        ["", "extensions", "KHR_lights_punctual", "lights", light, path] => {
            light.parse().ok().zip(light_property(path)).map(|(light, property)| Target::Light(light, property))
        }
        _ => None,
    };
    resolved.ok_or_else(|| kind(&pointer.pointer))
}

fn light_property(path: &str) -> Option<Property> {
    Some(match path {
        "color" => Property::LightColor,
        "intensity" => Property::LightIntensity,
        "range" => Property::LightRange,
        _ => return None,
    })
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
        Some("extensions") if has("KHR_lights_punctual") || has("EXT_lights_area") => {
            "animations of other properties of lights"
        }
        _ => "animations of other properties",
    }
}
