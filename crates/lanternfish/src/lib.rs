//! Lanternfish: thousands of lights, with ray-traced shadows, on any GPU that wgpu reaches, or on none.
//!
//! A [`Renderer`] compiles the passes that its [`Settings`] need, uploads a scene, and renders images of it: linear
//! radiance, a display image, and a report with the time of each pass and counters. It uses the caller's
//! `wgpu::Device` and `wgpu::Queue`. It opens no device, logs through `tracing`, and never prints or exits.
//!
//! Scenes come from `lanternfish-scene`: a glTF 2.0 file, a generated scene, or lists of your own.
//!
//! # Your own wgpu device → an image
//!
//! ```
//! use lanternfish::{Renderer, Settings};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // As in any wgpu program; a program with a device passes its own.
//! let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
//! let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
//! # if adapter.is_err() { return Ok(()) }
//! let (device, queue) = pollster::block_on(adapter?.request_device(&wgpu::DeviceDescriptor::default()))?;
//!
//! // "demo:cornell", or the path of a .gltf or .glb file.
//! let scene = lanternfish_scene::load("demo:cornell")?;
//! let camera = scene.default_camera(64.0 / 48.0);
//!
//! let mut renderer = Renderer::new(&device, &queue, Settings::default())?;
//! let uploaded = renderer.upload(&scene)?;
//! let image = renderer.render(&uploaded, &camera, [64, 48])?;
//!
//! // Rows from the top: `display` is sRGB, 8 bits; `radiance` is linear, nits.
//! assert_eq!(image.display.len(), 64 * 48);
//! assert!(image.radiance.iter().any(|texel| texel[1] > 0.1));
//! # Ok(())
//! # }
//! ```
//!
//! `examples/own_device.rs` does the same with a scene built in code, and writes a PNG.
//!
//! # What the device needs
//!
//! WebGPU's default limits, and no optional feature. Optional features that the device has are used:
//! `Gpu::WANTED_FEATURES` of `lanternfish-gpu` lists them, and `Gpu::open` opens a device with all that the adapter
//! has. Larger limits allow larger scenes and images; a scene that exceeds a limit is an error ([`RenderError`]).
//!
//! # Architecture
//!
//! A folder holds the host code and the shaders of a technique. Techniques of a kind share one trait ([`technique`]); a program may add its own.
//!
//! ```text
//! gpu_scene ─▶ prepass ─▶ light_culling ─▶ occlusion ─▶ shadows ─▶ shading ─▶ sky ─┬▶ progressive ─┬▶ output
//!                                                                                  └▶ antialiasing ┘
//!                                                                                  └▶ debug_views
//! ```
//!
//! Units: metres, radians, candela (point and spot lights), lux (directional lights), nits (disks, rectangles, emission, sky, images);
//! linear Rec. 709. Right-handed, +y up. The same scene, settings and adapter give the same image, bit for bit,
//! unless the radiance cache is full (`Sampled::cache_entries`).

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

// Public for the project's other crates alone: no part of the interface, without promises.
#[doc(hidden)]
pub mod antialiasing;
#[doc(hidden)]
pub mod common;
#[doc(hidden)]
pub mod debug_views;
#[doc(hidden)]
pub mod denoise;
#[doc(hidden)]
pub mod direct_light;
#[doc(hidden)]
pub mod environment_light;
#[doc(hidden)]
pub mod gpu_scene;
#[doc(hidden)]
pub mod indirect;
#[doc(hidden)]
pub mod light_culling;
#[doc(hidden)]
pub mod lights;
#[doc(hidden)]
pub mod occlusion;
#[doc(hidden)]
pub mod output;
#[doc(hidden)]
pub mod prepass;
#[doc(hidden)]
pub mod progressive;
#[doc(hidden)]
pub mod rays;
#[doc(hidden)]
pub mod shaders;
#[doc(hidden)]
pub mod shading;
#[doc(hidden)]
pub mod shadows;
#[doc(hidden)]
pub mod sky;
#[doc(hidden)]
pub mod texture;
#[doc(hidden)]
pub mod view;

mod aovs;
mod context;
mod error;
mod frame;
mod platform;
mod renderer;
mod request;
mod resolution_scaling;
pub mod settings;
pub mod technique;
pub mod techniques;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use aovs::{Aovs, Moment};
pub use context::ViewContext;
pub use error::RenderError;
pub use gpu_scene::{GpuScene, Sent};
pub use lanternfish_gpu::Engine;
pub use renderer::{Change, FrameId, FrameMemory, FrameReport, PendingFrame, RenderedImage, Renderer, Report};
pub use request::{SurfaceSource, Target, ViewRequest};
#[doc(hidden)]
pub use resolution_scaling::ResolutionScaling;
pub use settings::Settings;

// What a technique of indirect light is made of.
#[doc(hidden)]
pub use indirect::CausticTechnique;
pub use indirect::{DemodulatedIrradiance, Indirect, IndirectPasses, IndirectTechnique, layers_target};
pub use prepass::Surface;
pub use rays::Tracer;
pub use shaders::{Package, Root, Shaders};
pub use view::ViewBuffer;
