//! Alpha masks of traced triangles, as words for shaders (`gpu_scene/mask.wesl`).

use std::collections::HashMap;

use glam::{UVec2, Vec2};
use lanternfish_scene::{Filter, Material, Primitive, Scene, Wrap};
use rayon::prelude::*;

use super::{
    super::{
        shaders::{MaskHeader, MaskRecord},
        upload::{materials::mask_cutoff, mips},
    },
    panes::{PANE_WORDS, Pane},
};

pub const RECORD_WORDS: usize = size_of::<MaskRecord>() / 4;
pub const HEADER_WORDS: usize = size_of::<MaskHeader>() / 4;

/// The header is the index of the material until [`pack_masks`] assigns addresses.
pub fn mask_record(primitive: &Primitive, material: &Material, triangle: [u32; 3]) -> MaskRecord {
    let [uv_a, uv_b, uv_c] = triangle.map(|i| {
        let Some(reference) = &material.base_color_texture else { return Vec2::ZERO };
        let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
        reference.texture_from_uv.transform_point2(set.get(i as usize).copied().unwrap_or_default())
    });
    let vertex_alpha = |i: u32| primitive.colors.get(i as usize).map_or(1.0, |c| c.w);
    // The block of a pane has its material's alpha, which may change.
    let factor = if material.is_pane() { 1.0 } else { material.base_color.w };
    let [alpha_a, alpha_b, alpha_c] = triangle.map(|i| factor * vertex_alpha(i));
    MaskRecord { uv_a, uv_b, uv_c, alpha_a, alpha_b, alpha_c, header: primitive.material as u32 }
}

/// An image's alpha.
struct MaskImage {
    /// `None`: one opaque texel, for materials without a texture.
    image: Option<usize>,
    /// Size after halving, texels.
    size: UVec2,
    /// Number of halvings of each side.
    halvings: u32,
}

/// [`super::Tracing::masks`], where blocks of panes are still empty, and [`super::Tracing::panes`]. Writes the headers'
/// addresses into the records.
pub fn pack_masks(scene: &Scene, records: &mut [MaskRecord], mask_bytes: u64) -> (Vec<u32>, Vec<Pane>) {
    // Equal headers and equal images are stored once each, in the order of their first use.
    let mut images = Vec::new();
    let mut headers = Vec::new();
    let mut header_of_material: HashMap<u32, usize> = HashMap::new();
    for record in records.iter_mut() {
        let header = *header_of_material
            .entry(record.header)
            .or_insert_with(|| header_index(scene, record.header as usize, &mut headers, &mut images));
        record.header = header as u32;
    }

    // Addresses.
    let first_header = RECORD_WORDS * records.len();
    let first_pane = first_header + HEADER_WORDS * headers.len();
    let of_panes = headers.iter_mut().filter(|header| header.pane > 0);
    let place = |(header, at): (&mut MaskHeader, usize)| {
        Pane::new(scene, std::mem::replace(&mut header.pane, at as u32) as usize - 1, at as u32)
    };
    let panes: Vec<Pane> = of_panes.zip((first_pane..).step_by(PANE_WORDS)).map(place).collect();
    let first_texel = first_pane + PANE_WORDS * panes.len();
    for record in records.iter_mut() {
        record.header = (first_header + HEADER_WORDS * record.header as usize) as u32;
    }
    fit(&mut images, (mask_bytes / 4).saturating_sub(first_texel as u64) as usize);
    let mut total = first_texel;
    let mut reserve = |image: &MaskImage| {
        total += image.words();
        (total - image.words()) as u32
    };
    let addresses: Vec<u32> = images.iter().map(&mut reserve).collect();
    for header in &mut headers {
        let image = header.texels as usize;
        (header.size, header.texels) = (images[image].size, addresses[image]);
    }

    let mut words = vec![0; total];
    words[..first_header].copy_from_slice(bytemuck::cast_slice(records));
    words[first_header..first_pane].copy_from_slice(bytemuck::cast_slice(&headers));
    let mut rest = &mut words[first_texel..];
    let slots: Vec<&mut [u32]> = images
        .iter()
        .map(|image| {
            let (slot, after) = std::mem::take(&mut rest).split_at_mut(image.words());
            rest = after;
            slot
        })
        .collect();
    images.par_iter().zip(slots).for_each(|(image, slot)| {
        let alpha = image.alpha(scene);
        bytemuck::cast_slice_mut(slot)[..alpha.len()].copy_from_slice(&alpha);
    });
    (words, panes)
}

/// Index of a material's header. Until addresses are known, its `texels` is the index of its image, and its `pane` that
/// of its material plus one.
fn header_index(scene: &Scene, index: usize, headers: &mut Vec<MaskHeader>, images: &mut Vec<MaskImage>) -> usize {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    let material = &scene.materials[index];
    let mut header = MaskHeader { cutoff: mask_cutoff(material).unwrap_or(0.0), ..MaskHeader::default() };
    if material.is_pane() {
        (header.cutoff, header.pane) = (f32::MAX, index as u32 + 1);
    }
    let texture = material.base_color_texture.as_ref().map(|reference| scene.textures[reference.texture]);
    if let Some(texture) = texture {
        let sampler = scene.samplers[texture.sampler];
        header.wrap = UVec2::new(wrap(sampler.wrap_u), wrap(sampler.wrap_v));
        header.linear_filter = u32::from(sampler.mag == Filter::Linear);
    }
    let image = texture.map(|texture| texture.image);
    header.texels = images.iter().position(|other| other.image == image).unwrap_or_else(|| {
        let size = image.map_or(UVec2::ONE, |i| UVec2::new(scene.images[i].width, scene.images[i].height));
        images.push(MaskImage { image, size, halvings: 0 });
        images.len() - 1
    }) as u32;
    headers.iter().position(|other| *other == header).unwrap_or_else(|| {
        headers.push(header);
        headers.len() - 1
    })
}

/// Halves the largest images until all together take at most this many words, or one each.
fn fit(images: &mut [MaskImage], budget_words: usize) {
    let mut words: usize = images.iter().map(MaskImage::words).sum();
    while words > budget_words {
        let Some(largest) = images.iter_mut().max_by_key(|image| image.words()).filter(|image| image.words() > 1)
        else {
            break;
        };
        words -= largest.words();
        largest.size = (largest.size / 2).max(UVec2::ONE);
        largest.halvings += 1;
        words += largest.words();
    }
    let halved = images.iter().filter(|image| image.halvings > 0).count();
    if halved > 0 {
        tracing::warn!(
            halved,
            masks = images.len(),
            most_halvings = images.iter().map(|image| image.halvings).max(),
            bytes = 4 * words,
            "alpha masks for rays are reduced in resolution: they do not fit one binding of this device"
        );
    }
}

impl MaskImage {
    /// Words of its texels, four a word.
    fn words(&self) -> usize {
        (self.size.x as usize * self.size.y as usize).div_ceil(4)
    }

    /// Its texels, row by row.
    fn alpha(&self, scene: &Scene) -> Vec<u8> {
        let Some(image) = self.image else { return vec![255] };
        let image = &scene.images[image];
        let alpha: Vec<u8> = image.rgba.as_chunks::<4>().0.iter().map(|texel| texel[3]).collect();
        let halve = |(alpha, width, height): (Vec<u8>, u32, u32), _| mips::half_alpha(&alpha, width, height);
        (0..self.halvings).fold((alpha, image.width, image.height), halve).0
    }
}
