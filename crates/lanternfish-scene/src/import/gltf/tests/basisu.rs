//! Basis Universal textures. `ktx2/` has one pattern of 16 × 16 pixels in both codecs, compressed with the reference encoder.

use serde_json::json;

use super::{File, damaged, materials::with_material, warnings::warnings};

const ETC1S: &[u8] = include_bytes!("ktx2/etc1s.ktx2");
/// Supercompressed with Zstandard.
const UASTC: &[u8] = include_bytes!("ktx2/uastc.ktx2");
const SIZE: usize = 16;

/// The pattern: red to the right, green down, squares in blue, and a translucent quarter.
fn pattern(x: usize, y: usize) -> [u8; 4] {
    let blue = if (x / 4 + y / 4).is_multiple_of(2) { 40 } else { 200 };
    [17 * x as u8, 17 * y as u8, blue, if x >= 8 && y >= 8 { 128 } else { 255 }]
}

/// A file whose material has this texture, and no other form of it.
fn file(bytes: &[u8]) -> File {
    let mut file = with_material(json!({ "emissiveTexture": { "index": 0 } }));
    let view = file.view(bytes);
    file.json["images"][0] = json!({ "bufferView": view, "mimeType": "image/ktx2" });
    file.json["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
    file.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    file
}

#[test]
fn basis_textures_are_the_image_within_their_loss() {
    // The least error of ETC1S: one colour and four luminances per block.
    for (name, bytes, most) in [("ETC1S", ETC1S, 12.0), ("UASTC", UASTC, 2.0)] {
        let file = file(bytes);
        assert!(warnings(&file).is_empty(), "{name}: {:?}", warnings(&file));
        let image = file.scene().images.remove(0);
        assert_eq!((image.width, image.height), (16, 16));
        let mut sum = 0.0;
        for (i, pixel) in image.rgba.as_chunks::<4>().0.iter().enumerate() {
            let expected = pattern(i % SIZE, i / SIZE);
            sum += pixel.iter().zip(expected).map(|(a, b)| f32::from(a.abs_diff(b))).sum::<f32>();
        }
        let mean = sum / (4 * SIZE * SIZE) as f32;
        println!("{name}: off by {mean} of 255");
        assert!(mean < most, "{name}: off by {mean} of 255");
    }
}

#[test]
fn the_extension_is_preferred_to_the_fallback() {
    let mut file = file(UASTC);
    file.json["textures"][0]["source"] = json!(7);
    assert_eq!(file.scene().images[0].width, 16);
}

/// Damaged textures are left out, and never a panic.
#[test]
fn damaged_basis_textures_do_not_panic() {
    for (name, bytes) in [("ETC1S", ETC1S), ("UASTC", UASTC)] {
        let mut refused = 0;
        for i in 0..1000usize {
            let damaged = damaged(bytes, i, 12..80);
            let file = file(&damaged);
            match file.load() {
                Ok(scene) => refused += usize::from(scene.materials[0].emissive_texture.is_none()),
                Err(error) => panic!("{name}, {i}: {error}"),
            }
        }
        println!("{name}: {refused} of 1000 were left out");
        assert!(refused > 300, "{name}: {refused}");
    }
}
