//! `KHR_lights_punctual`.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;

use super::fault::{Place, Result, invalid, item};
use super::hierarchy::Placed;
use super::normals::direction;
use super::notes::Notes;
use super::schema::{self, Root};
use crate::{Light, LightKind};

/// The light at a node. `None`, with a note, for a kind that is unknown.
pub(super) fn read(root: &Root, index: usize, at: &Placed, notes: &mut Notes) -> Result<Option<Light>> {
    let lights = root.extensions.lights.as_ref().map_or(&[][..], |extension| &extension.lights);
    let light = item(lights, index, "lights")?;
    let Some(kind) = read_kind(light).place(|| format!("lights[{index}]"))? else {
        notes.add("lights of an unknown kind");
        return Ok(None);
    };
    let intensity = light.intensity.unwrap_or(1.0) * light.color.map_or(Vec3::ONE, Vec3::from);
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(invalid(format!("lights[{index}]: intensity times color is {intensity}")));
    }
    if light.range.is_some_and(|range| !(range > 0.0 && range.is_finite())) {
        return Err(invalid(format!("lights[{index}]: range {:?} is not above 0", light.range)));
    }
    let is_directional = kind == LightKind::Directional;
    let world_from_node = &at.world_from_node;
    Ok(Some(Light {
        name: if at.node.name.is_empty() { light.name.clone() } else { at.node.name.clone() },
        kind,
        position: if is_directional { Vec3::ZERO } else { world_from_node.translation.into() },
        // A node that is scaled to nothing has no direction; any will do.
        direction: direction(world_from_node.transform_vector3(Vec3::NEG_Z)).unwrap_or(Vec3::NEG_Z),
        intensity,
        range: light.range.filter(|_| !is_directional),
    }))
}

fn read_kind(light: &schema::Light) -> Result<Option<LightKind>> {
    Ok(match light.kind.as_str() {
        "point" => Some(LightKind::Point),
        "directional" => Some(LightKind::Directional),
        "spot" => {
            let spot = light.spot.as_ref().ok_or_else(|| invalid("a spot light without `spot`"))?;
            let inner = spot.inner_cone_angle.unwrap_or(0.0);
            let outer = spot.outer_cone_angle.unwrap_or(FRAC_PI_4);
            // π/2 is often written with few digits, rounded up.
            if !(outer > 0.0 && outer <= FRAC_PI_2 + 1e-3 && inner >= 0.0) {
                return Err(invalid(format!("cone angles {inner}, {outer} are not within 0..=π/2")));
            }
            let outer_angle = outer.min(FRAC_PI_2);
            // Exporters write hard edges as equal angles; the falloff between them needs a width.
            Some(LightKind::Spot { inner_angle: inner.min(0.999 * outer_angle), outer_angle })
        }
        _ => None,
    })
}
