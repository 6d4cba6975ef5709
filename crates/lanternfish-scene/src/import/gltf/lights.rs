//! `KHR_lights_punctual`, and `EXT_lights_area` (a draft: KhronosGroup/glTF, pull request 2525).

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;

use super::fault::{Place, Result, invalid, item};
use super::hierarchy::Placed;
use super::notes::Notes;
use super::schema::{self, Root};
use crate::{Light, LightKind};

/// The light at a node, in the node's space. `None`, with a note, for an unknown kind.
pub(super) fn read(root: &Root, index: usize, at: &Placed, notes: &mut Notes) -> Result<Option<Light>> {
    let lights = root.extensions.lights.as_ref().map_or(&[][..], |extension| &extension.lights);
    let light = item(lights, index, "lights")?;
    let Some(kind) = read_kind(light).place(|| format!("lights[{index}]"))? else {
        notes.add("lights of an unknown kind");
        return Ok(None);
    };
    let intensity = colored(light.intensity.unwrap_or(1.0), light.color).place(|| format!("lights[{index}]"))?;
    if light.range.is_some_and(|range| !(range > 0.0 && range.is_finite())) {
        return Err(invalid(format!("lights[{index}]: range {:?} is not above 0", light.range)));
    }
    Ok(Some(Light {
        name: if at.node.name.is_empty() { light.name.clone() } else { at.node.name.clone() },
        kind,
        position: Vec3::ZERO,
        direction: Vec3::NEG_Z,
        intensity,
        range: light.range.filter(|_| kind != LightKind::Directional),
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
            if !(outer > f32::MIN_POSITIVE && outer <= FRAC_PI_2 + 1e-3 && inner >= 0.0) {
                return Err(invalid(format!("cone angles {inner}, {outer} are not within 0..=π/2")));
            }
            let outer_angle = outer.min(FRAC_PI_2);
            // Exporters write hard edges as equal angles; the falloff needs a non-zero width.
            Some(LightKind::Spot { inner_angle: inner.min(0.999 * outer_angle), outer_angle })
        }
        _ => None,
    })
}

/// The area light at a node, in the node's space. `None`, with a note, for an unknown shape.
pub(super) fn read_area(root: &Root, index: usize, at: &Placed, notes: &mut Notes) -> Result<Option<Light>> {
    let lights = root.extensions.area_lights.as_ref().map_or(&[][..], |extension| &extension.lights);
    let light = item(lights, index, "EXT_lights_area: lights")?;
    let place = || format!("EXT_lights_area: lights[{index}]");
    let radiance = colored(light.intensity.unwrap_or(1000.0), light.color).place(place)?;
    let size = light.size.unwrap_or(1.0);
    let aspect = light.rect.as_ref().and_then(|rect| rect.aspect).unwrap_or(1.0);
    if !(size > 0.0 && size.is_finite() && aspect > 0.0 && aspect.is_finite()) {
        return Err(invalid(format!("size {size}, aspect {aspect}: not above 0"))).place(place);
    }
    let area = match light.kind.as_str() {
        "disk" => Light::disk(Vec3::ZERO, Vec3::NEG_Z, 0.5 * size, radiance),
        "rect" => Light::rectangle(Vec3::ZERO, Vec3::NEG_Z, Vec3::X, [size * aspect, size], radiance),
        _ => {
            notes.add("area lights of an unknown shape");
            return Ok(None);
        }
    };
    let name = if at.node.name.is_empty() { light.name.clone() } else { at.node.name.clone() };
    Ok(Some(Light { name, ..area }))
}

fn colored(intensity: f32, color: Option<[f32; 3]>) -> Result<Vec3> {
    let intensity = intensity * color.map_or(Vec3::ONE, Vec3::from);
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(invalid(format!("intensity times color is {intensity}")));
    }
    Ok(intensity)
}
