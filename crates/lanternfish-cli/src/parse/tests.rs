use lanternfish::techniques::ClusterShape;
use lanternfish_scene::LightKind;

use super::*;
use crate::paper::DirectionSet;

/// Every word of `bad` is refused, with a reason that has this part.
#[track_caller]
fn refused<T: std::fmt::Debug, E: ToString>(read: fn(&str) -> Result<T, E>, bad: &str, part: &str) {
    for bad in bad.split(' ') {
        let reason = read(bad).map_err(|error| error.to_string()).expect_err(bad);
        assert!(reason.contains(part), "{bad}: {reason}");
    }
}

#[test]
fn sizes() {
    assert_eq!(size("1280x720"), Ok(Size { width: 1280, height: 720 }));
    assert_eq!(size("1x16384"), Ok(Size { width: 1, height: 16384 }));
    refused(size, "0x720 1280x0 100000x100000 16385x1 99999999999999999999x1", "1 to 16384 pixels");
    refused(size, " 0 100000 1280 1280*720 x -1x5 +5x5 1x2x3 1.5x2", "1280x720, each side from 1 to 16384");
    assert!(size("1280 x 720").is_err());
}

#[test]
fn vectors_and_colours() {
    assert_eq!(position("1,-2.5,3e-1"), Ok(Vec3::new(1.0, -2.5, 0.3)));
    assert_eq!(position(" 1, 2, 3 "), Ok(Vec3::new(1.0, 2.0, 3.0)));
    refused(position, " 1,2 1,2,3,4 1,2,z 1,2,NaN inf,0,0 1;2;3 1,,3", "1,2.5,-3");
    assert!(position("-1e12,0,1e12").is_ok());
    assert!(position("0,-2e12,0").unwrap_err().contains("-1e12 to 1e12 m"));
    assert_eq!(color("0,0.5,2"), Ok(Vec3::new(0.0, 0.5, 2.0)));
    // Larger values than the half-precision maximum would be infinite in an EXR file.
    assert!(color("0,-0.5,2").is_err() && color("65504,0,0").is_ok() && color("65600,0,0").is_err());
}

#[test]
fn points() {
    let light = point_light("-1,2,3,100").unwrap();
    assert_eq!(light, Light::point(Vec3::new(-1.0, 2.0, 3.0), Vec3::splat(100.0)));
    let light = point_light("0,0,0,10,1,0.5,0,4").unwrap();
    assert_eq!((light.intensity, light.range), (Vec3::new(10.0, 5.0, 0.0), Some(4.0)));
    assert_eq!(point_light("0,0,0,10,1,0.5,0").unwrap().range, None);
    let bad = "0,0,0 0,0,0,1,1 0,0,0,1,1,1 0,0,0,-1 0,0,0,1,1,-1,1 0,0,0,1,1,1,1,0 1,1,1,1,1,1,1,1,1";
    refused(point_light, bad, "");
    // Each number is finite, but products and squares would overflow.
    refused(point_light, "0,0,0,1e38,1e38,1,1 1e30,0,0,1 0,0,0,1,1,1,1,1e30", "");
}

#[test]
fn suns() {
    let light = sun("0,-2,0,3,1,0.5,0").unwrap();
    assert_eq!((light.direction, light.intensity), (Vec3::NEG_Y, Vec3::new(3.0, 1.5, 0.0)));
    for long_or_short in ["0,-1e30,0,1", "0,-1e-30,0,1"] {
        assert_eq!(sun(long_or_short).unwrap().direction, Vec3::NEG_Y);
    }
    refused(sun, "0,0,0,1 0,-1,0 0,-1,0,-3 0,-1,0,1,1,1,1,1 0,-1,0,1e38,9,9,9", "");
}

#[test]
fn disks() {
    let light = disk("-1,2,3,0,-2,0,0.5,100").unwrap();
    assert_eq!(light, Light::disk(Vec3::new(-1.0, 2.0, 3.0), Vec3::NEG_Y, 0.5, Vec3::splat(100.0)));
    let light = disk("0,0,0,1,0,0,0.5,10,1,0.5,0,4").unwrap();
    assert_eq!((light.intensity, light.range), (Vec3::new(10.0, 5.0, 0.0), Some(4.0)));
    refused(disk, "0,0,0,0,-1,0,0.5 0,0,0,0,-1,0,0.5,1,1 0,0,0,0,-1,0,0,1 0,0,0,0,-1,0,-1,1 0,0,0,0,0,0,1,1", "");
    // Products of these numbers overflow or underflow.
    refused(disk, "0,0,0,0,-1,0,1e-30,1 0,0,0,0,-1,0,1e11,1e30 0,0,0,0,-1,0,2e12,1 0,0,0,0,-1,0,1,1,1,1,1,0", "");
}

#[test]
fn rectangles() {
    let shape = |text: &str| match rectangle(text).unwrap() {
        Light { kind: LightKind::Rectangle { half_width, half_height, right }, .. } => (half_width, half_height, right),
        other => panic!("{other:?}"),
    };
    assert_eq!(shape("0,2,0,0,-1,0,3,0.5,100"), (1.5, 0.25, Vec3::X));
    // On a wall its width is horizontal.
    let (_, _, right) = shape("0,2,0,1,-1,0,3,0.5,100");
    assert!(right.abs_diff_eq(Vec3::Z, 1e-6), "{right}");
    let light = rectangle("0,0,0,0,-1,0,1,2,10,1,0.5,0,4").unwrap();
    assert_eq!((light.intensity, light.range, light.area()), (Vec3::new(10.0, 5.0, 0.0), Some(4.0), Some(2.0)));
    let bad = "0,0,0,0,-1,0,1,2 0,0,0,0,-1,0,1,0,1 0,0,0,0,-1,0,0,1,1 0,0,0,0,0,0,1,1,1 0,0,0,0,-1,0,1,1,-1";
    refused(rectangle, bad, "");
}

#[test]
fn sets_of_lights() {
    let rain = |count, radius| Ok(LightSet::Rain { count, radius });
    assert_eq!(light_set("rain:1000"), rain(1000, None));
    assert_eq!(light_set("rain:5:0.25"), rain(5, Some(0.25)));
    assert_eq!(light_set("rain:2097152"), rain(2_097_152, None));
    let bounds = Bounds { min: Vec3::new(-9.0, 0.0, -4.0), max: Vec3::new(9.0, 9.0, 4.0) };
    let random = LightSet::Random { count: 10, radius: 1.5, seed: u64::MAX, bounds };
    assert_eq!(light_set("random:10:1.5:18446744073709551615:-9,0,-4,9,9,4"), Ok(random));
    let bad = "rain rain: rain:x rain:-1 rain:+1 rain:5:0 rain:5: rain:5:1:1 snow:5 random:5 random:5:1:1:0,0,0,1,1 \
               random:5:1:x:0,0,0,1,1,1 random:5:0:1:0,0,0,1,1,1 random:5:1:1:1,0,0,0,1,1";
    refused(light_set, bad, "");
    refused(light_set, "rain:5:1e30", "1e12");
    let bad = "rain:2097153 rain:4000000000 rain:99999999999999999999 random:2097153:1:1:0,0,0,1,1,1";
    refused(light_set, bad, "at most 2097152");
}

#[test]
fn cluster_shapes_survive_a_round_trip() {
    for text in ["persp:64", "ortho:4", "ortho:0.25", "displ:64:32"] {
        assert_eq!(text.parse::<ClusterShape>().unwrap().to_string(), text);
    }
    let bad = " persp persp:3 persp:1e9 ortho:0 ortho:-1 ortho:nan displ:64 displ:64:x cube:4";
    refused(str::parse::<ClusterShape>, bad, "");
}

#[test]
fn direction_sets_survive_a_round_trip() {
    for text in ["zonal:1", "zonal:169", "zonal:4096", "stacks:13x13", "stacks:16x256", "cube:1", "cube:36"] {
        assert_eq!(text.parse::<DirectionSet>().unwrap().to_string(), text);
    }
    assert_eq!("stacks:3x5".parse(), Ok(DirectionSet::StacksSlices { stacks: 3, slices: 5 }));
    let bad = " zonal zonal: zonal:-1 zonal:+1 zonal:x stacks:13 stacks:13x cube:2x2 ball:3";
    refused(str::parse::<DirectionSet>, bad, "zonal:169, stacks:13x13 or cube:5");
    let bad = "zonal:0 zonal:4097 zonal:99999999999 stacks:0x4 stacks:17x256 cube:0 cube:37 cube:99999999999";
    refused(str::parse::<DirectionSet>, bad, "1 to 4096");
    refused(str::parse::<DirectionSet>, "stacks:2x257", "at most 256");
}

#[test]
fn bytes_have_units() {
    assert_eq!(bytes("500M"), Ok(500_000_000));
    assert_eq!((bytes("4G"), bytes("0.5G"), bytes("1000k")), (Ok(4_000_000_000), Ok(500_000_000), Ok(1_000_000)));
    assert_eq!(bytes("2000000"), Ok(2_000_000));
    refused(bytes, " M 4 999999 -4G 4GB nan infG 1e30", "e.g. 500M or 4G");
}

#[test]
fn numbers_have_ranges() {
    assert!((fov_y("90").unwrap() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert!(fov_y("0").is_err() && fov_y("180").is_err() && fov_y("wide").is_err());
    assert!(rotation("-3600").is_ok() && rotation("3601").is_err() && rotation("inf").is_err());
    assert_eq!(exposure("-1.5"), Ok(-1.5));
    assert!(exposure("1000").is_err() && exposure("auto").is_err());
}
