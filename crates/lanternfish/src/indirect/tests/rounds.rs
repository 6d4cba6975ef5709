//! Rounds of rays that are traced together.

use super::*;
use crate::{indirect::sampled::MOST_ROUNDS_IN_TESTS, settings::HitLight};

/// A mean of two frames, of which so many rounds are traced together.
fn traced_together(gpu: &Gpu, most: u64, rays: Sampled) -> Vec<Vec3> {
    MOST_ROUNDS_IN_TESTS.set(most);
    let scene = demo("cornell").unwrap();
    let deep_images = DeepImageSettings { resolution: 32, ..DeepImageSettings::default() };
    picture(gpu, Settings { accumulate: 2, deep_images, ..settings(rays) }, &scene, &scene.cameras[0])
}

/// Whether a round is traced by itself or with others changes nothing.
#[test]
fn gpu_rounds_are_the_same_however_many_are_traced_together() {
    let Some(gpu) = testing::gpu("gpu_rounds_are_the_same_however_many_are_traced_together") else { return };
    for tracer in [Tracer::Bvh, Tracer::WithinTexel] {
        let rays = Sampled { diffuse_rays: 5, glossy_rays: 2, ..sampled(tracer) };
        let [one, three, all] = [1, 3, 16].map(|most| traced_together(gpu, most, rays));
        assert!(one == all && three == all, "{tracer:?}");
        // It can fail: other rays are another picture.
        assert!(traced_together(gpu, 16, Sampled { diffuse_rays: 4, ..rays }) != all, "{tracer:?}");
    }
}

/// With cells, the rays of all rounds that are looked up together ask for one that is new; else those of the first that ends there. The light
/// is the same.
#[test]
fn gpu_cells_send_the_same_however_many_rounds_are_looked_up_together() {
    let Some(gpu) = testing::gpu("gpu_cells_send_the_same_however_many_rounds_are_looked_up_together") else { return };
    let rays = Sampled { diffuse_rays: 12, glossy_rays: 4, hit_light: HitLight::Cached, ..sampled(Tracer::Bvh) };
    let [one, five, all] = [1, 5, 16].map(|most| traced_together(gpu, most, rays));
    for (what, some) in [("one", &one), ("five", &five)] {
        let (light, apart) = (mean(some) / mean(&all), off(some, &all));
        println!("{what}: {light:.4} of the light, off by {apart:.4}");
        assert!((light - 1.0).abs() < 0.002 && apart < 0.004, "{what}: {light} of the light, off by {apart}");
    }
    // It can fail: fewer rays are off by more.
    let fewer = traced_together(gpu, 16, Sampled { diffuse_rays: 3, ..rays });
    assert!(off(&fewer, &all) > 0.06, "{}", off(&fewer, &all));
}
