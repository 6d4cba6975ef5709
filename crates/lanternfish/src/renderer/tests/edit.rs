//! Shaders that are replaced at run time.

use lanternfish_gpu::{Engine, ShaderTexts, testing};
use lanternfish_scene::generate::demo;

use crate::{
    RenderError, Renderer, Settings, Target, ViewRequest,
    settings::{Culling, Exposure, Shadows},
    testing::edited_file,
};

/// A file of the library with one passage replaced.
fn edited(module: &str, from: &str, to: &str) -> ShaderTexts {
    [edited_file((module, from, to))].into()
}

#[gpu_test]
fn gpu_edited_shaders_take_effect_and_invalid_ones_change_nothing(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let camera = &scene.cameras[0];
    let settings = Settings::direct_light().with_shadows(Shadows::BVH).with_exposure(Exposure::Ev(0.0));
    let engine = Engine::new(&gpu.device, &gpu.queue);
    let mut renderer = Renderer::with_engine(&engine, settings.clone()).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let view = ViewRequest::of_camera(0, camera, [32, 24], Target::Own);
    let shown = |renderer: &mut Renderer| renderer.render(&uploaded, camera, [32, 24]).unwrap().radiance;
    renderer.ready(&uploaded, &[view]).unwrap();
    let own = shown(&mut renderer);

    // Halve the diffuse light.
    let darker = || edited("common/math", "const PI = 3.14159265358979;", "const PI = 6.28318530717959;");
    renderer.edit_shaders(darker(), &uploaded, &[view]).unwrap();
    let dark = shown(&mut renderer);
    let sum = |rendering: &[[f32; 4]]| rendering.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>();
    assert!(sum(&dark) < 0.9 * sum(&own), "{} of {}", sum(&dark), sum(&own));

    // Invalid texts: of shaders compiled with the passes, and of shaders compiled with the first frame.
    let broken = [
        edited("common/math", "const PI = ", "const PI = of "),
        edited("common/math", "const PI = ", "const TAU = "),
        edited("shading/forward", "@fragment", "@fragment nonsense"),
    ];
    for texts in broken {
        let module = texts.keys().next().unwrap().clone();
        let error = renderer.edit_shaders(texts, &uploaded, &[view]).unwrap_err();
        assert!(matches!(error, RenderError::Gpu(_)), "{module}: {error}");
        println!("{module}: {error}");
        assert_eq!(shown(&mut renderer), dark, "{module}");
    }
    // Another renderer of the engine uses the replacements, and a change of settings compiles them too.
    let mut other = Renderer::with_engine(&engine, settings.clone()).unwrap();
    let again = other.upload(&scene).unwrap();
    assert_eq!(other.render(&again, camera, [32, 24]).unwrap().radiance, dark);
    renderer.set(settings.clone().with_exposure(Exposure::Ev(1.0)).with_culling(Culling::NONE)).unwrap();
    renderer.set(settings).unwrap();
    assert_eq!(shown(&mut renderer), dark);

    // After the correction it recompiles nothing.
    let pipelines = engine.compilations().pipelines;
    renderer.edit_shaders(ShaderTexts::new(), &uploaded, &[view]).unwrap();
    let again = engine.compilations().pipelines - pipelines;
    assert_eq!(again, 0, "of {pipelines}");
    assert_eq!(shown(&mut renderer), own);
}
