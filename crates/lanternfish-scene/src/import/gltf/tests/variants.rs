//! `KHR_materials_variants`: the materials of a variant.

use serde_json::json;

use super::{File, assert_contains, load_with_options};
use crate::{LoadOptions, Scene, SceneError, import::load_with};

/// Two triangles, whose default materials are `plain` and the format's default one. Variants: `red` has a material for both,
/// `1` for the first one only.
fn file() -> File {
    let mut file = File::with_triangle();
    for name in ["plain", "scarlet", "green"] {
        file.push("materials", json!({ "name": name }));
    }
    let mapped = |material: usize, variants: &[usize]| json!({ "material": material, "variants": variants });
    let extension = |mappings| json!({ "KHR_materials_variants": { "mappings": mappings } });
    let mut first = file.json["meshes"][0]["primitives"][0].clone();
    let mut second = first.clone();
    first["material"] = json!(0);
    first["extensions"] = extension(json!([mapped(2, &[1]), mapped(1, &[0])]));
    second["extensions"] = extension(json!([mapped(1, &[0])]));
    file.json["meshes"][0]["primitives"] = json!([first, second]);
    file.json["extensions"] =
        json!({ "KHR_materials_variants": { "variants": [{ "name": "red" }, { "name": "1" }, { "name": "0" }] } });
    file.json["extensionsRequired"] = json!(["KHR_materials_variants"]);
    file
}

fn load(file: &File, variant: Option<&str>) -> Result<Scene, SceneError> {
    load_with_options(file, &LoadOptions { variant: variant.map(str::to_owned), ..LoadOptions::default() })
}

#[test]
fn primitives_have_the_materials_of_the_variant() {
    let file = file();
    for (variant, expected) in [
        (None, ["plain", ""]),
        (Some("red"), ["scarlet", "scarlet"]),
        (Some("1"), ["green", ""]),
        // Names go before indices.
        (Some("0"), ["plain", ""]),
        (Some("2"), ["plain", ""]),
    ] {
        let scene = load(&file, variant).expect("there is one");
        assert!(scene.validate().is_ok());
        let primitives = scene.meshes[0].primitives.iter();
        let names: Vec<_> = primitives.map(|p| scene.materials[p.material].name.as_str()).collect();
        assert_eq!(names, expected, "{variant:?}");
        assert_eq!(scene.variants, ["red", "1", "0"]);
    }
}

#[test]
fn an_unknown_variant_is_an_error_that_lists_them() {
    let file = file();
    for variant in ["Red", "3", "-1", ""] {
        let error = load(&file, Some(variant)).expect_err("there is none").to_string();
        assert_contains(&error, &format!("file.glb: no variant {variant:?}; there are: 0 \"red\", 1 \"1\", 2 \"0\""));
    }
    let error = load(&File::with_triangle(), Some("red")).expect_err("there is none").to_string();
    assert_contains(&error, "no variant \"red\"; there are: none");
    for source in ["demo:cornell", "some.obj"] {
        let options = LoadOptions { variant: Some("red".to_owned()), ..LoadOptions::default() };
        let error = load_with(source, &options).expect_err("there is none").to_string();
        assert_contains(&error, &format!("{source}: no variant \"red\"; there are: none"));
    }
}

#[test]
fn a_material_out_of_range_is_an_error_of_its_variant_alone() {
    let mut file = file();
    file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][0]["material"] =
        json!(9);
    assert!(load(&file, None).is_ok() && load(&file, Some("red")).is_ok());
    let error = load(&file, Some("1")).expect_err("there is no such material").to_string();
    assert_contains(&error, "meshes[0].primitives[0]: materials[9] is referred to, but there are 3");
}
