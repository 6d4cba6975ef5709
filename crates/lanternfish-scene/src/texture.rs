//! Images and how they are sampled.

use std::sync::LazyLock;

/// An image seen through a sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Texture {
    /// Index into [`crate::Scene::images`].
    pub image: usize,
    /// Index into [`crate::Scene::samplers`].
    pub sampler: usize,
}

/// Decoded pixels. Whether they are sRGB-encoded or linear is said by their use in a material, not here.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// The file's name for it, or empty.
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
    /// When a texel covers more than a pixel.
    pub mag: Filter,
    /// When a texel covers less than a pixel.
    pub min: Filter,
    /// Between mip levels.
    pub mip: MipFilter,
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
}

impl Default for Sampler {
    /// Trilinear, repeating: glTF's default where a texture has no sampler.
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
    /// Between the two nearest levels.
    Linear,
}

/// What lies outside 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The image again, every other one mirrored.
    MirroredRepeat,
    /// The border texels, stretched.
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
