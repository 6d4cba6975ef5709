//! Sample indices that are traced together, and the order of rays.

use std::collections::{HashMap, HashSet};

use glam::{UVec4, Vec2, Vec4, Vec4Swizzles};
use lanternfish_gpu::{Bindings, uniform_buffer_of};

use super::*;
use crate::{
    indirect::sampled::{MOST_SAMPLES_IN_TESTS, SampledParameters, sample_order},
    testing::evaluate_points,
    view::View,
};

/// A mean of two frames, with at most `most` sample indices traced together.
fn traced_together(gpu: &Gpu, most: u64, rays: Sampled) -> Vec<Vec3> {
    MOST_SAMPLES_IN_TESTS.set(most);
    let scene = demo("cornell").unwrap();
    image_of(gpu, LARGE, over_frames(rays, 2), &scene, &scene.cameras[0])
}

/// The image does not depend on how many sample indices are traced together.
#[gpu_test]
fn gpu_shaded_light_does_not_depend_on_batch_size(gpu: &Gpu) {
    let rays = Sampled { diffuse_rays: 5, glossy_rays: 2, ..sampled(Tracer::BVH) };
    let [one, three, all] = [1, 3, 16].map(|most| traced_together(gpu, most, rays));
    assert!(one == all && three == all);
    // The test can fail: other rays give another image.
    assert!(traced_together(gpu, 16, Sampled { diffuse_rays: 4, ..rays }) != all);
}

/// With the cache, the rays of all sample indices that are looked up together vote for a new entry, so that its sample position depends on their number.
/// The light is the same except for noise, which is less than half of that of a quarter of the rays.
#[gpu_test]
fn gpu_cached_light_does_not_depend_on_batch_size(gpu: &Gpu) {
    let rays = Sampled { diffuse_rays: 12, glossy_rays: 4, hit_light: HitLight::Cached, ..sampled(Tracer::BVH) };
    let [one, five, all] = [1, 5, 16].map(|most| traced_together(gpu, most, rays));
    for (what, some) in [("one", &one), ("five", &five)] {
        let (light, apart) = (mean(some) / mean(&all), off(some, &all));
        println!("{what}: {light:.4} of the light, off by {apart:.4}");
        assert!((light - 1.0).abs() < 0.004 && apart < 0.03, "{what}: {light} of the light, off by {apart}");
    }
    // The test can fail: fewer rays have a larger error.
    let fewer = traced_together(gpu, 16, Sampled { diffuse_rays: 3, ..rays });
    assert!(off(&fewer, &all) > 0.06, "{}", off(&fewer, &all));
}

/// Answers of a probe for every invocation of these workgroups.
fn of_invocations(gpu: &Gpu, entry: &str, [width, height, _]: [u32; 3]) -> Vec<Vec4> {
    let order = uniform_buffer_of(&gpu.device, "sample_order", &sample_order::words());
    let invocations = (0..width * height).flat_map(|group| (0..64).map(move |invocation| [group, invocation]));
    let query = |[group, invocation]: [u32; 2]| UVec4::new(group, invocation, width, height).as_vec4();
    let about = Bindings::new().buffer("sample_order", &order);
    evaluate_points(gpu, entry, &about, &invocations.map(query).collect::<Vec<_>>(), 1)
}

/// The order covers every pixel of an image once, block by block, and successive pixels have similar shifts: the order of the host matches the shifts of
/// the shaders.
#[gpu_test]
fn gpu_pixel_order_covers_the_image_coherently(gpu: &Gpu) {
    let size = UVec2::new(90, 40);
    let pixels = of_invocations(gpu, "ordered_pixels", sample_order::workgroups(size));
    let seen: HashSet<_> = pixels.iter().map(|pixel| (pixel.x as u32, pixel.y as u32)).collect();
    assert_eq!(seen.len(), (96 * 64) as usize);
    assert!((0..size.y).all(|y| (0..size.x).all(|x| seen.contains(&(x, y)))), "a pixel is left out");
    assert!(
        pixels
            .chunks(1024)
            .all(|block| block.iter().all(|pixel| (pixel.xy() / 32.0).floor() == (block[0].xy() / 32.0).floor())),
        "a block is left before its end"
    );
    // Distance on a torus, mean over both axes: a quarter for random points, a thirtieth for neighbours of 1,024 evenly distributed ones.
    let apart = |a: f32, b: f32| (a - b).abs().min(1.0 - (a - b).abs());
    let steps = pixels.windows(2).map(|pair| 0.5 * (apart(pair[0].z, pair[1].z) + apart(pair[0].w, pair[1].w)));
    let mean = steps.sum::<f32>() / pixels.len() as f32;
    assert!(mean < 0.05, "{mean}");

    // Shifts of the pixels of every aligned square of 2^k x 2^k, up to 32, are a net: one lies in each strip, column and box of the corresponding area of
    // the unit square. Squares of 32 pixels differ by a constant.
    let shifts: HashMap<_, _> = pixels.iter().map(|pixel| (pixel.xy().as_uvec2(), pixel.zw())).collect();
    let first: Vec<(UVec2, Vec2)> =
        shifts.iter().map(|(at, shift)| (*at, *shift)).filter(|(at, _)| at.max_element() < 32).collect();
    for k in 1..=5 {
        for strips in 0..=2 * k {
            // The width of a box is 2^-strips; there is one box for each of the square's pixels.
            let boxes = Vec2::new((1 << strips) as f32, (1 << (2 * k - strips)) as f32);
            let taken: HashSet<_> = first.iter().map(|(at, shift)| (*at >> k, (*shift * boxes).as_uvec2())).collect();
            assert_eq!(taken.len(), first.len(), "squares of {} pixels, {boxes} boxes", 1 << k);
        }
    }
    let apart = |at: UVec2, to: UVec2| (shifts[&(at + to)] - shifts[&at]).rem_euclid(Vec2::ONE);
    let others = [UVec2::new(32, 0), UVec2::new(0, 32), UVec2::new(32, 32)];
    for to in others {
        assert!(first.iter().all(|(at, _)| apart(*at, to).abs_diff_eq(apart(UVec2::ZERO, to), 1e-6)), "{to}");
    }
    // The constants of four squares all differ.
    let moved = others.map(|to| apart(UVec2::ZERO, to));
    let differ = |a: Vec2, b: Vec2| (a - b).abs().min(1.0 - (a - b).abs()).min_element() > 0.05;
    assert!(moved.iter().all(|a| differ(*a, Vec2::ZERO)), "{moved:?}");
    assert!(differ(moved[0], moved[1]) && differ(moved[0], moved[2]) && differ(moved[1], moved[2]), "{moved:?}");
}

/// Each pixel has a unique index for the data of its rays, and the index identifies the pixel.
#[gpu_test]
fn gpu_every_pixel_has_a_unique_index(gpu: &Gpu) {
    let order = uniform_buffer_of(&gpu.device, "sample_order", &sample_order::words());
    let about = Bindings::new().buffer("sample_order", &order);
    let size = UVec2::new(90, 40);
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
    let queries: Vec<_> = pixels.map(|pixel| pixel.extend(size.x).extend(size.y).as_vec4()).collect();
    let answers = evaluate_points(gpu, "places_of_pixels", &about, &queries, 1);
    let count = sample_order::place_count(size);
    let places: HashSet<_> = answers.iter().map(|answer| answer.x as u32).collect();
    assert_eq!(places.len(), queries.len());
    assert!(places.iter().all(|place| *place < count));
    for (query, answer) in queries.iter().zip(&answers) {
        assert_eq!((answer.yz(), answer.w), (query.xy(), count as f32));
    }

    // Invocations of a pass by rows of blocks follow the index in order.
    let answers = of_invocations(gpu, "places_in_rows", sample_order::workgroups_in_rows(size));
    assert_eq!(answers.len(), count as usize);
    for (i, answer) in answers.iter().enumerate() {
        assert_eq!((answer.z, answer.w), (i as f32, i as f32));
        let is_seen = answer.xy().cmplt(size.as_vec2()).all();
        assert_eq!(is_seen, places.contains(&(i as u32)));
    }
}

/// Without glossy rays, the weight of a ray does not depend on its direction.
#[gpu_test]
fn gpu_weights_of_diffuse_rays_need_no_directions(gpu: &Gpu) {
    let rays =
        SampledParameters { diffuse_rays: 8, diffuse_density: 8.0, most_roughness: f32::MAX, ..Default::default() };
    let parameters = SampledParameters { first_points: UVec2::splat(40), ..rays };
    let sampled = uniform_buffer_of(&gpu.device, "sampled", &parameters);
    let view = uniform_buffer_of(&gpu.device, "view", &View::default());
    let mut random = Random::new(3);
    let mut queries = Vec::new();
    for i in 0..4000 {
        let normal = random.direction();
        // Direction towards the viewer.
        let towards = (normal + 0.99 * random.direction()).normalize();
        queries.extend([normal.extend(random.unit()), towards.extend((i % 8) as f32)]);
        queries.push(Vec4::new(random.unit(), random.unit(), 0.0, 0.0));
    }
    let about = Bindings::new().buffer("sampled", &sampled).buffer("view", &view);
    let answers = evaluate_module(gpu, "testing/ray_weights", "weights", &about, &queries, 3);
    let off = |a: Vec2, b: Vec2| (a - b).abs().max_element();
    // A ray within rounding of the surface may have weight 0.
    let apart = answers.iter().filter(|answer| off(answer.xy(), answer.zw()) > 1e-5).count();
    assert!(apart <= 4, "{apart} of {}", answers.len());
    // Total weights are equal, but the grazing fractions differ: the comparison can fail.
    assert!(answers.iter().all(|answer| (answer.z + answer.w - 0.125).abs() < 1e-6));
    let others = answers.iter().zip(&answers[1..]).filter(|(a, b)| off(a.xy(), b.zw()) > 1e-4).count();
    assert!(2 * others > answers.len(), "{others}");
}
