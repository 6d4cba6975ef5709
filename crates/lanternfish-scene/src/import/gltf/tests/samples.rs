//! Tests with real scenes, if they are available: `LANTERNFISH_SHARED` names the folder that holds `assets/`.

use std::path::PathBuf;

use crate::{Camera, LightKind, Scene, import::load};

/// A validated scene from the folder of assets; `None`, with a message, if it is missing.
fn sample(name: &str) -> Option<Scene> {
    let path = asset(name, "scene samples")?;
    let scene = load(path.to_str().expect("UTF-8")).unwrap_or_else(|error| panic!("{error}"));
    scene.validate().unwrap_or_else(|fault| panic!("{}: {fault}", path.display()));
    Some(scene)
}

/// A path below the folder of assets; `None`, with a message that names `test`, if it is missing.
pub fn asset(name: &str, test: &str) -> Option<PathBuf> {
    let beside_the_workspace = || concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared").into();
    let folder = std::env::var_os("LANTERNFISH_SHARED").map_or_else(beside_the_workspace, PathBuf::from);
    let path = folder.join("assets").join(name);
    if !path.exists() {
        left_out(&format!("LEFT OUT (shared): {test}: no {}", path.display()));
        return None;
    }
    Some(path)
}

#[test]
fn sponza_is_complete() {
    let Some(scene) = sample("sponza/Sponza.glb") else { return };
    assert_eq!(scene.triangle_counts(), (262_267, 262_267));
    assert_eq!((scene.materials.len(), scene.images.len(), scene.name.as_str()), (25, 69, "Sponza"));
    let vertex_count: usize = scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|p| p.positions.len()).sum();
    assert!(vertex_count < 262_267, "{vertex_count} vertices: generated tangents have unshared them");
}

#[test]
fn candela_city_is_complete() {
    let Some(scene) = sample("candela-city/candela_city.glb") else { return };
    assert_eq!(scene.triangle_counts().1, 444_434);
    let count = |kind: LightKind| scene.lights.iter().filter(|light| light.kind == kind).count();
    assert_eq!((count(LightKind::Point), count(LightKind::Directional), scene.lights.len()), (94, 1, 95));
    assert!(scene.meshes.len() < scene.instances.len());
    assert!(!scene.cameras.is_empty());
}

#[test]
#[ignore = "full"]
fn bistro_is_complete() {
    let Some(scene) = sample("bistro/bistro-exterior.glb") else { return };
    assert_eq!((scene.triangle_counts(), scene.materials.len()), ((1_593_530, 1_813_746), 82));
    let count = |kind: fn(&LightKind) -> bool| scene.lights.iter().filter(|light| kind(&light.kind)).count();
    assert_eq!(count(|kind| matches!(kind, LightKind::Point)), 38);
    assert_eq!(count(|kind| matches!(kind, LightKind::Spot { .. })), 33);
    assert_eq!(count(|kind| matches!(kind, LightKind::Directional)), 1);
}

#[test]
fn cornell_box_is_complete() {
    let Some(scene) = sample("cornell/CornellBox-Original.glb") else { return };
    assert_eq!((scene.triangle_counts(), scene.materials.len()), ((36, 36), 8));
    let emitters = scene.materials.iter().filter(|material| material.emissive.max_element() > 1.0).count();
    assert_eq!(emitters, 1);
}

/// Writes the line to stderr and to the file that `LANTERNFISH_LEFT_OUT` names.
fn left_out(line: &str) {
    use std::io::Write;
    eprintln!("{line}");
    let Some(file) = std::env::var_os("LANTERNFISH_LEFT_OUT") else { return };
    let mut file = std::fs::OpenOptions::new().append(true).create(true).open(file).expect("it can be written");
    writeln!(file, "{line}").expect("it can be written");
}

#[test]
fn overview_cameras_are_inside_interiors_and_outside_objects() {
    let samples = [
        ("sponza/Sponza.glb", true),
        ("cornell/CornellBox-Blocks.glb", false),
        ("conformance/CesiumMilkTruck.glb", false),
        ("conformance/DamagedHelmet.glb", false),
        ("conformance/OrientationTest.glb", false),
        ("conformance/BoxTextured/BoxTextured.gltf", false),
        ("stanford/dragon.glb", false),
    ];
    for (file, is_interior) in samples {
        let Some(scene) = sample(file) else { continue };
        let (camera, is_inside) = Camera::overview(&scene, None, 16.0 / 9.0);
        assert_eq!(is_inside, is_interior, "{file}: {camera:?}");
    }
}
