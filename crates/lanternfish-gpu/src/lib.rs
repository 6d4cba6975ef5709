//! A thin layer over wgpu that all techniques share.
//!
//! - [`Gpu`]: an adapter and its device, opened with the features the renderer can use.
//! - [`ShaderLibrary`]: WESL sources, linked, validated and reflected.
//! - [`gpu_struct!`]: a struct that host and shader share, its layout checked against the shader's.
//! - [`ComputeKernel`], [`RasterPipeline`]: pipelines whose resources are bound by name ([`Bindings`]).
//! - [`Engine`]: a cache of the shaders and pipelines compiled for a device.
//! - [`Frame`]: records the commands of a frame and times each pass. Its transient resources come from a [`Pool`].
//! - [`primitives`]: prefix sums and sorting.

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

// Public for the project's other crates alone: no part of the interface, without promises.
#[doc(hidden)]
pub mod primitives;

// `gpu_struct!` expands to paths that name this crate, and this crate uses it too.
extern crate self as lanternfish_gpu;

mod adapter;
mod bindings;
mod buffer;
mod capacity_policy;
mod compute;
mod driver;
mod edited;
mod engine;
mod error;
mod frame;
mod gpu_struct;
mod made;
mod platform;
mod pool;
mod raster;
mod reflect;
mod shader;
#[cfg(feature = "testing")]
pub mod testing;
mod vertex_grid;

pub use adapter::{AdapterChoice, AdapterDescription, Gpu, adapters, instance_flags};
pub use bindings::{Bindings, BufferPart};
pub use buffer::{storage_buffer, storage_buffer_of, uniform_buffer_of};
pub use compute::ComputeKernel;
pub use engine::Engine;
pub use error::GpuError;
pub use frame::{Frame, PassCommands, PassTime};
pub use gpu_struct::{Field, GpuStruct, LayoutError, SharedStruct, WgslType, check_layout};
pub use shader::{Feature, LinkedShader, ShaderSource};

#[doc(hidden)]
pub use {
    buffer::{checked, indirect_buffer, is_lost, is_same_device, read_back, read_texture, texels, texture_of},
    capacity_policy::{Arrived, Counted, Growth, ListCapacity, Outcome},
    driver::{FAULTY_LOOP_STEPS, driver_warning, faulty_software, software_mesa},
    edited::{ShaderTexts, read_shader_texts, shader_files},
    engine::{Compilations, KeptCompiled, Requested},
    frame::{AcrossFrames, PassProgress, PassWatcher, Profiler, discarded, submitted},
    made::{Made, made},
    platform::CAN_WAIT,
    pool::{BindGroups, Pool},
    raster::{RasterPipeline, RasterState},
    shader::ShaderLibrary,
    vertex_grid::drawn_subpixel_bits,
};

#[doc(hidden)]
pub use bytemuck;
