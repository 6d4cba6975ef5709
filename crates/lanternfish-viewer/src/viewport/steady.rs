//! Repeated changes of settings do not increase memory use.

use lanternfish::{
    settings::{DebugView, History, Indirect, Quality, Samples, Shadows},
    techniques::{SampledLights, Tiled},
};
use lanternfish_gpu::{AdapterChoice, KeptCompiled, testing};
use lanternfish_scene::generate::demo;

use super::*;

/// Tolerance for equal resources, bytes. The allocator's rounding depends on the position of each allocation.
const TOLERANCE: u64 = 4096;
/// Frames under the same settings: more than the transient pool keeps unused resources.
const FRAMES_PER_SETTING: usize = 6;

/// Live resources of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alive {
    /// Number of allocated buffers and textures.
    pub allocations: usize,
    /// Their size, bytes.
    pub bytes: u64,
    pub compiled: KeptCompiled,
}

impl Alive {
    /// `None` if the device reports no allocations.
    pub fn of(viewport: &Viewport) -> Option<Self> {
        viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let report = viewport.gpu.device.generate_allocator_report()?;
        let compiled = viewport.renderer.engine().kept();
        Some(Self { allocations: report.allocations.len(), bytes: report.total_allocated_bytes, compiled })
    }
}

/// Opens a separate device of the adapter, since other tests allocate on the shared one.
pub fn own(gpu: &Gpu) -> Gpu {
    Gpu::open(&AdapterChoice::Name(gpu.description.name.clone())).unwrap()
}

/// One setting for each kind of change: parameters, shaders, upload, deep images, multisampled textures, indirect light.
fn kinds() -> Vec<Settings> {
    let base = Settings::direct_light().with_shadows(Shadows::BVH);
    let mut deep = base.clone();
    deep.set("occlusion", "deep").and_then(|()| deep.set("deep-resolution", "16")).unwrap();
    let indirect = Indirect::from(Quality::Draft.sampled());
    vec![
        base.clone(),
        base.clone().with_culling(Tiled::default()).with_shadows(Shadows::None),
        base.clone().with_samples(Samples::Four),
        base.clone().with_direct(SampledLights::default()).with_history(History::On),
        deep,
        base.clone().with_indirect(indirect),
        base.with_debug_view(Some(DebugView::Normal)),
    ]
}

#[gpu_test(full)]
fn gpu_repeated_settings_do_not_increase_memory(gpu: &Gpu) {
    crate::testing::know_papers();
    let scene = demo("cornell").unwrap();
    let camera = scene.default_camera(1.5);
    let mut viewport = Viewport::new(own(gpu), scene, &kinds()[0]).unwrap();
    let mut cycle = |size: u32| {
        for settings in kinds() {
            viewport.set(&settings).unwrap();
            viewport.resize(UVec2::splat(size));
            for _ in 0..FRAMES_PER_SETTING {
                viewport.draw(&camera).unwrap();
                viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
                viewport.poll();
            }
        }
        println!("{:?}", Alive::of(&viewport));
        (Alive::of(&viewport).unwrap_or_default(), viewport.renderer.engine().compilations())
    };
    cycle(16);
    let (second, compiled) = cycle(16);
    for _ in 0..3 {
        let (now, compiled_now) = cycle(16);
        assert_eq!((now.allocations, now.compiled, compiled_now), (second.allocations, second.compiled, compiled));
        assert!(now.bytes.abs_diff(second.bytes) < TOLERANCE, "{} bytes, {} before", now.bytes, second.bytes);
    }
    // Check that the test can fail: larger images use more memory.
    let (larger, _) = cycle(200);
    assert!(larger == Alive::default() || larger.bytes > second.bytes + TOLERANCE, "{larger:?}");
}
