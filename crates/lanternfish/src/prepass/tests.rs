//! Motion of every pixel against a host reference that casts rays at triangles and projects with the matrices of both
//! frames.

use glam::{Affine3A, DMat4, DVec2, DVec3, UVec2, Vec2, Vec3, Vec4};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, Gpu, Profiler, read_back, storage_buffer, testing};
use lanternfish_scene::{
    AlphaMode, Camera, Filter, Image, Instance, Material, Mesh, Projection, Sampler, Scene, Texture, TextureRef,
};

use super::*;
use crate::{
    Renderer, Settings,
    settings::Shadows,
    testing::{looking, probe, quad, scene_of},
    view::{View, ViewKey},
};

const SIZE: UVec2 = UVec2::new(132, 88);

/// A wall, a quad with two instances, one of them mirrored and half masked, and a sheet that bends.
fn scene() -> Scene {
    let solid = Material { double_sided: true, ..Material::default() };
    let masked = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_texture: Some(TextureRef::new(0)),
        ..solid.clone()
    };
    let mut scene =
        scene_of(vec![quad(0, Vec3::new(0.0, 0.0, -1.0), 1.8 * Vec3::X, 1.0 * Vec3::Y)], vec![solid, masked]);
    for primitive in [
        quad(0, Vec3::new(0.1, 0.0, 0.0), 0.3 * Vec3::X, Vec3::new(0.05, 0.25, 0.1)),
        quad(1, Vec3::new(0.0, 0.3, 0.2), 0.4 * Vec3::X, 0.25 * Vec3::Y),
        quad(0, Vec3::new(0.0, -0.45, 0.1), 0.4 * Vec3::X, Vec3::new(0.0, 0.2, -0.2)),
    ] {
        scene.meshes.push(Mesh { name: String::new(), primitives: vec![primitive] });
    }
    let placed = |mesh, world_from_object| Instance { name: String::new(), mesh, world_from_object };
    let mirrored = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    scene.instances.extend([
        placed(1, Affine3A::from_translation(Vec3::new(-0.6, 0.1, 0.0))),
        placed(1, Affine3A::from_translation(Vec3::new(0.7, 0.0, 0.1)) * mirrored),
        placed(2, Affine3A::IDENTITY),
        placed(3, Affine3A::from_rotation_z(0.1)),
    ]);
    scene.images.push(Image {
        name: String::new(),
        width: 2,
        height: 1,
        rgba: [[255; 4], [255, 255, 255, 0]].concat(),
    });
    let nearest = Sampler { mag: Filter::Nearest, min: Filter::Nearest, ..Sampler::default() };
    scene.samplers.push(nearest);
    scene.textures.push(Texture { image: 0, sampler: 0 });
    scene
}

/// The passes up to motion.
struct Harness<'g> {
    gpu: &'g Gpu,
    renderer: Renderer,
    profiler: Profiler,
    prepass: Prepass,
    shown: ShownViews,
    pixels: ComputeKernel,
}

impl<'g> Harness<'g> {
    fn new(gpu: &'g Gpu) -> Self {
        let settings = Settings::direct_light().with_shadows(Shadows::None);
        Self {
            gpu,
            renderer: Renderer::with_engine(&testing::engine(gpu), settings).unwrap(),
            profiler: Profiler::new(&gpu.device, &gpu.queue),
            prepass: Prepass::of_moving(),
            shown: ShownViews::default(),
            pixels: probe(gpu, "testing/motion", &[], "pixels"),
        }
    }

    /// Renders a frame of one view and returns motion, uv, and depth of each pixel.
    fn show(&mut self, scene: &GpuScene, view: &View) -> Vec<Vec4> {
        let Self { gpu, profiler, prepass, shown, pixels, .. } = self;
        let count = (SIZE.x * SIZE.y) as usize;
        let mut frame = Frame::new(&gpu.device, &gpu.queue, profiler);
        let before = shown.follow(&mut frame, scene, view, ViewKey::Slot(0)).unwrap();
        let buffer = view.upload(&gpu.device);
        let draws = scene.visible_draws(view);
        let surface = prepass.record(&mut frame, scene, &draws, &buffer, SIZE, Some(&before)).unwrap();
        let actual = storage_buffer(&gpu.device, "pixel_motions", 16 * count as u64).unwrap();
        let bindings =
            buffer.bindings().with(&surface.bindings()).with(&Bindings::new().buffer("pixel_motions", &actual));
        frame.dispatch(pixels, &bindings, [SIZE.x.div_ceil(8), SIZE.y.div_ceil(8), 1]);
        frame.submit();
        read_back(&gpu.device, &gpu.queue, &actual, count).unwrap()
    }
}

/// A triangle of the scene in the previous and the current frame, world space.
struct Triangle {
    corners: [[DVec3; 3]; 2],
    uv: [Vec2; 3],
    is_masked: bool,
}

fn triangles(before: &Scene, now: &Scene) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for (i, instance) in now.instances.iter().enumerate() {
        for (p, primitive) in now.meshes[instance.mesh].primitives.iter().enumerate() {
            triangles.extend(primitive.indices.as_chunks::<3>().0.iter().map(|corners| {
                let of = |scene: &Scene| {
                    let world_from_object = scene.instances[i].world_from_object;
                    let positions = &scene.meshes[instance.mesh].primitives[p].positions;
                    corners.map(|v| world_from_object.transform_point3(positions[v as usize]).as_dvec3())
                };
                Triangle {
                    corners: [of(before), of(now)],
                    uv: corners.map(|v| primitive.uv0[v as usize]),
                    is_masked: primitive.material == 1,
                }
            }));
        }
    }
    triangles
}

/// The nearest hit of a ray.
struct Hit {
    triangle: usize,
    weights: [f64; 3],
    distance: f64,
}

fn weighted<T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>>(v: [T; 3], w: [f64; 3]) -> T {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

/// Casts a ray at the triangles of a frame: 0: previous, 1: current.
fn cast(triangles: &[Triangle], moment: usize, eye: DVec3, direction: DVec3) -> Option<Hit> {
    let hits = triangles.iter().enumerate().filter_map(|(index, triangle)| {
        let [a, b, c] = triangle.corners[moment];
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        let from = eye - a;
        let u = from.dot(across) / determinant;
        let v = direction.dot(from.cross(ab)) / determinant;
        let distance = ac.dot(from.cross(ab)) / determinant;
        let weights = [1.0 - u - v, u, v];
        let is_hit = distance > 0.0 && weights.iter().all(|w| *w >= 0.0);
        let is_open = triangle.is_masked && weighted(triangle.uv.map(|uv| f64::from(uv.x)), weights) >= 0.5;
        (is_hit && !is_open).then_some(Hit { triangle: index, weights, distance })
    });
    hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

fn eye(view: &View) -> DVec3 {
    view.eye.as_dvec3()
}

/// The ray direction through an image position, pixels; its component along the view axis is 1.
fn direction(view: &View, pixel: DVec2) -> DVec3 {
    let ndc = pixel / SIZE.as_dvec2() * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
    let world_from_clip = (view.clip_from_view.as_dmat4() * view.view_from_world.as_dmat4()).inverse();
    (world_from_clip.project_point3(ndc.extend(0.5)) - eye(view)).normalize()
}

fn uv_of(view: &View, p: DVec3, w: f64) -> DVec2 {
    let clip_from_world: DMat4 = view.clip_from_view.as_dmat4() * view.view_from_world.as_dmat4();
    let clip = clip_from_world * p.extend(w);
    DVec2::new(clip.x, -clip.y) / clip.w * 0.5 + 0.5
}

/// The previous and the current frame.
struct Frames<'a> {
    triangles: Vec<Triangle>,
    /// Without subpixel jitter.
    views: [&'a View; 2],
}

impl Frames<'_> {
    /// The previous world-space position of the surface at an image position, and its motion, uv. None within a pixel
    /// of an edge. `through` is the jittered view of the image.
    fn at(&self, through: &View, pixel: DVec2) -> Option<(Option<DVec3>, DVec2)> {
        let seen = |pixel| cast(&self.triangles, 1, eye(through), direction(through, pixel));
        let middle = seen(pixel);
        let around = [(-0.8, -0.8), (0.8, -0.8), (-0.8, 0.8), (0.8, 0.8)].map(|(x, y)| seen(pixel + DVec2::new(x, y)));
        let index = |hit: &Option<Hit>| hit.as_ref().map(|hit| hit.triangle);
        if around.iter().any(|hit| index(hit) != index(&middle)) {
            return None;
        }
        let [before, now] = self.views;
        Some(match middle {
            None => {
                let far = direction(through, pixel);
                (None, uv_of(now, far, 0.0) - uv_of(before, far, 0.0))
            }
            Some(hit) => {
                let [was, is] = self.triangles[hit.triangle].corners.map(|corners| weighted(corners, hit.weights));
                (Some(was), uv_of(now, is, 1.0) - uv_of(before, was, 1.0))
            }
        })
    }

    /// Compares all pixels except those at edges.
    fn check(&self, name: &str, actual: &[Vec4], through: &View) -> Checked {
        let mut checked = Checked::default();
        for (i, texel) in actual.iter().enumerate() {
            let pixel = UVec2::new(i as u32 % SIZE.x, i as u32 / SIZE.x).as_dvec2() + 0.5;
            let Some((position, expected)) = self.at(through, pixel) else { continue };
            assert_eq!(position.is_some(), texel.z > 0.0, "{name}: {pixel} shows something else");
            let motion = texel.truncate().truncate().as_dvec2();
            let off = ((motion - expected) * SIZE.as_dvec2()).abs();
            // Half-float steps, which devices round in either direction, and triangle corners snapped to 1/256 of a
            // pixel.
            let halves = (expected * SIZE.as_dvec2()).abs() / 1024.0;
            let allowed = halves + 1.0 / 256.0;
            checked.wrong += usize::from(off.cmpgt(allowed).any());
            checked.off = checked.off.max((off - halves).max_element());
            checked.longest = checked.longest.max((expected * SIZE.as_dvec2()).length());
            checked.pixels += 1;
            checked.covered += usize::from(position.is_some());
        }
        checked
    }
}

#[derive(Debug, Default)]
struct Checked {
    pixels: usize,
    covered: usize,
    wrong: usize,
    /// Excess over the half-float rounding, pixels.
    off: f64,
    /// Longest motion, pixels.
    longest: f64,
}

/// A change between two frames.
struct Step {
    name: &'static str,
    camera: Option<Camera>,
    /// Applied by [`Renderer::move_instances`].
    moved: Vec<(usize, Affine3A)>,
    /// Applied by [`Renderer::update`], one after the other.
    updates: Vec<fn(&mut Scene)>,
}

fn steps() -> Vec<Step> {
    let nothing = || Step { name: "nothing", camera: None, moved: Vec::new(), updates: Vec::new() };
    let rotate = |s: &mut Scene| {
        for (i, instance) in s.instances.iter_mut().enumerate() {
            let shift = Affine3A::from_translation(Vec3::new(0.05, 0.03 * i as f32, -0.04));
            instance.world_from_object = shift * instance.world_from_object * Affine3A::from_rotation_z(0.1);
        }
    };
    let bend = |s: &mut Scene| {
        let positions = &mut s.meshes[3].primitives[0].positions;
        (positions[1].y, positions[2].z, positions[3].x) =
            (positions[1].y + 0.12, positions[2].z + 0.1, positions[3].x - 0.06);
    };
    let shift = |x, y| Affine3A::from_translation(Vec3::new(x, y, 0.05));
    let camera = |x, y, z| Some(looking([x, y, z], [0.0, 0.1, 0.0]));
    vec![
        Step { name: "the camera", camera: camera(0.4, 0.3, 2.3), ..nothing() },
        Step { name: "one instance", moved: vec![(1, shift(-0.8, -0.1))], ..nothing() },
        Step { name: "instances", updates: vec![rotate], ..nothing() },
        nothing(),
        Step { name: "vertices", updates: vec![bend], ..nothing() },
        Step { name: "vertices again", updates: vec![bend], ..nothing() },
        Step {
            name: "all, and twice",
            camera: camera(0.1, 0.2, 2.2),
            moved: vec![(3, shift(0.2, -0.1)), (0, shift(0.0, 0.1))],
            updates: vec![rotate, bend],
        },
        nothing(),
        Step { name: "a wide rotation", camera: Some(looking([0.1, 0.2, 2.2], [0.6, 0.4, 0.4])), ..nothing() },
    ]
}

fn view_of(camera: &Camera, scene: &Scene) -> View {
    View::new(camera, SIZE, Vec3::ZERO, &scene.bounds())
}

#[gpu_test]
fn gpu_motion_equals_the_cpu_reference(gpu: &Gpu) {
    let mut harness = Harness::new(gpu);
    let mut scene = scene();
    let mut uploaded = harness.renderer.upload(&scene).unwrap();
    let mut view = view_of(&looking([0.3, 0.2, 2.4], [0.0, 0.1, 0.0]), &scene);
    let first = harness.show(&uploaded, &view);
    // The two positions are computed by different expressions, which a device may round differently.
    assert!(first.iter().all(|texel| texel.x.abs().max(texel.y.abs()) < 1e-5), "the first frame has no predecessor");
    for (i, Step { name, camera, moved, updates }) in steps().into_iter().enumerate() {
        let (before, last_view) = (scene.clone(), view);
        if !moved.is_empty() {
            harness.renderer.move_instances(&mut uploaded, &moved).unwrap();
            moved.iter().for_each(|(instance, to)| scene.instances[*instance].world_from_object = *to);
        }
        for update in updates {
            update(&mut scene);
            harness.renderer.update(&mut uploaded, &scene).unwrap();
        }
        if let Some(camera) = camera {
            view = view_of(&camera, &scene);
        }
        // Every other frame has another subpixel jitter, which is not motion.
        let through = view.of_frame(i as u32 % 2 * 5);
        let actual = harness.show(&uploaded, &through);
        let frames = Frames { triangles: triangles(&before, &scene), views: [&last_view, &view] };
        let checked = frames.check(name, &actual, &through);
        println!("{name}: {checked:?}");
        assert!(checked.pixels > 9000 && checked.covered > 3000, "{name}: {checked:?}");
        assert_eq!(checked.wrong, 0, "{name}: {checked:?}");
        let still = name == "nothing";
        assert_eq!(still, checked.longest == 0.0, "{name}: {checked:?}");
        assert!(!still || actual.iter().all(|texel| texel.truncate().truncate().abs().max_element() < 1e-7), "{name}");
        if !still {
            // Check that the test can fail: against no motion, and against reversed motion.
            let stays = Frames { triangles: triangles(&scene, &scene), views: [&view, &view] };
            let back: Vec<Vec4> = actual.iter().map(|texel| Vec4::new(-texel.x, -texel.y, texel.z, 0.0)).collect();
            for checked in [stays.check(name, &actual, &through), frames.check(name, &back, &through)] {
                assert!(checked.wrong > 40, "{name}: does not detect other motion: {checked:?}");
            }
        }
    }
}

/// A point that was behind the viewer has the motion of a point outside the image. An orthographic view has motion too.
#[gpu_test]
fn gpu_motion_from_behind_and_of_orthographic_views(gpu: &Gpu) {
    let mut harness = Harness::new(gpu);
    let scene = scene();
    let uploaded = harness.renderer.upload(&scene).unwrap();
    let away = view_of(&looking([0.0, 0.0, 3.0], [0.0, 0.0, 9.0]), &scene);
    let towards = view_of(&looking([0.0, 0.0, 3.0], [0.0, 0.0, 0.0]), &scene);
    harness.show(&uploaded, &away);
    let actual = harness.show(&uploaded, &towards);
    assert!(actual.iter().all(|texel| texel.x == 65504.0 && texel.y == 65504.0), "{:?}", actual[0]);
    let parallel = |x: f32| {
        let projection = Projection::Orthographic { half_height: 1.5, near: 0.01, far: 20.0 };
        view_of(&Camera::look_at(Vec3::new(x, 0.0, 5.0), Vec3::new(x, 0.0, 0.0), projection), &scene)
    };
    harness.show(&uploaded, &parallel(0.0));
    let actual = harness.show(&uploaded, &parallel(0.25));
    // 0.25 m of 4.5 m to the left; points at infinity do not move.
    let expected = |texel: &Vec4| if texel.z > 0.0 { -0.25 / 4.5 } else { 0.0 };
    let off = actual.iter().map(|texel| (texel.x - expected(texel)).abs().max(texel.y.abs())).fold(0.0, f32::max);
    let covered = actual.iter().filter(|texel| texel.z > 0.0).count();
    println!("parallel rays: off by {off}, {covered} pixels");
    assert!(off < 1e-4 && covered > 1000 && covered < actual.len(), "{off}, {covered}");
}
