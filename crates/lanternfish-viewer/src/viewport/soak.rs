//! Random changes of settings, as by the panels, over many frames.

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

/// Number of frames, unless the environment variable [`FRAMES_FROM`] overrides it.
const FRAMES: u64 = 150;
const FRAMES_FROM: &str = "LANTERNFISH_FRAMES";
/// Number of warm-up frames, each with changed settings. After them the engine's pipeline cache is full.
const WARM: u64 = 140;
/// Frames per setting after the warm-up.
const FRAMES_PER_SETTING: u64 = 6;
/// Limits of compute and render pipelines: the most that one setting needs, plus [`SPARE`].
const MOST_COMPILED: [usize; 2] = [96 + SPARE[0], 16 + SPARE[1]];
/// Unused compute and render pipelines that the engine keeps.
const SPARE: [usize; 2] = [64, 24];
/// Greatest growth of the process's private memory since frame [`WARM`], bytes, for any number of frames on Mesa's
/// software adapter.
///
/// The driver uses 1 to 4 MiB per pipeline, and the number of cached pipelines varies. Measured: 246 MiB at frame 100,
/// and 265 to 306 MiB over the next 2,900 frames, without a trend. If long-unused pipelines are never dropped, memory
/// grows by 604 MiB by frame 3,000; only a run of that length detects this. Device memory is not limited here, since it
/// comes in blocks of 128 MiB: 186 MiB, or 315 MiB if settings need a second block. `steady.rs` checks that equal
/// settings use equal device memory.
const MAX_GROWTH: u64 = 96 << 20;

/// A random valid value of a setting. Counts stay at most 100 above their minimum, to limit the run time.
fn value(info: &ParameterInfo, names: &[(&'static str, &'static str)], random: &mut Random) -> String {
    let mut below = |count: usize| (random.unit() * count as f64) as usize;
    match info.range {
        Range::Names | Range::Numbers => names[below(names.len())].0.to_owned(),
        Range::Switch(..) => ["on", "off"][below(2)].to_owned(),
        Range::Count(least, most) => (least + below((most - least).min(100) as usize + 1) as u32).to_string(),
        Range::Positive | Range::Number(..) => format!("{:.3}", 0.2 + 2.0 * random.unit()),
        Range::Text => ["auto", "0", "1.5", "none"][below(4)].to_owned(),
    }
}

/// Changes a technique, or one of its parameters, at random.
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
    let (info, now) = &parameters[(random.unit() * parameters.len() as f64) as usize];
    // A rejected value changes nothing.
    let _ = technique.set(info.name, &value(info, &now.names(), random));
}

/// Changes one setting of the panels at random.
fn change(settings: &mut Settings, random: &mut Random) {
    match (random.unit() * 6.0) as u32 {
        0 => change_technique(&mut settings.indirect, random),
        1 => change_technique(&mut settings.occlusion, random),
        2 => change_technique(&mut settings.culling, random),
        3 => change_technique(&mut settings.caustics, random),
        _ => {
            let shown: Vec<_> = Settings::PARAMETERS.iter().filter(|parameter| parameter.info.has_panel).collect();
            let parameter = shown[(random.unit() * shown.len() as f64) as usize];
            let names = (parameter.of)(&mut settings.clone()).names();
            let _ = settings.set(parameter.info.name, &value(&parameter.info, &names, random));
        }
    }
}

/// Resident memory of this process, bytes.
#[derive(Clone, Copy, Debug)]
struct Resident {
    /// Private memory of the process and the driver.
    own: u64,
    /// Shared memory: device memory of Mesa's software adapter.
    shared: u64,
}

impl Resident {
    /// The current use; `None` if the system does not report it.
    ///
    /// Free heap memory is returned to the system first: the compilation of one large shader in a driver thread leaves
    /// 250 MiB of it.
    fn now() -> Option<Self> {
        #[cfg(all(target_os = "linux", target_env = "gnu"))]
        // Safety: `malloc_trim` takes no pointer and does not touch live allocations.
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
        write!(f, "{} MiB private, {} MiB device", self.own >> 20, self.shared >> 20)
    }
}

/// True if the error states a limit or missing feature, and not a failure.
fn is_refusal(error: &RenderError) -> bool {
    !matches!(error, RenderError::Gpu(what) if !matches!(what, GpuError::TooLarge { .. }))
}

#[gpu_test(full)]
fn gpu_settings_change_at_random(gpu: &Gpu) {
    crate::testing::know_papers();
    let frames = std::env::var(FRAMES_FROM).ok().and_then(|count| count.parse().ok()).unwrap_or(FRAMES);
    let gpu = own(gpu);
    let scene = demo("cornell").unwrap();
    let camera = scene.default_camera(1.5);
    let base = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut viewport = Viewport::new(gpu, scene, &base).unwrap();
    viewport.resize(UVec2::new(24, 16));
    let mut random = Random::new(7, 0, 0);
    let (mut requested, mut rejected, mut complete, mut warm) = (base.clone(), 0, 0, None);
    for frame in 0..frames {
        if frame < WARM || frame % FRAMES_PER_SETTING == 0 {
            if random.unit() < 0.1 {
                requested = base.clone();
            }
            change(&mut requested, &mut random);
            // As in the window, the current settings stay after an error.
            if let Err(error) = viewport.set(&requested) {
                assert!(is_refusal(&error), "{requested:?}: {error}");
                (rejected, requested) = (rejected + 1, viewport.requested().clone());
            }
        }
        if let Err(error) = viewport.draw(&camera) {
            assert!(is_refusal(&error), "{requested:?}: {error}");
            (rejected, requested) = (rejected + 1, base.clone());
            viewport.set(&base).unwrap();
            continue;
        }
        viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        viewport.poll();
        assert!(!viewport.is_busy(), "the frame is complete");
        complete += u64::from(viewport.averaged() > 0);
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
                "the pipeline cache is not full: {compiled:?}"
            );
        }
        if (frame == WARM || frame > 0 && frame % 500 == 0)
            && let Some(now) = Resident::now()
        {
            println!("frame {frame}: {now}; {:?}", Alive::of(&viewport));
        }
    }
    println!("{frames} frames, {complete} complete, {rejected} changes rejected");
    assert!(2 * complete > frames, "{complete} of {frames} frames are complete");
    if let (Some(warm), Some(end)) = (warm, Resident::now()) {
        println!("after {WARM} frames {warm}; at the end {end}");
        assert!(end.own < warm.own + MAX_GROWTH, "{} MiB more", (end.own - warm.own) >> 20);
    }
}
