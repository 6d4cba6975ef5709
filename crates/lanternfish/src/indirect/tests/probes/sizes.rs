//! Images of every size, and several views.

use super::*;

/// Images that are smaller than a tile or no multiple of one, lines, and large ones are complete: every pixel has light.
#[gpu_test]
fn gpu_probes_light_images_of_every_size(gpu: &Gpu) {
    let mut scene = closed_box(matt(0.6));
    scene.lights.push(Light::point(Vec3::new(0.3, 0.2, 0.0), Vec3::ONE));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let image = |indirect: Indirect, size| image_of(gpu, size, with(indirect, History::Off), &scene, &camera);
    // A frame of 4096 x 2160 pixels takes a minute on a software adapter.
    let sizes = [([1, 1], 8), ([3, 5], 4), ([37, 1], 8), ([1, 37], 32), ([129, 65], 8), ([4096, 2160], 32)];
    for (size, probe_size) in sizes.into_iter().take(if testing::is_full() { 6 } else { 4 }) {
        let size = UVec2::from(size);
        let [actual, none] =
            [Indirect::from(probes_of(probe_size, 32)), Indirect::NONE].map(|indirect| image(indirect, size));
        let added = mean(&actual) - mean(&none);
        println!("{size}, tiles of {probe_size}: {added:.4}");
        let is_lit = |(with, without): (&Vec3, &Vec3)| with.is_finite() && (with.x > without.x || without.x == 0.0);
        assert!(actual.iter().zip(&none).all(is_lit), "{size}: a pixel without light");
        // A few probes: within noise of the box's mean.
        assert!((0.02..0.5).contains(&added), "{size}: {added}");
    }
}

/// Views of one frame, and a view after one of another size, are the images of views alone.
#[gpu_test(full)]
fn gpu_views_have_their_own_probes(gpu: &Gpu) {
    let scene = clutter(40, 0.1);
    let cameras = [looking([-0.03, 0.0, 0.95], [0.1, 0.1, -1.0]), looking([0.03, 0.0, 0.95], [0.1, 0.1, -1.0])];
    let renderer = |history| {
        let renderer = walks::renderer(gpu, with(probes(), history));
        let uploaded = renderer.upload(&scene).unwrap();
        (renderer, uploaded)
    };
    let views = [(&cameras[0], LARGE.into()), (&cameras[1], [SIZE.y, SIZE.x])];
    let alone = views.map(|(camera, size)| {
        let (mut renderer, uploaded) = renderer(History::Off);
        renderer.render(&uploaded, camera, size).unwrap()
    });
    let (mut both, uploaded) = renderer(History::Off);
    let together = both.render_views(&uploaded, &views).unwrap();
    // Views of a frame share the radiance cache, and so the entries that either requests, and the bright spots among them: light, not noise. Entries that few
    // rays hit have two samples. Measured: 0.089.
    for (together, alone) in together.iter().zip(&alone) {
        let apart = off(&pixels(together), &pixels(alone));
        println!("the means differ by {apart}");
        assert!(apart < 0.1, "{apart}");
    }
    for i in [0, 1, 0] {
        let again = both.render(&uploaded, views[i].0, views[i].1).unwrap().radiance;
        assert!(again == alone[i].radiance, "view {i} after one of another size");
    }
    // With a history, views keep their own.
    let (mut both, uploaded) = renderer(History::On);
    for _ in 0..3 {
        both.render_views(&uploaded, &views).unwrap();
    }
    let last = both.render_views(&uploaded, &views).unwrap();
    for (image, alone) in last.iter().zip(&alone) {
        let energy = mean(&pixels(image)) / mean(&pixels(alone));
        assert!((energy - 1.0).abs() < 0.08, "{energy}");
    }
}
