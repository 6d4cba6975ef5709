//! Parallel building blocks.

mod scan;

pub use scan::Scan;

use crate::ShaderLibrary;

/// The shaders of this crate.
pub const SHADERS: ShaderLibrary = ShaderLibrary::new(&[("primitives/scan/scan", include_str!("scan/scan.wesl"))]);
