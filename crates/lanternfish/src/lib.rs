//! Lanternfish: thousands of lights, with shadows, on any GPU that wgpu reaches.

pub mod debug_views;
mod error;
mod frame;
pub mod gpu_scene;
pub mod light_culling;
pub mod lights;
pub mod output;
pub mod prepass;
mod renderer;
pub mod settings;
pub mod shaders;
pub mod shading;
pub mod shadows;
#[cfg(test)]
mod testing;
mod texture;
pub mod view;

pub use error::RenderError;
pub use gpu_scene::GpuScene;
pub use renderer::{Picture, Renderer, Report};
pub use settings::Settings;
