//! Every pixel with a surface finds the cluster that its fragment marked [VanGelderen2020, §5.2.1].

use glam::{UVec2, Vec3};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, Gpu, Profiler, read_back, read_texture, storage_buffer, testing,
};
use lanternfish_scene::{AlphaMode, Camera, Light, Material, Primitive, Projection, Scene, generate};

use super::*;
use crate::{
    GpuScene, Renderer,
    light_culling::{LightLists, Reach},
    output::display_target,
    prepass::Prepass,
    settings::Shadows,
    shading::Forward,
    techniques::{ClusterShape, Clustered},
    testing::{Random, context, probe, quad, scene_of},
    view::View,
};

#[test]
fn quantities_are_the_shaders() {
    for view in DebugView::ALL {
        let Some(number) = quantity(*view) else { continue };
        let name = view.to_string().to_uppercase().replace('-', "_");
        assert_eq!(crate::shaders::constant("debug_views/debug", &name), f64::from(number), "{view}");
    }
}

#[test]
fn views_of_clusters_need_clusters() {
    let clustered = Culling::from(Clustered::default());
    for culling in [Culling::NONE].into_iter().chain(Culling::all()) {
        for view in DebugView::ALL {
            let shows_clusters = matches!(view, DebugView::ClusterIndex | DebugView::ClusterFragments);
            match check_clusters(*view, &culling) {
                Ok(()) => assert!(!shows_clusters || culling == clustered, "{view} with {culling:?}"),
                Err(error) => {
                    assert!(shows_clusters && culling != clustered, "{view} with {culling:?}");
                    let name = format!("`debug-view {view}` needs `culling clustered`");
                    assert_eq!(error.to_string(), name);
                }
            }
        }
    }
}

/// Every pixel of a view filled with one surface has the colour that the scale gives for the surface's value.
#[gpu_test]
fn gpu_colours_are_those_of_the_scale(gpu: &Gpu) {
    let camera = |distance: f32| {
        let projection = Projection::Orthographic { half_height: 1.0, near: 0.01, far: 1000.0 };
        Camera::look_at(Vec3::new(0.0, 0.0, distance), Vec3::ZERO, projection)
    };
    let wall = |roughness: f32, lights: usize| {
        let material = Material { perceptual_roughness: roughness, ..Material::default() };
        let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 4.0 * Vec3::X, 4.0 * Vec3::Y)], vec![material]);
        scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::ONE); lights];
        scene
    };
    let mut seen = std::collections::BTreeSet::new();
    let mut check = |view: DebugView, scene: &Scene, camera: &Camera, value: f32| {
        let scale = Scale::of(view).expect("a scale");
        let settings = Settings::default().with_debug_view(Some(view)).with_shadows(Shadows::BVH);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(scene).unwrap();
        let rendering = renderer.render(&uploaded, camera, [16, 12]).unwrap();
        let [red, green, blue, _] = rendering.display[16 * 6 + 8];
        let expected = scale.color(scale.place(value));
        // One step of 8 bits, because the shader may round differently and roughness is stored in 8 bits.
        let off = [red, green, blue].iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
        assert!(off <= Some(1), "{view}: {value} is {:?}, not {expected:?}", [red, green, blue]);
        seen.insert([red, green, blue]);
        // The position maps back to the value within the scale.
        let position = scale.place(value);
        assert!((scale.value(position) - value).abs() <= 1e-4 * value.max(1.0), "{view}: {value}");
    };
    for lights in [0, 1, 3, 8, 15, 40] {
        let scene = wall(0.5, lights);
        for view in [DebugView::LightCount, DebugView::RayCount, DebugView::LightsPerPixel, DebugView::ClusterLights] {
            check(view, &scene, &camera(5.0), lights as f32);
        }
    }
    check(DebugView::Visibility, &wall(0.5, 3), &camera(5.0), 1.0);
    for roughness in [0.1, 0.5, 0.9] {
        check(DebugView::Roughness, &wall(roughness, 1), &camera(5.0), roughness);
    }
    for distance in [0.1, 1.0, 7.3, 50.0, 300.0] {
        check(DebugView::Depth, &wall(0.5, 1), &camera(distance), distance);
    }
    assert!(seen.len() > 15, "many colours: {}", seen.len());
}

#[test]
fn scales_state_their_limits() {
    let said = |view| Scale::of(view).unwrap().to_string();
    assert_eq!(said(DebugView::LightCount), "listed lights, linear: 0 is black, 10 and more red");
    assert_eq!(said(DebugView::ClusterLights), "lights of the cluster, logarithmic: 0 is black, 1023 and more red");
    assert_eq!(
        said(DebugView::Depth),
        "m from the camera plane, logarithmic: 64 and more is black, 0.0625 and less white"
    );
    assert_eq!(said(DebugView::Occlusion), "ambient visibility, linear: 0 is black, 1 white");
    // Ambient visibility is displayed as sRGB-encoded light: 0.5 is brighter than half of 255.
    let ambient_visibility = Scale::of(DebugView::Occlusion).unwrap();
    assert_eq!([0.0, 0.5, 1.0].map(|position| ambient_visibility.color(position)[0]), [0, 188, 255]);
}

/// Not a multiple of any cluster size.
const SIZE: UVec2 = UVec2::new(163, 101);

const SHAPES: [ClusterShape; 4] = [
    ClusterShape::Perspective { pixels: 32 },
    ClusterShape::Perspective { pixels: 5 },
    ClusterShape::Orthographic { side: 0.31 },
    ClusterShape::Displaced { pixels: 24, distance: 3.0 },
];

/// The passes up to an image of `cluster-fragments`.
struct Harness<'g> {
    gpu: &'g Gpu,
    renderer: Renderer,
    profiler: Profiler,
    prepass: Prepass,
    culling: LightCulling,
    forward: Forward,
    debug_views: DebugViews,
    unmarked: ComputeKernel,
}

impl<'g> Harness<'g> {
    fn new(gpu: &'g Gpu, shape: ClusterShape) -> Self {
        let culling = Culling::from(Clustered { shape, ..Clustered::default() });
        let debug_view = Some(DebugView::ClusterFragments);
        let settings = Settings::direct_light()
            .with_culling(culling.clone())
            .with_debug_view(debug_view)
            .with_shadows(Shadows::None);
        Self {
            gpu,
            renderer: Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap(),
            profiler: Profiler::new(&gpu.device, &gpu.queue),
            prepass: Prepass::new(true, 1),
            culling: LightCulling::new(&gpu.device, &culling, 1).unwrap(),
            forward: Forward::new(&settings, None),
            debug_views: DebugViews::new(&gpu.device, &settings).unwrap().unwrap(),
            unmarked: probe(gpu, "testing/unmarked", &[], "unmarked"),
        }
    }

    /// Number of pixels with a surface, and number of those that the view paints magenta. Clusters are marked from `marked` and looked up
    /// from `shown`; a frame uses one camera for both.
    fn magenta(&mut self, scene: &Scene, marked: &Camera, shown: &Camera) -> (usize, usize) {
        let Self { gpu, renderer, profiler, prepass, culling, forward, debug_views, .. } = self;
        let scene_bounds = scene.bounds();
        let scene = &renderer.upload(scene).unwrap();
        let mut frame = Frame::new(&gpu.device, &gpu.queue, profiler);
        let lists = record(&mut frame, prepass, culling, scene, &View::new(marked, SIZE, Vec3::ZERO, &scene_bounds));
        let view = View::new(shown, SIZE, Vec3::ZERO, &scene_bounds);
        let buffer = view.upload(&gpu.device);
        let surface = prepass.record(&mut frame, scene, &scene.visible_draws(&view), &buffer, SIZE, None).unwrap();
        let radiance = forward.target(&mut frame, SIZE);
        let view = context(scene, &view, &buffer, &surface);
        let shaded = Shaded::of_lights(radiance, Some(lists));
        let rendering = display_target(&mut frame, SIZE);
        debug_views.record(&mut frame, &view, &shaded, &rendering);
        frame.submit();
        let colors: Vec<[u8; 4]> = read_texture(&gpu.device, &gpu.queue, rendering.texture()).unwrap();
        // Black is the background: one fragment is blue, and none is magenta.
        let count = |wanted: [u8; 4]| colors.iter().filter(|color| **color == wanted).count();
        (colors.len() - count([0, 0, 0, 255]), count([255, 0, 255, 255]))
    }

    /// Number of fragments of transparent surfaces, and of those whose cluster is not marked: the nearest surfaces of `scene` are drawn as
    /// opaque and looked up in the clusters that the scene marks.
    fn unmarked_transparent(&mut self, scene: &Scene, camera: &Camera, drawn: bool) -> (usize, usize) {
        let mut solid = scene.clone();
        for material in &mut solid.materials {
            material.alpha_mode = AlphaMode::Opaque;
        }
        let mut without = scene.clone();
        for mesh in &mut without.meshes {
            let opaque = |p: &Primitive| scene.materials[p.material].alpha_mode == AlphaMode::Opaque;
            mesh.primitives.retain(opaque);
        }
        let Self { gpu, renderer, profiler, prepass, culling, unmarked, .. } = self;
        let view = View::new(camera, SIZE, Vec3::ZERO, &scene.bounds());
        let marks = renderer.upload(if drawn { scene } else { &without }).unwrap();
        let solid = renderer.upload(&solid).unwrap();
        let count = (SIZE.x * SIZE.y) as usize;
        let fragments = storage_buffer(&gpu.device, "fragments", 4 * count as u64).unwrap();
        let mut frame = Frame::new(&gpu.device, &gpu.queue, profiler);
        let lists = record(&mut frame, prepass, culling, &marks, &view);
        let buffer = view.upload(&gpu.device);
        let surface = prepass.record(&mut frame, &solid, &solid.visible_draws(&view), &buffer, SIZE, None).unwrap();
        let own = Bindings::new().buffer("pixel_fragments", &fragments);
        let bindings = buffer.bindings().with(&surface.bindings()).with(&lists.bindings()).with(&own);
        frame.dispatch(unmarked, &bindings, [SIZE.x.div_ceil(8), SIZE.y.div_ceil(8), 1]);
        frame.submit();
        let actual: Vec<u32> = read_back(&gpu.device, &gpu.queue, &fragments, count).unwrap();
        let nowhere = u32::MAX;
        let covered = || actual.iter().filter(|fragments| **fragments != nowhere);
        (covered().count(), covered().filter(|fragments| **fragments == 0).count())
    }
}

fn record(
    frame: &mut Frame<'_>,
    prepass: &mut Prepass,
    culling: &mut LightCulling,
    scene: &GpuScene,
    view: &View,
) -> LightLists {
    let buffer = view.upload(frame.device);
    let draws = scene.visible_draws(view);
    let surface = prepass.record(frame, scene, &draws, &buffer, SIZE, None).unwrap();
    culling.record(frame, &[context(scene, view, &buffer, &surface)], Reach::Surface, &scene.lights).unwrap().remove(0)
}

/// Thin dielectrics of every size at every distance; every third one is transparent.
fn thin_dielectrics(seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let thin_dielectrics = (0..60).map(|i| {
        let right = random.direction() * random.between(0.05, 2.0);
        let up = right.cross(random.direction()) * random.between(0.3, 1.5);
        quad(usize::from(i % 3 == 0), random.point() * Vec3::new(4.0, 3.0, 8.0), right, up)
    });
    let solid = Material { double_sided: true, ..Material::default() };
    let transparent = Material { alpha_mode: AlphaMode::Blend, ..solid.clone() };
    scene_of(thin_dielectrics.collect(), vec![solid, transparent])
}

fn camera(random: &mut Random, reach: Vec3) -> Camera {
    let (eye, target) = (random.point() * reach, random.point() * reach * 0.3);
    let fov_y = random.between(0.3, 2.2);
    let projection = match random.unit() {
        u if u < 0.75 => Projection::Perspective { fov_y, near: 0.01 },
        _ => Projection::Orthographic { half_height: random.between(0.3, 5.0), near: 0.0, far: 40.0 },
    };
    Camera::look_at(eye, target + Vec3::new(0.0, 0.0, 0.013), projection)
}

/// Scenes with cameras of all kinds.
fn cases() -> Vec<(Scene, Vec<Camera>)> {
    let mut random = Random::new(11);
    let around = (0..2).map(|_| camera(&mut random, Vec3::new(6.0, 4.0, 9.0))).collect();
    let [cornell, atrium] = ["cornell", "atrium"].map(|name| generate::demo(name).unwrap());
    let inside = vec![atrium.cameras[0].clone(), camera(&mut random, 0.4 * atrium.bounds().size())];
    vec![(thin_dielectrics(0), around), (cornell.clone(), vec![cornell.cameras[0].clone()]), (atrium, inside)]
}

/// No opaque and no transparent surface misses its cluster.
#[gpu_test]
fn gpu_no_surface_misses_its_cluster(gpu: &Gpu) {
    let mut random = Random::new(12);
    let (mut total, mut transparent, mut missed) = (0, 0, 0);
    for shape in SHAPES {
        let mut harness = Harness::new(gpu, shape);
        for (scene, cameras) in cases() {
            for camera in &cameras {
                let (covered, magenta) = harness.magenta(&scene, camera, camera);
                assert_eq!(magenta, 0, "of {covered} pixels of {} from {camera:?}, {shape:?}", scene.name);
                total += covered;
            }
        }
        for seed in 3..5 {
            let scene = thin_dielectrics(seed);
            let camera = camera(&mut random, Vec3::new(6.0, 4.0, 9.0));
            let (covered, unmarked) = harness.unmarked_transparent(&scene, &camera, true);
            assert_eq!(unmarked, 0, "of {covered} pixels from {camera:?}, {shape:?}");
            transparent += covered;
            // Check that the test can fail: without its transparent surfaces the scene does not mark their clusters.
            missed += harness.unmarked_transparent(&scene, &camera, false).1;
        }
        // Clusters that were marked from 17 cm aside are detected.
        let scene = generate::demo("cornell").unwrap();
        let mut beside = scene.cameras[0].clone();
        beside.world_from_camera.translation += glam::Vec3A::splat(0.1);
        let (covered, magenta) = harness.magenta(&scene, &beside, &scene.cameras[0]);
        println!("{shape:?}: {magenta} of {covered} pixels are magenta from aside");
        assert!(magenta > 0, "{shape:?}: does not detect a camera shift");
    }
    println!("{total} and {transparent} fragments; without the transparent surfaces {missed} miss their cluster");
    assert!(total > 130_000, "the cases cover too little: {total} fragments");
    assert!(transparent > 15_000 && missed > 150, "{transparent} fragments, {missed} missed");
}
