//! Settings that change at random, frame after frame, as a hand on the panels changes them.

use lanternfish::{
    settings::Shadows,
    technique::{Choice, Kind, ParameterInfo, Range},
};
use lanternfish_gpu::testing;
use lanternfish_reference::Random;
use lanternfish_scene::generate::demo;

use super::{
    steady::{Alive, own},
    *,
};

/// Frames, unless the variable below says how many.
const FRAMES: u64 = 150;
const FRAMES_FROM: &str = "LANTERNFISH_FRAMES";
/// The first frames, each of which is under other settings: after them the engine keeps as many pipelines as it ever does.
const WARM: u64 = 100;
/// Frames under the same settings, after those.
const ALIKE: u64 = 6;
/// Pipelines of compute and of drawing: those of any settings, and those that the engine keeps though nobody uses them.
const MOST_COMPILED: [usize; 2] = [64 + SPARE[0], 16 + SPARE[1]];
/// Those that the engine keeps though nobody uses them.
const SPARE: [usize; 2] = [64, 24];
/// Bytes by which the process's own memory may be more than at frame [`WARM`], however long the run, on Mesa's software adapter: the driver holds 1 to
/// 4 MiB for each pipeline, of which more are kept at some times than at others. It was 246 MiB at frame 100, and 265 to 306, without growing, in
/// the 2,900 after it. Before pipelines were dropped that nobody had used for long, it grew by 604 MiB to frame 3,000, which only a run of so many
/// frames finds. Memory of the device comes in blocks of 128 MiB: 186 MiB, and 315 where settings ask for a second one; what is in use under the
/// same settings is the same (`steady.rs`).
const KEPT: u64 = 96 << 20;

/// A value that a setting of these words takes. Counts stay below a hundred or so: what takes long is not the question here.
fn value(words: &ParameterInfo, names: &[(&'static str, &'static str)], random: &mut Random) -> String {
    let mut below = |count: usize| (random.unit() * count as f64) as usize;
    match words.range {
        Range::Names | Range::Numbers => names[below(names.len())].0.to_owned(),
        Range::Switch(..) => ["on", "off"][below(2)].to_owned(),
        Range::Count(least, most) => (least + below((most - least).min(100) as usize + 1) as u32).to_string(),
        Range::Positive => format!("{:.3}", 0.2 + 2.0 * random.unit()),
        Range::Text => ["auto", "0", "1.5", "none"][below(4)].to_owned(),
    }
}

/// Changes the choice of a technique, or one of its parameters.
fn change_technique<K: Kind + ?Sized>(choice: &mut Choice<K>, random: &mut Random) {
    if random.unit() < 0.5 {
        let all: Vec<Choice<K>> = [Choice::NONE].into_iter().chain(Choice::all()).collect();
        *choice = all[(random.unit() * all.len() as f64) as usize].clone();
        return;
    }
    let Some(technique) = choice.technique_mut() else { return };
    let parameters = technique.parameters();
    if parameters.is_empty() {
        return;
    }
    let (words, names) = &parameters[(random.unit() * parameters.len() as f64) as usize];
    // What is refused has a message, and changes nothing.
    let _ = technique.set(words.name, &value(words, names, random));
}

/// Changes one thing that panels show.
fn change(settings: &mut Settings, random: &mut Random) {
    match (random.unit() * 5.0) as u32 {
        0 => change_technique(&mut settings.indirect, random),
        1 => change_technique(&mut settings.occlusion, random),
        2 => change_technique(&mut settings.culling, random),
        _ => {
            let parameter = &Settings::PARAMETERS[(random.unit() * Settings::PARAMETERS.len() as f64) as usize];
            let names = (parameter.of)(&mut settings.clone()).names();
            let _ = settings.set(parameter.info.name, &value(&parameter.info, &names, random));
        }
    }
}

/// Memory that this process uses, bytes.
#[derive(Clone, Copy, Debug)]
struct Resident {
    /// Its own: what is allocated for it and for the driver.
    own: u64,
    /// What is shared: memory of Mesa's software device.
    shared: u64,
}

impl Resident {
    /// None where the system does not say it. What is free, and kept by the C library for later, is given back first: one large shader that is
    /// compiled in a thread of the driver leaves 250 MiB of that.
    fn now() -> Option<Self> {
        #[cfg(all(target_os = "linux", target_env = "gnu"))]
        // Safety: it takes no pointer, and touches nothing that is in use.
        unsafe {
            libc::malloc_trim(0)
        };
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let bytes = |name: &str| {
            let line = status.lines().find(|line| line.starts_with(name))?;
            line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib << 10)
        };
        Some(Self { own: bytes("RssAnon:")?, shared: bytes("RssShmem:")? })
    }
}

impl std::fmt::Display for Resident {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} MiB of its own, {} MiB of the device", self.own >> 20, self.shared >> 20)
    }
}

/// Whether it says what the device or the renderer has not, and not that something went wrong.
fn is_refusal(error: &RenderError) -> bool {
    !matches!(error, RenderError::Gpu(what) if !matches!(what, GpuError::TooLarge { .. }))
}

#[test]
fn gpu_settings_change_at_random() {
    lanternfish_papers::register();
    let Some(gpu) = testing::gpu("gpu_settings_change_at_random") else { return };
    let frames = std::env::var(FRAMES_FROM).ok().and_then(|count| count.parse().ok()).unwrap_or(FRAMES);
    let gpu = own(gpu);
    let scene = demo("cornell").unwrap();
    let camera = scene.default_camera(1.5);
    let usual = Settings { shadows: Shadows::BVH, ..Settings::direct_light() };
    let mut viewport = Viewport::new(gpu, scene, &usual).unwrap();
    viewport.resize(UVec2::new(24, 16));
    let mut random = Random::new(7, 0, 0);
    let (mut requested, mut refused, mut whole, mut warm) = (usual.clone(), 0, 0, None);
    for frame in 0..frames {
        if frame < WARM || frame % ALIKE == 0 {
            if random.unit() < 0.1 {
                requested = usual.clone();
            }
            change(&mut requested, &mut random);
            // As the window does: the image stays, and the panels say why.
            if let Err(error) = viewport.set(&requested) {
                assert!(is_refusal(&error), "{requested:?}: {error}");
                (refused, requested) = (refused + 1, viewport.settings().clone());
            }
        }
        if let Err(error) = viewport.draw(&camera) {
            assert!(is_refusal(&error), "{requested:?}: {error}");
            (refused, requested) = (refused + 1, usual.clone());
            viewport.set(&usual).unwrap();
            continue;
        }
        viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        viewport.poll();
        assert!(!viewport.is_busy(), "the device is done");
        whole += u64::from(viewport.averaged() > 0);
        let compiled = viewport.renderer.engine().kept();
        let most = MOST_COMPILED;
        assert!(
            compiled.kernels <= most[0] && compiled.rasters <= most[1],
            "{requested:?}: the engine keeps {compiled:?}"
        );
        if frame >= WARM && warm.is_none() {
            warm = Resident::now();
            let [kernels, rasters] = SPARE;
            assert!(
                compiled.kernels >= kernels && compiled.rasters >= rasters,
                "as many as it keeps anyway: {compiled:?}"
            );
        }
        if (frame == WARM || frame > 0 && frame % 500 == 0)
            && let Some(now) = Resident::now()
        {
            println!("frame {frame}: {now}; {:?}", Alive::of(&viewport));
        }
    }
    println!("{frames} frames, {whole} of them shown, {refused} changes refused");
    assert!(2 * whole > frames, "{whole} of {frames} frames are shown");
    if let (Some(warm), Some(end)) = (warm, Resident::now()) {
        println!("after {WARM} frames {warm}; at the end {end}");
        assert!(end.own < warm.own + KEPT, "{} MiB more", (end.own - warm.own) >> 20);
    }
}
