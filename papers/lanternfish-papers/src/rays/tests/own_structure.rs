//! An external tracer with its own acceleration structure.

use std::sync::Arc;

use glam::Quat;
use lanternfish::{
    GpuScene, RenderError, Renderer, Settings,
    gpu_scene::Parts,
    rays::{KeptStructure, Structure, StructureTechnique, TracedStructure, Tracer, TracerInfo},
    settings::Shadows,
    shaders::Shaders,
    technique::{Parameter, Technique},
    techniques::Sampled,
};
use lanternfish_gpu::{Bindings, Feature, Frame, Growth};
use lanternfish_scene::generate::demo;

use crate::{DeepImageSettings, WITHIN_TEXEL, testing};

/// A structure with one part and no contents.
#[derive(Clone, Debug, Default, PartialEq)]
struct Nothing;

impl Technique for Nothing {
    const NAME: &'static str = "nothing";
    const SUMMARY: &'static str = "Nothing";
    const PARAMETERS: &'static [Parameter<Self>] = &[];
    const SHADERS: Shaders = Shaders::of(&crate::shaders::SHADERS, &[], &[]);
}

impl StructureTechnique for Nothing {
    fn features(&self, _with_triangles: bool) -> Vec<Feature> {
        Vec::new()
    }

    fn every_features(&self, _with_triangles: bool) -> Vec<Vec<Feature>> {
        vec![Vec::new()]
    }

    fn finds_triangles(&self) -> bool {
        true
    }

    fn update_frames(&self) -> u32 {
        1
    }

    fn build(&self, _device: &wgpu::Device) -> Result<Box<dyn KeptStructure>, RenderError> {
        Ok(Box::new(CountedBuilds { builds: 0 }))
    }
}

#[derive(Debug)]
struct CountedBuilds {
    builds: u64,
}

impl KeptStructure for CountedBuilds {
    fn get(&mut self, _: &mut Frame<'_>, _: &GpuScene, _: Quat) -> Result<Arc<dyn TracedStructure>, RenderError> {
        self.builds += 1;
        Ok(Arc::new(Nothing))
    }

    fn builds(&self) -> u64 {
        self.builds
    }

    fn check_growth(&self, _growth: Growth) -> Result<(), RenderError> {
        Ok(())
    }
}

impl TracedStructure for Nothing {
    fn distance_features(&self) -> Vec<Feature> {
        Vec::new()
    }

    fn for_each_part(&self, bindings: &Bindings<'_>, dispatch: &mut dyn FnMut(&Bindings<'_>)) {
        dispatch(bindings);
    }
}

/// Traces with the BVH under another name.
static OTHER: TracerInfo = TracerInfo {
    name: "other",
    words: "The BVH under another name",
    feature: Feature::choosing("tracer_other", "tracer", "rays/bvh/tracer", None),
    parts: Parts::NONE,
    needs: wgpu::Features::empty(),
    structure: Some(|| Nothing.into()),
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
