//! Candidates of surfaces are drawn as often as their chances state.

use std::collections::HashMap;

use glam::{UVec2, Vec3, Vec3Swizzles, Vec4};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Feature, Frame, Gpu, Profiler, ShaderLibrary, read_back, storage_buffer,
    storage_buffer_of, testing,
};
use lanternfish_scene::{Light, LightKind, Material, Scene};

use crate::{
    GpuScene, Renderer, Settings,
    settings::Shadows,
    testing::{
        Random, library,
        light::{floor, looking, matt},
        probe_of, quad,
    },
    view::View,
};

use super::super::{DirectSampling, EMISSION, SampledLights};

const PIXELS: usize = 64;
const PROBE: &str = "testing/light_samples";

/// A surface that receives light.
#[derive(Clone, Copy, Debug)]
struct Surface {
    p: Vec3,
    normal: Vec3,
    wo: Vec3,
    perceptual_roughness: f32,
}

/// Lights of all kinds over a floor, of which the first are directional; some do not shine, and some are near.
fn lights(count: usize, sun_count: usize) -> Vec<Light> {
    let mut random = Random::new(61);
    let light = |i: usize| {
        let position = 4.0 * random.point() + 4.1 * Vec3::Y;
        let direction = (random.direction() - 1.2 * Vec3::Y).normalize();
        let color = Vec3::splat(random.between(0.5, 4.0));
        if i < sun_count {
            return Light::directional(direction, color);
        }
        let outer_angle = random.between(0.5, 1.5);
        let mut light = match i % 6 {
            0 => Light::disk(position, direction, random.between(0.1, 0.8), color),
            1 => Light::rectangle(position, direction, Vec3::X, [0.4, random.between(0.1, 2.0)], color),
            2 => Light {
                kind: LightKind::Spot { inner_angle: 0.1, outer_angle },
                direction,
                ..Light::point(position, color)
            },
            _ => Light::point(position, color),
        };
        light.range = i.is_multiple_of(5).then_some(5.0);
        match i % 11 {
            7 => light.intensity = Vec3::ZERO,
            5 => light.position = 0.3 * random.point() + 0.31 * Vec3::Y,
            _ => {}
        }
        light
    };
    (0..count).map(light).collect()
}

/// A floor under lights; with lamps, if triangles emit.
fn scene(lights: Vec<Light>, has_lamps: bool) -> Scene {
    let mut scene = floor(matt(0.5));
    scene.lights = lights;
    if has_lamps {
        let mut random = Random::new(62);
        scene.materials.push(Material { emissive: Vec3::new(3.0, 2.0, 1.0), double_sided: false, ..matt(0.0) });
        for i in 0..6 {
            let center = 2.0 * random.point() + 2.5 * Vec3::Y;
            let half = random.between(0.05, 0.5);
            // Three face the floor.
            let up = if i % 2 == 0 { half * Vec3::Z } else { -half * Vec3::Z };
            scene.meshes[0].primitives.push(quad(1, center, half * Vec3::X, up));
        }
    }
    scene
}

/// Two tiles of surfaces: on the floor; and half of it there, half on a wall farther away.
fn surfaces() -> Vec<Surface> {
    let eye = Vec3::new(0.0, 1.5, 3.0);
    let on = |p: Vec3, normal: Vec3, i: usize| Surface {
        p,
        normal,
        wo: (eye - p).normalize(),
        perceptual_roughness: 0.2 + 0.01 * i as f32,
    };
    let across = |i: usize| 0.02 * Vec3::new((i % 8) as f32, 0.0, (i / 8) as f32);
    let flat = (0..PIXELS).map(|i| on(across(i), Vec3::Y, i));
    let edge = (0..PIXELS).map(|i| match i % 8 < 4 {
        true => on(across(i), Vec3::Y, i),
        false => on(Vec3::new(0.5, 0.3, -2.0) + across(i).xzy(), Vec3::Z, i),
    });
    flat.chain(edge).collect()
}

/// Compiled entry points of the probe, by name and features: a software adapter compiles them for seconds.
struct Kernels<'a> {
    gpu: &'a Gpu,
    library: ShaderLibrary,
    compiled: HashMap<(&'static str, bool), ComputeKernel>,
}

impl<'a> Kernels<'a> {
    fn new(gpu: &'a Gpu, library: ShaderLibrary) -> Self {
        Self { gpu, library, compiled: HashMap::new() }
    }

    fn of(&mut self, entry: &'static str, has_emission: bool) -> &ComputeKernel {
        let (gpu, library) = (self.gpu, &self.library);
        let compile = || {
            let features: &[Feature] = if has_emission { &[EMISSION] } else { &[] };
            probe_of(library, gpu, PROBE, features, entry)
        };
        self.compiled.entry((entry, has_emission)).or_insert_with(compile)
    }
}

/// A scene on the device, and how its lights are drawn.
struct Drawn {
    scene: GpuScene,
    has_lamps: bool,
    rays: u32,
}

impl Drawn {
    fn new(gpu: &Gpu, scene: &Scene, rays: u32) -> Self {
        let direct = SampledLights::default();
        let settings = Settings::direct_light().with_direct(direct).with_shadows(Shadows::None);
        let renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let has_lamps = scene.materials.len() > 1;
        Self { scene: renderer.upload(scene).unwrap(), has_lamps, rays }
    }

    fn samples(&self, frame: u32) -> DirectSampling {
        let (rays, candidates) = (self.rays, (4 * self.rays).clamp(8, 32));
        DirectSampling { light_samples: rays, candidates, frame, ..DirectSampling::default() }
    }

    fn emitters(&self) -> usize {
        self.scene.lights.on_host.len() + self.scene.traced_triangles as usize
    }

    /// Runs an entry point of the probe over the surfaces, once for each frame; `outputs` are the other buffers.
    fn run(
        &self,
        kernels: &mut Kernels<'_>,
        entry: &'static str,
        outputs: &[(&str, &wgpu::Buffer)],
        groups: [u32; 3],
        frames: u32,
    ) {
        let gpu = kernels.gpu;
        let surfaces = surfaces();
        let words = surfaces.iter().flat_map(|surface| {
            let Surface { p, normal, wo, perceptual_roughness } = *surface;
            [p.extend(perceptual_roughness), normal.extend(0.0), normal.extend(0.0), wo.extend(0.0)]
        });
        let words: Vec<Vec4> = words.collect();
        let none = wgpu::BufferUsages::empty();
        let queries = storage_buffer_of(&gpu.device, "queries", &words, none).unwrap();
        let kernel = kernels.of(entry, self.has_lamps);
        let camera = looking([0.0, 1.5, 3.0], [0.0, 0.0, 0.0]);
        let view = View::new(&camera, UVec2::splat(8), Vec3::ZERO, self.scene.bounds());
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let view = view.record(&mut frame);
        let parts: Vec<_> = (0..frames).map(|i| frame.uniform(&self.samples(i))).collect();
        let (scene, view) = (self.scene.bindings(), view.bindings());
        for samples in &parts {
            let mut bindings = Bindings::new().with(&scene).with(&view).buffer("queries", &queries);
            for (name, buffer) in outputs {
                bindings = bindings.buffer(name, buffer);
            }
            frame.dispatch(kernel, &bindings.part("direct_sampling", samples), groups);
        }
        frame.submit();
    }

    fn buffer(&self, gpu: &Gpu, name: &str, bytes: usize) -> wgpu::Buffer {
        storage_buffer(&gpu.device, name, bytes as u64).unwrap()
    }

    /// Least and most worth of each emitter to each surface.
    fn worths(&self, kernels: &mut Kernels<'_>) -> Vec<[f32; 2]> {
        let count = surfaces().len() * self.emitters();
        let buffer = self.buffer(kernels.gpu, "answers", 16 * count);
        self.run(kernels, "worths", &[("answers", &buffer)], [count.div_ceil(64) as u32, 1, 1], 1);
        let answers: Vec<Vec4> = read_back(&kernels.gpu.device, &kernels.gpu.queue, &buffer, count).unwrap();
        // Without the feature, triangles are no emitters.
        let lights = if self.has_lamps { usize::MAX } else { self.scene.lights.on_host.len() };
        let of =
            |(i, answer): (usize, &Vec4)| if i % self.emitters() < lights { [answer.x, answer.y] } else { [0.0; 2] };
        answers.iter().enumerate().map(of).collect()
    }

    /// How often each emitter was a candidate of each surface in some frames of some tiles, and the probability that
    /// the shader states.
    fn found(&self, kernels: &mut Kernels<'_>, tiles: u32, frames: u32) -> Vec<(u32, f32)> {
        let count = surfaces().len() * self.emitters();
        let counts = self.buffer(kernels.gpu, "found_counts", 4 * count);
        let chances = self.buffer(kernels.gpu, "found_chances", 4 * count);
        let outputs = [("found_counts", &counts), ("found_chances", &chances)];
        let groups = [tiles, (surfaces().len() / PIXELS) as u32, 1];
        self.run(kernels, "tiles_candidates", &outputs, groups, frames);
        let counts: Vec<u32> = read_back(&kernels.gpu.device, &kernels.gpu.queue, &counts, count).unwrap();
        let chances: Vec<f32> = read_back(&kernels.gpu.device, &kernels.gpu.queue, &chances, count).unwrap();
        counts.into_iter().zip(chances).collect()
    }
}

/// What is wrong with candidates: how often each emitter was drawn by each surface in so many trials, and the chance
/// that the shader states. `worths`: least and most worth of the emitter's points to the surface.
/// `is_whole`: every emitter that lights a surface is a candidate in each trial.
fn fault(
    worths: &[[f32; 2]],
    found: &[(u32, f32)],
    emitters: usize,
    trials: f64,
    is_whole: bool,
) -> Result<(), String> {
    // By tile and emitter: sum of the differences, and of the variances.
    let mut sums = vec![[0.0f64; 2]; found.len() / PIXELS];
    let mut compared = 0;
    for (at, ((count, chance), [least, most])) in found.iter().zip(worths).enumerate() {
        let about = || format!("emitter {} of surface {}", at % emitters, at / emitters);
        if *most == 0.0 && f64::from(*count) > 0.01 * trials + 2.0 {
            return Err(format!("{} has no light, and is drawn {count} times", about()));
        }
        if is_whole && *least > 0.3 * most && f64::from(*count) != trials {
            return Err(format!("{} is a candidate {count} times of {trials}", about()));
        }
        let all = || -> f32 { worths[at / emitters * emitters..][..emitters].iter().map(|[_, most]| most).sum() };
        if *count == 0 && trials > 1000.0 && *most > 0.1 * all() {
            return Err(format!("{} has a tenth of the light, and is never drawn", about()));
        }
        // Of area lights at the horizon some points are no candidates; a few points do not show all of them.
        if *count == 0 || *least <= 0.3 * most {
            continue;
        }
        compared += 1;
        let chance = f64::from(*chance);
        let off = f64::from(*count) / trials - chance;
        // Of independent draws; those of a sequence of frames are better distributed. Rounding: two counts.
        let variance = (chance * (1.0 - chance)).max(0.0) / trials;
        if off.abs() > 5.5 * variance.sqrt() + 2.0 / trials {
            return Err(format!("{} of chance {chance:.4} is drawn {count} times of {trials}", about()));
        }
        let sum = &mut sums[at / emitters / PIXELS * emitters + at % emitters];
        *sum = [sum[0] + off, sum[1] + variance];
    }
    // Rounding of the probabilities themselves: 0.1 % of all surfaces together. Few draws tell nothing.
    let is_often = |sum: &&[f64; 2]| sum[1] * trials * trials > 1000.0;
    let z = |[off, variance]: &[f64; 2]| (off.abs() - 0.001 * PIXELS as f64).max(0.0) / variance.sqrt();
    let most = sums.iter().filter(is_often).map(z).fold(0.0, f64::max);
    if most > 8.0 {
        return Err(format!("an emitter is drawn {most:.1} deviations too often or too seldom by a tile"));
    }
    if compared > 100 { Ok(()) } else { Err(format!("{compared} compared")) }
}

/// Numbers of lights and directional ones among them, whether triangles emit, rays, and how many draws of tiles are
/// compared.
type Case = (usize, usize, bool, u32, u32);

fn check_draws(gpu: &Gpu, cases: &[Case]) {
    let mut kernels = Kernels::new(gpu, library());
    for &(count, sun_count, has_lamps, rays, tiles) in cases {
        let drawn = Drawn::new(gpu, &scene(lights(count, sun_count), has_lamps), rays);
        let name = format!("{count} lights, {sun_count} suns, lamps {has_lamps}");
        let worths = drawn.worths(&mut kernels);
        // A pixel over many frames, and many pixels.
        for (tiles, frames) in [(1, 4 * tiles), (tiles, 16)] {
            let (found, trials) = (drawn.found(&mut kernels, tiles, frames), f64::from(tiles * frames));
            let fault = |found: &[(u32, f32)]| fault(&worths, found, drawn.emitters(), trials, count <= 32);
            fault(&found).unwrap_or_else(|what| panic!("{name}: {what}"));
            // The check can fail: chances that are stated a tenth too high, and draws that are a tenth too many.
            let stated: Vec<_> = found.iter().map(|(count, chance)| (*count, 1.1 * chance)).collect();
            let more: Vec<_> = found.iter().map(|(count, chance)| (count + count / 10, *chance)).collect();
            assert!(trials < 1000.0 || (fault(&stated).is_err() && fault(&more).is_err()), "{name}");
        }
    }
}

#[gpu_test]
fn gpu_candidates_are_drawn_as_often_as_their_chances_state(gpu: &Gpu) {
    // Lists that are whole, and more lights than a list holds.
    check_draws(gpu, &[(17, 3, false, 4, 64), (300, 3, false, 4, 64)]);
}

#[gpu_test(full)]
fn gpu_candidates_of_few_and_of_many_lights_are_drawn_as_often(gpu: &Gpu) {
    check_draws(gpu, &[(9, 9, false, 1, 8), (10, 0, true, 8, 8), (100, 9, true, 4, 64), (5000, 3, false, 8, 8)]);
}
