//! Probes in means of frames, and beside transparent surfaces.

use lanternfish_scene::AlphaMode;

use super::*;

/// The last frame of a mean, and the mean image.
fn averaged(gpu: &Gpu, indirect: impl Into<Indirect>, accumulate: u32, scene: &Scene) -> RenderedImage {
    let settings = with(indirect, History::Off).with_accumulate(accumulate);
    rendered(gpu, SIZE, settings, scene, &looking(CAMERA.0, CAMERA.1))
}

/// The first frame of a mean has rays from probes, about one per pixel; all others have the rays of `sampled`, whose image the mean approaches.
#[gpu_test(full)]
fn gpu_means_have_probes_in_their_first_frame_only(gpu: &Gpu) {
    let scene = cornell();
    let rays = |indirect: Indirect, frames| counted(&averaged(gpu, indirect, frames, &scene), "indirect/rays");
    let frames = [1, 2, 3].map(|frames| [Indirect::from(probes()), per_pixel()].map(|of| rays(of, frames)));
    println!("rays of probes and of sampled, frame by frame: {frames:?}");
    let tiles = u64::from(SIZE.x.div_ceil(8) * SIZE.y.div_ceil(8));
    // At most three further probes in a tile, and a glossy ray from every fourth pixel.
    let least = tiles * 32 / 2;
    let most = tiles * 32 * 4 + u64::from(SIZE.x.div_ceil(2) * SIZE.y.div_ceil(2));
    assert!((least..=most).contains(&frames[0][0]), "{frames:?}");
    assert!(2 * frames[0][0] < frames[0][1], "{frames:?}");
    assert!(frames[1][0] == frames[1][1] && frames[2][0] == frames[2][1], "{frames:?}");

    let [of_probes, of_pixels, one] =
        [(Indirect::from(probes()), 16), (per_pixel(), 16), (Indirect::from(probes()), 1)]
            .map(|(indirect, frames)| pixels(&averaged(gpu, indirect, frames, &scene)));
    let [apart, first] = [&of_probes, &one].map(|image| off(image, &of_pixels));
    let energy = mean(&of_probes) / mean(&of_pixels);
    println!("means of 16 frames are {apart:.4} apart, the first frame {first:.4}; energy {energy:.4}");
    // A sixteenth of the first frame's difference remains, beside noise.
    assert!(apart < 0.02 && (energy - 1.0).abs() < 0.01, "{apart}, {energy}");
}

/// Transparent surfaces have rays from every pixel: behind glass alone, over nothing, the image is that of `sampled` bit for bit.
#[gpu_test]
fn gpu_glass_has_the_light_of_sampled(gpu: &Gpu) {
    // The pane reflects what is behind the camera.
    let mut scene = cornell();
    let glass = Material {
        alpha_mode: AlphaMode::Blend,
        base_color: Vec4::new(0.5, 0.6, 0.7, 0.4),
        specular: 0.5,
        perceptual_roughness: 0.1,
        ..matt(0.5)
    };
    scene.materials.push(glass);
    let pane = scene.materials.len() - 1;
    let pane = quad(pane, Vec3::new(0.0, 1.0, 4.0), 0.6 * Vec3::X, -0.6 * Vec3::Y);
    scene.meshes[0].primitives.push(pane);
    let image = |indirect: Indirect, camera: &Camera| image_of(gpu, SIZE, with(indirect, History::Off), &scene, camera);
    let camera = looking([0.0, 1.0, 2.6], [0.0, 1.0, 4.0]);
    let [of_probes, of_pixels, none] =
        [Indirect::from(probes()), per_pixel(), Indirect::NONE].map(|indirect| image(indirect, &camera));
    println!("on glass: {:.4}, without indirect light {:.4}", mean(&of_probes), mean(&none));
    assert!(mean(&of_probes) > 1.1 * mean(&none), "the glass reflects nothing");
    assert!(of_probes == of_pixels, "off by {}", off(&of_probes, &of_pixels));
    // In front of the box: both kinds of surfaces in one image.
    let camera = looking([0.0, 1.0, 5.5], [0.0, 1.0, 0.0]);
    let image = |indirect| image_of(gpu, SIZE, with(indirect, History::Off).with_accumulate(4), &scene, &camera);
    let [of_probes, of_pixels] = [Indirect::from(probes()), per_pixel()].map(image);
    let energy = mean(&of_probes) / mean(&of_pixels);
    println!("through glass: energy {energy:.4}");
    assert!((energy - 1.0).abs() < 0.03, "{energy}");
}
