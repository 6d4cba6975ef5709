//! Adapters of this machine, and what each can run.

use lanternfish::{
    Renderer, Settings,
    settings::{Caustics, Culling, Direct, Indirect, Occlusion, Shadows, Tracer},
};
use lanternfish_gpu::{AdapterDescription, Engine, Gpu, driver_warning};

use super::report::{Adapter, Technique};
use crate::flags::as_flags;

/// Describes an adapter, without its techniques and its vertex grid, which need an open device.
pub fn describe(adapter: &AdapterDescription, info: Option<&wgpu::AdapterInfo>) -> Adapter {
    let named = [
        ("ray query", wgpu::Features::EXPERIMENTAL_RAY_QUERY),
        ("texture arrays", Gpu::TEXTURE_ARRAYS),
        ("timestamps", Gpu::TIMESTAMPS),
        ("32-bit float blending", wgpu::Features::FLOAT32_BLENDABLE),
    ];
    let limits = &adapter.limits;
    let limits = [
        ("buffer", limits.max_buffer_size),
        ("binding", limits.max_storage_buffer_binding_size),
        ("texture edge", u64::from(limits.max_texture_dimension_2d)),
        ("workgroup", u64::from(limits.max_compute_invocations_per_workgroup)),
    ];
    Adapter {
        name: adapter.name.clone(),
        kind: adapter.device_type.clone(),
        backend: adapter.backend.clone(),
        driver: adapter.driver.clone(),
        faults: info.and_then(driver_warning),
        automatic_tracer: Tracer::automatic(adapter.kind, adapter.features).name().to_owned(),
        features: named.map(|(name, feature)| (name.to_owned(), adapter.features.contains(feature))).to_vec(),
        limits: limits.map(|(name, limit)| (name.to_owned(), limit)).to_vec(),
        subpixel_bits: None,
        techniques: Vec::new(),
    }
}

/// The techniques and tracers that the engine's device can run. Each is built to find out.
pub fn techniques(engine: &Engine) -> Vec<Technique> {
    let direct = Settings::direct_light;
    let culling = |of: Culling| (format!("culling {}", of.name()), direct().with_culling(of));
    let lights = |of: Direct| (format!("direct {}", of.name()), direct().with_direct(of));
    let shadows = |of: Tracer| (format!("shadows {of}"), direct().with_shadows(Shadows::Traced(of)));
    let occlusion = |of: Occlusion| (format!("occlusion {}", of.name()), direct().with_occlusion(of));
    let caustics = |of: Caustics| (format!("caustics {}", of.name()), direct().with_caustics(of));
    let indirect = |of: Indirect| (format!("indirect {}", of.name()), direct().with_indirect(of));
    let requested = Culling::all().into_iter().map(culling).chain(Direct::all().into_iter().map(lights));
    let requested = requested.chain(Tracer::all().into_iter().map(shadows));
    let requested = requested.chain(Occlusion::all().into_iter().map(occlusion));
    let requested = requested.chain(Caustics::all().into_iter().map(caustics));
    let requested = requested.chain(Indirect::all().into_iter().map(indirect));
    let built = |(name, settings): (String, Settings)| {
        let reason = Renderer::with_engine(engine, settings).err().map(|error| as_flags(&error.to_string()));
        Technique { name, reason }
    };
    requested.map(built).collect()
}
