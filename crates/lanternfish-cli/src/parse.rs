//! Parses words of the command line as vectors, sizes and lights. Messages state the expected form, with an example.

mod area_light;
mod pose;
mod range;
#[cfg(test)]
mod tests;

use std::fmt;

use glam::Vec3;
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Bounds, Light, Scene};

pub use self::{
    area_light::{disk, light_text, rectangle},
    pose::{PoseConvention, intrinsics, pose},
    range::{Frames, Span, fps, frames, orbit, samples, span},
};

/// Valid image widths and heights, pixels.
const SIDES: std::ops::RangeInclusive<u32> = 1..=16384;

/// Most generated lights: at 64 bytes each they fill 128 MiB, which every adapter can bind at once.
const MOST_LIGHTS: u32 = (128 << 20) / 64;

/// Largest distance from the origin and largest range, m.
const FARTHEST: f32 = Scene::FARTHEST;

/// Largest half-precision float, the format of rendered images.
const BRIGHTEST: f32 = 65504.0;

/// A number of bytes: `500000000`, `500M`, `0.5G`.
pub fn bytes(text: &str) -> Result<u64, String> {
    let units = [("k", 1e3), ("K", 1e3), ("M", 1e6), ("G", 1e9), ("T", 1e12)];
    let unit = units.into_iter().find_map(|(name, factor)| Some((text.strip_suffix(name)?, factor)));
    let (text, factor) = unit.unwrap_or((text, 1.0));
    let bytes = text.parse::<f64>().ok().map(|number| number * factor).filter(|bytes| *bytes >= 1e6 && *bytes <= 1e18);
    bytes.map(|bytes| bytes as u64).ok_or_else(|| "expected a number of bytes from 1M on, e.g. 500M or 4G".to_owned())
}

/// Width and height, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Size {
    /// Width over height.
    pub fn aspect(self) -> f32 {
        self.width as f32 / self.height as f32
    }
}

/// Parses a size, `WxH`, pixels.
pub fn size(text: &str) -> Result<Size, String> {
    let range = format!("each side from {} to {} pixels", SIDES.start(), SIDES.end());
    let malformed = || format!("expected WxH, e.g. 1280x720, {range}");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(malformed)?;
    let side = |what: &str, text: &str| {
        if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
            return Err(malformed());
        }
        // Overflowing numbers are out of range too.
        text.parse().ok().filter(|side| SIDES.contains(side)).ok_or_else(|| format!("{what} {text}: expected {range}"))
    };
    Ok(Size { width: side("width", width)?, height: side("height", height)? })
}

/// Parses a position, `x,y,z`, m.
pub fn position(text: &str) -> Result<Vec3, String> {
    let position = three_numbers(text).ok_or("expected three numbers x,y,z, e.g. 1,2.5,-3")?;
    near_enough(position)
}

/// Parses a colour, `r,g,b`, each from 0 to `BRIGHTEST`.
pub fn color(text: &str) -> Result<Vec3, String> {
    three_numbers(text)
        .filter(|color| color.cmpge(Vec3::ZERO).all() && color.max_element() <= BRIGHTEST)
        .ok_or_else(|| format!("expected three numbers r,g,b from 0 to {BRIGHTEST}, e.g. 0.2,0.3,0.5"))
}

fn three_numbers(text: &str) -> Option<Vec3> {
    <[f32; 3]>::try_from(numbers(text)?).ok().map(Vec3::from_array)
}

fn near_enough(position: Vec3) -> Result<Vec3, String> {
    if position.abs().max_element() > FARTHEST {
        return Err(format!("expected coordinates from {:e} to {FARTHEST:e} m", -FARTHEST));
    }
    Ok(position)
}

/// Parses a point light, `x,y,z,cd[,r,g,b[,range]]`: position, m; intensity, cd; colour; range, m.
pub fn point_light(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,cd[,r,g,b[,range]], e.g. 0,2.5,0,100 or 0,2.5,0,100,1,0.9,0.8,5";
    let values = numbers(text).filter(|v| matches!(v.len(), 4 | 7 | 8)).ok_or(expected)?;
    let mut light = Light::point(near_enough(Vec3::from_slice(&values))?, intensity(&values[3..])?);
    if let Some(range) = values.get(7) {
        light.range = Some(reach(*range).map_err(|expected| format!("range {range}: {expected}"))?);
    }
    Ok(light)
}

/// Parses a directional light, `dx,dy,dz,lux[,r,g,b]`: direction in which the light travels, illuminance, colour.
pub fn sun(text: &str) -> Result<Light, String> {
    let expected = "expected dx,dy,dz,lux[,r,g,b], e.g. 0.3,-1,-0.6,3";
    let values = numbers(text).filter(|v| matches!(v.len(), 4 | 7)).ok_or(expected)?;
    let direction = unit(&values)?;
    Ok(Light { direction, ..Light::directional(direction, intensity(&values[3..])?) })
}

/// The direction of the first three values, which may have any length but zero. The result has a length of about 1.
fn direction(values: &[f32]) -> Result<Vec3, String> {
    let direction = Vec3::from_slice(values);
    // Scale the largest component to 1, so that the length does not overflow or underflow.
    let direction = direction / direction.abs().max_element();
    if !direction.is_finite() {
        return Err("direction 0,0,0: expected where the light travels to, e.g. 0,-1,0 for straight down".to_owned());
    }
    Ok(direction)
}

/// The direction of the first three values, of length 1. Values that have this length stay as they are, so that written
/// lights are read again to the bit.
fn unit(values: &[f32]) -> Result<Vec3, String> {
    let given = Vec3::from_slice(values);
    Ok(if (given.length_squared() - 1.0).abs() < 1e-6 { given } else { direction(values)?.normalize() })
}

/// A light's strength times its colour. `values` are the strength, then red, green and blue if a colour is given.
fn intensity(values: &[f32]) -> Result<Vec3, String> {
    let color = values.get(1..4).map_or(Vec3::ONE, Vec3::from_slice);
    if values[0] < 0.0 || color.cmplt(Vec3::ZERO).any() {
        return Err("a light's strength and colour must not be negative".to_owned());
    }
    let intensity = values[0] * color;
    if !intensity.is_finite() {
        return Err(format!("a light's strength times its colour must not exceed {:e}", f32::MAX));
    }
    Ok(intensity)
}

/// Generated lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightSet {
    /// Light rain: lights that fall through the scene's bounds.
    Rain {
        /// Number of lights.
        count: u32,
        /// Range of each light, m; `None`: derived from the scene's size.
        radius: Option<f32>,
    },
    /// Lights at random positions in a box, by a rule that other renderers can implement.
    Random {
        /// Number of lights.
        count: u32,
        /// Range of each light, m.
        radius: f32,
        /// Seed of the random numbers.
        seed: u64,
        /// Bounds of the lights, world space, m.
        bounds: Bounds,
    },
}

impl fmt::Display for LightSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Rain { count, radius: None } => write!(f, "rain:{count}"),
            Self::Rain { count, radius: Some(radius) } => write!(f, "rain:{count}:{radius}"),
            Self::Random { count, radius, seed, bounds: Bounds { min, max } } => {
                let [a, b] = [min, max].map(|p| format!("{},{},{}", p.x, p.y, p.z));
                write!(f, "random:{count}:{radius}:{seed}:{a},{b}")
            }
        }
    }
}

/// Parses generated lights: `rain:N[:radius]` or `random:N:radius:seed:x0,y0,z0,x1,y1,z1`.
pub fn light_set(text: &str) -> Result<LightSet, String> {
    let expected = "expected rain:N, rain:N:radius or random:N:radius:seed:x0,y0,z0,x1,y1,z1, e.g. rain:1000 or \
                    random:1000:1.5:7:-9,0,-4,9,9,4";
    let radius_of = |text: &str| {
        let metres = number(text).ok_or_else(|| "expected a number".to_owned()).and_then(reach);
        metres.map_err(|error| format!("radius {text:?}: {error}"))
    };
    match text.split(':').collect::<Vec<_>>()[..] {
        ["rain", count] => Ok(LightSet::Rain { count: light_count(count, expected)?, radius: None }),
        ["rain", count, radius] => {
            Ok(LightSet::Rain { count: light_count(count, expected)?, radius: Some(radius_of(radius)?) })
        }
        ["random", count, radius, seed, corners] => {
            let wrong = || format!("box {corners:?}: expected x0,y0,z0,x1,y1,z1, the lower corner first, m");
            let corners = numbers(corners).and_then(|v| <[f32; 6]>::try_from(v).ok()).ok_or_else(wrong)?;
            let (min, max) = (near_enough(Vec3::from_slice(&corners))?, near_enough(Vec3::from_slice(&corners[3..]))?);
            if !min.cmple(max).all() {
                return Err(wrong());
            }
            Ok(LightSet::Random {
                count: light_count(count, expected)?,
                radius: radius_of(radius)?,
                seed: seed.parse().map_err(|_| format!("seed {seed:?}: expected an integer, 0 to {}", u64::MAX))?,
                bounds: Bounds { min, max },
            })
        }
        _ => Err(expected.to_owned()),
    }
}

fn light_count(text: &str, expected: &str) -> Result<u32, String> {
    if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
        return Err(format!("number of lights {text:?}: {expected}"));
    }
    // Overflowing numbers are out of range too.
    let count = text.parse().ok().filter(|count| *count <= MOST_LIGHTS);
    count.ok_or_else(|| format!("number of lights {text}: expected at most {MOST_LIGHTS}"))
}

/// Checks a light's range, m: above 0 and at most [`FARTHEST`].
fn reach(metres: f32) -> Result<f32, String> {
    if metres > 0.0 && metres <= FARTHEST {
        return Ok(metres);
    }
    Err(format!("expected metres, more than 0, at most {FARTHEST:e}"))
}

/// Parses the seed of random numbers.
pub fn seed(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| format!("expected a whole number from 0 to {}", u32::MAX))
}

/// Parses a number above zero.
pub fn positive(text: &str) -> Result<f32, String> {
    number(text).filter(|n| *n > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

/// Valid vertical fields of view, degrees.
pub const FOV_Y: std::ops::RangeInclusive<f32> = 0.1..=179.0;

/// Parses a vertical field of view, degrees, and returns it in radians.
pub fn fov_y(text: &str) -> Result<f32, String> {
    number(text)
        .filter(|degrees| FOV_Y.contains(degrees))
        .map(f32::to_radians)
        .ok_or_else(|| format!("expected degrees from {} to {}", FOV_Y.start(), FOV_Y.end()))
}

/// Parses a rotation, degrees. The limit keeps thousandths of a degree in an `f32`.
pub fn rotation(text: &str) -> Result<f32, String> {
    number(text).filter(|d| d.abs() <= 3600.0).ok_or_else(|| "expected degrees from -3600 to 3600".to_owned())
}

/// Parses an angle above the horizon, degrees.
pub fn elevation(text: &str) -> Result<f32, String> {
    number(text).filter(|d| d.abs() <= 90.0).ok_or_else(|| "expected degrees from -90 to 90".to_owned())
}

/// Parses a time, s.
pub fn time(text: &str) -> Result<f32, String> {
    number(text).filter(|s| s.abs() <= 1e6).ok_or_else(|| "expected seconds from -1e6 to 1e6".to_owned())
}

/// Parses an exposure in stops, −64 to 64: 2^±64 exceeds any image's range and is well within `f32`.
pub fn exposure(text: &str) -> Result<f32, String> {
    number(text)
        .filter(|ev| ev.abs() <= 64.0)
        .ok_or_else(|| "expected stops from -64 to 64, e.g. -1.5 (0: unchanged, 1: twice as bright)".to_owned())
}

/// Reads `cpu`, `gpu` or a part of an adapter's name.
pub fn adapter(text: &str) -> Result<AdapterChoice, String> {
    match text {
        "" => Err("expected a part of an adapter's name, gpu or cpu".to_owned()),
        "cpu" => Ok(AdapterChoice::Cpu),
        "gpu" => Ok(AdapterChoice::Hardware),
        name => Ok(AdapterChoice::Name(name.to_owned())),
    }
}

/// Numbers as a flag states them.
pub(crate) fn list(values: &[f32]) -> String {
    values.iter().map(f32::to_string).collect::<Vec<_>>().join(",")
}

/// The shortest number of degrees that is this angle, radians.
pub(crate) fn degrees(angle: f32) -> String {
    let degrees = angle.to_degrees();
    let (up, down) = (degrees.next_up(), degrees.next_down());
    let near = [degrees, up, down, up.next_up(), down.next_down()].into_iter();
    let exact = near.filter(|degrees| degrees.to_radians() == angle).map(|degrees| degrees.to_string());
    exact.min_by_key(String::len).unwrap_or_else(|| degrees.to_string())
}

/// Parses comma-separated numbers; `None` if one of them is not a finite number.
pub fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split(',').map(number).collect()
}

/// Parses a finite number.
pub(crate) fn number(text: &str) -> Option<f32> {
    text.trim().parse().ok().filter(|n: &f32| n.is_finite())
}
