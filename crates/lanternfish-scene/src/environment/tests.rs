use std::path::PathBuf;

use glam::{Quat, Vec3};

use super::*;

/// An environment whose pixels all differ.
fn numbered(width: usize, height: usize) -> Environment {
    let pixels = (0..width * height).map(|i| Vec3::new(i as f32, (i % width) as f32, (i / width) as f32)).collect();
    Environment { width, height, pixels, rotation: 0.0 }
}

/// Directions over the full sphere, including the six axes.
fn directions() -> impl Iterator<Item = Vec3> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    // A Fibonacci spiral.
    let spiral = (0..1000).map(|i| {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / 1000.0;
        let (sin, cos) = (i as f32 * 2.399_963_2).sin_cos();
        let radius = (1.0 - y * y).sqrt();
        Vec3::new(radius * cos, y, radius * sin)
    });
    axes.chain(spiral)
}

#[test]
fn axes_map_to_the_documented_uv() {
    let environment = numbered(8, 4);
    for (direction, u, v) in [
        (Vec3::NEG_Z, 0.5, 0.5),
        (Vec3::X, 0.75, 0.5),
        (Vec3::NEG_X, 0.25, 0.5),
        (Vec3::new(0.0, 1.0, -1.0).normalize(), 0.5, 0.25),
        (Vec3::new(1.0, -1.0, -1.0).normalize(), 0.625, 0.5 + (1f32 / 3.0).sqrt().asin() / PI),
    ] {
        let (actual_u, actual_v) = environment.uv(direction);
        assert!((actual_u - u).abs() < 1e-6 && (actual_v - v).abs() < 1e-6, "{direction}: {actual_u}, {actual_v}");
    }
    assert_eq!((environment.uv(Vec3::Y).1, environment.uv(Vec3::NEG_Y).1), (0.0, 1.0));
    // The seam is at +z.
    let (u, _) = environment.uv(Vec3::Z);
    assert!(u.min(1.0 - u) < 1e-6, "{u}");
}

#[test]
fn rotation_rotates_radiance() {
    let still = numbered(64, 32);
    for angle in [0.3, -2.0, 7.0] {
        let rotated = Environment { rotation: angle, ..still.clone() };
        // At the poles all columns meet.
        for direction in directions().filter(|direction| direction.y.abs() < 1.0) {
            let (before, after) =
                (still.radiance(direction), rotated.radiance(Quat::from_rotation_y(angle) * direction));
            let difference = (before - after).abs();
            // The seam falls from 63 to 0 within one of 64 pixels, which scales a rounding error of u by 64 × 63.
            assert!(difference.max_element() < 4096.0 * 4e-7 * 64.0, "{angle}, {direction}: {before} {after}");
        }
    }
    // Counter-clockwise seen from above: the centre of the image moves to the left (−x).
    let quarter = Environment { rotation: PI / 2.0, ..still };
    assert!((quarter.uv(Vec3::NEG_X).0 - 0.5).abs() < 1e-6);
}

#[test]
fn direction_and_uv_are_inverses() {
    for rotation in [0.0, 1.0, -4.0] {
        let environment = Environment { rotation, ..numbered(2, 1) };
        for direction in directions() {
            let (u, v) = environment.uv(direction);
            assert!((0.0..1.0).contains(&u) && (0.0..=1.0).contains(&v), "{direction}: {u}, {v}");
            let back = environment.direction(u, v);
            assert!((back - direction).length() < 2e-6, "{direction} became {back}");
            assert!((back.length() - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn radiance_is_exact_at_centres_and_bilinear_between() {
    let environment = numbered(8, 4);
    for i in 0..32 {
        let (u, v) = ((i % 8) as f32 / 8.0 + 1.0 / 16.0, (i / 8) as f32 / 4.0 + 1.0 / 8.0);
        let radiance = environment.radiance(environment.direction(u, v));
        assert!((radiance - environment.pixels[i]).abs().max_element() < 1e-4, "{i}: {radiance}");
    }
    let at = |u, v| environment.radiance(environment.direction(u, v));
    // Between the pixels 10, 11, 18 and 19; across the seam, 15 and 8; beyond the last row, 28 and 29.
    for (u, v, expected) in [(0.375, 0.5, 14.5), (0.0, 0.375, 11.5), (0.625, 0.999, 28.5), (0.625, 0.001, 4.5)] {
        assert!((at(u, v).x - expected).abs() < 1e-3, "{u}, {v}: {}", at(u, v));
    }
    assert_eq!(numbered(1, 1).radiance(Vec3::Z), Vec3::ZERO);
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    }

    fn fault(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        Environment::load(&self.file(name, bytes)).expect_err(name).to_string()
    }
}

/// A Radiance file without run-length encoding: RGB = mantissas * 2^(exponent - 136).
fn radiance_file(header: &str, pixels: &[[u8; 4]]) -> Vec<u8> {
    [header.as_bytes(), pixels.as_flattened()].concat()
}

fn exr_file(width: usize, height: usize, pixel: impl Fn(usize) -> [f32; 3] + Sync) -> Vec<u8> {
    use exr::prelude::*;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = pixel(at.y() * width + at.x());
        (r, g, b)
    });
    Image::from_channels((width, height), channels).write().to_buffered(&mut bytes).expect("encoded");
    bytes.into_inner()
}

#[test]
fn radiance_files_are_read() {
    let folder = Folder::new();
    let pixels = [[128, 64, 0, 129], [255, 255, 255, 137], [0, 0, 0, 0], [1, 2, 3, 136]];
    for signature in ["#?RADIANCE", "#?RGBE"] {
        let header = format!("{signature}\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n");
        let environment = Environment::load(&folder.file("a.hdr", radiance_file(&header, &pixels))).expect(signature);
        assert_eq!((environment.width, environment.height, environment.rotation), (2, 2, 0.0));
        let expected = [Vec3::new(1.0, 0.5, 0.0), Vec3::splat(510.0), Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)];
        assert_eq!(environment.pixels, expected);
        environment.validate().expect("sound");
    }
    // Run-length encoded: each of the four components is a run of five bytes, then three literal ones.
    let row: Vec<u8> =
        [[128u8; 2], [64; 2], [0; 2], [129; 2]].iter().flat_map(|c| [133, c[0], 3, c[1], c[1], c[1]]).collect();
    let bytes = [b"#?RADIANCE\n\n-Y 1 +X 8\n\x02\x02\x00\x08", &row[..]].concat();
    let environment = Environment::load(&folder.file("A.HDR", bytes)).expect("run lengths");
    assert_eq!(environment.pixels, [Vec3::new(1.0, 0.5, 0.0); 8]);
}

#[test]
fn exr_files_are_read_negative_values_become_zero_and_others_that_are_no_light_are_refused() {
    let folder = Folder::new();
    let pixel = |i: usize| [i as f32 * 0.125, 1e6, if i == 3 { -0.5 } else { 2.0 }];
    let environment = Environment::load(&folder.file("a.exr", exr_file(7, 5, pixel))).expect("read");
    assert_eq!((environment.width, environment.height), (7, 5));
    for (i, actual) in environment.pixels.iter().enumerate() {
        assert_eq!(*actual, Vec3::from(pixel(i)).max(Vec3::ZERO), "{i}");
    }
    // Infinite pixels, and those that are not a number, are counted.
    let pixel =
        |i: usize| [1.0, if i.is_multiple_of(4) { f32::NAN } else { 0.0 }, if i == 1 { f32::INFINITY } else { 0.0 }];
    let fault = folder.fault("sun.exr", exr_file(6, 2, pixel));
    assert!(fault.contains("sun.exr: 4 of 12 pixels are infinite or not a number"), "{fault}");
}

#[test]
fn broken_files_are_errors_that_name_the_file() {
    let folder = Folder::new();
    let error = Environment::load(&folder.0.path().join("missing.hdr")).expect_err("missing");
    assert!(matches!(error, SceneError::Io { .. }), "{error}");
    assert!(folder.fault("sky.png", "").contains("sky.png: not an environment (expected .hdr or .exr)"));
    let complete_hdr = radiance_file("#?RADIANCE\n\n-Y 2 +X 2\n", &[[1, 2, 3, 128]; 4]);
    let complete_exr = exr_file(20, 20, |i| [i as f32; 3]);
    for length in 0..complete_hdr.len() {
        let fault = folder.fault("cut.hdr", &complete_hdr[..length]);
        assert!(fault.contains("cut.hdr: "), "{fault}");
    }
    for length in (0..complete_exr.len()).step_by(7) {
        let fault = folder.fault("cut.exr", &complete_exr[..length]);
        assert!(fault.contains("cut.exr: not an OpenEXR image"), "{length}: {fault}");
    }
    for garbage in [&b"this is no image"[..], &[0; 1000], &[0xff; 1000], b"#?RADIANCE\n\n-Y two +X 2\n"] {
        assert!(folder.fault("a.hdr", garbage).contains("not a Radiance image"));
        assert!(folder.fault("a.exr", garbage).contains("not an OpenEXR image"));
    }
    let xyz = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    assert!(folder.fault("a.hdr", radiance_file(xyz, &[[1; 4]])).contains("32-bit_rle_xyze"));
}

#[test]
fn mutated_files_are_images_or_errors() {
    let folder = Folder::new();
    let row: Vec<u8> = (0..4).flat_map(|c| [136, c + 1, 4, 9, 8, 7, 6]).collect();
    let run_lengths = [b"#?RADIANCE\nEXPOSURE=1\n\n-Y 1 +X 12\n\x02\x02\x00\x0c", &row[..]].concat();
    let seeds = [
        ("a.hdr", radiance_file("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n", &[[1, 2, 3, 128]; 4])),
        ("b.hdr", run_lengths),
        ("c.exr", exr_file(20, 20, |i| [i as f32; 3])),
    ];
    let mut state = 1u64;
    let mut random = |below: usize| {
        // The high bits of Knuth's MMIX generator.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut images, mut errors) = (0, 0);
    for i in 0..1200 {
        let (name, seed) = &seeds[i % seeds.len()];
        let mut bytes = seed.clone();
        for _ in 0..=random(4) {
            let at = random(bytes.len());
            bytes[at] = [0, 1, 0x7f, 0x80, 0xff, random(256) as u8][random(6)];
        }
        match Environment::load(&folder.file(name, &bytes)) {
            Ok(environment) => {
                environment.validate().unwrap_or_else(|fault| panic!("{name}: {fault}"));
                images += 1;
            }
            Err(_) => errors += 1,
        }
    }
    assert!(images > 120 && errors > 120, "{images} images, {errors} errors: the mutations are too weak or too strong");
}

#[test]
fn sizes_beyond_the_data_allocate_nothing() {
    let folder = Folder::new();
    for (size, message) in [
        ("-Y 0 +X 8", "8 × 0 pixels: expected 1 to 16384 a side"),
        ("-Y 8 +X 0", "0 × 8 pixels"),
        ("-Y 8 +X 4000000000", "4000000000 × 8 pixels"),
        ("-Y 4294967295 +X 4294967295", "too large"),
        ("-Y 16384 +X 16384", "at most 134217728 in all"),
        ("-Y 8192 +X 16384", "8192 rows"),
        ("-Y 8 +X 16384", "not a Radiance image"),
    ] {
        let fault =
            folder.fault("huge.hdr", format!("#?RADIANCE\n\n{size}\n\x02\x02\x02\x02\x02\x02\x02\x02{:40}", ""));
        assert!(fault.contains(message), "{size}: {fault}");
    }
    // The maximum corner of the data window, in the header of an OpenEXR file.
    let sound = exr_file(3, 3, |_| [1.0; 3]);
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = sound.windows(name.len()).position(|w| w == name).expect("a data window") + name.len() + 8;
    for (side, message) in [(i32::MAX - 1, "expected 1 to 16384 a side"), (16_383, "in all"), (8000, "not an OpenEXR")]
    {
        let mut bytes = sound.clone();
        bytes[at..at + 4].copy_from_slice(&side.to_le_bytes());
        bytes[at + 4..at + 8].copy_from_slice(&side.to_le_bytes());
        let fault = folder.fault("huge.exr", bytes);
        assert!(fault.contains(message) || side > 16_383 && fault.contains("not an OpenEXR"), "{side}: {fault}");
    }
}
