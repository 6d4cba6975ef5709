//! Parses disk and rectangle lights.

use glam::Vec3;
use lanternfish_scene::Light;

use super::{direction, intensity, near_enough, numbers, reach};

/// Parses a disk, `x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]]`: centre, m; normal; radius, m; radiance, nits; colour; range, m.
pub fn disk(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,dx,dy,dz,radius,nits[,r,g,b[,range]], e.g. 0,2.5,0,0,-1,0,0.3,500";
    let values = numbers(text).filter(|v| matches!(v.len(), 8 | 11 | 12)).ok_or(expected)?;
    let radius = reach(values[6]).map_err(|expected| format!("radius {}: {expected}", values[6]))?;
    let (position, towards) = (near_enough(Vec3::from_slice(&values))?, direction(&values[3..])?.normalize());
    finished(Light::disk(position, towards, radius, intensity(&values[7..])?), values.get(11))
}

/// Parses a rectangle, `x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]]`, as a disk. Its width is horizontal; along x if it
/// faces straight up or down.
pub fn rectangle(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,dx,dy,dz,width,height,nits[,r,g,b[,range]], e.g. 0,2.5,0,0,-1,0,1.2,0.3,500";
    let values = numbers(text).filter(|v| matches!(v.len(), 9 | 12 | 13)).ok_or(expected)?;
    let side = |what: &str, side: f32| reach(side).map_err(|expected| format!("{what} {side}: {expected}"));
    let size = [side("width", values[6])?, side("height", values[7])?];
    let (position, towards) = (near_enough(Vec3::from_slice(&values))?, direction(&values[3..])?.normalize());
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
