use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Camera, Light, Material, Scene};

use crate::{
    Renderer, Settings, Target, ViewRequest,
    settings::{Antialiasing, Samples, Shadows},
    testing::{looking, quad, scene_of},
};

const SIZE: (u32, u32) = (64, 48);
/// Frames after which the mean of frames has settled.
const SETTLED: u32 = 24;

fn settings(antialiasing: Antialiasing) -> Settings {
    Settings::direct_light().with_antialiasing(antialiasing).with_shadows(Shadows::None)
}

/// A dark wall with a bright, tilted board before it, both of them emissive: frames have no noise.
fn board() -> Scene {
    let shining = |radiance| Material { emissive: Vec3::splat(radiance), double_sided: true, ..Material::default() };
    let wall = quad(0, Vec3::new(0.0, 0.0, -1.0), 4.0 * Vec3::X, 3.0 * Vec3::Y);
    let tilted = quad(1, Vec3::ZERO, Vec3::new(0.5, 0.13, 0.0), Vec3::new(-0.09, 0.4, 0.0));
    let mut scene = scene_of(vec![wall], vec![shining(0.1), shining(1.0)]);
    let board = scene_of(vec![tilted], Vec::new());
    scene.meshes.extend(board.meshes);
    let instance = lanternfish_scene::Instance { mesh: 1, ..scene.instances[0].clone() };
    scene.instances.push(instance);
    scene
}

fn camera() -> Camera {
    looking([0.0, 0.0, 2.0], [0.0, 0.0, 0.0])
}

/// Luminance of the pixels of the last of `count` frames. `pose` gives scene and camera of each.
fn last(gpu: &Gpu, settings: Settings, count: u32, pose: impl Fn(u32) -> (Scene, Camera)) -> Vec<f32> {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let mut uploaded = renderer.upload(&pose(0).0).unwrap();
    let mut radiance = Vec::new();
    for frame in 0..count {
        let (scene, camera) = pose(frame);
        renderer.update(&mut uploaded, &scene).unwrap();
        radiance = renderer.render(&uploaded, &camera, SIZE.into()).unwrap().radiance;
    }
    radiance.iter().map(|texel| texel[1]).collect()
}

/// Root mean square difference of two images.
fn error(image: &[f32], reference: &[f32]) -> f32 {
    let sum: f32 = image.iter().zip(reference).map(|(a, b)| (a - b) * (a - b)).sum();
    (sum / image.len() as f32).sqrt()
}

/// Sixty-four points of each pixel.
fn reference(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Vec<f32> {
    let settings = settings(Antialiasing::None).with_accumulate(64);
    last(gpu, settings, 1, |_| (scene.clone(), camera.clone()))
}

#[gpu_test]
fn gpu_the_first_frame_is_that_without_antialiasing_to_the_bit(gpu: &Gpu) {
    let of = |antialiasing, count| last(gpu, settings(antialiasing), count, |_| (board(), camera()));
    let bits = |image: Vec<f32>| image.into_iter().map(f32::to_bits).collect::<Vec<_>>();
    let plain = bits(of(Antialiasing::None, 1));
    assert!(bits(of(Antialiasing::Temporal, 1)) == plain);
    // Check that the test can fail: the second frame has other points.
    assert!(bits(of(Antialiasing::Temporal, 2)) != plain);
    assert!(bits(of(Antialiasing::None, 2)) == plain);
}

#[gpu_test]
fn gpu_edges_at_rest_are_as_smooth_as_with_four_samples(gpu: &Gpu) {
    let (scene, camera) = (board(), camera());
    let reference = reference(gpu, &scene, &camera);
    let of = |settings, count| error(&last(gpu, settings, count, |_| (scene.clone(), camera.clone())), &reference);
    let plain = of(settings(Antialiasing::None), 1);
    let multisampled = of(settings(Antialiasing::None).with_samples(Samples::Four), 1);
    let temporal = of(settings(Antialiasing::Temporal), SETTLED);
    println!("error without {plain:.4}, with four samples {multisampled:.4}, temporal {temporal:.4}");
    assert!(temporal < multisampled && multisampled < plain, "{temporal} {multisampled} {plain}");
}

/// Clipping to the neighbourhood would keep light of the former lamp where the board and the wall meet.
#[gpu_test]
fn gpu_a_lamp_that_goes_out_leaves_no_light_at_edges(gpu: &Gpu) {
    let lamp = |intensity| Light::point(Vec3::new(0.0, 0.0, 1.5), Vec3::splat(intensity));
    // Light of a sun behind the wall keeps the unit of light, and with it the history.
    let lights = |intensity| vec![lamp(intensity), Light::directional(Vec3::Z, Vec3::ONE)];
    let [lit, dark] = [30.0, 0.0].map(|intensity| Scene { lights: lights(intensity), ..board() });
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(Antialiasing::Temporal)).unwrap();
    let mut uploaded = renderer.upload(&lit).unwrap();
    let light = |image: &[[f32; 4]]| image.iter().map(|texel| texel[1]).sum::<f32>();
    let [before, after] = [(lit, 12), (dark.clone(), 1)].map(|(scene, count)| {
        renderer.update(&mut uploaded, &scene).unwrap();
        let frames = (0..count).map(|_| renderer.render(&uploaded, &camera(), SIZE.into()).unwrap().radiance);
        light(&frames.last().unwrap())
    });
    let expected = reference(gpu, &dark, &camera()).iter().sum::<f32>();
    println!("light {before:.1} with the lamp, {after:.2} after it, {expected:.2} without it");
    assert!(before > 2.0 * expected && (after / expected - 1.0).abs() < 0.02, "{before} {after} {expected}");
}

/// A board that moves by three pixels a frame: pixels that it has left show the wall, as without a history.
#[gpu_test]
fn gpu_what_moves_leaves_no_ghost(gpu: &Gpu) {
    let pose = |frame: u32| {
        let mut scene = board();
        let x = -0.9 + 0.055 * frame as f32;
        scene.instances[1].world_from_object = Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
        (scene, camera())
    };
    let after = 20;
    let reference = reference(gpu, &pose(after - 1).0, &camera());
    let image = last(gpu, settings(Antialiasing::Temporal), after, pose);
    let [width, height] = [SIZE.0 as usize, SIZE.1 as usize];
    // Pixels in whose neighbourhood nothing but the wall is visible.
    let is_wall = |x: usize, y: usize| {
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| y * width + x));
        around.into_iter().all(|i| (reference[i] - 0.1).abs() < 1e-3)
    };
    let inner = (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y)));
    let walls: Vec<usize> = inner.filter(|(x, y)| is_wall(*x, *y)).map(|(x, y)| y * width + x).collect();
    let worst = walls.iter().map(|i| (image[*i] - 0.1).abs()).fold(0.0, f32::max);
    println!("{} pixels of the wall, off by at most {worst:.5}", walls.len());
    assert!(walls.len() > 500 && worst < 0.004, "{worst}");
    // Check that the test can fail: the frame before.
    let before = self::reference(gpu, &pose(after - 2).0, &camera());
    assert!(walls.iter().any(|i| (before[*i] - 0.1).abs() > 0.1));
}

/// Alpha is the coverage of the surfaces of this frame, also behind a board that moves before nothing.
#[gpu_test]
fn gpu_coverage_does_not_trail(gpu: &Gpu) {
    let texels = |antialiasing| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings(antialiasing)).unwrap();
        let mut scene = board();
        scene.instances.remove(0);
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut texels = Vec::new();
        for frame in 0..20 {
            let x = -0.9 + 0.055 * frame as f32;
            scene.instances[0].world_from_object = Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
            renderer.update(&mut uploaded, &scene).unwrap();
            texels = renderer.render(&uploaded, &camera(), SIZE.into()).unwrap().radiance;
        }
        texels
    };
    let [plain, temporal] = [Antialiasing::None, Antialiasing::Temporal].map(texels);
    assert!(temporal.iter().all(|texel| (0.0..=1.0).contains(&texel[3])));
    // The board is jittered by up to half a pixel, and the history keeps what the pixels around have: two pixels. A trail of three pixels a frame
    // would be longer.
    let [width, height] = [SIZE.0 as usize, SIZE.1 as usize];
    let is_beside = |i: usize| {
        let rows = (i / width).saturating_sub(2)..(i / width + 3).min(height);
        let columns = (i % width).saturating_sub(2)..(i % width + 3).min(width);
        rows.flat_map(|y| columns.clone().map(move |x| y * width + x)).any(|i| plain[i][3] > 0.0)
    };
    let covered: Vec<usize> = (0..temporal.len()).filter(|i| temporal[*i][3] > 0.0).collect();
    assert!(covered.len() > 100 && covered.iter().all(|i| is_beside(*i)));
    // Check that the test can fail: most of the image is neither.
    assert!((0..temporal.len()).filter(|i| is_beside(*i)).count() < temporal.len() / 2);
    let is_bright_alone = |texel: &[f32; 4]| texel[1] > texel[3] + 0.15;
    assert!(!temporal.iter().any(is_bright_alone), "radiance without coverage");
}

/// A view that moves by three quarters of a pixel a frame has smoother edges than without antialiasing. So has one of a program that records frames and
/// asks for means: the mean begins at rest, and frames that are incomplete leave no black history.
#[gpu_test]
fn gpu_edges_of_a_moving_view_are_smoother_than_without(gpu: &Gpu) {
    let scene = board();
    let moved = |frame: u32| {
        let step = Vec3::new(0.013, 0.007, 0.0) * frame as f32;
        looking((Vec3::new(-0.2, 0.0, 2.0) + step).into(), (Vec3::new(-0.2, 0.0, 0.0) + step).into())
    };
    let recorded = |antialiasing, moves: bool| {
        let settings = settings(antialiasing).with_accumulate(2);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let mut image = Vec::new();
        for frame in 0..SETTLED {
            let camera = moved(if moves { frame } else { 0 });
            let view = ViewRequest::of_camera(1, &camera, SIZE.into(), Target::Own);
            let mut commands = gpu.device.create_command_encoder(&Default::default());
            let id = renderer.record(&mut commands, &uploaded, &[view]).unwrap();
            gpu.queue.submit([commands.finish()]);
            let id = renderer.submitted(id);
            image = renderer.read(id).unwrap().remove(0).radiance.iter().map(|texel| texel[1]).collect();
            while renderer.poll().is_some() {}
        }
        image
    };
    let rendered = |antialiasing| last(gpu, settings(antialiasing), SETTLED, |frame| (scene.clone(), moved(frame)));
    let reference = reference(gpu, &scene, &moved(SETTLED - 1));
    let both = [Antialiasing::None, Antialiasing::Temporal];
    for (name, images) in [("rendered", both.map(rendered)), ("recorded", both.map(|a| recorded(a, true)))] {
        let [plain, temporal] = images.map(|image| error(&image, &reference));
        println!("{name}: error without {plain:.4}, temporal {temporal:.4}");
        assert!(temporal < 0.7 * plain, "{name}: {temporal} {plain}");
    }
    // At rest both are means, of one frame more or less.
    let [plain, temporal] = both.map(|a| recorded(a, false));
    assert!(error(&plain, &temporal) < 0.01);
}
