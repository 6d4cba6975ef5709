//! Tests of materials, textures, samplers and images.

use std::io::Cursor;

use glam::{Mat3, Vec2, Vec3, Vec4};
use image::ImageFormat;
use serde_json::{Value, json};

use super::{File, assert_contains, warnings::warnings};
use crate::{AlphaMode, Filter, Material, MipFilter, Sampler, Wrap};

/// A triangle with this material, whose extensions the file requires, and texture 0 of a red pixel.
pub fn with_material(material: Value) -> File {
    let mut file = File::with_triangle();
    let names: Vec<_> = material["extensions"].as_object().into_iter().flat_map(|map| map.keys().cloned()).collect();
    (file.json["extensionsRequired"], file.json["extensionsUsed"]) = (json!(names), json!(names));
    file.push("materials", material);
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let view = file.view(&encode(ImageFormat::Png, image::RgbImage::from_pixel(1, 1, image::Rgb([255, 0, 0])).into()));
    file.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    file.push("textures", json!({ "source": 0 }));
    file
}

pub fn material(material: Value) -> Material {
    with_material(material).scene().materials.remove(0)
}

pub fn encode(format: ImageFormat, image: image::DynamicImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("an image is written to memory");
    bytes.into_inner()
}

#[test]
fn all_of_a_material_is_read() {
    let read = material(json!({
        "name": "paint", "doubleSided": true, "emissiveFactor": [1, 0.5, 0],
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 3, -0.4], "metallicFactor": 0.5, "roughnessFactor": 7,
            "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0, "texCoord": 1 },
        },
        "normalTexture": { "index": 0, "scale": 0.5 },
        "occlusionTexture": { "index": 0, "strength": 0.25, "texCoord": 1 },
        "emissiveTexture": { "index": 0 },
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 10 }, "KHR_materials_unlit": {},
        },
    }));
    assert_eq!(read.name, "paint");
    assert!(read.double_sided && read.unlit);
    assert_eq!(read.emissive, Vec3::new(10.0, 5.0, 0.0));
    assert_eq!(read.base_color, Vec4::new(0.1, 0.2, 1.0, 0.0));
    assert_eq!((read.metallic, read.perceptual_roughness), (0.5, 1.0));
    assert_eq!((read.normal_scale, read.occlusion_strength), (0.5, 0.25));
    let textures = [
        read.base_color_texture,
        read.metallic_roughness_texture,
        read.normal_texture,
        read.occlusion_texture,
        read.emissive_texture,
    ];
    assert_eq!(textures.map(|texture| texture.expect("all are given").uv_set), [0, 1, 0, 1, 0]);
}

#[test]
fn alpha_modes_are_read() {
    let mode = |value: Value| material(value).alpha_mode;
    assert_eq!(mode(json!({})), AlphaMode::Opaque);
    assert_eq!(mode(json!({ "alphaMode": "OPAQUE" })), AlphaMode::Opaque);
    assert_eq!(mode(json!({ "alphaMode": "MASK" })), AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(mode(json!({ "alphaMode": "MASK", "alphaCutoff": 0.1 })), AlphaMode::Mask { cutoff: 0.1 });
    assert_eq!(mode(json!({ "alphaMode": "BLEND" })), AlphaMode::Blend);
}

#[test]
fn the_default_material_is_appended_once() {
    let mut file = with_material(json!({ "name": "paint" }));
    let bare = json!({ "attributes": { "POSITION": 0 } });
    for _ in 0..2 {
        file.json["meshes"][0]["primitives"].as_array_mut().expect("primitives").insert(0, bare.clone());
    }
    let scene = file.scene();
    let used: Vec<_> = scene.meshes[0].primitives.iter().map(|primitive| primitive.material).collect();
    assert_eq!(used, [1, 1, 0]);
    assert_eq!(scene.materials.len(), 2);
    assert_eq!((scene.materials[0].name.as_str(), scene.materials[1].base_color), ("paint", Vec4::ONE));
}

#[test]
fn texture_transforms_follow_the_extension() {
    let transformed = |transform: Value| {
        let extensions = json!({ "KHR_texture_transform": transform });
        let texture = json!({ "index": 0, "texCoord": 0, "extensions": extensions });
        material(json!({ "emissiveTexture": texture })).emissive_texture.expect("it is given")
    };
    // The extension's example: the lower left quadrant (v points down), rotated by 90° clockwise.
    let example =
        transformed(json!({ "offset": [0, 1], "rotation": std::f32::consts::FRAC_PI_2, "scale": [0.5, 0.5] }));
    for (uv, expected) in [
        (Vec2::ZERO, Vec2::new(0.0, 1.0)),
        (Vec2::X, Vec2::new(0.0, 0.5)),
        (Vec2::Y, Vec2::new(0.5, 1.0)),
        (Vec2::ONE, Vec2::new(0.5, 0.5)),
    ] {
        let got = example.texture_from_uv.transform_point2(uv);
        assert!(got.abs_diff_eq(expected, 1e-6), "{uv}: {got}, not {expected}");
    }
    // Offset * rotation * scale as matrices, with v pointing down.
    let (angle, scale) = (0.3_f32, Vec2::new(2.0, 3.0));
    let general = transformed(json!({ "offset": [0.1, 0.2], "rotation": angle, "scale": [2, 3], "texCoord": 1 }));
    let (sin, cos) = angle.sin_cos();
    let rotation = Mat3::from_cols(Vec3::new(cos, -sin, 0.0), Vec3::new(sin, cos, 0.0), Vec3::Z);
    let expected = Mat3::from_translation(Vec2::new(0.1, 0.2)) * rotation * Mat3::from_scale(scale);
    assert!(Mat3::from(general.texture_from_uv).abs_diff_eq(expected, 1e-6), "{:?}", general.texture_from_uv);
    assert_eq!(general.uv_set, 1, "overridden");
    assert_eq!(transformed(json!({})).texture_from_uv, glam::Affine2::IDENTITY);
    let infinite = json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": [1e39, 2] } } });
    assert_contains(&with_material(json!({ "emissiveTexture": infinite })).fault(), "KHR_texture_transform");
}

#[test]
fn samplers_are_read_and_shared() {
    let mut file = with_material(json!({
        "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 1 }, "occlusionTexture": { "index": 2 },
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 3 } },
    }));
    let nearest = json!({ "magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33648 });
    file.push("samplers", nearest.clone());
    file.push("samplers", nearest);
    file.push("samplers", json!({}));
    for sampler in 0..3 {
        file.push("textures", json!({ "source": 0, "sampler": sampler }));
    }
    let scene = file.scene();
    assert_eq!((scene.images.len(), scene.textures.len(), scene.samplers.len()), (1, 2, 2));
    let expected = Sampler {
        mag: Filter::Nearest,
        min: Filter::Nearest,
        mip: MipFilter::None,
        wrap_u: Wrap::ClampToEdge,
        wrap_v: Wrap::MirroredRepeat,
    };
    let sampler = |texture: Option<crate::TextureRef>| {
        scene.samplers[scene.textures[texture.expect("it is given").texture].sampler]
    };
    assert_eq!(sampler(scene.materials[0].normal_texture), expected);
    assert_eq!(sampler(scene.materials[0].occlusion_texture), expected);
    assert_eq!(sampler(scene.materials[0].base_color_texture), Sampler::default());
    assert_eq!(sampler(scene.materials[0].emissive_texture), Sampler::default());
}

#[test]
fn filters_map_to_filter_and_mip_filter() {
    for (code, min, mip) in [
        (9729, Filter::Linear, MipFilter::None),
        (9984, Filter::Nearest, MipFilter::Nearest),
        (9985, Filter::Linear, MipFilter::Nearest),
        (9986, Filter::Nearest, MipFilter::Linear),
        (9987, Filter::Linear, MipFilter::Linear),
    ] {
        let mut file = with_material(json!({ "emissiveTexture": { "index": 0 } }));
        file.push("samplers", json!({ "minFilter": code }));
        file.json["textures"][0]["sampler"] = json!(0);
        let sampler = file.scene().samplers[0];
        assert_eq!((sampler.min, sampler.mip), (min, mip), "{code}");
    }
}

#[test]
fn unused_materials_and_textures_are_left_out() {
    let mut file = with_material(json!({ "name": "used", "emissiveTexture": { "index": 1 } }));
    file.push("materials", json!({ "name": "unused", "emissiveTexture": { "index": 0 } }));
    let view = file.view(&encode(ImageFormat::Png, image::RgbImage::new(3, 2).into()));
    file.json["images"][0] = json!({ "uri": "there is no such file.png" });
    file.push("images", json!({ "bufferView": view }));
    file.push("textures", json!({ "source": 1 }));
    let scene = file.scene();
    assert_eq!((scene.materials.len(), scene.textures.len(), scene.images.len()), (1, 1, 1));
    assert_eq!((scene.images[0].width, scene.images[0].height), (3, 2));
    assert_eq!(scene.materials[0].emissive_texture.expect("it is given").texture, 0);
}

#[test]
fn image_formats_are_detected_by_content_and_become_rgba8() {
    let gray16 = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(2, 1, image::Luma([0x8080]));
    let red = image::RgbImage::from_pixel(2, 1, image::Rgb([255, 0, 0]));
    for (bytes, expected) in [
        (encode(ImageFormat::Png, gray16.into()), [0x80, 0x80, 0x80, 255]),
        (encode(ImageFormat::Png, red.clone().into()), [255, 0, 0, 255]),
        (encode(ImageFormat::Jpeg, red.into()), [254, 0, 0, 255]),
    ] {
        let mut file = with_material(json!({ "emissiveTexture": { "index": 0 } }));
        let view = file.view(&bytes);
        file.json["images"][0] = json!({ "bufferView": view, "mimeType": "image/png", "name": "image" });
        let image = file.scene().images.remove(0);
        assert_eq!((image.width, image.height, image.name.as_str()), (2, 1, "image"));
        assert_eq!(image.rgba, expected.repeat(2));
    }
}

/// Surfaces lack the textures whose images cannot be read, and a warning names these.
#[test]
fn corrupt_and_missing_images_are_left_out() {
    let png = encode(ImageFormat::Png, image::RgbImage::new(8, 8).into());
    for (bytes, message) in
        [(&png[..40], ""), (&b"not an image"[..], "neither PNG, JPEG, WebP nor KTX2"), (&[][..], "neither")]
    {
        let mut file = with_material(json!({ "emissiveTexture": { "index": 0 } }));
        let view = file.view(bytes);
        file.json["images"][0] = json!({ "bufferView": view, "name": "image" });
        let scene = file.scene();
        assert_eq!((scene.materials[0].emissive_texture, scene.validate().is_ok()), (None, true));
        let [warning] = warnings(&file).try_into().expect("one warning");
        assert_contains(&warning, "surfaces lack a texture: images[0] (image): ");
        assert_contains(&warning, message);
    }
    let mut file = with_material(json!({ "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 1 } }));
    let view = file.view(&png);
    file.json["images"] = json!([{ "uri": "wood.png" }, { "bufferView": view }]);
    file.json["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
    let material = &file.scene().materials[0];
    assert!(material.emissive_texture.is_none() && material.normal_texture.is_some());
    let warnings = warnings(&file);
    assert!(warnings.len() == 1 && warnings[0].contains("wood.png"), "{warnings:?}");
}

#[test]
fn images_over_the_limit_are_left_out_before_they_are_decoded() {
    let mut png = encode(ImageFormat::Png, image::GrayImage::new(16_385, 1).into());
    let mut file = with_material(json!({ "emissiveTexture": { "index": 0 } }));
    let view = file.view(&png);
    file.json["images"][0] = json!({ "bufferView": view });
    assert_contains(&warnings(&file)[0], "images[0]: ");
    png = encode(ImageFormat::Png, image::GrayImage::new(16_384, 1).into());
    let view = file.view(&png);
    file.json["images"][0] = json!({ "bufferView": view });
    assert_eq!(file.scene().images[0].width, 16_384);
}

#[test]
fn textures_that_cannot_be_read_are_left_out_or_refused() {
    let mut file = with_material(json!({ "emissiveTexture": { "index": 0, "texCoord": 2 } }));
    assert_eq!(file.scene().materials[0].emissive_texture, None, "a third set of coordinates");
    file.json["materials"][0]["emissiveTexture"] = json!({ "index": 0 });
    file.json["textures"][0] = json!({ "extensions": { "MSFT_texture_dds": { "source": 0 } } });
    assert_eq!(file.scene().materials[0].emissive_texture, None, "only an extension's image");
    file.json["textures"][0] = json!({ "source": 1 });
    assert_contains(&file.fault(), "materials[0]: textures[0]: images[1]");
    file.json["textures"][0] = json!({ "source": 0, "sampler": 0 });
    assert_contains(&file.fault(), "materials[0]: textures[0]: samplers[0]");
    file.json["materials"][0]["emissiveTexture"] = json!({ "index": 1 });
    assert_contains(&file.fault(), "materials[0]: textures[1]");
}
