//! Parses disk and rectangle lights, and writes lights.

use glam::Vec3;
use lanternfish_scene::{Light, LightKind};

use super::{intensity, list, near_enough, numbers, reach, unit};

/// Parses a disk, `x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]]`: centre, m; normal; radius, m; radiance, nits; colour; range, m.
pub fn disk(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]], e.g. 0,2.5,0,0,-1,0,0.3,500";
    let values = numbers(text).filter(|v| matches!(v.len(), 8 | 11 | 12)).ok_or(expected)?;
    let radius = reach(values[6]).map_err(|expected| format!("radius {}: {expected}", values[6]))?;
    let (position, towards) = (near_enough(Vec3::from_slice(&values))?, unit(&values[3..])?);
    finished(Light::disk(position, towards, radius, intensity(&values[7..])?), values.get(11))
}

/// Parses a rectangle, `x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]]`, as a disk. Its width is horizontal; along x if it
/// faces straight up or down.
pub fn rectangle(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]], e.g. 0,2.5,0,0,-1,0,1.2,0.3,500";
    let values = numbers(text).filter(|v| matches!(v.len(), 9 | 12 | 13)).ok_or(expected)?;
    let side = |what: &str, side: f32| reach(side).map_err(|expected| format!("{what} {side}: {expected}"));
    let size = [side("width", values[6])?, side("height", values[7])?];
    let (position, towards) = (near_enough(Vec3::from_slice(&values))?, unit(&values[3..])?);
    let right = towards.cross(Vec3::Y);
    let right = if right.length() > 1e-3 { right } else { Vec3::X };
    finished(Light::rectangle(position, towards, right, size, intensity(&values[8..])?), values.get(12))
}

/// The light with its range. Returns an error if its emitted power is not a finite number.
fn finished(mut light: Light, range: Option<&f32>) -> Result<Light, String> {
    if let Some(range) = range {
        light.range = Some(reach(*range).map_err(|expected| format!("range {range}: {expected}"))?);
    }
    if !(light.area() > Some(0.0) && light.greatest_intensity().is_finite()) {
        return Err("the light's area is too small, or radiance times area too large, for a float".to_owned());
    }
    Ok(light)
}

/// The flag that adds a light: its id, and its value. The error says why there is none.
pub fn light_text(light: &Light) -> Result<(&'static str, String), String> {
    let Light { position, direction, intensity, range, .. } = light;
    let (id, mut values) = match light.kind {
        LightKind::Point => ("points", position.to_array().to_vec()),
        LightKind::Directional => ("sun", direction.to_array().to_vec()),
        LightKind::Disk { radius } => ("disks", [&position.to_array()[..], &direction.to_array(), &[radius]].concat()),
        LightKind::Rectangle { right, .. } if right.y.abs() > 1e-3 && direction.y.abs() < 0.999 => {
            return Err("no flag can express a rectangle whose width is not horizontal".to_owned());
        }
        LightKind::Rectangle { half_width, half_height, .. } => {
            let size = [2.0 * half_width, 2.0 * half_height];
            ("rectangles", [&position.to_array()[..], &direction.to_array(), &size].concat())
        }
        LightKind::Spot { .. } => return Err("no flag can express a spot light".to_owned()),
    };
    // A strength and a colour whose largest component is 1, if their product is exact.
    let strength = intensity.max_element();
    let [strength, color] = match *intensity / strength {
        color if strength * color == *intensity => [Vec3::splat(strength), color],
        _ => [Vec3::ONE, *intensity],
    };
    values.push(strength.x);
    if range.is_some() || color != Vec3::ONE {
        values.extend(color.to_array());
    }
    values.extend(range);
    Ok((id, list(&values)))
}
