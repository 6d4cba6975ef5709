//! Renders every file of the conformance suite that the Khronos validator accepts.

use std::{collections::BTreeMap, path::Path};

use lanternfish::{Renderer, Settings};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Light, SceneError};

/// Files of the suite, each with true if the validator finds no error.
fn verdicts(table: &Path) -> BTreeMap<String, bool> {
    let text = std::fs::read_to_string(table).expect("readable");
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().expect("a heading").split('\t').collect();
    let column = |name: &str| columns.iter().position(|c| *c == name).unwrap_or_else(|| panic!("{columns:?}"));
    let (file, errors) = (column("file"), column("errors"));
    lines
        .map(|line| {
            let fields: Vec<&str> = line.split('\t').collect();
            (fields[file].to_owned(), fields[errors] == "0")
        })
        .collect()
}

#[gpu_test]
fn gpu_conformance_files_render(gpu: &Gpu) {
    let test = "gpu_conformance_files_render";
    let Some(table) = testing::shared(test, "assets/conformance/VALIDATOR.tsv") else { return };
    let folder = table.parent().expect("it lies in the suite's folder");
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), Settings::direct_light()).unwrap();
    let (mut rendered, mut rejected, mut seen) = (0, 0, 0);
    let every = if testing::is_full() { 1 } else { 12 };
    for (file, accepted) in verdicts(&table).into_iter().step_by(every) {
        let path = folder.join(&file);
        let mut scene = match lanternfish_scene::load(path.to_str().expect("UTF-8")) {
            Ok(scene) => scene,
            Err(SceneError::Io { .. }) if !path.exists() => panic!("{file} is listed and not there"),
            Err(error) => {
                assert!(!accepted, "{file}: {error}");
                rejected += 1;
                continue;
            }
        };
        let camera = scene.cameras.first().cloned();
        let camera = camera.unwrap_or_else(|| Camera::framing(&scene.bounds(), 0.8, 4.0 / 3.0));
        scene.lights.push(Light::directional(glam::Vec3::new(0.2, -0.5, -1.0), glam::Vec3::splat(3.0)));
        let uploaded = renderer.upload(&scene).unwrap_or_else(|error| panic!("{file}: {error}"));
        let rendering = renderer.render(&uploaded, &camera, [32, 24]).unwrap_or_else(|error| panic!("{file}: {error}"));
        // A file with errors may contain anything; a valid one gives finite radiance.
        let finite = rendering.radiance.iter().flatten().all(|value| value.is_finite());
        assert!(finite || !accepted, "{file}: radiance is not finite");
        seen += usize::from(rendering.radiance.iter().any(|texel| texel[3] > 0.0));
        rendered += 1;
    }
    println!("{rendered} files rendered, {seen} of them show a surface, {rejected} rejected");
    assert!(rendered * every >= 200 && seen > rendered / 3, "the suite covers too little");
}
