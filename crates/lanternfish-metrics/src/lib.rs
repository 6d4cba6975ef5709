//! Image files and image difference metrics. No GPU.
//!
//! [`RgbImage`] is linear and scene-referred; it is read from and written to OpenEXR. Display values have 8 bits and are
//! written to PNG by [`write_png`]. [`Pair`] holds two images for comparison by any metric and leaves out pixels that are
//! not finite. [`RelativeError`] measures the error against a ground truth where it is lit, [`fraction_differing`] compares
//! two images that should be equal, and [`flip_ldr`] and [`flip_hdr`] measure the perceived difference.

mod compare;
mod error;
mod exr_file;
mod flip;
mod gif_file;
mod image;
mod image_errors;
mod jpeg_file;
mod normal;
mod open_file;
mod pair;
mod png_file;
mod ssim;
mod write_aside;
mod z_test;

pub use compare::RelativeError;
pub use error::MetricsError;
pub use exr_file::{read_exr, write_exr};
pub use flip::{Exposures, FlipMap, FlipToneMapper, HdrFlip, HdrFlipMap, PIXELS_PER_DEGREE, flip_hdr, flip_ldr};
pub use image::RgbImage;
pub use image_errors::ImageErrors;
pub use pair::Pair;
pub use png_file::{ColorType, read_png, write_png};

#[doc(hidden)]
pub use {
    compare::fraction_differing,
    exr_file::{
        exr_layer_size, exr_layers, read_exr_attributes, read_exr_layer, write_exr_channels, write_exr_image,
        write_exr_layers,
    },
    gif_file::Animation,
    image_errors::{RELATIVE_EPSILON, Spread},
    jpeg_file::{read_jpeg, write_jpeg},
    pair::PixelFaults,
    png_file::{read_png_texts, write_png_with_texts},
    write_aside::{check_writable, destination, is_stream, remove_unfinished, write_aside},
    z_test::{Z_TEST_TILE, ZTest, ZVerdict},
};
