//! Changed settings of a renderer, and several renderers of one engine.

use lanternfish_gpu::{Engine, testing};
use lanternfish_scene::generate::demo;

use crate::{
    Change, RenderError, RenderedImage, Renderer, Settings,
    settings::{Attenuation, Exposure, Samples, Shadows, ToneMap, Tracer},
    techniques::{Sampled, Tiled},
};

fn bvh() -> Settings {
    Settings::direct_light().with_shadows(Shadows::BVH).with_exposure(Exposure::Ev(0.0))
}

/// The parts of an image that equal settings must reproduce.
fn shown(rendering: RenderedImage) -> (Vec<[f32; 4]>, Vec<[u8; 4]>, Option<f32>) {
    (rendering.radiance, rendering.display, rendering.exposure)
}

#[gpu_test]
fn gpu_a_renderer_with_changed_settings_equals_a_new_one(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let camera = &scene.cameras[0];
    let engine = Engine::new(&gpu.device, &gpu.queue);
    let mut renderer = Renderer::with_engine(&engine, bvh()).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    renderer.render(&uploaded, camera, [32, 24]).unwrap();
    let few = Sampled { diffuse_rays: 1, glossy_rays: 0, ..Sampled::default() };
    let sampled = bvh().with_indirect(few);
    let more = bvh().with_indirect(Sampled { diffuse_rays: 2, ..few });
    for (name, settings, expected) in [
        ("the same", bvh(), Change::Uniform),
        ("a tone map", bvh().with_tone_map(ToneMap::Aces), Change::Uniform),
        ("an exposure", bvh().with_exposure(Exposure::Ev(1.5)), Change::Uniform),
        ("automatic exposure", bvh().with_exposure(Exposure::Auto), Change::Relink),
        ("a mean of frames", bvh().with_accumulate(3).with_exposure(Exposure::Auto), Change::Uniform),
        ("tiles", bvh().with_culling(Tiled::default()), Change::Relink),
        ("four samples", bvh().with_samples(Samples::Four), Change::Relink),
        ("no shadows", bvh().with_shadows(Shadows::None), Change::Relink),
        ("another attenuation", bvh().with_attenuation(Attenuation::Physical), Change::Upload),
        ("indirect light", sampled, Change::Upload),
        ("more rays", more, Change::Uniform),
        // A scene with more than the required data is accepted.
        ("back again", bvh(), Change::Relink),
    ] {
        let before = engine.compilations();
        let change = renderer.set(settings.clone()).unwrap();
        let compiled = engine.compilations();
        println!("{name}: {change:?}, {before:?} -> {compiled:?}");
        assert_eq!(change, expected, "{name}");
        if change == Change::Upload {
            let refused = renderer.render(&uploaded, camera, [32, 24]);
            assert!(matches!(refused, Err(RenderError::OtherSettings { .. })), "{name}");
            uploaded = renderer.upload(&scene).unwrap();
        }
        let actual = shown(renderer.render(&uploaded, camera, [32, 24]).unwrap());
        if change == Change::Uniform {
            assert_eq!(engine.compilations(), before, "{name}");
        }
        let mut fresh = Renderer::new(&gpu.device, &gpu.queue, settings.clone()).unwrap();
        let its_own = fresh.upload(&scene).unwrap();
        let rendering = shown(fresh.render(&its_own, camera, [32, 24]).unwrap());
        assert!(actual == rendering, "{name}: another image");
        assert_eq!(renderer.settings(), &settings);
        // A renderer with the same settings compiles nothing, and an engine compiles everything only once.
        let compiled = engine.compilations();
        let mut second = Renderer::with_engine(&engine, settings).unwrap();
        let uploaded = second.upload(&scene).unwrap();
        assert!(shown(second.render(&uploaded, camera, [32, 24]).unwrap()) == rendering, "{name}: another image");
        assert_eq!(engine.compilations(), compiled, "{name}: compiled again");
        // Check that the test can fail: a new engine compiles more than the change needs.
        assert!(compiled.pipelines - before.pipelines < fresh.engine().compilations().pipelines, "{name}");
    }
}

#[gpu_test]
fn gpu_invalid_settings_leave_the_current_ones(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, bvh()).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let render = |renderer: &mut Renderer| shown(renderer.render(&uploaded, &scene.cameras[0], [32, 24]).unwrap());
    let before = render(&mut renderer);
    // An exposure set with `set_exposure` also changes the settings.
    let auto = bvh().with_exposure(Exposure::Auto);
    renderer.set_exposure(Exposure::Auto).unwrap();
    assert_eq!(renderer.set(auto).unwrap(), Change::Uniform);
    renderer.set(bvh()).unwrap();
    for settings in [
        bvh().with_accumulate(0),
        bvh().with_exposure(Exposure::Ev(f32::NAN)),
        bvh().with_shadows(Shadows::Traced(Tracer::BVH)).with_light_radius(-1.0),
    ] {
        assert!(renderer.set(settings.clone()).is_err(), "{settings:?}");
        assert_eq!(renderer.settings(), &bvh());
        assert!(render(&mut renderer) == before);
    }
}
