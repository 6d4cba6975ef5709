//! From the words of the command line to vectors, sizes and lights. Messages say what was expected, with an example.

use glam::Vec3;
use lanternfish_scene::Light;

/// Pixels a side that are accepted.
const SIDES: std::ops::RangeInclusive<u32> = 1..=16384;

/// Width and height, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

/// `WxH`.
pub fn size(text: &str) -> Result<Size, String> {
    let range = format!("each side from {} to {} pixels", SIDES.start(), SIDES.end());
    let malformed = || format!("expected WxH, e.g. 1280x720, {range}");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(malformed)?;
    let side = |what: &str, text: &str| {
        if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
            return Err(malformed());
        }
        // Digits that do not fit are too many pixels as well.
        text.parse().ok().filter(|side| SIDES.contains(side)).ok_or_else(|| format!("{what} {text}: expected {range}"))
    };
    Ok(Size { width: side("width", width)?, height: side("height", height)? })
}

/// `x,y,z`.
pub fn vector(text: &str) -> Result<Vec3, String> {
    let expected = || "expected three numbers x,y,z, e.g. 1,2.5,-3".to_owned();
    let values = numbers(text).ok_or_else(expected)?;
    <[f32; 3]>::try_from(values).map(Vec3::from_array).map_err(|_| expected())
}

/// `r,g,b`, none negative.
pub fn color(text: &str) -> Result<Vec3, String> {
    vector(text)
        .ok()
        .filter(|color| color.cmpge(Vec3::ZERO).all())
        .ok_or_else(|| "expected three numbers r,g,b, none below 0, e.g. 0.2,0.3,0.5".to_owned())
}

/// `x,y,z,cd[,r,g,b[,range]]`.
pub fn point_light(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,cd[,r,g,b[,range]], e.g. 0,2.5,0,100 or 0,2.5,0,100,1,0.9,0.8,5";
    let values = numbers(text).filter(|v| matches!(v.len(), 4 | 7 | 8)).ok_or(expected)?;
    let mut light = Light::point(Vec3::from_slice(&values), intensity(&values[3..])?);
    if let Some(range) = values.get(7) {
        if *range <= 0.0 {
            return Err(format!("range {range}: expected metres, more than 0"));
        }
        light.range = Some(*range);
    }
    Ok(light)
}

/// `dx,dy,dz,lux[,r,g,b]`.
pub fn sun(text: &str) -> Result<Light, String> {
    let expected = "expected dx,dy,dz,lux[,r,g,b], e.g. 0.3,-1,0.2,3";
    let values = numbers(text).filter(|v| matches!(v.len(), 4 | 7)).ok_or(expected)?;
    let direction = Vec3::from_slice(&values);
    if direction.try_normalize().is_none() {
        return Err("direction 0,0,0: expected where the light travels to, e.g. 0,-1,0 for straight down".to_owned());
    }
    Ok(Light::directional(direction, intensity(&values[3..])?))
}

/// Strength, then colour if there is one.
fn intensity(values: &[f32]) -> Result<Vec3, String> {
    let color = values.get(1..4).map_or(Vec3::ONE, Vec3::from_slice);
    if values[0] < 0.0 || color.cmplt(Vec3::ZERO).any() {
        return Err("a light's strength and colour must not be negative".to_owned());
    }
    Ok(values[0] * color)
}

/// Lights made by rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rain {
    /// How many.
    pub count: u32,
    /// How far each reaches, m; `None`: chosen by the scene's size.
    pub radius: Option<f32>,
}

/// `rain:N[:radius]`.
pub fn rain(text: &str) -> Result<Rain, String> {
    let expected = "expected rain:N or rain:N:radius, e.g. rain:1000 or rain:1000:0.8";
    let mut parts = text.split(':');
    let (Some("rain"), Some(count), radius, None) = (parts.next(), parts.next(), parts.next(), parts.next()) else {
        return Err(expected.to_owned());
    };
    let count = count.parse().map_err(|_| format!("number of lights {count:?}: {expected}"))?;
    let radius = match radius {
        None => None,
        Some(text) => Some(positive(text).map_err(|error| format!("radius {text:?}: {error}"))?),
    };
    Ok(Rain { count, radius })
}

/// A number above zero.
pub fn positive(text: &str) -> Result<f32, String> {
    number(text).filter(|n| *n > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

/// Degrees of a vertical angle of view, as radians.
pub fn fov_y(text: &str) -> Result<f32, String> {
    number(text)
        .filter(|degrees| (0.1..=179.0).contains(degrees))
        .map(f32::to_radians)
        .ok_or_else(|| "expected degrees from 0.1 to 179".to_owned())
}

/// Exposure in stops. 2^±64 is far beyond any picture and far inside `f32`.
pub fn exposure(text: &str) -> Result<f32, String> {
    number(text)
        .filter(|ev| ev.abs() <= 64.0)
        .ok_or_else(|| "expected stops from -64 to 64, e.g. -1.5 (0: unchanged, 1: twice as bright)".to_owned())
}

/// Finite numbers between commas.
fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split(',').map(number).collect()
}

fn number(text: &str) -> Option<f32> {
    text.trim().parse().ok().filter(|n: &f32| n.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("1280x720"), Ok(Size { width: 1280, height: 720 }));
        assert_eq!(size("1x16384"), Ok(Size { width: 1, height: 16384 }));
        for bad in ["0x720", "1280x0", "100000x100000", "16385x1", "99999999999999999999x1"] {
            assert!(size(bad).unwrap_err().contains("1 to 16384 pixels"), "{bad}");
        }
        for bad in ["", "0", "100000", "1280", "1280*720", "x", "-1x5", "+5x5", "1x2x3", "1.5x2", "1280 x 720"] {
            assert!(size(bad).unwrap_err().contains("1280x720, each side from 1 to 16384"), "{bad}");
        }
    }

    #[test]
    fn vectors_and_colours() {
        assert_eq!(vector("1,-2.5,3e-1"), Ok(Vec3::new(1.0, -2.5, 0.3)));
        assert_eq!(vector(" 1, 2, 3 "), Ok(Vec3::new(1.0, 2.0, 3.0)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,z", "1,2,NaN", "inf,0,0", "1;2;3", "1,,3"] {
            assert!(vector(bad).is_err(), "{bad}");
        }
        assert_eq!(color("0,0.5,2"), Ok(Vec3::new(0.0, 0.5, 2.0)));
        assert!(color("0,-0.5,2").is_err());
    }

    #[test]
    fn points() {
        let light = point_light("-1,2,3,100").unwrap();
        assert_eq!(light, Light::point(Vec3::new(-1.0, 2.0, 3.0), Vec3::splat(100.0)));
        let light = point_light("0,0,0,10,1,0.5,0,4").unwrap();
        assert_eq!((light.intensity, light.range), (Vec3::new(10.0, 5.0, 0.0), Some(4.0)));
        assert_eq!(point_light("0,0,0,10,1,0.5,0").unwrap().range, None);
        for bad in
            ["0,0,0", "0,0,0,1,1", "0,0,0,1,1,1", "0,0,0,-1", "0,0,0,1,1,-1,1", "0,0,0,1,1,1,1,0", "1,1,1,1,1,1,1,1,1"]
        {
            assert!(point_light(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn suns() {
        let light = sun("0,-2,0,3,1,0.5,0").unwrap();
        assert_eq!((light.direction, light.intensity), (Vec3::NEG_Y, Vec3::new(3.0, 1.5, 0.0)));
        for bad in ["0,0,0,1", "0,-1,0", "0,-1,0,-3", "0,-1,0,1,1,1,1,1"] {
            assert!(sun(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn rains() {
        assert_eq!(rain("rain:1000"), Ok(Rain { count: 1000, radius: None }));
        assert_eq!(rain("rain:5:0.25"), Ok(Rain { count: 5, radius: Some(0.25) }));
        for bad in ["rain", "rain:", "rain:x", "rain:-1", "rain:5:0", "rain:5:", "rain:5:1:1", "snow:5"] {
            assert!(rain(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_have_ranges() {
        assert!((fov_y("90").unwrap() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        assert!(fov_y("0").is_err() && fov_y("180").is_err() && fov_y("wide").is_err());
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        assert!(exposure("1000").is_err());
        assert!(positive("0").is_err() && positive("-1").is_err() && positive("0.02").is_ok());
    }
}
