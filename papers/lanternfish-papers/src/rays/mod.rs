//! Tracers that traverse deep images.

pub(crate) mod across_texels;
mod count;
#[cfg(test)]
mod tests;
pub(crate) mod within_texel;

pub(crate) use self::count::DECLARED;
pub use self::count::RayCounter;
