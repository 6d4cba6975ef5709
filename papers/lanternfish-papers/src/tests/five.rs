//! All five papers in one frame: each of them does something in it.

use glam::Vec3;
use lanternfish::{Renderer, Settings};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{Light, generate::demo};

use crate::{
    Paper,
    testing::{self, engine, inside},
};

/// An image, and the counters of its frame.
type Drawn = (Vec<[f32; 4]>, Vec<(String, u64)>);

/// All five in a small scene with a sky and a second lamp, which does not reach far; with some settings changed.
fn draw(gpu: &Gpu, changes: &[(&str, &str)]) -> Drawn {
    let mut settings: Settings = Paper::Five.settings();
    for (name, value) in [("samples", "1")].iter().chain(changes) {
        settings.set(name, value).unwrap();
    }
    let mut scene = demo("cornell").unwrap();
    scene.sky = Vec3::splat(0.5);
    scene.lights.push(Light { range: Some(0.4), ..Light::point(Vec3::new(0.3, 0.3, 0.3), Vec3::ONE) });
    let mut renderer = Renderer::with_engine(&engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let drawn = renderer.render(&uploaded, &scene.cameras[0], [32, 24]).unwrap();
    (drawn.radiance, drawn.report.counters)
}

/// What differs without a paper: the image, or a counter of this name.
fn check(gpu: &Gpu, changes: &[(&str, &str)], counter: Option<&str>) {
    let (all, without) = (draw(gpu, &[]), draw(gpu, changes));
    let Some(name) = counter else {
        assert_ne!(all.0, without.0, "{changes:?}: the same image");
        return;
    };
    let [all, without] = [all, without].map(|(_, counters)| counters.into_iter().find(|(it, _)| it == name));
    assert!(all.is_some() || without.is_some(), "nothing counts {name}");
    assert_ne!(all, without, "{changes:?}");
}

#[gpu_test]
fn gpu_five_culls_rays_by_facing(gpu: &Gpu) {
    check(gpu, &[("ray-culling", "none")], Some("shadows/rays"));
}

#[gpu_test]
fn gpu_five_culls_lights_by_clusters(gpu: &Gpu) {
    check(gpu, &[("culling", "all")], Some("light_culling/visible_clusters"));
}

#[gpu_test]
fn gpu_five_traces_virtual_lights_across_texels(gpu: &Gpu) {
    check(gpu, &[("vpl-shadows", "bvh")], None);
}

#[gpu_test]
fn gpu_five_occludes_by_layered_depth_maps(gpu: &Gpu) {
    check(gpu, &[("occlusion", "none")], None);
}

#[gpu_test]
fn gpu_five_ranges_virtual_lights_by_compound_deep_images(gpu: &Gpu) {
    check(gpu, &[("vpl-ranges", "unlimited")], None);
    check(gpu, &[("indirect", "none")], None);
}

/// The cube of shadow rays and the stacks of ranges are both there, beside the maps of occlusion, which are its own.
#[gpu_test]
fn gpu_five_has_two_structures_for_tracers(gpu: &Gpu) {
    let structures = |changes: &[(&str, &str)]| {
        let mut settings = Paper::Five.settings();
        changes.iter().for_each(|(name, value)| settings.set(name, value).unwrap());
        inside::structures(&Renderer::with_engine(&engine(gpu), settings).unwrap())
    };
    assert_eq!(structures(&[]), 2);
    assert_eq!(structures(&[("vpl-images", "niessner")]), 1);
    assert_eq!(structures(&[("vpl-shadows", "bvh")]), 1);
}
