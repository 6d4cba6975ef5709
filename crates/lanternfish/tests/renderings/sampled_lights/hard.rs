//! Lights without an area: the difference to a ray to every light is noise.

use super::*;

/// Frames of a view at rest.
const FRAMES: usize = 128;

/// Energy over that of a ray to every light, and the largest offset of a channel in standard errors, beyond the rounding of the layers.
fn apart(name: &str, renderer: &mut Renderer, scene: &Scene, all: &RgbImage) -> [f64; 2] {
    let [mean, variance] = mean(&frames(renderer, scene, &scene.cameras[0], FRAMES)).map(|image| energies(&image));
    let expected = energies(all);
    let z = [0, 1, 2].map(|channel| {
        // Some adapters round layers of 16-bit floats towards zero, on average by less than half a unit in the last place.
        let rounding = 0.5 * f64::from(HALF) * expected[channel];
        ((mean[channel] - expected[channel]).abs() - rounding).max(0.0) / variance[channel].sqrt()
    });
    let ratio = farthest(mean, expected);
    println!("{name}: energy {ratio:.4}, {z:.2?} standard errors");
    [ratio, z.into_iter().fold(0.0, f64::max)]
}

fn is_right([ratio, z]: [f64; 2]) -> bool {
    (ratio - 1.0).abs() < 0.005 && z < 4.0
}

#[gpu_test]
fn gpu_the_mean_of_frames_is_all_lights(gpu: &Gpu) {
    let mut atrium = generate::demo("atrium").unwrap();
    atrium.lights.extend(generate::light_rain(&atrium.bounds(), 300, None, 1, 0.0));
    // An engine of its own: its shaders are edited.
    let engine = Engine::new(&gpu.device, &gpu.queue);
    let mut renderer = Renderer::with_engine(&engine, sampled()).unwrap();
    let all = |scene: &Scene| {
        let settings = sampled().with_direct(Direct::NONE).with_history(History::Off);
        linear(&render(gpu, scene, &scene.cameras[0], SIZE, settings))
    };
    for (name, scene) in [
        ("six points", cornell(6, point)),
        ("points", cornell(30, point)),
        ("spots", cornell(30, spot)),
        ("suns", cornell(30, sun_or_point)),
        // Leaves with masks, normal maps, glass.
        ("atrium", atrium),
    ] {
        let found = apart(name, &mut renderer, &scene, &all(&scene));
        assert!(is_right(found), "{name}: {found:?}");
    }
    // Check that the test can fail: probabilities that are 5 % too high.
    let scene = cornell(30, point);
    let uploaded = renderer.upload(&scene).unwrap();
    let view = [ViewRequest::of_camera(0, &scene.cameras[0], [EDGE, EDGE], Target::Own)];
    let [text, by] = ["= chance * found.chances[i];", "= 1.05 * chance * found.chances[i];"];
    let source = include_str!("../../../src/direct_light/sampled/trace.wesl");
    assert!(source.contains(text));
    let texts = BTreeMap::from([("direct_light/sampled/trace".to_owned(), source.replace(text, by))]);
    renderer.edit_shaders(texts, &uploaded, &view).unwrap();
    let [ratio, z] = apart("5 % too high", &mut renderer, &scene, &all(&scene));
    assert!((ratio - 1.0).abs() > 0.03 && z > 4.0, "{ratio}, {z}");
}
