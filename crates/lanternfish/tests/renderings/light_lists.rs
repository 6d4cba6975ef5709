//! What clusters and tiles hold, with one sample per pixel and with several.

use lanternfish::{
    Renderer, Settings,
    settings::{Culling, Indirect, Samples, Shadows},
    techniques::{Sampled, TileSize, Tiled},
};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Scene, generate};

use crate::support::{counter, differing, render};

const SIZE: (u32, u32) = (72, 48);

/// The atrium's columns in front of its far walls, in many short-ranged lights.
fn atrium_in_rain() -> (Scene, Camera) {
    let mut scene = generate::demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights = generate::light_rain(&scene.bounds(), 300, Some(2.0), 1, 0.0);
    (scene, camera)
}

/// Each shaded fragment is counted once, whatever else needs the clusters of the pixels' centres.
#[gpu_test]
fn gpu_clusters_count_every_shaded_fragment_once(gpu: &Gpu) {
    // Large triangles, some behind others: triangles smaller than a pixel would be a fragment each.
    let scene = generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let engine = testing::engine(gpu);
    let rays = Sampled { diffuse_rays: 1, glossy_rays: 0, ..Sampled::default() };
    for samples in [Samples::One, Samples::Four] {
        let mut counts = Vec::new();
        for shadows in [Shadows::None, Shadows::BVH] {
            for indirect in [Indirect::NONE, rays.one_bounce().into()] {
                let settings =
                    Settings::direct_light().with_samples(samples).with_shadows(shadows).with_indirect(indirect);
                let mut renderer = Renderer::with_engine(&engine, settings).unwrap();
                let uploaded = renderer.upload(&scene).unwrap();
                let rendering = renderer.render(&uploaded, &camera, SIZE.into()).unwrap();
                let surfaces = rendering.radiance.iter().filter(|texel| texel[3] > 0.0).count() as u64;
                let contents = renderer.cluster_contents().unwrap().remove(0);
                let most = contents.visible.iter().map(|cluster| cluster.fragments).max();
                counts.push((contents.fragments(), most, surfaces));
            }
        }
        println!("{samples}: {counts:?}");
        assert!(
            counts.iter().all(|(fragments, most, _)| (*fragments, *most) == (counts[0].0, counts[0].1)),
            "{counts:?}"
        );
        let (fragments, _, surfaces) = counts[0];
        match samples {
            Samples::One => assert_eq!(fragments, surfaces),
            // Pixels at edges shade several triangles. Hidden fragments would double the count.
            _ => assert!(fragments > surfaces && fragments < surfaces * 13 / 10, "{fragments} of {surfaces}"),
        }
    }
}

/// Tiles end at the nearest and farthest surface with several samples per pixel too, and the image is that of all lights.
#[gpu_test]
fn gpu_tiles_of_several_samples_end_at_their_surfaces(gpu: &Gpu) {
    let (scene, camera) = atrium_in_rain();
    let lit = |samples, shadows, culling| {
        let settings = Settings::direct_light().with_samples(samples).with_shadows(shadows).with_culling(culling);
        render(gpu, &scene, &camera, SIZE, settings)
    };
    let tiled = |aabb_test| Culling::from(Tiled { tile_size: TileSize::Px8, aabb_test });
    let listed = |samples, aabb| counter(&lit(samples, Shadows::None, tiled(aabb)), "light_culling/listed_lights");
    let [one, four] = [Samples::One, Samples::Four].map(|samples| [false, true].map(|aabb| listed(samples, aabb)));
    println!("listed lights without and with the box test: {one:?} with one sample, {four:?} with four");
    // A fragment at an edge widens its tile a little; tiles without bounds list half as many again.
    assert!(four[0] >= one[0] && four[0] as f64 <= 1.15 * one[0] as f64, "{one:?}, {four:?}");
    let saved = |[planes, boxes]: [u64; 2]| 1.0 - boxes as f64 / planes as f64;
    assert!(saved(four) > 0.7 * saved(one), "{one:?}, {four:?}");
    let all = lit(Samples::Four, Shadows::None, Culling::NONE);
    assert_eq!(differing(&lit(Samples::Four, Shadows::None, tiled(true)), &all), 0);
}
