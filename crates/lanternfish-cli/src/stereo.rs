//! Stereo images.

use lanternfish::RenderedImage;
use lanternfish_scene::{Camera, Eyes, named_enum};

use crate::{
    error::CliError,
    parse::{self, degrees},
};

named_enum! {
    /// Layout of two images in one file.
    #[derive(Default)]
    StereoLayout {
        #[default]
        SideBySide = "side-by-side": "Side by side, the left eye's image on the left: twice as wide as --size",
        Layers = "layers": "Two layers of one file, called left and right. EXR only",
    }
}

/// Parses `vive`, `parallel[:metres]` or `l,r,b,t,metres[,degrees]`.
pub fn eyes(text: &str) -> Result<Eyes, String> {
    let expected = "expected vive, parallel, parallel:METRES or l,r,b,t,METRES[,DEGREES] (slopes of the left eye's sides, the \
                    distance of the eyes, how far each is turned out), e.g. -1.39,1.25,-1.47,1.46,0.063";
    let apart = |metres: f32| {
        let sound = (0.0..=1000.0).contains(&metres);
        if sound { Ok(metres) } else { Err(format!("{metres} m between the eyes: expected 0 to 1000")) }
    };
    match text.split_once(':') {
        None if text == "vive" => return Ok(Eyes::Vive),
        None if text == "parallel" => return Ok(Eyes::Parallel(Eyes::HUMAN)),
        Some(("parallel", metres)) => {
            return Ok(Eyes::Parallel(apart(parse::number(metres).ok_or(expected)?)?));
        }
        _ => {}
    }
    let values = parse::numbers(text).filter(|v| matches!(v.len(), 5 | 6)).ok_or(expected)?;
    let slopes: [f32; 4] = values[..4].try_into().expect("four of them");
    if !(slopes[0] < slopes[1] && slopes[2] < slopes[3]) || slopes.iter().any(|slope| slope.abs() > 1e3) {
        return Err("slopes: expected left < right and bottom < top, each from -1000 to 1000".to_owned());
    }
    let degrees = values.get(5).copied().unwrap_or(0.0);
    if degrees.abs() > 45.0 {
        return Err(format!("{degrees} degrees: expected -45 to 45"));
    }
    Ok(Eyes::Rig(slopes, apart(values[4])?, degrees.to_radians()))
}

/// Formats the eyes as [`eyes`] parses them.
pub fn text(eyes: Eyes) -> String {
    match eyes {
        Eyes::Vive => "vive".to_owned(),
        Eyes::Parallel(metres) => format!("parallel:{metres}"),
        Eyes::Rig([l, r, b, t], metres, cant) => format!("{l},{r},{b},{t},{metres},{}", degrees(cant)),
    }
}

/// The two cameras of a head with the pose of `head`.
pub fn cameras(eyes: Eyes, head: &Camera, aspect: f32) -> Result<[Camera; 2], CliError> {
    eyes.cameras(head, aspect).ok_or_else(|| {
        CliError::new("--stereo parallel: the camera is orthographic", "choose a perspective one, or --stereo vive")
    })
}

/// Joins two images of equal height, the first on the left. Times and counters are the first's and, if only the second has
/// them, the second's; counters of both are summed.
pub fn side_by_side(left: RenderedImage, right: RenderedImage) -> RenderedImage {
    let width = left.width + right.width;
    let rows = |height: u32| 0..height as usize;
    let (l, r) = (left.width as usize, right.width as usize);
    let mut joined = RenderedImage { width, radiance: Vec::new(), display: Vec::new(), ..left.clone() };
    for y in rows(left.height) {
        joined.radiance.extend_from_slice(&left.radiance[y * l..][..l]);
        joined.radiance.extend_from_slice(&right.radiance[y * r..][..r]);
        joined.display.extend_from_slice(&left.display[y * l..][..l]);
        joined.display.extend_from_slice(&right.display[y * r..][..r]);
    }
    for (name, count) in right.report.counters {
        // Counters of the scene are the same for both eyes; add them once.
        match joined.report.counters.iter_mut().find(|(other, _)| *other == name) {
            Some(_) if name.starts_with("scene/") => {}
            Some((_, sum)) => *sum += count,
            None => joined.report.counters.push((name, count)),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use lanternfish::Report;

    use super::*;

    #[test]
    fn eyes_are_parsed() {
        assert_eq!(eyes("vive"), Ok(Eyes::Vive));
        assert_eq!(eyes("parallel"), Ok(Eyes::Parallel(0.063)));
        assert_eq!(eyes("parallel:0.1"), Ok(Eyes::Parallel(0.1)));
        assert_eq!(eyes("-1,2,-3,4,0.06"), Ok(Eyes::Rig([-1.0, 2.0, -3.0, 4.0], 0.06, 0.0)));
        assert!(matches!(eyes("-1,2,-3,4,0.06,10"), Ok(Eyes::Rig(_, _, cant)) if (cant - 0.1745).abs() < 1e-4));
        let bad = " oculus parallel: parallel:-1 parallel:x 1,2,3,4 1,0,-1,1,0.06 -1,1,-1,1,0.06,90 -1,1,-1,1,-2";
        for bad in bad.split(' ') {
            assert!(eyes(bad).is_err(), "{bad}");
        }
        for said in ["vive", "parallel:0.0631", "-1,2,-3,4,0.06,0"] {
            assert_eq!(text(eyes(said).unwrap()), said);
        }
    }

    #[test]
    fn two_images_are_joined_side_by_side() {
        let rendering = |value: u8, counters: &[(&str, u64)]| RenderedImage {
            width: 2,
            height: 2,
            radiance: vec![[f32::from(value); 4]; 4],
            display: vec![[value; 4]; 4],
            exposure: Some(0.0),
            report: Report {
                counters: counters.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect(),
                ..Report::default()
            },
        };
        let both = side_by_side(
            rendering(1, &[("scene/draws", 5), ("rays", 7)]),
            rendering(2, &[("scene/draws", 5), ("rays", 8)]),
        );
        assert_eq!((both.width, both.height), (4, 2));
        assert_eq!(both.display.iter().map(|p| p[0]).collect::<Vec<_>>(), [1, 1, 2, 2, 1, 1, 2, 2]);
        assert_eq!(both.radiance.len(), 8);
        assert_eq!(both.report.counters, [("scene/draws".to_owned(), 5), ("rays".to_owned(), 15)]);
    }
}
