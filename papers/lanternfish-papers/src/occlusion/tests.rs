mod environment;
mod glass;
mod history;

use glam::{UVec2, Vec3};
use lanternfish::{
    GpuScene, RenderError, Renderer, Settings,
    settings::{DebugView, Occlusion, Shadows},
};
use lanternfish_gpu::Gpu;
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer,
    settings::{Integrator, LightChoice},
};
use lanternfish_scene::{Camera, Material, Projection, Scene, generate::demo};

use crate::{
    Deep, DeepImageSettings, DirectionSet, Hbao,
    testing::{self, inside, looking, quad, scene_of},
};

/// The size is not a multiple of the workgroup size.
const SIZE: UVec2 = UVec2::new(61, 45);

fn deep() -> Occlusion {
    Occlusion::from(Deep::default())
}

fn settings(occlusion: Occlusion) -> Settings {
    Settings::direct_light().with_occlusion(occlusion).with_shadows(Shadows::None)
}

fn renderer(gpu: &Gpu, settings: Settings) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), settings).unwrap()
}

/// Ambient visibility of each pixel, rows from the top.
fn ambient_visibility(gpu: &Gpu, renderer: &mut Renderer, scene: &GpuScene, camera: &Camera) -> Vec<f32> {
    inside::ambient_visibility(gpu, renderer, scene, camera, SIZE)
}

/// Ambient visibility of each pixel of a scene that is uploaded for this call.
fn ambient_visibility_of(gpu: &Gpu, settings: Settings, scene: &Scene, camera: &Camera) -> Vec<f32> {
    let mut renderer = renderer(gpu, settings);
    let uploaded = renderer.upload(scene).unwrap();
    ambient_visibility(gpu, &mut renderer, &uploaded, camera)
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}

/// Mean absolute difference between pixels.
fn off(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / a.len() as f64
}

/// Root mean square difference between the means of squares of 4 x 4 pixels. Noise of single pixels counts a quarter, low-frequency
/// blotches count in full.
fn mottling(a: &[f32], b: &[f32]) -> f64 {
    let UVec2 { x: columns, y: rows } = SIZE / 4;
    let square = |i: u32| {
        let (x, y) = (4 * (i % columns), 4 * (i / columns));
        let pixels = (0..16).map(|k| ((y + k / 4) * SIZE.x + x + k % 4) as usize);
        pixels.map(|pixel| f64::from(a[pixel] - b[pixel])).sum::<f64>() / 16.0
    };
    let squares = columns * rows;
    ((0..squares).map(|i| square(i).powi(2)).sum::<f64>() / f64::from(squares)).sqrt()
}

fn white() -> Material {
    Material { metallic: 0.0, double_sided: true, ..Material::default() }
}

/// A floor of 20 x 20 m.
fn floor() -> Scene {
    scene_of(vec![quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z)], vec![white()])
}

/// Ground truth: 128 rays per pixel through exact triangles. Its own mean deviation from the exact value is at most 0.035 (half the square
/// root of 1/128, times the mean deviation of a normal distribution). Pixels at edges show several surfaces to the ground truth and one to
/// the renderer. Bounds are a quarter above the measured values.
#[gpu_test]
fn gpu_deep_images_find_the_occlusion_that_exact_rays_find(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let camera = &scene.cameras[0];
    let exact = |integrator| {
        let settings = TracerSettings { integrator, light_choice: LightChoice::Uniform, ..TracerSettings::default() };
        let mut film = Film::new(SIZE.into()).unwrap();
        Tracer::new(&scene, settings).unwrap().render(camera, &mut film, 128);
        film.mean().iter().map(|pixel| pixel[0]).collect::<Vec<f32>>()
    };
    let actual = |occlusion, resolution| {
        let deep_images = DeepImageSettings { resolution, ..DeepImageSettings::default() };
        ambient_visibility_of(gpu, settings(occlusion).with_structure(deep_images), &scene, camera)
    };
    let occlusion = exact(Integrator::Occlusion);
    let obscurance = exact(Integrator::Obscurance { max_distance: 0.6 });
    let near = Occlusion::from(Deep { max_distance: Some(0.6), ..Deep::default() });
    let mut failures = Vec::new();
    for (setting, ground_truth, resolution, most_off, most_mottled, most_biased) in [
        (deep(), &occlusion, 64, 0.034, 0.022, 0.01),
        (deep(), &occlusion, 128, 0.034, 0.022, 0.01),
        (near.clone(), &obscurance, 64, 0.016, 0.011, 0.004),
        (near, &obscurance, 128, 0.016, 0.011, 0.004),
    ] {
        let actual = actual(setting.clone(), resolution);
        let (off, bias) = (off(&actual, ground_truth), mean(&actual) - mean(ground_truth));
        let mottled = mottling(&actual, ground_truth);
        let line = format!("{setting:?} at {resolution}: off by {off:.4}, squares by {mottled:.4}, bias {bias:+.4}");
        println!("{line}");
        if off >= most_off || mottled >= most_mottled || bias.abs() >= most_biased {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    // As the paper has it: the same answer, coarser.
    let plain = actual(Deep { plain: true, ..Deep::default() }.into(), 128);
    let (plain_off, bias) = (off(&plain, &occlusion), mean(&plain) - mean(&occlusion));
    println!("plain at 128: off by {plain_off:.4}, bias {bias:+.4}");
    assert!(plain_off < 0.04 && bias.abs() < 0.016, "plain: {plain_off}, {bias}");
    assert!(off(&plain, &actual(deep(), 128)) > 0.005, "the same as with tests of triangles");
    // The comparison detects another distance and missing occlusion.
    let farther = actual(Occlusion::from(Deep { max_distance: Some(0.9), ..Deep::default() }), 64);
    assert!(
        off(&farther, &obscurance) > 0.05,
        "insensitive to a distance 1.5 times as large: {}",
        off(&farther, &obscurance)
    );
    let unoccluded = vec![1.0; pixel_count()];
    assert!(off(&unoccluded, &obscurance) > 0.08 && off(&unoccluded, &occlusion) > 0.2);
}

fn pixel_count() -> usize {
    (SIZE.x * SIZE.y) as usize
}

#[gpu_test]
fn gpu_an_unoccluded_plane_is_visible_and_a_closed_box_is_occluded(gpu: &Gpu) {
    let camera = looking([1.0, 1.5, 4.0], [0.0, 0.0, -1.0]);
    for occlusion in [
        deep(),
        Occlusion::from(Deep { max_distance: Some(3.0), ..Deep::default() }),
        Occlusion::from(Hbao { radius: 3.0, ..Hbao::default() }),
    ] {
        let actual = ambient_visibility_of(gpu, settings(occlusion.clone()), &floor(), &camera);
        let least = actual.iter().copied().fold(f32::INFINITY, f32::min);
        // A device may round 1 to the next lower number.
        assert!(least > 1.0 - 1e-6, "{occlusion:?}: {least}");
    }
    // The paper's sum gives what its directions do, for any plane: a number near 1.
    let directions = DirectionSet::ZonalEqualArea { count: 64 };
    let expected = {
        let set = crate::deep_images::directions::Directions::new(directions).unwrap();
        2.0 / 64.0 * set.axes().iter().map(|axis| axis.y.abs()).sum::<f32>()
    };
    let plain = settings(Deep { plain: true, ..Deep::default() }.into());
    let structure = DeepImageSettings { directions, ..DeepImageSettings::default() };
    let actual = ambient_visibility_of(
        gpu,
        plain.clone().with_structure(structure),
        &floor(),
        &looking([0.0, 3.0, 0.1], [0.0; 3]),
    );
    let off = actual.iter().map(|open| (open - expected).abs()).fold(0.0, f32::max);
    println!("plain: {expected}, off by {off}");
    assert!(off < 1e-5 && (expected - 1.0).abs() < 0.02 && expected != 1.0, "{expected}, off by {off}");
    // A box around the camera: visible directions pass its edges, within a texel.
    let side = |axis: Vec3| {
        let (right, up) = axis.any_orthonormal_pair();
        quad(0, 2.0 * axis, 2.0 * right, 2.0 * up)
    };
    let sides = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(side);
    let closed = scene_of(sides.into(), vec![white()]);
    let camera = looking([1.2, 0.3, 1.4], [-2.0, -1.0, -1.5]);
    let [coarse, fine] = [64, 256].map(|resolution| {
        let deep_images = DeepImageSettings { resolution, ..DeepImageSettings::default() };
        mean(&ambient_visibility_of(gpu, settings(deep()).with_structure(deep_images), &closed, &camera))
    });
    println!("closed: {coarse:.4}, {fine:.4}");
    let plain = mean(&ambient_visibility_of(gpu, plain, &closed, &camera));
    println!("closed, plain: {plain:.4}");
    assert!(plain < 0.1, "{plain}");
    assert!(coarse < 0.06 && fine < 0.5 * coarse, "{coarse} {fine}");
}

/// Half of the hemisphere is occluded on a floor at the foot of an endless wall; nothing is occluded at a distance of one radius.
#[gpu_test]
fn gpu_horizons_darken_a_corner(gpu: &Gpu) {
    let mut scene = floor();
    scene.meshes[0].primitives.push(quad(0, Vec3::new(0.0, 5.0, -2.0), 10.0 * Vec3::X, 5.0 * Vec3::Y));
    // Straight down: a column of pixels runs from the wall's foot outwards.
    let camera = Camera::look_at(
        Vec3::new(0.0, 3.0, -0.6),
        Vec3::new(0.0, 0.0, -0.6),
        Projection::Perspective { fov_y: 1.0, near: 0.05 },
    );
    let occlusion = Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() });
    let actual = ambient_visibility_of(gpu, settings(occlusion), &scene, &camera);
    let at = |y: u32| actual[(y * SIZE.x + SIZE.x / 2) as usize];
    let column: Vec<f32> = (0..SIZE.y).map(at).collect();
    let darkest = column.iter().copied().fold(f32::INFINITY, f32::min);
    assert!((0.4..0.75).contains(&darkest) && column[SIZE.y as usize - 4] > 0.97, "{column:.2?}");
}

/// Samples by the radius are as dense for a large radius as for a small one: half the step finds nothing new.
#[gpu_test]
fn gpu_samples_in_proportion_to_the_radius_converge(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let visibility = |step| {
        let hbao = Hbao { radius: 2.0, step };
        ambient_visibility_of(gpu, settings(hbao.into()), &scene, &scene.cameras[0])
    };
    let dense = visibility(Some(0.25));
    let [fixed, coarse, fine] = [None, Some(8.0), Some(0.5)].map(|step| off(&visibility(step), &dense));
    println!("off: 12 samples {fixed:.4}, every 8 pixels {coarse:.4}, every half {fine:.4}");
    assert!(fine < 0.25 * fixed && fine < 0.25 * coarse && fixed > 0.0, "{fixed} {coarse} {fine}");
}

/// Where a floor touches a wall, a texel's axis may pass behind the wall. Ground truth: at distance x from a long wall of height h, the
/// fraction (1 - x / √(x² + h²)) / 2 of a floor's hemisphere is occluded. A row of pixels is at one distance; its mean is free of most
/// noise.
#[gpu_test]
fn gpu_creases_do_not_glow(gpu: &Gpu) {
    // The floor extends behind the wall or ends there.
    for foot in [-2.0, -10.0] {
        let mut scene = floor();
        scene.meshes[0].primitives.push(quad(0, Vec3::new(0.0, 5.0, foot), 10.0 * Vec3::X, 5.0 * Vec3::Y));
        // Straight down; the wall's foot is at the upper edge.
        let projection = Projection::Orthographic { half_height: 1.0, near: 0.0, far: 20.0 };
        let camera = Camera::look_at(Vec3::new(0.0, 3.0, foot + 1.0), Vec3::new(0.0, 0.0, foot + 1.0), projection);
        for resolution in [64, 128] {
            let deep_images = DeepImageSettings { resolution, ..DeepImageSettings::default() };
            let actual = ambient_visibility_of(gpu, settings(deep()).with_structure(deep_images), &scene, &camera);
            let rows: Vec<f64> = actual.chunks(SIZE.x as usize).map(mean).collect();
            let ground_truth = |row: usize| {
                let distance = 2.0 * (row as f64 + 0.5) / f64::from(SIZE.y);
                0.5 + 0.5 * distance / distance.hypot(10.0)
            };
            println!("{foot} at {resolution}: {rows:.2?}");
            for (row, actual) in rows.iter().enumerate() {
                let ground_truth = ground_truth(row);
                assert!(
                    (actual - ground_truth).abs() < 0.05,
                    "{foot} at {resolution}, row {row}: {actual} instead of {ground_truth}"
                );
            }
        }
    }
}

#[gpu_test]
fn gpu_frames_of_a_mean_use_different_directions(gpu: &Gpu) {
    let mut scene = floor();
    scene.meshes[0].primitives.push(quad(0, 0.4 * Vec3::Y, 0.8 * Vec3::X, -0.8 * Vec3::Z));
    scene.sky = Vec3::ONE;
    let camera = looking([0.0, 1.5, 5.0], [0.0, 0.0, 0.0]);
    let radiance = |count, accumulate| {
        let directions = DirectionSet::ZonalEqualArea { count };
        let deep_images = DeepImageSettings { directions, resolution: 128, ..DeepImageSettings::default() };
        let mut renderer = renderer(gpu, settings(deep()).with_structure(deep_images).with_accumulate(accumulate));
        let uploaded = renderer.upload(&scene).unwrap();
        let rendering = renderer.render(&uploaded, &camera, SIZE.into()).unwrap();
        rendering.radiance.iter().map(|pixel| pixel[0]).collect::<Vec<f32>>()
    };
    let many = radiance(400, 4);
    let (one, mean) = (off(&radiance(10, 1), &many), off(&radiance(10, 16), &many));
    println!("10 directions are off by {one:.4}, their mean by {mean:.4}");
    assert!(mean < 0.6 * one, "{mean} {one}");
}

#[gpu_test]
fn gpu_unsupported_settings_are_refused_with_a_remedy(gpu: &Gpu) {
    let refused = |settings| Renderer::with_engine(&testing::engine(gpu), settings).unwrap_err();
    for distance in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        for occlusion in [
            Occlusion::from(Deep { max_distance: Some(distance), ..Deep::default() }),
            Occlusion::from(Hbao { radius: distance, ..Hbao::default() }),
        ] {
            let error = refused(settings(occlusion));
            assert!(matches!(error, RenderError::Value { .. }), "{error}");
        }
    }
    let error = refused(settings(Occlusion::NONE).with_debug_view(Some(DebugView::Occlusion)));
    assert!(error.to_string().contains("`occlusion`"), "{error}");
}
