//! Choice of an adapter, and opening of its device.

use crate::{GpuError, platform::wait};

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The most capable one: discrete before integrated before virtual before software.
    #[default]
    Auto,
    /// A software adapter.
    Cpu,
    /// The most capable one that is not software. An error without a graphics card.
    Hardware,
    /// The first one whose name contains this text, ignoring case.
    Name(String),
}

/// Properties of an adapter.
#[derive(Clone, Debug)]
pub struct AdapterDescription {
    /// The adapter's name, from the driver.
    pub name: String,
    /// The graphics API, e.g. `vulkan`.
    pub backend: String,
    /// Driver and driver version.
    pub driver: String,
    /// The device type as text, e.g. `Cpu`.
    pub device_type: String,
    /// True if it supports ray query, in hardware or emulated.
    pub ray_query: bool,
    /// True if it supports binding arrays of textures.
    pub texture_arrays: bool,
    /// True if it supports timestamp queries.
    pub timestamps: bool,
    /// The device type.
    pub kind: wgpu::DeviceType,
    /// All features of the adapter. The device is opened with those of [`Gpu::WANTED_FEATURES`].
    pub features: wgpu::Features,
    /// The adapter's limits. The device is opened with WebGPU's default limits, except for sizes.
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
    /// True if both describe the same adapter with the same API and driver.
    pub fn is(&self, other: &Self) -> bool {
        (&self.name, &self.backend, &self.driver) == (&other.name, &other.backend, &other.driver)
    }
}

/// All adapters of this machine, in the order of preference of [`AdapterChoice::Auto`].
pub fn adapters() -> Vec<AdapterDescription> {
    enumerate().iter().map(AdapterDescription::new).collect()
}

/// Flags of a wgpu instance for Lanternfish: wgpu's defaults, without the validation of indirect calls.
///
/// For this validation wgpu adds a dispatch and its barriers to each indirect dispatch, also in release builds. Lanternfish does not need it:
/// its shaders limit the numbers of workgroups that they write. The environment variable `WGPU_VALIDATION_INDIRECT_CALL` turns it on, to
/// measure it.
pub fn instance_flags() -> wgpu::InstanceFlags {
    wgpu::InstanceFlags::default().difference(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL).with_env()
}

fn enumerate() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.flags = instance_flags();
    descriptor.backends = wgpu::Backends::PRIMARY;
    sorted(&wgpu::Instance::new(descriptor))
}

/// The adapters of an instance, the most capable first.
fn sorted(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut adapters = wait(instance.enumerate_adapters(wgpu::Backends::PRIMARY)).unwrap_or_default();
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    adapters
}

/// The requested adapter.
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
/// A convenience: the renderer accepts any `wgpu::Device`.
#[derive(Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter's properties.
    pub description: AdapterDescription,
}

impl Gpu {
    /// Features for binding all textures of a scene as an array.
    #[doc(hidden)]
    pub const TEXTURE_ARRAYS: wgpu::Features = wgpu::Features::TEXTURE_BINDING_ARRAY
        .union(wgpu::Features::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING);

    /// Features for timing passes, and dispatches that share a pass.
    #[doc(hidden)]
    pub const TIMESTAMPS: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);

    /// Optional features that some technique uses if they are available.
    pub const WANTED_FEATURES: wgpu::Features = Self::TEXTURE_ARRAYS
        .union(wgpu::Features::EXPERIMENTAL_RAY_QUERY)
        .union(Self::TIMESTAMPS)
        .union(wgpu::Features::FLOAT32_BLENDABLE);

    /// Opens an adapter's device with all features of [`Gpu::WANTED_FEATURES`] that it supports.
    ///
    /// Limits are WebGPU's defaults, so that the renderer does not depend on this adapter. Sizes (of buffers, bindings and textures) and
    /// the counts of optional features have the adapter's limits.
    pub fn open(choice: &AdapterChoice) -> Result<Self, GpuError> {
        let adapter = choose(enumerate(), choice)?;
        Self::open_adapter(&adapter, adapter.features() & Self::WANTED_FEATURES)
    }

    /// Like [`Self::open`], for an adapter from [`adapters`].
    #[doc(hidden)]
    pub fn open_listed(listed: &AdapterDescription) -> Result<Self, GpuError> {
        let adapters = enumerate();
        let adapter = adapters.iter().find(|adapter| AdapterDescription::new(adapter).is(listed));
        let adapter = adapter.ok_or(GpuError::NoAdapter)?;
        Self::open_adapter(adapter, adapter.features() & Self::WANTED_FEATURES)
    }

    /// Like [`Self::open`], among the adapters of `instance` that can present to `surface`. Also returns the adapter.
    #[doc(hidden)]
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
        wait(Self::request(adapter, features)).unwrap_or(Err(GpuError::Waits { what: "a device" }))
    }

    /// Like [`Self::open_adapter`], for a browser, which cannot wait.
    #[doc(hidden)]
    pub async fn request(adapter: &wgpu::Adapter, features: wgpu::Features) -> Result<Self, GpuError> {
        let description = AdapterDescription::new(adapter);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lanternfish"),
            required_features: features,
            required_limits: limits(&adapter.limits(), features),
            // Safety: ray query is used as wgpu documents it; acceleration structures outlive their use.
            experimental_features: unsafe { wgpu::ExperimentalFeatures::enabled() },
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        };
        let refused = |source| GpuError::Device { adapter: description.name.clone(), source };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(refused)?;
        Ok(Self { device, queue, description })
    }
}

/// WebGPU's default limits, with the adapter's limits for sizes and for the counts of optional features.
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
