//! Tracers that traverse deep images.

pub(crate) mod across_texels;
#[cfg(test)]
mod tests;
pub(crate) mod within_texel;
