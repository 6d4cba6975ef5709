//! Test support for this crate and for crates with further techniques (feature `testing`): kernels that evaluate single
//! shader functions, checks of every shader, and small scenes.
//!
//! The probes are not part of the library's shaders: `build.rs` excludes this folder.

pub mod culling;
pub mod every_shader;
pub mod in_browser;
pub mod inside;
pub mod later;
pub mod light;
pub mod shared;
pub mod steady;
pub mod walks;

use std::sync::OnceLock;

use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Engine, Feature, Frame, Gpu, Profiler, ShaderLibrary, ShaderSource, read_back,
    storage_buffer, storage_buffer_of,
};
use lanternfish_scene::{Bounds, Camera, Environment, Instance, Material, Mesh, Primitive, Projection, Scene};

use crate::{
    GpuScene, RenderedImage,
    context::ViewContext,
    prepass::Surface,
    settings::{Structure, Tracer},
    shaders::SHADERS,
    view::{View, ViewBuffer, ViewKey},
};

const PROBES: [ShaderSource; 15] = [
    ("testing/functions", include_str!("functions.wesl")),
    ("testing/light_samples", include_str!("light_samples.wesl")),
    ("testing/light_tree", include_str!("light_tree.wesl")),
    ("testing/masks", include_str!("masks.wesl")),
    ("testing/motion", include_str!("motion.wesl")),
    ("testing/pixels", include_str!("pixels.wesl")),
    ("testing/probe_coverage", include_str!("probe_coverage.wesl")),
    ("testing/radiance_cache", include_str!("radiance_cache.wesl")),
    ("testing/radiance_cache_rays", include_str!("radiance_cache_rays.wesl")),
    ("testing/random", include_str!("random.wesl")),
    ("testing/ray_weights", include_str!("ray_weights.wesl")),
    ("testing/roulette", include_str!("roulette.wesl")),
    ("testing/screen_probes", include_str!("screen_probes.wesl")),
    ("testing/segments", include_str!("segments.wesl")),
    ("testing/unmarked", include_str!("unmarked.wesl")),
];

/// Every animated sample, below `assets/conformance/` of the shared files.
pub const ANIMATED: [&str; 12] = [
    "AnimatedCube/AnimatedCube.gltf",
    "AnimatedTriangle/AnimatedTriangle.gltf",
    "AnimatedMorphCube.glb",
    "BoxAnimated.glb",
    "CesiumMan.glb",
    "CesiumMilkTruck.glb",
    "Fox.glb",
    "InterpolationTest.glb",
    "RiggedFigure.glb",
    "RiggedSimple.glb",
    "SimpleMorph/SimpleMorph.gltf",
    "SimpleSkin/SimpleSkin.gltf",
];

/// The library's shaders and the probes.
pub fn sources() -> Vec<ShaderSource> {
    SHADERS.sources().iter().copied().chain(PROBES).collect()
}

/// The sources as a library.
pub fn library() -> ShaderLibrary {
    static SOURCES: OnceLock<&'static [ShaderSource]> = OnceLock::new();
    ShaderLibrary::new(SOURCES.get_or_init(|| sources().leak()))
}

/// The library with an edit of one file, which must contain `text`; all occurrences are replaced.
pub fn edited_library(module: &str, text: &str, by: &str) -> ShaderLibrary {
    edited(library().sources(), (module, text, by))
}

/// As [`edited_library`], of any sources.
pub fn edited(sources: &[ShaderSource], edit: (&str, &str, &str)) -> ShaderLibrary {
    let replaced =
        |&(path, source)| if path == edit.0 { (path, &*edited_text(source, edit).leak()) } else { (path, source) };
    assert!(sources.iter().any(|(path, _)| *path == edit.0), "there is no {}", edit.0);
    ShaderLibrary::new(sources.iter().map(replaced).collect::<Vec<_>>().leak())
}

fn edited_text(source: &str, (module, text, by): (&str, &str, &str)) -> String {
    assert!(source.contains(text) && text != by, "{module} has no {text:?}");
    source.replace(text, by)
}

/// The text of a file of the library with this edit, for [`crate::shaders::edit`].
pub fn edited_file(edit: (&str, &str, &str)) -> (String, String) {
    let (_, source) = SHADERS.sources().iter().find(|(path, _)| *path == edit.0).expect("a file of the library");
    (edit.0.to_owned(), edited_text(source, edit))
}

/// An engine that is not shared and has these edits: module, text and what replaces it.
pub fn edited_engine(gpu: &Gpu, edits: &[(&str, &str, &str)]) -> Engine {
    let engine = Engine::new(&gpu.device, &gpu.queue);
    crate::shaders::edit(&engine, edits.iter().copied().map(edited_file).collect());
    engine
}

/// One entry point of a probe.
pub fn probe(gpu: &Gpu, module: &str, features: &[Feature], entry: &str) -> ComputeKernel {
    probe_of(&library(), gpu, module, features, entry)
}

/// One entry point of a probe of this library.
pub fn probe_of(library: &ShaderLibrary, gpu: &Gpu, module: &str, features: &[Feature], entry: &str) -> ComputeKernel {
    let shader = library.link(module, features).unwrap_or_else(|error| panic!("{error}"));
    ComputeKernel::new(&gpu.device, &shader, entry, module)
}

/// A counter of an image's report; 0 where it has none of this name.
pub fn counted(image: &RenderedImage, name: &str) -> u64 {
    image.report.counters.iter().find(|(counter, _)| counter == name).map_or(0, |(_, count)| *count)
}

/// Runs a probe of `testing/functions` over its queries, `vectors` vec4f each.
pub fn evaluate(gpu: &Gpu, entry: &str, queries: &[Vec4], vectors: usize) -> Vec<Vec4> {
    evaluate_points(gpu, entry, &Bindings::new(), queries, vectors)
}

/// The same with further bindings of the entry point.
pub fn evaluate_points(gpu: &Gpu, entry: &str, about: &Bindings<'_>, queries: &[Vec4], vectors: usize) -> Vec<Vec4> {
    evaluate_module(gpu, "testing/functions", entry, about, queries, vectors)
}

/// The features of the techniques that a probe uses.
fn technique_features(module: &str) -> Vec<Feature> {
    match module {
        "testing/pixels" => vec![crate::light_culling::tiled::CULLING_TILED],
        "testing/roulette" | "testing/segments" => Tracer::BVH.features(&Structure::NONE, true),
        _ => Vec::new(),
    }
}

/// Runs a probe of another module over its queries.
pub fn evaluate_module(
    gpu: &Gpu,
    module: &str,
    entry: &str,
    about: &Bindings<'_>,
    queries: &[Vec4],
    vectors: usize,
) -> Vec<Vec4> {
    let kernel = probe(gpu, module, &technique_features(module), entry);
    let count = queries.len() / vectors;
    let none = wgpu::BufferUsages::empty();
    let queries = storage_buffer_of(&gpu.device, "queries", queries, none).expect("a few queries fit");
    let answers = storage_buffer(&gpu.device, "answers", 16 * count as u64).expect("a few answers fit");
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let bindings = Bindings::new().buffer("queries", &queries).buffer("answers", &answers).with(about);
    frame.dispatch(&kernel, &bindings, [count.div_ceil(64) as u32, 1, 1]);
    frame.submit();
    read_back(&gpu.device, &gpu.queue, &answers, count).expect("answers can be read")
}

/// A single-sampled view, for passes after the prepass.
pub fn context<'a>(scene: &'a GpuScene, view: &'a View, buffer: &ViewBuffer, surface: &Surface) -> ViewContext<'a> {
    let (buffer, surface, rotation) = (buffer.clone(), surface.clone(), Quat::IDENTITY);
    let draws = scene.visible_draws(view);
    let (key, view, center_surface) = (ViewKey::Slot(0), *view, surface.clone());
    ViewContext { scene, key, view, buffer, draws, center_surface, surface, rotation, structures: Vec::new() }
}

/// A scene of one mesh with one instance.
pub fn scene_of(primitives: Vec<Primitive>, materials: Vec<Material>) -> Scene {
    Scene {
        name: "test".to_owned(),
        meshes: vec![Mesh { name: String::new(), primitives }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials,
        ..Scene::default()
    }
}

/// The scene with every primitive as a mesh of its own, so that each can move alone.
pub fn apart(scene: &Scene) -> Scene {
    let mut parts = Scene { meshes: Vec::new(), instances: Vec::new(), ..scene.clone() };
    for instance in &scene.instances {
        for primitive in &scene.meshes[instance.mesh].primitives {
            parts.instances.push(Instance { mesh: parts.meshes.len(), ..instance.clone() });
            parts.meshes.push(Mesh { name: String::new(), primitives: vec![primitive.clone()] });
        }
    }
    parts
}

/// The scene with every other instance rotated about its centre and shifted by up to `reach`, m.
pub fn moved(scene: &Scene, seed: u64, reach: f32) -> Scene {
    let (mut scene, mut random) = (scene.clone(), Random::new(seed));
    for instance in scene.instances.iter_mut().step_by(2) {
        let mut bounds = Bounds::EMPTY;
        scene.meshes[instance.mesh].primitives.iter().for_each(|p| bounds.add_bounds(&p.bounds()));
        let middle = bounds.transformed(&instance.world_from_object).center();
        let rotation = Affine3A::from_axis_angle(random.direction(), random.between(0.1, 3.0));
        let shift = Affine3A::from_translation(middle + reach * random.point());
        instance.world_from_object =
            shift * rotation * Affine3A::from_translation(-middle) * instance.world_from_object;
    }
    scene
}

/// A rectangle seen from its front: `half_right` points right and `half_up` up; uv 0..1 from its top left.
pub fn quad(material: usize, center: Vec3, half_right: Vec3, half_up: Vec3) -> Primitive {
    let corner = |s: f32, t: f32| center + s * half_right + t * half_up;
    Primitive {
        material,
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![half_right.cross(half_up).normalize(); 4],
        uv0: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// A camera at `eye` that looks at `target`, world space, m.
pub fn looking(eye: [f32; 3], target: [f32; 3]) -> Camera {
    Camera::look_at(eye.into(), target.into(), Projection::Perspective { fov_y: 0.8, near: 0.05 })
}

/// An environment image with this radiance by direction.
pub fn image(width: usize, height: usize, rotation: f32, radiance: impl Fn(Vec3) -> Vec3) -> Environment {
    let blank = Environment { width, height, pixels: Vec::new(), rotation: 0.0 };
    let part = |i: usize, count: usize| (i as f32 + 0.5) / count as f32;
    let at = |i: usize| radiance(blank.direction(part(i % width, width), part(i / width, height)));
    Environment { pixels: (0..width * height).map(at).collect(), rotation, ..blank.clone() }
}

/// White from above, black from below.
pub fn half_white() -> Environment {
    image(512, 256, 0.0, |direction| if direction.y > 0.0 { Vec3::ONE } else { Vec3::ZERO })
}

/// Numbers in 0..1 that are the same on every machine (PCG, 32 bits of output).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(2).wrapping_add(0x853c_49e6_748f_ea9b));
        random.unit();
        random
    }

    /// A number in 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        // 24 bits: exact in a float, and below 1.
        (word.rotate_right((self.0 >> 59) as u32) >> 8) as f32 / (1 << 24) as f32
    }

    /// A number in the given range.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A point of the cube from −1 to 1.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f32::consts::TAU).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, z).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_probe_validates() {
        for (module, _) in PROBES {
            library().link(module, &technique_features(module)).unwrap_or_else(|error| panic!("{error}"));
        }
        let ray_query = Tracer::RAY_QUERY.features(&Structure::NONE, true);
        library().link("testing/segments", &ray_query).unwrap_or_else(|error| panic!("{error}"));
        // The probes are not part of the library's sources.
        assert!(SHADERS.sources().iter().all(|(module, _)| !module.starts_with("testing")));
    }
}
