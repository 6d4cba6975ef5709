//! Choosing an adapter and opening its device.

use crate::GpuError;

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The most capable: discrete before integrated before virtual before software.
    #[default]
    Auto,
    /// A software adapter.
    Cpu,
    /// The most capable that is not software: an error where there is no graphics card.
    Hardware,
    /// The first whose name contains this, in any case.
    Name(String),
}

/// An adapter as a user needs to know it.
#[derive(Clone, Debug)]
pub struct AdapterDescription {
    /// The driver's name for it.
    pub name: String,
    /// The API it is reached through, e.g. `vulkan`.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// What kind of device it is, e.g. `Cpu`.
    pub device_type: String,
    /// True if it traces rays in hardware (or emulates that).
    pub ray_query: bool,
    /// True if all textures can be bound at once.
    pub texture_arrays: bool,
    /// True if passes can be timed.
    pub timestamps: bool,
    /// The same as [`Self::device_type`], to decide by.
    pub kind: wgpu::DeviceType,
    /// Every feature of the adapter; the device is opened with those of [`Gpu::WANTED_FEATURES`].
    pub features: wgpu::Features,
    /// The adapter's limits; the device is opened with WebGPU's defaults but for sizes.
    pub limits: wgpu::Limits,
}

impl AdapterDescription {
    fn new(adapter: &wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        let features = adapter.features();
        Self {
            name: info.name,
            backend: info.backend.to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            device_type: format!("{:?}", info.device_type),
            ray_query: features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY),
            texture_arrays: features.contains(Gpu::TEXTURE_ARRAYS),
            timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
            kind: info.device_type,
            features,
            limits: adapter.limits(),
        }
    }
}

impl AdapterDescription {
    /// True if both are of one adapter, reached through one API by one driver.
    pub fn is(&self, other: &Self) -> bool {
        (&self.name, &self.backend, &self.driver) == (&other.name, &other.backend, &other.driver)
    }
}

/// Every adapter of this machine, the one [`AdapterChoice::Auto`] takes first.
pub fn adapters() -> Vec<AdapterDescription> {
    enumerate().iter().map(AdapterDescription::new).collect()
}

fn enumerate() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    sorted(&wgpu::Instance::new(descriptor))
}

/// Those of an instance, the most capable first.
fn sorted(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    adapters
}

/// The one that is requested.
fn choose(adapters: Vec<wgpu::Adapter>, choice: &AdapterChoice) -> Result<wgpu::Adapter, GpuError> {
    if adapters.is_empty() {
        return Err(GpuError::NoAdapter);
    }
    let adapter = match choice {
        AdapterChoice::Auto => adapters.first(),
        AdapterChoice::Cpu => adapters.iter().find(|a| a.get_info().device_type == wgpu::DeviceType::Cpu),
        AdapterChoice::Hardware => adapters.iter().find(|a| a.get_info().device_type != wgpu::DeviceType::Cpu),
        AdapterChoice::Name(name) => {
            adapters.iter().find(|a| a.get_info().name.to_lowercase().contains(&name.to_lowercase()))
        }
    };
    adapter.cloned().ok_or_else(|| {
        let known = adapters.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
        match choice {
            AdapterChoice::Hardware => GpuError::NoHardware { known },
            AdapterChoice::Name(name) => GpuError::UnknownAdapter { name: name.clone(), known },
            AdapterChoice::Auto | AdapterChoice::Cpu => GpuError::UnknownAdapter { name: "cpu".to_owned(), known },
        }
    })
}

/// An adapter and its open device.
///
/// The renderer itself takes any `wgpu::Device`; this is the convenient way to one.
#[derive(Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What was opened.
    pub description: AdapterDescription,
}

impl Gpu {
    /// Features that bind all textures of a scene at once.
    pub const TEXTURE_ARRAYS: wgpu::Features = wgpu::Features::TEXTURE_BINDING_ARRAY
        .union(wgpu::Features::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING);

    /// Features that time passes, and dispatches that share a pass.
    pub const TIMESTAMPS: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);

    /// Optional features that some technique uses when they are there.
    pub const WANTED_FEATURES: wgpu::Features = Self::TEXTURE_ARRAYS
        .union(wgpu::Features::EXPERIMENTAL_RAY_QUERY)
        .union(Self::TIMESTAMPS)
        .union(wgpu::Features::FLOAT32_BLENDABLE);

    /// Opens an adapter's device with every feature of [`Gpu::WANTED_FEATURES`] that it has.
    ///
    /// Limits are WebGPU's defaults, so that what runs here runs everywhere, but for sizes (buffers, bindings,
    /// textures) and the counts that optional features need, which are the adapter's.
    pub fn open(choice: &AdapterChoice) -> Result<Self, GpuError> {
        let adapter = choose(enumerate(), choice)?;
        Self::open_adapter(&adapter, adapter.features() & Self::WANTED_FEATURES)
    }

    /// The same for an adapter that [`adapters`] lists.
    pub fn open_listed(listed: &AdapterDescription) -> Result<Self, GpuError> {
        let known = enumerate();
        let found = known.iter().find(|adapter| AdapterDescription::new(adapter).is(listed));
        let adapter = found.ok_or(GpuError::NoAdapter)?;
        Self::open_adapter(adapter, adapter.features() & Self::WANTED_FEATURES)
    }

    /// The same among the adapters of an instance that can draw to a window's surface, and the adapter.
    pub fn open_for(
        instance: &wgpu::Instance,
        surface: &wgpu::Surface<'_>,
        choice: &AdapterChoice,
    ) -> Result<(Self, wgpu::Adapter), GpuError> {
        let able = sorted(instance).into_iter().filter(|adapter| adapter.is_surface_supported(surface));
        let adapter = choose(able.collect(), choice)?;
        let gpu = Self::open_adapter(&adapter, adapter.features() & Self::WANTED_FEATURES)?;
        Ok((gpu, adapter))
    }

    /// Opens `adapter` with exactly these features.
    pub fn open_adapter(adapter: &wgpu::Adapter, features: wgpu::Features) -> Result<Self, GpuError> {
        let description = AdapterDescription::new(adapter);
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("lanternfish"),
            required_features: features,
            required_limits: limits(&adapter.limits(), features),
            // Safety: ray query is used as wgpu documents it; acceleration structures outlive their use.
            experimental_features: unsafe { wgpu::ExperimentalFeatures::enabled() },
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        }))
        .map_err(|source| GpuError::Device { adapter: description.name.clone(), source })?;
        Ok(Self { device, queue, description })
    }
}

/// WebGPU's default limits with the adapter's sizes.
fn limits(adapter: &wgpu::Limits, features: wgpu::Features) -> wgpu::Limits {
    let mut limits = wgpu::Limits {
        max_buffer_size: adapter.max_buffer_size,
        max_storage_buffer_binding_size: adapter.max_storage_buffer_binding_size,
        max_texture_dimension_2d: adapter.max_texture_dimension_2d,
        ..Default::default()
    };
    if features.contains(wgpu::Features::TEXTURE_BINDING_ARRAY) {
        limits.max_binding_array_elements_per_shader_stage = adapter.max_binding_array_elements_per_shader_stage;
        limits.max_binding_array_sampler_elements_per_shader_stage =
            adapter.max_binding_array_sampler_elements_per_shader_stage;
    }
    if features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY) {
        limits.max_blas_primitive_count = adapter.max_blas_primitive_count;
        limits.max_blas_geometry_count = adapter.max_blas_geometry_count;
        limits.max_tlas_instance_count = adapter.max_tlas_instance_count;
        limits.max_acceleration_structures_per_shader_stage = adapter.max_acceleration_structures_per_shader_stage;
        limits.max_buffers_and_acceleration_structures_per_shader_stage =
            adapter.max_buffers_and_acceleration_structures_per_shader_stage;
    }
    limits
}
