//! Candidates of surfaces: their probabilities against those of the host, and how often they are drawn.

use std::collections::HashMap;

use glam::{UVec2, Vec3, Vec3Swizzles, Vec4};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Feature, Frame, Gpu, Profiler, ShaderLibrary, ShaderSource, read_back, storage_buffer,
    storage_buffer_of, testing,
};
use lanternfish_scene::{Light, LightKind, Material, Scene};

use crate::{
    GpuScene, Renderer, Settings,
    settings::Shadows,
    testing::{
        Random, library,
        light::{floor, looking, matt},
        probe_of, quad, sources,
    },
    view::View,
};

use super::{
    super::{EMISSION, LightSamples, SampledLights, TILES},
    reference::{Surface, Trees},
};

const PIXELS: usize = 64;
const PROBE: &str = "testing/light_samples";
/// The entry point for surfaces that are of no tile.
const OWN: &str = "own_candidates";
/// Choices of lights, as in `LightSamples::is_uniform`.
const TREE: u32 = 0;
const UNIFORM: u32 = 1;

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
            let features = [(entry != OWN).then_some(TILES), has_emission.then_some(EMISSION)];
            let features: Vec<Feature> = features.into_iter().flatten().collect();
            probe_of(library, gpu, PROBE, &features, entry)
        };
        self.compiled.entry((entry, has_emission)).or_insert_with(compile)
    }
}

/// A scene on the device, and how its lights are drawn.
struct Drawn {
    scene: GpuScene,
    has_lamps: bool,
    has_tiles: bool,
    rays: u32,
    choice: u32,
}

impl Drawn {
    fn new(gpu: &Gpu, scene: &Scene, rays: u32) -> Self {
        let direct = SampledLights::default();
        let settings = Settings::direct_light().with_direct(direct).with_shadows(Shadows::None);
        let renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let has_lamps = scene.materials.len() > 1;
        Self { scene: renderer.upload(scene).unwrap(), has_lamps, has_tiles: true, rays, choice: TREE }
    }

    fn samples(&self, frame: u32) -> LightSamples {
        let (rays, candidates) = (self.rays, (4 * self.rays).clamp(8, 32));
        LightSamples { rays, candidates, frame, has_filter: 0, is_uniform: self.choice }
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
            frame.dispatch(kernel, &bindings.part("light_samples", samples), groups);
        }
        frame.submit();
    }

    fn buffer(&self, gpu: &Gpu, name: &str, bytes: usize) -> wgpu::Buffer {
        storage_buffer(&gpu.device, name, bytes as u64).unwrap()
    }

    /// The light trees.
    fn trees(&self, kernels: &mut Kernels<'_>) -> Trees {
        let nodes = 8 * self.emitters() + 128;
        let buffer = self.buffer(kernels.gpu, "tree_words", 32 * (nodes + 1));
        self.run(kernels, "tree", &[("tree_words", &buffer)], [nodes.div_ceil(64) as u32, 1, 1], 1);
        let words = read_back(&kernels.gpu.device, &kernels.gpu.queue, &buffer, 8 * (nodes + 1)).unwrap();
        Trees::new(words, self.samples(0).candidates)
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

    /// How often each emitter was a candidate of each surface in some frames of some tiles, and the probability that the shader states.
    fn found(&self, kernels: &mut Kernels<'_>, tiles: u32, frames: u32) -> Vec<(u32, f32)> {
        let count = surfaces().len() * self.emitters();
        let counts = self.buffer(kernels.gpu, "found_counts", 4 * count);
        let chances = self.buffer(kernels.gpu, "found_chances", 4 * count);
        let outputs = [("found_counts", &counts), ("found_chances", &chances)];
        let groups = [tiles, (surfaces().len() / PIXELS) as u32, 1];
        let entry = if self.has_tiles { "tiles_candidates" } else { OWN };
        self.run(kernels, entry, &outputs, groups, frames);
        let counts: Vec<u32> = read_back(&kernels.gpu.device, &kernels.gpu.queue, &counts, count).unwrap();
        let chances: Vec<f32> = read_back(&kernels.gpu.device, &kernels.gpu.queue, &chances, count).unwrap();
        counts.into_iter().zip(chances).collect()
    }

    /// Probabilities by the host, of each emitter and surface.
    fn expected(&self, kernels: &mut Kernels<'_>) -> Vec<f64> {
        let (trees, surfaces, emitters) = (self.trees(kernels), surfaces(), self.emitters());
        if self.choice == UNIFORM {
            let count = trees.light_count();
            let chance = f64::from(self.rays.min(count)) / f64::from(count);
            let of_light = |i: usize| if i % emitters < count as usize { chance } else { 0.0 };
            return (0..surfaces.len() * emitters).map(of_light).collect();
        }
        let of = |tile: &[Surface]| -> Vec<f64> {
            let tile_of = self.has_tiles.then_some(tile);
            tile.iter().flat_map(|surface| trees.chances(surface, tile_of, self.has_lamps, emitters)).collect()
        };
        surfaces.chunks(PIXELS).flat_map(of).collect()
    }
}

/// What the host knows of a case.
struct Known {
    expected: Vec<f64>,
    worths: Vec<[f32; 2]>,
}

impl Known {
    /// Every emitter whose light arrives may be a candidate.
    fn new(kernels: &mut Kernels<'_>, name: &str, drawn: &Drawn) -> Self {
        let known = Self { expected: drawn.expected(kernels), worths: drawn.worths(kernels) };
        let arriving = known.worths.iter().zip(&known.expected).filter(|([_, most], _)| *most > 0.0);
        let (mut count, mut least) = (0, 1.0f64);
        for ([_, most], chance) in arriving {
            assert!(*chance > 0.0, "{name}: an emitter worth {most} has no chance");
            (count, least) = (count + 1, least.min(*chance));
        }
        println!("{name}: light arrives {count} times, least chance {least:.1e}");
        assert!(count > 100, "{name}: {count}");
        known
    }

    /// What is wrong with the candidates of a shader; `tiles` and `frames`: how many are drawn.
    fn fault(&self, drawn: &Drawn, kernels: &mut Kernels<'_>, tiles: u32, frames: u32) -> Result<(), String> {
        let trials = f64::from(tiles * frames);
        let found = drawn.found(kernels, tiles, frames);
        let emitters = drawn.emitters();
        // By tile and emitter: sum of the differences, and of the variances.
        let mut sums = vec![[0.0f64; 2]; found.len() / PIXELS];
        let (mut compared, mut worst) = (0, 0.0f64);
        for (at, ((count, stated), chance)) in found.iter().zip(&self.expected).enumerate() {
            let [least, most] = self.worths[at];
            let about = || format!("emitter {} of surface {}", at % emitters, at / emitters);
            if *count > 0 && most == 0.0 && f64::from(*count) > 0.01 * trials + 2.0 {
                return Err(format!("{} has no light, and is drawn {count} times", about()));
            }
            // A dozen levels, of a few roundings each; where cosines are near zero the relative error is larger.
            if *count > 0 && (f64::from(*stated) / chance - 1.0).abs() > 0.01 {
                return Err(format!("{}: chance {stated}, not {chance}", about()));
            }
            // Of area lights at the horizon some points are no candidates; a few points do not show all of them.
            if least <= 0.3 * most {
                continue;
            }
            compared += 1;
            let off = f64::from(*count) / trials - chance;
            // Of independent draws; those of a sequence of frames are better distributed. Rounding: two counts.
            let deviation = (chance * (1.0 - chance) / trials).sqrt();
            worst = worst.max((off.abs() - 2.0 / trials).max(0.0) / deviation.max(1e-9));
            if off.abs() > 5.5 * deviation + 2.0 / trials {
                return Err(format!("{} of chance {chance:.4} is drawn {count} times of {trials}", about()));
            }
            let sum = &mut sums[at / emitters / PIXELS * emitters + at % emitters];
            sum[0] += off;
            sum[1] += chance * (1.0 - chance) / trials;
        }
        // Rounding of the probabilities themselves: 0.1 % of all surfaces together. Few draws tell nothing.
        let is_often = |sum: &&[f64; 2]| sum[1] * trials * trials > 1000.0;
        let z = |[off, variance]: &[f64; 2]| (off.abs() - 0.001 * PIXELS as f64).max(0.0) / variance.sqrt();
        let most = sums.iter().filter(is_often).map(z).fold(0.0, f64::max);
        println!("{compared} compared over {trials} draws: {worst:.1} deviations at most, {most:.1} of a tile");
        // Pixels of a tile have the walks in common, so their errors are not independent: measured, 3.
        if most > 8.0 {
            return Err(format!("an emitter is drawn {most:.1} deviations too often or too seldom by a tile"));
        }
        Ok(())
    }
}

/// Numbers of lights and directional ones among them, whether triangles emit, rays, and how many draws of tiles are compared.
const CASES: [(usize, usize, bool, u32, u32); 5] =
    [(9, 9, false, 1, 8), (10, 0, true, 8, 8), (17, 3, false, 4, 64), (100, 9, true, 4, 64), (5000, 3, false, 8, 8)];

#[gpu_test]
fn gpu_candidates_are_drawn_as_often_as_their_chances_state(gpu: &Gpu) {
    let mut kernels = Kernels::new(gpu, library());
    for (count, sun_count, has_lamps, rays, tiles) in CASES {
        let mut drawn = Drawn::new(gpu, &scene(lights(count, sun_count), has_lamps), rays);
        for (has_tiles, choice) in [(true, TREE), (false, TREE), (true, UNIFORM)] {
            // Other combinations would compile further shaders.
            if (choice == UNIFORM && count != 17) || (!has_tiles && has_lamps) {
                continue;
            }
            (drawn.has_tiles, drawn.choice) = (has_tiles, choice);
            let name =
                format!("{count} lights, {sun_count} suns, lamps {has_lamps}, tiles {has_tiles}, choice {choice}");
            let known = Known::new(&mut kernels, &name, &drawn);
            // A pixel over many frames, and many pixels.
            for (tiles, frames) in [(1, 4 * tiles), (tiles, 16)] {
                known.fault(&drawn, &mut kernels, tiles, frames).unwrap_or_else(|what| panic!("{name}: {what}"));
            }
        }
    }
}

/// Chances and draws that are off by 5 % are noticed.
#[gpu_test]
fn gpu_the_checks_of_candidates_can_fail(gpu: &Gpu) {
    let [candidates, paths, trace] = ["candidates", "tile_paths", "trace"];
    let of = "f32(draws) * path.chance * drawn.chance";
    let edits = [
        (candidates, of, format!("WRONG(1.0, 1.05) * {of}")),
        (candidates, "chance = f32(count) / f32(suns);", "chance = WRONG(1.0, 0.95) * f32(count) / f32(suns);".into()),
        (candidates, "emitter == last", "(emitter == last && WRONG(true, false))".into()),
        (
            trace,
            "last_of_five(light_samples.frame, shift.ww).x",
            "WRONG(last_of_five(light_samples.frame, shift.ww).x, shift.w)".into(),
        ),
        (paths, "let goes_first = left < fraction;", "let goes_first = left < WRONG(1.0, 1.05) * fraction;".into()),
        (
            paths,
            "chance *= select(1.0 - fraction, fraction, goes_first)",
            "chance *= select(1.0 - fraction, WRONG(1.0, 0.95) * fraction, goes_first)".into(),
        ),
    ];
    // One shader with all edits, of which the choice of lights selects one: it is compiled once.
    let edit = |(path, source): ShaderSource| {
        let mut source = source.to_owned();
        for (i, (module, text, by)) in edits.iter().enumerate() {
            if path == format!("direct_light/sampled/{module}") {
                assert!(source.contains(text), "{module} has no {text}");
                let is_active = format!(", light_samples.is_uniform == {}u)", UNIFORM as usize + 1 + i);
                source = source.replace(text, &switched(by, &is_active));
            }
        }
        (path, &*source.leak())
    };
    let edited: Vec<ShaderSource> = sources().into_iter().map(edit).collect();
    let mut kernels = Kernels::new(gpu, ShaderLibrary::new(edited.leak()));
    let mut drawn = Drawn::new(gpu, &scene(lights(100, 9), false), 4);
    let known = Known::new(&mut kernels, "100 lights", &drawn);
    for (i, (_, text, by)) in [("", "", "nothing".to_owned())].iter().chain(&edits).enumerate() {
        drawn.choice = if i == 0 { TREE } else { UNIFORM + i as u32 };
        let mut fault = |tiles, frames| known.fault(&drawn, &mut kernels, tiles, frames);
        let found = fault(1, 256).and_then(|()| fault(64, 16));
        println!("{by}: {found:?}");
        assert_eq!(found.is_err(), i > 0, "{by} instead of {text}");
    }
}

/// `WRONG(right, wrong)` as a selection by the condition.
fn switched(text: &str, condition: &str) -> String {
    let Some((before, rest)) = text.split_once("WRONG(") else { return text.to_owned() };
    let mut depth = 1;
    let end = rest.find(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0
    });
    let (arguments, after) = rest.split_at(end.unwrap());
    format!("{before}select({arguments}{condition}{}", &after[1..])
}
