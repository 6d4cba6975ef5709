//! Checks of the examples.

use lanternfish::{
    Settings,
    settings::{Indirect, Shadows},
    techniques::Sampled,
};
use lanternfish_gpu::testing;

use super::support::render;

#[path = "../../examples/in_flight.rs"]
#[expect(dead_code, reason = "`main` is for the example alone")]
mod in_flight;
#[path = "../../examples/own_g_buffer.rs"]
#[expect(dead_code, reason = "`main` is for the example alone")]
mod own_g_buffer;
#[path = "../../examples/own_texture.rs"]
#[expect(dead_code, reason = "`main` is for the example alone")]
mod own_texture;

fn bvh(settings: Settings) -> Settings {
    settings.with_shadows(Shadows::BVH)
}

#[gpu_test]
fn gpu_a_texture_of_the_programs_shows_the_image_to_the_bit(gpu: &Gpu) {
    // The radiance cache would change the images of later frames.
    let indirect = Indirect::from(Sampled::default().one_bounce());
    let settings = bvh(Settings::default().with_indirect(indirect));
    let actual = own_texture::draw(&gpu.device, &gpu.queue, settings.clone()).unwrap();
    let scene = lanternfish_scene::load("demo:cornell").unwrap();
    let [width, height] = own_texture::SIZE;
    let camera = scene.default_camera(width as f32 / height as f32);
    let expected = render(gpu, &scene, &camera, (width, height), settings.clone());
    assert!(actual == expected.display);
    // Check that the test can fail.
    let other = render(gpu, &scene, &camera, (width, height), bvh(Settings::direct_light()));
    assert!(actual != other.display);
}

#[gpu_test]
fn gpu_ten_frames_of_a_window_are_reported(gpu: &Gpu) {
    let reports = in_flight::frames(&gpu.device, &gpu.queue, bvh(Settings::direct_light()), 10).unwrap();
    assert_eq!(reports.len(), 10);
    assert!(reports.is_sorted_by_key(|report| report.frame));
    assert!(reports.last().is_some_and(|last| last.is_complete), "{reports:?}");
    assert!(reports.iter().all(|report| !report.is_lost));
}

/// The program's image equals Lanternfish's image of the same scene, except for 16-bit normals and positions reconstructed from depth.
#[gpu_test]
fn gpu_demodulated_light_equals_the_light_of_the_image(gpu: &Gpu) {
    let settings = bvh(own_g_buffer::settings());
    let actual = own_g_buffer::draw(&gpu.device, &gpu.queue, settings.clone()).unwrap();
    let [width, height] = own_g_buffer::SIZE;
    let rendering = |settings| render(gpu, &own_g_buffer::scene(), &own_g_buffer::camera(), (width, height), settings);
    let expected = rendering(settings.clone());
    let apart = |a: &[[u8; 4]], b: &[[u8; 4]]| {
        let pairs = a.iter().zip(b).filter(|(a, b)| a[..3].iter().zip(&b[..3]).any(|(a, b)| a.abs_diff(*b) > 2));
        pairs.count() as f64 / a.len() as f64
    };
    let (fraction, unshadowed) =
        (apart(&actual, &expected.display), rendering(settings.clone().with_shadows(Shadows::None)));
    let without = rendering(settings.with_indirect(Settings::direct_light().indirect));
    let others = [apart(&actual, &unshadowed.display), apart(&actual, &without.display)];
    println!(
        "{fraction} of the pixels differ by more than 2 of 255; without shadows, without indirect light {others:?}"
    );
    assert!(fraction < 0.005, "{fraction}");
    // Check that the test can fail.
    assert!(others.iter().all(|fraction| *fraction > 0.02), "{others:?}");
    let lit = actual.iter().filter(|pixel| pixel[..3].iter().any(|c| *c > 20)).count();
    assert!(lit * 2 > actual.len(), "{lit} pixels are lit");
}
