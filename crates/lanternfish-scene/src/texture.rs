//! Images and how they are sampled.

use std::sync::LazyLock;

/// A pair of image and sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Texture {
    /// Index into [`crate::Scene::images`].
    pub image: usize,
    /// Index into [`crate::Scene::samplers`].
    pub sampler: usize,
}

/// A decoded image. The material that uses it determines if the values are sRGB-encoded or linear.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// Name in the file, or empty.
    pub name: String,
    /// Pixels across; > 0.
    pub width: u32,
    /// Pixels down; > 0.
    pub height: u32,
    /// RGBA, 8 bits each, rows from the top; `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

/// How a texture is filtered and wrapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Magnification filter.
    pub mag: Filter,
    /// Minification filter.
    pub min: Filter,
    /// Filter between mip levels.
    pub mip: MipFilter,
    /// Wrapping along u.
    pub wrap_u: Wrap,
    /// Wrapping along v.
    pub wrap_v: Wrap,
}

impl Default for Sampler {
    /// Trilinear filtering and repeating: glTF's default for textures without a sampler.
    fn default() -> Self {
        Self {
            mag: Filter::Linear,
            min: Filter::Linear,
            mip: MipFilter::Linear,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
        }
    }
}

/// Filter within one mip level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    Linear,
}

/// Filter between mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MipFilter {
    /// Only level 0.
    None,
    /// The nearest level.
    Nearest,
    /// Linear interpolation between the two nearest levels.
    Linear,
}

/// Wrapping of texture coordinates outside 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Repeats the image.
    Repeat,
    /// Repeats the image, every other copy mirrored.
    MirroredRepeat,
    /// Extends the border texels.
    ClampToEdge,
}

/// Linear value of every sRGB byte [IEC 61966-2-1].
pub static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let s = i as f32 / 255.0;
        if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
    })
});

/// Linear value of an sRGB byte.
pub fn linear_from_srgb(byte: u8) -> f32 {
    LINEAR_FROM_SRGB[byte as usize]
}
