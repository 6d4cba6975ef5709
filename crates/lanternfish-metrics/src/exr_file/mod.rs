//! OpenEXR: linear images on disk.

mod order;
mod read;
mod write;

pub use read::{exr_layer_size, exr_layers, read_exr, read_exr_attributes, read_exr_layer};
pub use write::{write_exr, write_exr_channels, write_exr_image, write_exr_layers};

#[cfg(test)]
mod tests;
