//! An external tracer with its own acceleration structure.

use lanternfish::{
    Renderer, Settings,
    gpu_scene::Parts,
    rays::{Structure, Tracer, TracerInfo},
    settings::Shadows,
    techniques::Sampled,
};
use lanternfish_gpu::Feature;
use lanternfish_scene::generate::demo;

use crate::{DeepImageSettings, WITHIN_TEXEL, testing};

/// Its structure, which it does not read.
const OWN: DeepImageSettings = DeepImageSettings { resolution: 8, ..DeepImageSettings::NIESSNER };

/// Traces with the BVH under another name.
static OTHER: TracerInfo = TracerInfo {
    name: "other",
    words: "The BVH under another name",
    feature: Feature::choosing("tracer_other", "tracer", "rays/bvh/tracer", None),
    parts: Parts::NONE,
    needs: wgpu::Features::empty(),
    structure: Some(|| OWN.into()),
};

#[gpu_test]
fn gpu_a_tracer_with_its_own_structure_is_traced_without_others(gpu: &Gpu) {
    let other = Tracer::new(&OTHER);
    other.register();
    assert!(Tracer::all().contains(&other) && "other".parse() == Ok(other));
    let scene = demo("cornell").unwrap();
    let camera = scene.default_camera(1.5);
    // The chosen structure belongs to another tracer.
    let structure = || Structure::from(DeepImageSettings::default());
    let settings = |tracer: Tracer| {
        let indirect = Sampled { tracer: tracer.into(), ..Sampled::default() }.one_bounce();
        Settings::default().with_shadows(Shadows::Traced(tracer)).with_indirect(indirect).with_structure(structure())
    };
    let image = |tracer: Tracer| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(tracer)).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let image = renderer.render(&uploaded, &camera, [24, 16]).unwrap();
        (image.radiance, testing::inside::structure_builds(&renderer))
    };
    let (actual, expected) = (image(other), image(Tracer::BVH));
    assert_eq!(actual.0, expected.0);
    assert!(actual.1 >= Some(1) && expected.1.is_none(), "{:?}, {:?}", actual.1, expected.1);
    let both = settings(other).with_shadows(Shadows::Traced(WITHIN_TEXEL));
    let renderer = Renderer::with_engine(&testing::engine(gpu), both).unwrap();
    assert_eq!(testing::inside::structures(&renderer), 2, "each tracer has its own");
}
