//! Images on disk and how two of them differ. No GPU.
//!
//! [`RgbImage`] is linear and scene-referred; it is read from and written to OpenEXR. What a display shows is 8 bits
//! and goes to PNG with [`write_png`]. [`RelativeError`] compares with a ground truth, [`share_differing`] compares
//! two pictures that should be the same, [`flip_ldr`] how different two look to an observer.

mod compare;
mod error;
mod exr_file;
mod flip;
mod image;
mod png_file;
mod write_aside;

pub use compare::{RelativeError, share_differing};
pub use error::MetricsError;
pub use exr_file::{exr_layers, read_exr, read_exr_attributes, read_exr_layer, write_exr, write_exr_layers};
pub use flip::{FlipMap, PIXELS_PER_DEGREE, flip_ldr};
pub use image::RgbImage;
pub use png_file::{ColorType, write_png};
pub use write_aside::write_aside;
