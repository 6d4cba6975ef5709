//! Settings that come again and again take no more and more memory.

use lanternfish::{
    settings::{Culling, DebugView, Indirect, Occlusion, Quality, Samples, Shadows},
    techniques::Tiled,
};
use lanternfish_gpu::{AdapterChoice, KeptCompiled, testing};
use lanternfish_papers::{Deep, DeepImageSettings};
use lanternfish_scene::generate::demo;

use super::*;

/// Bytes by which the same things may differ: how much the device's allocator rounds depends on where it puts each.
const ROUNDED: u64 = 4096;
/// Frames under the same settings: more than the pool keeps what no frame asks for.
const ALIKE: usize = 6;

/// What is alive on a device and for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alive {
    /// Buffers and textures of the device that have memory, and their bytes.
    pub allocations: usize,
    pub bytes: u64,
    pub compiled: KeptCompiled,
}

impl Alive {
    /// None where the device does not say what has memory.
    pub fn of(viewport: &Viewport) -> Option<Self> {
        viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let report = viewport.gpu.device.generate_allocator_report()?;
        let compiled = viewport.renderer.engine().kept();
        Some(Self { allocations: report.allocations.len(), bytes: report.total_allocated_bytes, compiled })
    }
}

/// Another device of the adapter: on one that tests share, others make things meanwhile.
pub fn own(gpu: &Gpu) -> Gpu {
    Gpu::open(&AdapterChoice::Name(gpu.description.name.clone())).unwrap()
}

/// Changes of each kind: other numbers, other shaders, another upload; deep images, textures of several samples, indirect light.
fn kinds() -> Vec<Settings> {
    let usual = Settings { shadows: Shadows::BVH, ..Settings::direct_light() };
    let deep_images = DeepImageSettings { resolution: 16, ..DeepImageSettings::default() };
    let sampled = Indirect::from(Quality::Draft.sampled());
    vec![
        usual.clone(),
        Settings { culling: Culling::from(Tiled::default()), shadows: Shadows::None, ..usual.clone() },
        Settings { samples: Samples::Four, ..usual.clone() },
        Settings { occlusion: Occlusion::from(Deep::default()), structure: deep_images.into(), ..usual.clone() },
        Settings { indirect: sampled, ..usual.clone() },
        Settings { debug_view: Some(DebugView::Normal), ..usual },
    ]
}

#[test]
fn gpu_settings_that_come_again_take_no_more_memory() {
    lanternfish_papers::register();
    let Some(gpu) = testing::gpu("gpu_settings_that_come_again_take_no_more_memory") else { return };
    let scene = demo("cornell").unwrap();
    let camera = scene.default_camera(1.5);
    let mut viewport = Viewport::new(own(gpu), scene, &kinds()[0]).unwrap();
    let mut round = |size: u32| {
        for settings in kinds() {
            viewport.set(&settings).unwrap();
            viewport.resize(UVec2::splat(size));
            for _ in 0..ALIKE {
                viewport.draw(&camera).unwrap();
                viewport.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
                viewport.poll();
            }
        }
        println!("{:?}", Alive::of(&viewport));
        (Alive::of(&viewport).unwrap_or_default(), viewport.renderer.engine().compilations())
    };
    round(16);
    let (second, compiled) = round(16);
    for _ in 0..3 {
        let (now, compiled_now) = round(16);
        assert_eq!((now.allocations, now.compiled, compiled_now), (second.allocations, second.compiled, compiled));
        assert!(now.bytes.abs_diff(second.bytes) < ROUNDED, "{} bytes, {} before", now.bytes, second.bytes);
    }
    // It can fail: larger images take more.
    let (larger, _) = round(200);
    assert!(larger == Alive::default() || larger.bytes > second.bytes + ROUNDED, "{larger:?}");
}
