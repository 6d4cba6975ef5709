//! Adapters of this machine, and what each can run.

use lanternfish::{
    RenderError, Renderer, Settings,
    settings::{Caustics, Culling, Direct, Indirect, Occlusion, Shadows, Tracer},
};
use lanternfish_gpu::{AdapterDescription, Engine, Gpu, driver_warning};
use lanternfish_papers::DeepImageSettings;

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
    let mut requested: Vec<(String, Settings)> = Vec::new();
    let culling = Culling::all().into_iter();
    requested.extend(culling.map(|culling| (format!("culling {}", culling.name()), direct().with_culling(culling))));
    let lights = Direct::all().into_iter();
    requested.extend(lights.map(|lights| (format!("direct {}", lights.name()), direct().with_direct(lights))));
    requested.extend(
        Tracer::all()
            .into_iter()
            .map(|tracer| (format!("shadows {tracer}"), direct().with_shadows(Shadows::Traced(tracer)))),
    );
    let occlusion = Occlusion::all().into_iter();
    requested.extend(
        occlusion.map(|occlusion| (format!("occlusion {}", occlusion.name()), direct().with_occlusion(occlusion))),
    );
    let caustics = Caustics::all().into_iter();
    requested
        .extend(caustics.map(|caustics| (format!("caustics {}", caustics.name()), direct().with_caustics(caustics))));
    let deep_images = DeepImageSettings::default();
    let indirect = Indirect::all().into_iter();
    requested.extend(indirect.map(|indirect| {
        (format!("indirect {}", indirect.name()), direct().with_indirect(indirect).with_structure(deep_images))
    }));
    let built = |(name, settings): (String, Settings)| {
        let reason =
            Renderer::with_engine(engine, settings).err().map(|error: RenderError| as_flags(&error.to_string()));
        Technique { name, reason }
    };
    requested.into_iter().map(built).collect()
}
