//! Tests of the extensions of materials and textures.

use glam::{Vec3, Vec4};
use serde_json::{Value, json};

use super::File;
use super::materials::{encode, material, with_material};
use super::warnings::warnings;
use crate::{AlphaMode, LayerTextures, Material, TextureRef};

#[test]
fn refraction_and_specular_are_read_and_clamped() {
    let default = Material::default();
    assert_eq!((default.ior, default.specular, default.specular_color), (1.5, 1.0, Vec3::ONE));
    for (stored, read) in [(1.33, 1.33), (0.0, 0.0), (0.7, 1.0), (-2.0, 1.0), (2.42, 2.42), (1e300, f32::MAX)] {
        assert_eq!(material(json!({ "extensions": { "KHR_materials_ior": { "ior": stored } } })).ior, read);
    }
    let extension = json!({ "specularFactor": 0.25, "specularColorFactor": [2, 0.5, -1] });
    let read = material(json!({ "extensions": { "KHR_materials_specular": extension, "KHR_materials_ior": {} } }));
    assert_eq!((read.ior, read.specular, read.specular_color), (1.5, 0.25, Vec3::new(2.0, 0.5, 0.0)));
}

#[test]
fn transmissive_materials_are_transparent_and_keep_their_alpha() {
    let read = |mut source: Value, factor: f32| {
        source["extensions"] = json!({ "KHR_materials_transmission": { "transmissionFactor": factor } });
        let file = with_material(source);
        assert!(warnings(&file).is_empty(), "{:?}", warnings(&file));
        file.scene().materials.remove(0)
    };
    let glass = json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": [1, 0, 0, 0.5] } });
    for factor in [0.0, 0.5, 1.0] {
        for (name, alpha_mode) in
            [("OPAQUE", AlphaMode::Opaque), ("MASK", AlphaMode::Mask { cutoff: 0.5 }), ("BLEND", AlphaMode::Blend)]
        {
            let mut source = glass.clone();
            source["alphaMode"] = name.into();
            let material = read(source, factor);
            assert_eq!((material.alpha_mode, material.transmission), (alpha_mode, factor));
            assert_eq!(material.is_transparent(), factor > 0.0 || name == "BLEND");
            assert_eq!(material.base_color, Vec4::new(1.0, 0.0, 0.0, 0.5));
        }
    }
    assert_eq!(read(json!({}), 1.0).transmission, 0.0, "metal transmits nothing");
}

#[test]
fn volumes_are_read_and_clamped() {
    let default = Material::default();
    let parts = |m: &Material| (m.thickness, m.attenuation_color, m.attenuation_distance);
    assert_eq!(parts(&default), (0.0, Vec3::ONE, f32::INFINITY));
    let read = |volume: Value| parts(&material(json!({ "extensions": { "KHR_materials_volume": volume } })));
    let jade = json!({ "thicknessFactor": 0.25, "attenuationColor": [0.1, 0.5, 0.2], "attenuationDistance": 0.5 });
    assert_eq!(read(jade), (0.25, Vec3::new(0.1, 0.5, 0.2), 0.5));
    assert_eq!(read(json!({ "thicknessFactor": 2 })), (2.0, Vec3::ONE, f32::INFINITY));
    // Without thickness there is no volume.
    assert_eq!(read(json!({ "attenuationColor": [0, 0, 0], "attenuationDistance": 1 })), parts(&default));
    assert_eq!(read(json!({ "thicknessFactor": -1, "attenuationDistance": 1 })), parts(&default));
    let hostile = json!({ "thicknessFactor": 1e300, "attenuationColor": [-1, 2, 1e300], "attenuationDistance": -1 });
    assert_eq!(read(hostile), (f32::MAX, Vec3::new(0.0, 1.0, 1.0), f32::MIN_POSITIVE));
    let endless = json!({ "thicknessFactor": 1, "attenuationDistance": 1e300 });
    assert_eq!(read(endless), (1.0, Vec3::ONE, f32::INFINITY));
    let textured = json!({ "thicknessFactor": 1, "thicknessTexture": { "index": 0 } });
    let file = with_material(json!({ "extensions": { "KHR_materials_volume": textured } }));
    assert_eq!(warnings(&file), ["folder/test.glb: left out: textures of KHR_materials_volume (1)"]);
}

#[test]
fn dispersion_is_read() {
    let read = |dispersion: f64| {
        let extensions = json!({ "KHR_materials_dispersion": { "dispersion": dispersion } });
        let file = with_material(json!({ "extensions": extensions }));
        assert!(warnings(&file).is_empty());
        file.scene().materials.remove(0).dispersion
    };
    assert_eq!([1.5, -2.0, 1e300].map(read), [1.5, 0.0, f32::MAX]);
}

#[test]
fn extensions_without_effect_leave_nothing_out() {
    let file = with_material(json!({ "extensions": {
        "KHR_materials_clearcoat": {}, "KHR_materials_sheen": {}, "KHR_materials_volume": {},
        "KHR_materials_iridescence": {}, "KHR_materials_anisotropy": {}, "KHR_materials_dispersion": {},
        "KHR_materials_ior": {}, "KHR_materials_variants": {},
    } }));
    assert!(warnings(&file).is_empty(), "without effect there is nothing to leave out");
    let mut file = File::with_triangle();
    file.json["asset"]["minVersion"] = json!("2.1");
    assert_eq!(warnings(&file), ["folder/test.glb: requires glTF 2.1; read as 2.0"]);
}

#[test]
fn specular_and_glossiness_are_converted() {
    let extension = json!({
        "diffuseFactor": [0.5, 1, 0.25, 0.75], "specularFactor": [0.04, 0.2, 0.08], "glossinessFactor": 0.75,
    });
    let mut file = with_material(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, 1], "roughnessFactor": 0.5 },
        "extensions": { "KHR_materials_pbrSpecularGlossiness": extension },
    }));
    let read = file.scene().materials.remove(0);
    assert_eq!((read.metallic, read.perceptual_roughness), (0.0, 0.25));
    assert!(read.base_color.abs_diff_eq(Vec4::new(0.4, 0.8, 0.2, 0.75), 1e-6), "{}", read.base_color);
    assert!(read.specular_color.abs_diff_eq(Vec3::new(1.0, 5.0, 2.0), 1e-5), "{}", read.specular_color);
    // Not required: the core is the author's own conversion.
    file.json["extensionsRequired"] = json!([]);
    let read = file.scene().materials.remove(0);
    assert_eq!((read.base_color, read.specular_color), (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec3::ONE));
}

#[test]
fn textures_of_specular_and_glossiness_are_converted() {
    let mut file = textured(json!([{ "source": 0 }, { "source": 1 }]));
    let extension = |transform: Value| {
        json!({ "KHR_materials_pbrSpecularGlossiness": {
            "diffuseFactor": [1, 1, 1, 0.5], "diffuseTexture": { "index": 0 },
            "specularGlossinessTexture": { "index": 1, "extensions": { "KHR_texture_transform": transform } },
        } })
    };
    // Green reflects, as a metal; of alpha 128 is half as glossy.
    file.json["materials"][0] = json!({ "extensions": extension(json!({})) });
    assert!(warnings(&file).is_empty(), "{:?}", warnings(&file));
    let scene = file.scene();
    let read = &scene.materials[0];
    let texel =
        |texture: Option<TextureRef>| scene.images[scene.textures[texture.unwrap().texture].image].rgba[..4].to_vec();
    assert_eq!(texel(read.metallic_roughness_texture)[1..3], [127, 255]);
    assert_eq!(texel(read.base_color_texture), [0, 255, 0, 255]);
    assert_eq!((read.base_color.w, read.metallic, read.perceptual_roughness), (0.5, 1.0, 1.0));
    // Textures in different places are not combined.
    file.json["materials"][0] = json!({ "extensions": extension(json!({ "scale": [2, 2] })) });
    assert!(warnings(&file)[0].contains("placed otherwise"), "{:?}", warnings(&file));
    assert_eq!(file.scene().materials[0].perceptual_roughness, 0.5);
}

#[test]
fn textures_of_coats_specular_layers_and_transmission_are_read() {
    let texture = |index: u32| json!({ "index": index });
    let mut file = textured(json!([{ "source": 0 }, { "source": 1 }]));
    file.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 0.into();
    file.json["materials"][0]["extensions"] = json!({
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 0.75, "clearcoatTexture": texture(0),
            "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": texture(1),
            "clearcoatNormalTexture": { "index": 1, "scale": 0.5 },
        },
        "KHR_materials_specular": { "specularTexture": texture(1), "specularColorTexture": texture(0) },
        "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": texture(1) },
    });
    assert!(warnings(&file).is_empty(), "{:?}", warnings(&file));
    let read = file.scene().materials.remove(0);
    assert_eq!((read.clearcoat, read.clearcoat_roughness, read.transmission), (0.75, 0.25, 0.5));
    let index = |reference: Option<TextureRef>| reference.expect("it is read").texture;
    let (first, second) = (index(read.clearcoat_texture), index(read.clearcoat_roughness_texture));
    assert_eq!(first, index(read.base_color_texture));
    assert_ne!(first, second);
    assert_eq!(index(read.specular_color_texture), first);
    assert_eq!((index(read.clearcoat_normal_texture), read.clearcoat_normal_scale), (second, 0.5));
    assert_eq!((index(read.specular_texture), index(read.transmission_texture)), (second, second));
    // Without a clearcoat its textures are not read; values out of range are clamped.
    let coat = |coat: Value| {
        let read = material(json!({ "extensions": { "KHR_materials_clearcoat": coat } }));
        (read.clearcoat, read.clearcoat_roughness)
    };
    assert_eq!(coat(json!({})), (0.0, 0.0));
    assert_eq!(coat(json!({ "clearcoatFactor": 2, "clearcoatRoughnessFactor": -1 })), (1.0, 0.0));
}

#[test]
fn diffuse_transmission_is_read_and_clamped() {
    let texture = |index: u32| json!({ "index": index });
    let mut file = textured(json!([{ "source": 0 }, { "source": 1 }]));
    file.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 0.into();
    file.json["materials"][0]["extensions"] = json!({ "KHR_materials_diffuse_transmission": {
        "diffuseTransmissionFactor": 3, "diffuseTransmissionTexture": texture(0),
        "diffuseTransmissionColorFactor": [0.5, 2, -1], "diffuseTransmissionColorTexture": texture(1),
    } });
    file.json["extensionsRequired"] = json!(["KHR_materials_diffuse_transmission"]);
    assert!(warnings(&file).is_empty(), "{:?}", warnings(&file));
    let read = file.scene().materials.remove(0);
    assert_eq!((read.diffuse_transmission, read.diffuse_transmission_color), (1.0, Vec3::new(0.5, 1.0, 0.0)));
    assert!(read.scatters_from_behind() && !read.is_transparent());
    let index = |reference: Option<TextureRef>| reference.expect("it is read").texture;
    assert_eq!(index(read.diffuse_transmission_texture), index(read.base_color_texture));
    assert_ne!(index(read.diffuse_transmission_color_texture), index(read.base_color_texture));
    // Behind a transparent surface the image is seen; what it scatters through is left out, with a note.
    file.json["materials"][0]["alphaMode"] = "BLEND".into();
    assert!(warnings(&file)[0].contains("diffuse transmission"), "{:?}", warnings(&file));
    assert!(!file.scene().materials.remove(0).scatters_from_behind());
}

#[test]
fn textures_of_sheen_grain_and_film_are_read_where_a_coat_leaves_a_place() {
    let texture = |index: u32| json!({ "index": index });
    let mut file = textured(json!([{ "source": 0 }, { "source": 1 }]));
    let layers = json!({
        "KHR_materials_sheen": {
            "sheenColorFactor": [0.5, 0.25, 1], "sheenColorTexture": texture(1),
            "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": texture(1),
        },
        "KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyTexture": { "index": 0, "texCoord": 1 } },
        "KHR_materials_iridescence": {
            "iridescenceFactor": 0.75, "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 600,
            "iridescenceTexture": texture(1), "iridescenceThicknessTexture": texture(1),
        },
    });
    file.json["materials"][0]["extensions"] = layers.clone();
    assert!(warnings(&file).is_empty(), "{:?}", warnings(&file));
    let scene = file.scene();
    let read = &scene.materials[0];
    assert_eq!((read.sheen_color, read.sheen_roughness, read.anisotropy), (Vec3::new(0.5, 0.25, 1.0), 0.5, 0.5));
    assert_eq!((read.iridescence_thickness_minimum, read.iridescence_thickness), (200.0, 600.0));
    let image = |texture: Option<TextureRef>| scene.images[scene.textures[texture.unwrap().texture].image].rgba[0];
    let of = read.layer_textures();
    let images = [of.sheen_color, of.sheen_roughness, of.anisotropy, of.iridescence, of.iridescence_thickness];
    assert_eq!((images.map(image), read.tangent_uv_set()), ([0, 0, 255, 0, 0], Some(1)));
    // A coat's textures have the places of sheen's and of the film's.
    file.json["materials"][0]["extensions"]["KHR_materials_clearcoat"] =
        json!({ "clearcoatFactor": 1, "clearcoatTexture": texture(1), "clearcoatNormalTexture": texture(1) });
    assert!(warnings(&file)[0].contains("whose means are used"), "{:?}", warnings(&file));
    let read = file.scene().materials.remove(0);
    let nothing = LayerTextures::default();
    assert_eq!(read.layer_textures(), LayerTextures { anisotropy: read.anisotropy_texture, ..nothing });
    assert!(read.anisotropy_texture.is_some());
    assert_eq!((read.sheen_color, read.iridescence), (Vec3::new(0.0, 0.25, 0.0), 0.0));
}

#[test]
fn sheen_grain_and_film_have_the_means_of_textures_without_a_place() {
    let mut file = textured(json!([{ "source": 0 }, { "source": 1 }]));
    let extensions = |texture: Value| {
        json!({
            "KHR_materials_sheen": {
                "sheenColorFactor": [0.5, 0.25, 2], "sheenColorTexture": texture,
                "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": texture,
            },
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyRotation": 0.25 },
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 1, "clearcoatTexture": { "index": 0 },
                "clearcoatRoughnessTexture": { "index": 0 }, "clearcoatNormalTexture": { "index": 0 },
            },
            "KHR_materials_iridescence": {
                "iridescenceFactor": 0.75, "iridescenceIor": 1.8, "iridescenceThicknessMinimum": 200,
                "iridescenceThicknessMaximum": 600, "iridescenceThicknessTexture": texture,
            },
        })
    };
    // Texture 1 is (0, 255, 0, 128).
    file.json["materials"][0]["extensions"] = extensions(json!({ "index": 1 }));
    let scene = file.scene();
    let read = &scene.materials[0];
    assert_eq!((read.sheen_color, read.anisotropy, read.anisotropy_rotation), (Vec3::new(0.0, 0.25, 0.0), 0.5, 0.25));
    assert!((read.sheen_roughness - 0.5 * 128.0 / 255.0).abs() < 1e-6, "{}", read.sheen_roughness);
    assert_eq!((read.iridescence, read.iridescence_ior, read.iridescence_thickness), (0.75, 1.8, 600.0));
    assert_eq!(scene.images.iter().map(|image| image.rgba.len()).collect::<Vec<_>>(), [16, 4], "only the mean is kept");
    // A red texture: the thickness is the least one. A grain towards (1, -1) of strength 0.
    file.json["materials"][0]["extensions"] = extensions(json!({ "index": 0 }));
    file.json["materials"][0]["extensions"]["KHR_materials_anisotropy"]["anisotropyTexture"] = json!({ "index": 0 });
    let read = file.scene().materials.remove(0);
    assert_eq!((read.sheen_color, read.sheen_roughness), (Vec3::new(0.5, 0.0, 0.0), 0.5));
    assert_eq!((read.iridescence_thickness, read.anisotropy), (200.0, 0.0));
    // Without textures: the greatest thickness. Values out of range are clamped.
    let read = material(json!({ "extensions": {
        "KHR_materials_iridescence": { "iridescenceFactor": 3, "iridescenceIor": 0.5, "iridescenceThicknessMaximum": -1 },
        "KHR_materials_anisotropy": { "anisotropyStrength": 1e300, "anisotropyRotation": 1e300 },
    } }));
    assert_eq!((read.iridescence, read.iridescence_ior, read.iridescence_thickness), (1.0, 1.0, 0.0));
    assert_eq!((read.anisotropy, read.anisotropy_rotation), (1.0, 0.0));
    assert_eq!(material(json!({ "extensions": { "KHR_materials_iridescence": {} } })), material(json!({})));
}

/// A triangle whose base colour is texture 0, over these textures of two images: (255, 0, 0, 255) and (0, 255, 0, 128).
fn textured(textures: Value) -> File {
    let mut file = with_material(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    file.json["images"] = json!([]);
    for (format, color) in [(image::ImageFormat::Png, [255, 0, 0, 255]), (image::ImageFormat::WebP, [0, 255, 0, 128])] {
        let view = file.view(&encode(format, image::RgbaImage::from_pixel(2, 2, image::Rgba(color)).into()));
        file.push("images", json!({ "bufferView": view }));
    }
    file.json["textures"] = textures;
    file
}

#[test]
fn webp_is_preferred_to_its_fallback() {
    for source in [json!({}), json!({ "source": 0 })] {
        let mut texture = source;
        texture["extensions"] = json!({ "EXT_texture_webp": { "source": 1 } });
        let mut file = textured(json!([texture]));
        file.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
        let scene = file.scene();
        assert_eq!((scene.images.len(), &scene.images[0].rgba[..4]), (1, &[0, 255, 0, 128][..]));
    }
}
