//! From the words of the command line to vectors, sizes and lights. Messages say what was expected, with an example.

use glam::Vec3;
use lanternfish_scene::Light;

/// Pixels a side that are accepted.
const SIDES: std::ops::RangeInclusive<u32> = 1..=16384;

/// Most lights made by rule: at 64 bytes each they fill 128 MiB, which every adapter can bind at once.
const MOST_LIGHTS: u32 = (128 << 20) / 64;

/// Farthest that anything may be or reach, m. In squares and products of squares of metres, a float still has room.
const FARTHEST: f32 = 1e12;

/// Greatest number that a half float holds, in which pictures are kept.
const BRIGHTEST: f32 = 65504.0;

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

/// `x,y,z`, m.
pub fn position(text: &str) -> Result<Vec3, String> {
    let position = three_numbers(text).ok_or("expected three numbers x,y,z, e.g. 1,2.5,-3")?;
    near_enough(position)
}

/// `r,g,b`, from 0 to [`BRIGHTEST`].
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

/// `x,y,z,cd[,r,g,b[,range]]`.
pub fn point_light(text: &str) -> Result<Light, String> {
    let expected = "expected x,y,z,cd[,r,g,b[,range]], e.g. 0,2.5,0,100 or 0,2.5,0,100,1,0.9,0.8,5";
    let values = numbers(text).filter(|v| matches!(v.len(), 4 | 7 | 8)).ok_or(expected)?;
    let mut light = Light::point(near_enough(Vec3::from_slice(&values))?, intensity(&values[3..])?);
    if let Some(range) = values.get(7) {
        light.range = Some(reach(*range).map_err(|expected| format!("range {range}: {expected}"))?);
    }
    Ok(light)
}

/// `dx,dy,dz,lux[,r,g,b]`.
pub fn sun(text: &str) -> Result<Light, String> {
    let expected = "expected dx,dy,dz,lux[,r,g,b], e.g. 0.3,-1,0.2,3";
    let values = numbers(text).filter(|v| matches!(v.len(), 4 | 7)).ok_or(expected)?;
    let direction = Vec3::from_slice(&values);
    // The greatest component becomes 1, so that the length of what is very long or short is a number.
    let direction = direction / direction.abs().max_element();
    if !direction.is_finite() {
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
    let intensity = values[0] * color;
    if !intensity.is_finite() {
        return Err(format!("a light's strength times its colour must not exceed {:e}", f32::MAX));
    }
    Ok(intensity)
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
    if count.is_empty() || !count.bytes().all(|b| b.is_ascii_digit()) {
        return Err(format!("number of lights {count:?}: {expected}"));
    }
    // Digits that do not fit are too many lights as well.
    let count = count
        .parse()
        .ok()
        .filter(|count| *count <= MOST_LIGHTS)
        .ok_or_else(|| format!("number of lights {count}: expected at most {MOST_LIGHTS}"))?;
    let radius = radius
        .map(|text| number(text).ok_or_else(|| "expected a number".to_owned()).and_then(reach).map_err(|e| (text, e)))
        .transpose()
        .map_err(|(text, error)| format!("radius {text:?}: {error}"))?;
    Ok(Rain { count, radius })
}

/// How far a light reaches, m.
fn reach(metres: f32) -> Result<f32, String> {
    if metres > 0.0 && metres <= FARTHEST {
        return Ok(metres);
    }
    Err(format!("expected metres, more than 0, at most {FARTHEST:e}"))
}

/// A number above zero.
pub fn positive(text: &str) -> Result<f32, String> {
    number(text).filter(|n| *n > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

/// Degrees of a vertical angle of view that are accepted.
pub const FOV_Y: std::ops::RangeInclusive<f32> = 0.1..=179.0;

/// Degrees of a vertical angle of view, as radians.
pub fn fov_y(text: &str) -> Result<f32, String> {
    number(text)
        .filter(|degrees| FOV_Y.contains(degrees))
        .map(f32::to_radians)
        .ok_or_else(|| format!("expected degrees from {} to {}", FOV_Y.start(), FOV_Y.end()))
}

/// Degrees of a rotation, of which a float still keeps thousandths.
pub fn rotation(text: &str) -> Result<f32, String> {
    number(text).filter(|d| d.abs() <= 3600.0).ok_or_else(|| "expected degrees from -3600 to 3600".to_owned())
}

/// Seconds of a camera track.
pub fn time(text: &str) -> Result<f32, String> {
    number(text).filter(|s| s.abs() <= 1e6).ok_or_else(|| "expected seconds from -1e6 to 1e6".to_owned())
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
        assert_eq!(position("1,-2.5,3e-1"), Ok(Vec3::new(1.0, -2.5, 0.3)));
        assert_eq!(position(" 1, 2, 3 "), Ok(Vec3::new(1.0, 2.0, 3.0)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,z", "1,2,NaN", "inf,0,0", "1;2;3", "1,,3"] {
            assert!(position(bad).unwrap_err().contains("1,2.5,-3"), "{bad}");
        }
        assert!(position("-1e12,0,1e12").is_ok());
        assert!(position("0,-2e12,0").unwrap_err().contains("-1e12 to 1e12 m"));
        assert_eq!(color("0,0.5,2"), Ok(Vec3::new(0.0, 0.5, 2.0)));
        // More than a half float holds would be infinite in an EXR file.
        assert!(color("0,-0.5,2").is_err() && color("65504,0,0").is_ok() && color("65600,0,0").is_err());
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
        // Each number is finite; their products and squares would not be.
        for bad in ["0,0,0,1e38,1e38,1,1", "1e30,0,0,1", "0,0,0,1,1,1,1,1e30"] {
            assert!(point_light(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn suns() {
        let light = sun("0,-2,0,3,1,0.5,0").unwrap();
        assert_eq!((light.direction, light.intensity), (Vec3::NEG_Y, Vec3::new(3.0, 1.5, 0.0)));
        for long_or_short in ["0,-1e30,0,1", "0,-1e-30,0,1"] {
            assert_eq!(sun(long_or_short).unwrap().direction, Vec3::NEG_Y);
        }
        for bad in ["0,0,0,1", "0,-1,0", "0,-1,0,-3", "0,-1,0,1,1,1,1,1", "0,-1,0,1e38,9,9,9"] {
            assert!(sun(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn rains() {
        assert_eq!(rain("rain:1000"), Ok(Rain { count: 1000, radius: None }));
        assert_eq!(rain("rain:5:0.25"), Ok(Rain { count: 5, radius: Some(0.25) }));
        for bad in ["rain", "rain:", "rain:x", "rain:-1", "rain:+1", "rain:5:0", "rain:5:", "rain:5:1:1", "snow:5"] {
            assert!(rain(bad).is_err(), "{bad}");
        }
        // The intensity is chosen by the square of the radius.
        assert!(rain("rain:5:1e30").unwrap_err().contains("1e12"));
        assert_eq!(rain("rain:2097152").unwrap().count, 2_097_152);
        for bad in ["rain:2097153", "rain:4000000000", "rain:99999999999999999999"] {
            assert!(rain(bad).unwrap_err().contains("at most 2097152"), "{bad}");
        }
    }

    #[test]
    fn numbers_have_ranges() {
        assert!((fov_y("90").unwrap() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        assert!(fov_y("0").is_err() && fov_y("180").is_err() && fov_y("wide").is_err());
        assert!(rotation("-3600").is_ok() && rotation("3601").is_err() && rotation("inf").is_err());
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        assert!(exposure("1000").is_err());
        assert!(positive("0").is_err() && positive("-1").is_err() && positive("0.02").is_ok());
    }
}
