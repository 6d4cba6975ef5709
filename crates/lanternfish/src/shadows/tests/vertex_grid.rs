//! Rasterizers snap vertices to a grid in the image, and a depth is that of the snapped triangle.

use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::generate::{demo, light_rain};

use crate::{
    Renderer, Settings,
    settings::Shadows,
    testing::{apart, edited_engine, moved},
};

/// Pixels of the Cornell box in light rain, with its parts rotated, under shaders with these edits. Rays are offset for a grid of
/// `assumed_bits`, by default the adapter's.
fn pixels(gpu: &Gpu, edits: &[(&str, &str, &str)], assumed_bits: Option<i32>) -> Vec<[f32; 4]> {
    let engine = edited_engine(gpu, edits);
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut renderer = Renderer::with_engine(&engine, settings).unwrap();
    assert_eq!(renderer.vertex_grid, 0.5f32.powi(engine.subpixel_bits() as i32));
    renderer.vertex_grid = assumed_bits.map_or(renderer.vertex_grid, |bits| 0.5f32.powi(bits));
    let mut scene = moved(&apart(&demo("cornell").unwrap()), 7, 0.2);
    scene.lights = light_rain(&scene.bounds(), 2, None, 1, 0.0);
    let uploaded = renderer.upload(&scene).unwrap();
    renderer.render(&uploaded, &scene.cameras[0], [40, 40]).unwrap().radiance
}

/// Graphics cards have 8 bits, the least allowed are 4; software renderers may have no grid.
#[gpu_test]
fn gpu_shadow_rays_start_off_surfaces_whose_vertices_were_moved(gpu: &Gpu) {
    let energy = |pixels: &[[f32; 4]]| pixels.iter().flat_map(|pixel| &pixel[..3]).map(|v| f64::from(*v)).sum::<f64>();
    let expected = pixels(gpu, &[], None);
    for (bits, finer) in [(8, 24), (4, 8)] {
        let snapped = format!(
            "let clip = view.clip_from_view * (view.view_from_world * vec4f(p_world, 1.0));
             let half = {}.0 * vec2f(view.size);
             return vec4f(round(clip.xy / clip.w * half) / half * clip.w, clip.zw);",
            1 << (bits - 1)
        );
        let plain = "return view.clip_from_view * (view.view_from_world * vec4f(p_world, 1.0));";
        // The fraction of pixels that differ, and the ratio of the energy.
        let compared = |assumed_bits| {
            let actual = pixels(gpu, &[("gpu_scene/instance", plain, &snapped)], Some(assumed_bits));
            let differ = |(a, b): &(&[f32; 4], &[f32; 4])| (0..3).any(|i| (a[i] - b[i]).abs() > 0.1 * b[i] + 1e-3);
            let differing = actual.iter().zip(&expected).filter(differ).count() as f64 / expected.len() as f64;
            (differing, energy(&actual) / energy(&expected))
        };
        let (with, without) = (compared(bits), compared(finer));
        println!("{bits} bits: differing and energy {with:?}, and {without:?} where rays start as for {finer} bits");
        assert!(with.0 < 0.01 && (with.1 - 1.0).abs() < 0.005, "{with:?}");
        // The test can fail: without the offset, surfaces shadow themselves.
        assert!(without.0 > 0.05 && without.1 < 0.95, "{without:?}");
    }
}
