//! Temporal accumulation of indirect light.

use glam::Vec2;

use super::*;
use crate::{settings::History, techniques::Probes};

/// Few rays of both kinds, not filtered.
fn few() -> Sampled {
    Sampled { diffuse_rays: 2, glossy_rays: 1, ..sampled(Tracer::BVH) }
}

fn with_history(history: History, sampled: Sampled) -> Settings {
    settings(sampled).with_history(history)
}

/// The first image of a renderer, and a mean, are bit-identical with and without a history.
#[gpu_test]
fn gpu_first_frame_and_its_mean_have_no_history(gpu: &Gpu) {
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let usual = Sampled { filter_radius: 4, clamp: IndirectClamp::On, ..few() };
    for (technique, accumulate, samples) in [
        (Indirect::from(usual), 1, Samples::One),
        (Indirect::from(usual), 2, Samples::Four),
        (Indirect::from(Sampled { hit_light: HitLight::Cached, ..usual }), 2, Samples::One),
        (Indirect::from(Sampled { resolution: IndirectResolution::Half, ..usual }), 2, Samples::One),
    ] {
        let of = |history| {
            let settings = over_frames(usual, accumulate).with_samples(samples).with_history(history);
            rendering(gpu, settings.with_indirect(technique.clone()), &scene, &camera)
        };
        assert!(of(History::Off) == of(History::On), "{accumulate} frames, {samples:?}, {technique:?}");
    }
}

/// While the camera moves, accumulation reduces the noise and preserves the energy. At rest, the mean includes the history, and converges to the same
/// image.
#[gpu_test]
fn gpu_accumulation_reduces_noise_of_a_moving_camera(gpu: &Gpu) {
    let scene = cornell();
    let at = |step: u32| looking([0.02 * step as f32, 1.0, 2.6 - 0.01 * step as f32], CAMERA.1);
    let last = 12;
    let many = Sampled { diffuse_rays: 256, glossy_rays: 32, ..few() };
    let ground_truth = rendering(gpu, settings(many), &scene, &at(last));
    let direct = rendering(gpu, settings(many).with_indirect(Indirect::NONE), &scene, &at(last));
    let light = mean(&ground_truth) - mean(&direct);
    let walked = |history| {
        let mut renderer = walks::renderer(gpu, with_history(history, few()));
        let uploaded = renderer.upload(&scene).unwrap();
        let renderings = (0..=last).map(|step| renderer.render(&uploaded, &at(step), SIZE.into()).unwrap());
        pixels(&renderings.last().unwrap())
    };
    let [without, with] = [History::Off, History::On].map(walked);
    let [noise, kept] = [&without, &with].map(|rendering| off(rendering, &ground_truth));
    let brought = (mean(&with) - mean(&direct)) / light;
    println!("off by {noise:.4} without, by {kept:.4} with; {brought:.4} of the light");
    assert!(kept < 0.5 * noise && (brought - 1.0).abs() < 0.03, "{noise}, {kept}, {brought}");

    let rested = |history| {
        let mut renderer = walks::renderer(gpu, with_history(history, few()));
        let uploaded = renderer.upload(&scene).unwrap();
        (0..last).for_each(|step| {
            renderer.refine(&uploaded, &[(&at(step), SIZE.into())]).unwrap();
        });
        let mut refine = || pixels(&renderer.refine(&uploaded, &[(&at(last), SIZE.into())]).unwrap()[0]);
        let first = refine();
        let fourth = (0..3).map(|_| refine()).last().unwrap();
        (first, fourth, (0..28).map(|_| refine()).last().unwrap())
    };
    let mean_ground_truth = rendering(gpu, over_frames(Sampled { diffuse_rays: 32, ..many }, 32), &scene, &at(last));
    let [without, with] = [History::Off, History::On].map(rested);
    let errors = [&without.1, &with.1, &without.2, &with.2].map(|rendering| off(rendering, &mean_ground_truth));
    println!(
        "at rest, of 4 frames {:.4} without, {:.4} with; of 32 {:.4}, {:.4}",
        errors[0], errors[1], errors[2], errors[3]
    );
    assert!(errors[1] < 0.7 * errors[0] && errors[3] < 1.1 * errors[2], "{errors:?}");
    let later = (mean(&with.2) / mean(&mean_ground_truth) - 1.0).abs();
    assert!(later < 0.01, "{later}");
}

/// A lamp that is switched off leaves no ghost; a lamp that changes its colour is followed.
#[gpu_test]
fn gpu_accumulation_follows_changing_light(gpu: &Gpu) {
    let camera = looking(CAMERA.0, CAMERA.1);
    let lit = cornell();
    let with_lamp =
        |intensity: Vec3| Scene { lights: vec![Light::point(Vec3::new(0.0, 1.2, 0.5), intensity)], ..lit.clone() };
    let mut renderer = walks::renderer(gpu, with_history(History::On, few()));
    let mut uploaded = renderer.upload(&lit).unwrap();
    let render = |renderer: &mut Renderer, uploaded: &crate::GpuScene| {
        pixels(&renderer.render(uploaded, &camera, SIZE.into()).unwrap())
    };
    (0..12).for_each(|_| _ = render(&mut renderer, &uploaded));
    let dim = with_lamp(Vec3::new(0.5, 0.5, 1.0));
    renderer.update(&mut uploaded, &dim).unwrap();
    let ground_truth = rendering(gpu, settings(Sampled { diffuse_rays: 256, ..few() }), &dim, &camera);
    let alone = off(&rendering(gpu, settings(few()), &dim, &camera), &ground_truth);
    let frames: Vec<f64> = (0..16).map(|_| off(&render(&mut renderer, &uploaded), &ground_truth)).collect();
    println!("off by {:.3?}; a frame alone by {alone:.3}", [0, 3, 15].map(|k: usize| frames[k]));
    assert!(frames[0] < 1.5 * alone && frames[3] < alone && frames[15] < 0.5 * alone, "{frames:?}");
    // Red after blue: no blue light remains.
    renderer.update(&mut uploaded, &with_lamp(Vec3::new(2.0, 0.0, 0.0))).unwrap();
    let blue_over_red = |pixels: Vec<Vec3>| {
        let sum: Vec3 = pixels.iter().sum();
        f64::from(sum.z / sum.x)
    };
    let red: Vec<f64> = (0..8).map(|_| blue_over_red(render(&mut renderer, &uploaded))).collect();
    println!("blue over red {red:.4?}");
    assert!(red[0] < 0.1 && red[7] < 0.02, "{red:?}");
    renderer.update(&mut uploaded, &with_lamp(Vec3::ZERO)).unwrap();
    let left = mean(&render(&mut renderer, &uploaded));
    // Except where too few neighbours are of the same surface.
    assert!(left < 1e-3 * mean(&ground_truth), "{left} is left of {}", mean(&ground_truth));
}

/// A bright lamp is switched off and on again while a dim one of another colour stays on: its indirect light disappears and returns at once, in the
/// history of pixels and in cache entries with every bounce, with rays from every pixel and with probes.
#[gpu_test]
fn gpu_switched_off_lamp_leaves_no_ghost(gpu: &Gpu) {
    let camera = looking(CAMERA.0, CAMERA.1);
    let lamp = |x: f32, intensity: Vec3| Light::point(Vec3::new(x, 1.7, 0.0), intensity);
    let [dim, bright] = [lamp(0.5, Vec3::new(0.5, 0.7, 1.0)), lamp(-0.5, Vec3::new(60.0, 50.0, 30.0))];
    let dark = Scene { lights: vec![dim.clone()], ..cornell() };
    let lit = Scene { lights: vec![dim, bright], ..cornell() };
    // The history is clamped to a quarter of a standard deviation, which is about the mean, and is four fifths of the first frame.
    let rays = Sampled { diffuse_rays: 8, filter_radius: 4, ..few() };
    let cached = Sampled { hit_light: HitLight::Cached, bounces: Bounces::All, ..rays };
    let probes = Probes { per_pixel: cached, ..Probes::default() };
    // Probes of tiles of eight pixels lack a tenth of the light of rays from every pixel in an image this small, at rest too.
    let techniques = [("cached", Indirect::from(cached), 0.9), ("probes", Indirect::from(probes), 0.85)];
    for (name, indirect, least) in techniques.into_iter().take(if testing::is_full() { 2 } else { 1 }) {
        let settings = settings(rays).with_indirect(indirect);
        let mut renderer = walks::renderer(gpu, settings.clone().with_history(History::On));
        let mut uploaded = renderer.upload(&lit).unwrap();
        let render = |renderer: &mut Renderer, uploaded: &crate::GpuScene| {
            mean(&pixels(&renderer.render(uploaded, &camera, SIZE.into()).unwrap()))
        };
        (0..12).for_each(|_| _ = render(&mut renderer, &uploaded));
        let mut after = |scene: &Scene, frames: usize| {
            let of = |settings| mean(&rendering(gpu, settings, scene, &camera));
            let direct = of(settings.clone().with_indirect(Indirect::NONE));
            let expected = of(settings.clone().with_accumulate(8)) - direct;
            renderer.update(&mut uploaded, scene).unwrap();
            let actual: Vec<f64> =
                (0..frames).map(|_| (render(&mut renderer, &uploaded) - direct) / expected).collect();
            [0, 3].map(|k: usize| actual[k])
        };
        // Until the reset window of the first change is over: entries are not reset again within it.
        let (left, come) = (after(&dark, 12), after(&lit, 4));
        println!("{name}: of the light after 1 and 4 frames {left:.3?}, of the lamp's own {come:.3?}");
        assert!(left.iter().zip([1.2, 1.05]).all(|(left, most)| (least..most).contains(left)), "{left:?}");
        assert!(come.iter().zip([0.8, 0.9]).all(|(come, least)| (least..1.1).contains(come)), "{come:?}");
    }
}

/// While something changes in every frame, indirect light follows a lamp that goes out behind a wall. What is left for some frames is the history of
/// pixels: entries of the cache follow at once.
#[gpu_test]
fn gpu_hidden_lamp_goes_out_at_once_in_a_changing_scene(gpu: &Gpu) {
    let camera = looking([0.0, 0.0, 0.9], [0.3, -0.4, 0.0]);
    // The wall is as high as two thirds of the room.
    let mut room = closed_box(matt(0.7));
    room.meshes[0].primitives.push(quad(0, Vec3::new(0.0, -0.35, 0.0), Vec3::X, 0.65 * Vec3::Y));
    let lit = |hidden: f32, step: usize| {
        let flicker = 0.02 + 0.001 * (step % 2) as f32;
        let lights = [([0.0, -0.6, -0.6], hidden), ([0.5, 0.5, 0.6], flicker)];
        let lights = lights.map(|(at, candela)| Light::point(Vec3::from(at), Vec3::splat(candela))).to_vec();
        Scene { lights, ..room.clone() }
    };
    let rays =
        Sampled { diffuse_rays: 4, hit_light: HitLight::Cached, bounces: Bounces::All, filter_radius: 4, ..few() };
    let [on, off] = [1.0, 0.0].map(|hidden| {
        let of = |settings| mean(&rendering(gpu, settings, &lit(hidden, 0), &camera));
        let direct = of(settings(rays).with_indirect(Indirect::NONE));
        [direct, of(over_frames(rays, 8)) - direct]
    });
    let mut renderer = walks::renderer(gpu, with_history(History::On, rays));
    let mut uploaded = renderer.upload(&lit(1.0, 0)).unwrap();
    let mut frame = |hidden: f32, step: usize, [direct, _]: [f64; 2]| {
        renderer.update(&mut uploaded, &lit(hidden, step)).unwrap();
        mean(&pixels(&renderer.render(&uploaded, &camera, SIZE.into()).unwrap())) - direct
    };
    let before = (1..6).map(|step| frame(1.0, step, on) / on[1]).collect::<Vec<_>>();
    let left = (0..8).map(|step| (frame(0.0, step, off) - off[1]) / (on[1] - off[1])).collect::<Vec<_>>();
    assert!(before.iter().all(|before| (0.93..1.07).contains(before)), "{before:?}");
    assert!(left[1] < 0.5 && left[3] < 0.15 && left[7].abs() < 0.05, "{left:?}");
}

/// Lamps that jump, one in each frame, as falling ones start again at the top: light that they bring elsewhere is found by samples, so what they brought
/// does not go before. Of many lamps an entry's sample chooses one.
#[gpu_test]
fn gpu_lamps_that_jump_keep_their_light(gpu: &Gpu) {
    let camera = looking([0.0, 0.0, 0.9], [0.3, -0.4, 0.0]);
    let lit = |step: usize| {
        let at = |i: usize| {
            let place = 1.6 * (Vec2::new(0.7549, 0.5698) * (i + 31 * ((step + 23 - i) / 24)) as f32).fract() - 0.8;
            Vec3::new(place.x, 0.3 * (i % 4) as f32 - 0.4, place.y)
        };
        let lights = (0..24).map(|i| Light::point(at(i), Vec3::splat(0.05))).collect();
        Scene { lights, ..closed_box(matt(0.7)) }
    };
    let rays =
        Sampled { diffuse_rays: 4, hit_light: HitLight::Cached, bounces: Bounces::All, filter_radius: 4, ..few() };
    let mut renderer = walks::renderer(gpu, with_history(History::On, rays));
    let mut uploaded = renderer.upload(&lit(0)).unwrap();
    let [mut moving, mut still] = [0.0; 2];
    for step in 1..25 {
        renderer.update(&mut uploaded, &lit(step)).unwrap();
        let image = pixels(&renderer.render(&uploaded, &camera, SIZE.into()).unwrap());
        if step % 6 == 0 {
            moving += mean(&image);
            still += mean(&rendering(gpu, over_frames(rays, 4), &lit(step), &camera));
        }
    }
    assert!((moving / still - 1.0).abs() < 0.02, "{}", moving / still);
}

/// Disoccluded surfaces get no light of the object that was in front of them, and the moving object keeps its history.
#[gpu_test]
fn gpu_moving_surfaces_keep_their_history_without_ghosts(gpu: &Gpu) {
    let mut scene = floor(matt(0.8));
    scene.sky = Vec3::ONE;
    scene.materials.push(matt(0.05));
    let card = quad(1, Vec3::new(0.0, 0.5, 0.0), 0.5 * Vec3::X, -0.5 * Vec3::Z);
    let card = lanternfish_scene::Mesh { primitives: vec![card], ..scene.meshes[0].clone() };
    scene.meshes.push(card);
    let instance = lanternfish_scene::Instance { mesh: scene.meshes.len() - 1, ..scene.instances[0].clone() };
    scene.instances.push(instance);
    let camera = looking([0.0, 3.0, 0.5], [0.0, 0.0, 0.0]);
    let card = |step: u32| Affine3A::from_translation(Vec3::new(0.04 * step as f32 - 0.3, 0.0, 0.0));
    scene.instances[1].world_from_object = card(11);
    let many = Sampled { diffuse_rays: 128, ..few() };
    let ground_truth = image_of(gpu, LARGE, settings(many), &scene, &camera);
    scene.instances[1].world_from_object = card(10);
    let before = image_of(gpu, LARGE, settings(many), &scene, &camera);
    scene.instances[1].world_from_object = Affine3A::IDENTITY;
    let of = |history| {
        let mut renderer = walks::renderer(gpu, with_history(history, few()));
        let mut uploaded = renderer.upload(&scene).unwrap();
        let moved = (0..12).map(|step| {
            renderer.move_instances(&mut uploaded, &[(1, card(step))]).unwrap();
            pixels(&renderer.render(&uploaded, &camera, LARGE.into()).unwrap())
        });
        moved.last().unwrap()
    };
    let [without, with] = [History::Off, History::On].map(of);
    let [noise, kept] = [&without, &with].map(|rendering| off(rendering, &ground_truth));
    // The disoccluded area, which the card covered in the previous frame: the card is a twentieth as bright.
    let uncovered: Vec<usize> = (0..ground_truth.len()).filter(|i| before[*i].x < 0.3 * ground_truth[*i].x).collect();
    let of_uncovered = |rendering: &[Vec3]| uncovered.iter().map(|i| f64::from(rendering[*i].x)).sum::<f64>();
    let brought = of_uncovered(&with) / of_uncovered(&ground_truth);
    println!("off by {noise:.4} without, by {kept:.4} with; {} pixels uncovered get {brought:.3}", uncovered.len());
    assert!(kept < 0.8 * noise, "{kept} of {noise}");
    assert!(uncovered.len() > 10 && (brought - 1.0).abs() < 0.2, "{brought} of {}", uncovered.len());
}

/// After a cut of the camera, what was hidden has no history: its image does not depend on what was seen before the cut.
#[gpu_test]
fn gpu_a_cut_leaves_nothing_of_what_was_seen_before(gpu: &Gpu) {
    let mut scene = floor(matt(0.8));
    scene.sky = Vec3::new(1.0, 0.5, 0.25);
    // A card above the floor, smaller than the floor, that hides all of it from above.
    scene.meshes[0].primitives.push(quad(0, Vec3::new(0.0, 1.5, 0.0), Vec3::X, -Vec3::Z));
    let [above, below, beside] =
        [[0.0, 2.5, 0.01], [0.0, 1.2, 0.01], [0.05, 1.2, 0.01]].map(|eye| looking(eye, [0.0; 3]));
    let up = looking([0.0, 2.0, 0.01], [0.0, 9.0, 0.0]);
    let after = |first: &Camera| {
        let mut renderer = walks::renderer(gpu, with_history(History::On, Sampled { filter_radius: 4, ..few() }));
        let uploaded = renderer.upload(&scene).unwrap();
        (0..3).for_each(|_| _ = renderer.render(&uploaded, first, SIZE.into()).unwrap());
        renderer.render(&uploaded, &below, SIZE.into()).unwrap().radiance
    };
    let [of_card, of_sky, of_floor] = [&above, &up, &beside].map(after);
    assert!(of_card == of_sky, "of the card before the cut something is left");
    assert!(of_floor != of_sky, "a history of the floor itself is used");
}
