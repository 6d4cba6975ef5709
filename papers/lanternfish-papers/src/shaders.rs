//! The shaders of this crate.

use lanternfish::shaders::Package;

/// Every `.wesl` file of this crate; the path of a module is that of its file. They may import those of the library.
pub static SHADERS: Package = Package::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs")));
