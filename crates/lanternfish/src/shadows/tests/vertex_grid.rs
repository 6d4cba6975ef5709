//! Rasterizers snap vertices to a grid in the image, and a depth is that of the snapped triangle.

use lanternfish_gpu::{Engine, Gpu, ShaderTexts, testing};
use lanternfish_scene::generate::{demo, light_rain};

use crate::{
    Renderer, Settings,
    settings::Shadows,
    shaders::{SHADERS, edit},
    testing::{apart, moved},
};

/// A shader file with one piece of text replaced.
fn edited((module, from, to): (&str, &str, &str)) -> (String, String) {
    let (_, text) = *SHADERS.sources().iter().find(|(path, _)| *path == module).expect("it is a file of the library");
    assert_eq!(text.matches(from).count(), 1, "{module} has {from:?} once");
    (module.to_owned(), text.replace(from, to))
}

/// Pixels of the Cornell box in light rain, with its parts rotated, under shaders with these edits.
fn pixels(gpu: &Gpu, edits: &[(&str, &str, &str)]) -> Vec<[f32; 4]> {
    let engine = Engine::new(&gpu.device, &gpu.queue);
    edit(&engine, edits.iter().copied().map(edited).collect::<ShaderTexts>());
    let settings = Settings { shadows: Shadows::BVH, ..Settings::direct_light() };
    let mut renderer = Renderer::with_engine(&engine, settings).unwrap();
    let mut scene = moved(&apart(&demo("cornell").unwrap()), 7, 0.2);
    scene.lights = light_rain(&scene.bounds(), 2, None, 1, 0.0);
    let uploaded = renderer.upload(&scene).unwrap();
    renderer.render(&uploaded, &scene.cameras[0], 40, 40).unwrap().radiance
}

/// GPUs have 256 grid points a pixel along each axis; software renderers may have no grid.
#[test]
fn gpu_shadow_rays_start_off_surfaces_whose_vertices_were_moved() {
    let Some(gpu) = testing::gpu("gpu_shadow_rays_start_off_surfaces_whose_vertices_were_moved") else { return };
    let grid = (
        "gpu_scene/instance",
        "return view.clip_from_view * (view.view_from_world * vec4f(p_world, 1.0));",
        "let clip = view.clip_from_view * (view.view_from_world * vec4f(p_world, 1.0));
         let half = 128.0 * vec2f(view.size);
         return vec4f(round(clip.xy / clip.w * half) / half * clip.w, clip.zw);",
    );
    let expected = pixels(gpu, &[]);
    let differing = |edits: &[(&str, &str, &str)]| {
        let actual = pixels(gpu, edits);
        let differ = |(a, b): &(&[f32; 4], &[f32; 4])| (0..3).any(|i| (a[i] - b[i]).abs() > 0.1 * b[i] + 1e-3);
        actual.iter().zip(&expected).filter(differ).count() as f32 / expected.len() as f32
    };
    let (with, without) =
        (differing(&[grid]), differing(&[grid, ("rays/ray_offset", "VERTEX_GRID = 1.0 / 256.0", "VERTEX_GRID = 0.0")]));
    println!("{with} of the pixels differ, and {without} where rays start nearer");
    assert!(with < 0.01, "{with}");
    // The test can fail: without the offset, surfaces shadow themselves.
    assert!(without > 0.05, "{without}");
}
