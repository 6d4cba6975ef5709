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

/// A setting without a paper, and the counter that it changes; none: it changes the image.
type Without = (&'static str, &'static str, Option<&'static str>);

const WITHOUT: [Without; 6] = [
    // Ranges of virtual lights by compound deep images.
    ("vpl-ranges", "unlimited", None),
    ("ray-culling", "none", Some("shadows/rays")),
    ("culling", "all", Some("light_culling/visible_clusters")),
    // Across texels.
    ("vpl-shadows", "bvh", None),
    // By layered depth maps.
    ("occlusion", "none", None),
    ("indirect", "none", None),
];

fn check(gpu: &Gpu, papers: &[Without]) {
    let all = draw(gpu, &[]);
    for (name, value, counter) in papers {
        let without = draw(gpu, &[(name, value)]);
        let Some(counter) = counter else {
            assert_ne!(all.0, without.0, "{name} {value}: the same image");
            continue;
        };
        let [all, without] = [&all, &without].map(|(_, counters)| counters.iter().find(|(it, _)| it == counter));
        assert!((all.is_some() || without.is_some()) && all != without, "{name} {value}: {all:?} and {without:?}");
    }
}

#[gpu_test]
fn gpu_the_five_are_drawn_together(gpu: &Gpu) {
    check(gpu, &WITHOUT[..1]);
}

#[gpu_test(full)]
fn gpu_each_of_the_five_does_something(gpu: &Gpu) {
    check(gpu, &WITHOUT);
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
