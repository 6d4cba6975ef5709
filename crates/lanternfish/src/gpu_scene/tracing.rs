//! The surfaces that stop light, in world space: triangles, and the alpha masks of those that have holes.
//!
//! Blended surfaces are left out: they cast no shadow.

use std::collections::HashMap;

use glam::{UVec2, Vec2, Vec3};
use lanternfish_gpu::gpu_struct;
use lanternfish_scene::{AlphaMode, Filter, Material, Primitive, Scene, Wrap};
use rayon::prelude::*;

use super::{mask_cutoff, mips};

/// A triangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedTriangle {
    /// World space, m.
    pub corners: [Vec3; 3],
    /// 0: solid; else the index of its mask record plus one.
    pub record: u32,
}

gpu_struct! {
    /// What a masked triangle knows of its mask.
    pub struct MaskRecord {
        /// Texture coordinates of the first corner.
        uv_a: Vec2,
        /// Of the second.
        uv_b: Vec2,
        /// Of the third.
        uv_c: Vec2,
        /// Factor of the mask's alpha at the first corner.
        alpha_a: f32,
        /// At the second.
        alpha_b: f32,
        /// At the third.
        alpha_c: f32,
        /// Address of the mask's header, words.
        header: u32,
    }
}

gpu_struct! {
    /// How an image's alpha is read as a mask.
    pub struct MaskHeader {
        /// Of the image, texels.
        size: UVec2,
        /// Along u and v: constants in `mask.wesl`.
        wrap: UVec2,
        /// 1: bilinear, 0: nearest.
        linear_filter: u32,
        /// Alpha from which it is solid.
        cutoff: f32,
        /// Address of the first word of texels.
        texels: u32,
        /// Unused.
        _pad: u32,
    }
}

const RECORD_WORDS: usize = size_of::<MaskRecord>() / 4;
const HEADER_WORDS: usize = size_of::<MaskHeader>() / 4;

/// Everything that stops light.
#[derive(Debug, Default)]
pub struct Tracing {
    /// In no particular order until [`Tracing::reorder`].
    pub triangles: Vec<TracedTriangle>,
    /// Words: a [`MaskRecord`] for each masked triangle; a [`MaskHeader`] for each way of reading an image; the images'
    /// alpha, a byte a texel, each from a whole word on.
    pub masks: Vec<u32>,
    /// How many of the triangles have a record.
    pub record_count: usize,
}

impl Tracing {
    /// Gathers the triangles of every instance. Triangles without three distinct finite corners are left out.
    ///
    /// Where the masks would take more than `mask_bytes`, the largest get half the resolution until they fit. Records
    /// and one word a mask are kept whatever they take.
    pub fn new(scene: &Scene, mask_bytes: u64) -> Self {
        let parts: Vec<(Vec<TracedTriangle>, Vec<MaskRecord>)> = scene
            .instances
            .par_iter()
            .map(|instance| {
                let mut triangles = Vec::new();
                let mut records = Vec::new();
                for primitive in &scene.meshes[instance.mesh].primitives {
                    let material = &scene.materials[primitive.material];
                    if material.alpha_mode != AlphaMode::Blend {
                        gather(primitive, material, &instance.world_from_object, &mut triangles, &mut records);
                    }
                }
                (triangles, records)
            })
            .collect();

        let mut triangles = Vec::with_capacity(parts.iter().map(|(t, _)| t.len()).sum());
        let mut records = Vec::new();
        for (part, part_records) in parts {
            let first = records.len() as u32;
            triangles.extend(
                part.into_iter()
                    .map(|t| TracedTriangle { record: if t.record == 0 { 0 } else { t.record + first }, ..t }),
            );
            records.extend(part_records);
        }
        let masks = pack_masks(scene, &mut records, mask_bytes);
        Self { triangles, masks, record_count: records.len() }
    }

    /// Puts the triangles into this order, and the mask records into the order of their triangles.
    pub fn reorder(&mut self, order: &[u32]) {
        self.triangles = order.iter().map(|i| self.triangles[*i as usize]).collect();
        let records: &mut [MaskRecord] = bytemuck::cast_slice_mut(&mut self.masks[..RECORD_WORDS * self.record_count]);
        let old = records.to_vec();
        let masked = self.triangles.iter_mut().filter(|triangle| triangle.record > 0);
        for ((triangle, record), number) in masked.zip(records).zip(1..) {
            *record = old[triangle.record as usize - 1];
            triangle.record = number;
        }
    }
}

fn gather(
    primitive: &Primitive,
    material: &Material,
    world_from_object: &glam::Affine3A,
    triangles: &mut Vec<TracedTriangle>,
    records: &mut Vec<MaskRecord>,
) {
    let world: Vec<Vec3> = primitive.positions.iter().map(|p| world_from_object.transform_point3(*p)).collect();
    for triangle in primitive.indices.as_chunks::<3>().0 {
        let corners = triangle.map(|i| world[i as usize]);
        let degenerate = corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
        if degenerate || !corners.iter().all(|c| c.is_finite()) {
            continue;
        }
        let mut record = 0;
        if mask_cutoff(material).is_some() {
            records.push(mask_record(primitive, material, *triangle));
            record = records.len() as u32;
        }
        triangles.push(TracedTriangle { corners, record });
    }
}

/// The header is the index of the material until [`pack_masks`] puts the headers somewhere.
fn mask_record(primitive: &Primitive, material: &Material, triangle: [u32; 3]) -> MaskRecord {
    let [uv_a, uv_b, uv_c] = triangle.map(|i| {
        let Some(reference) = &material.base_color_texture else { return Vec2::ZERO };
        let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
        reference.texture_from_uv.transform_point2(set.get(i as usize).copied().unwrap_or_default())
    });
    let vertex_alpha = |i: u32| primitive.colors.get(i as usize).map_or(1.0, |c| c.w);
    let [alpha_a, alpha_b, alpha_c] = triangle.map(|i| material.base_color.w * vertex_alpha(i));
    MaskRecord { uv_a, uv_b, uv_c, alpha_a, alpha_b, alpha_c, header: primitive.material as u32 }
}

/// An image's alpha.
struct MaskImage {
    /// `None`: one opaque texel, for materials without a texture.
    image: Option<usize>,
    /// After halving, texels.
    size: UVec2,
    /// How often each side was halved.
    halvings: u32,
}

/// [`Tracing::masks`]. Puts the headers' addresses into the records.
fn pack_masks(scene: &Scene, records: &mut [MaskRecord], mask_bytes: u64) -> Vec<u32> {
    // Equal headers and equal images once each, in the order in which they come up.
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
    let first_texel = first_header + HEADER_WORDS * headers.len();
    for record in records.iter_mut() {
        record.header = (first_header + HEADER_WORDS * record.header as usize) as u32;
    }
    fit(&mut images, (mask_bytes / 4).saturating_sub(first_texel as u64) as usize);
    let mut total = first_texel;
    let mut place = |image: &MaskImage| {
        total += image.words();
        (total - image.words()) as u32
    };
    let addresses: Vec<u32> = images.iter().map(&mut place).collect();
    for header in &mut headers {
        let image = header.texels as usize;
        (header.size, header.texels) = (images[image].size, addresses[image]);
    }

    let mut words = vec![0; total];
    words[..first_header].copy_from_slice(bytemuck::cast_slice(records));
    words[first_header..first_texel].copy_from_slice(bytemuck::cast_slice(&headers));
    let mut rest = &mut words[first_texel..];
    let places: Vec<&mut [u32]> = images
        .iter()
        .map(|image| {
            let (place, after) = std::mem::take(&mut rest).split_at_mut(image.words());
            rest = after;
            place
        })
        .collect();
    images.par_iter().zip(places).for_each(|(image, place)| {
        let alpha = image.alpha(scene);
        bytemuck::cast_slice_mut(place)[..alpha.len()].copy_from_slice(&alpha);
    });
    words
}

/// Index of a material's header, whose `texels` is the index of its image until addresses are known.
fn header_index(scene: &Scene, material: usize, headers: &mut Vec<MaskHeader>, images: &mut Vec<MaskImage>) -> usize {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    let material = &scene.materials[material];
    let mut header = MaskHeader { cutoff: mask_cutoff(material).unwrap_or(0.0), ..MaskHeader::default() };
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
            "shadows of alpha masks are coarser than the masks: all of them do not fit one binding of this device"
        );
    }
}

impl MaskImage {
    /// Words that its texels take, four a word.
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

#[cfg(test)]
mod tests {
    use lanternfish_gpu::{Bindings, Frame, Profiler, read_back, storage_buffer, storage_buffer_of, testing};
    use lanternfish_scene::{Image, Instance, Mesh, Sampler, Texture, TextureRef};

    use super::*;
    use crate::testing::probe;

    fn scene() -> Scene {
        let quad = |material: usize, z: f32| Primitive {
            material,
            positions: vec![Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1.0, z), Vec3::NAN],
            uv0: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ZERO],
            normals: vec![Vec3::Z; 4],
            indices: vec![0, 1, 2, 0, 0, 2, 0, 1, 3],
            ..Default::default()
        };
        let masked = Material {
            alpha_mode: AlphaMode::Mask { cutoff: 0.25 },
            base_color_texture: Some(TextureRef::new(0)),
            ..Default::default()
        };
        let blended = Material { alpha_mode: AlphaMode::Blend, ..Default::default() };
        Scene {
            meshes: vec![Mesh { primitives: vec![quad(0, 0.0), quad(1, 1.0), quad(2, 2.0)], ..Default::default() }],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: glam::Affine3A::IDENTITY }; 2],
            materials: vec![Material::default(), masked, blended],
            textures: vec![Texture { image: 0, sampler: 0 }],
            samplers: vec![Sampler::default()],
            images: vec![Image {
                name: String::new(),
                width: 3,
                height: 1,
                rgba: vec![9, 9, 9, 1, 9, 9, 9, 2, 9, 9, 9, 3],
            }],
            ..Default::default()
        }
    }

    /// More than any test needs.
    const ANY: u64 = 1 << 20;

    fn records(tracing: &Tracing) -> &[MaskRecord] {
        bytemuck::cast_slice(&tracing.masks[..RECORD_WORDS * tracing.record_count])
    }

    fn header(tracing: &Tracing, record: usize) -> MaskHeader {
        let at = records(tracing)[record].header as usize;
        bytemuck::cast_slice(&tracing.masks[at..at + HEADER_WORDS])[0]
    }

    fn texels(tracing: &Tracing, header: MaskHeader) -> &[u8] {
        let bytes: &[u8] = bytemuck::cast_slice(&tracing.masks[header.texels as usize..]);
        &bytes[..header.size.element_product() as usize]
    }

    /// One masked triangle for each of these: image, wrap, cutoff. Images are square, of these sizes and random.
    fn masked_scene(sizes: &[u32], masks: &[(usize, Wrap, f32)]) -> Scene {
        let mut random = crate::testing::Random::new(3);
        let mut scene = Scene::default();
        for size in sizes {
            let rgba = (0..4 * size * size).map(|_| (256.0 * random.unit()) as u8).collect();
            scene.images.push(Image { name: String::new(), width: *size, height: *size, rgba });
        }
        let mut primitives = Vec::new();
        for (material, (image, wrap, cutoff)) in masks.iter().enumerate() {
            scene.samplers.push(Sampler { wrap_u: *wrap, wrap_v: Wrap::ClampToEdge, ..Sampler::default() });
            scene.textures.push(Texture { image: *image, sampler: material });
            scene.materials.push(Material {
                alpha_mode: AlphaMode::Mask { cutoff: *cutoff },
                base_color_texture: Some(TextureRef::new(material)),
                ..Material::default()
            });
            primitives.push(Primitive {
                material,
                positions: [0; 3].map(|_| random.point()).to_vec(),
                normals: vec![Vec3::Z; 3],
                uv0: [0; 3].map(|_| Vec2::new(random.unit(), random.unit())).to_vec(),
                colors: [0; 3].map(|_| glam::Vec4::splat(random.unit())).to_vec(),
                indices: vec![0, 1, 2],
                ..Primitive::default()
            });
        }
        scene.meshes = vec![Mesh { name: String::new(), primitives }];
        scene.instances = vec![Instance { name: String::new(), mesh: 0, world_from_object: glam::Affine3A::IDENTITY }];
        assert_eq!(scene.validate(), Ok(()));
        scene
    }

    #[test]
    fn constants_are_the_shaders() {
        let file = "shadows/mask";
        assert_eq!(crate::shaders::constant(file, "RECORD_WORDS"), RECORD_WORDS as f64);
        for (wrap, name) in [(Wrap::Repeat, "REPEAT"), (Wrap::MirroredRepeat, "MIRRORED_REPEAT")] {
            let tracing = Tracing::new(&masked_scene(&[4], &[(0, wrap, 0.5)]), ANY);
            assert_eq!(f64::from(header(&tracing, 0).wrap.x), crate::shaders::constant(file, name));
        }
    }

    #[test]
    fn gpu_records_and_headers_are_read_as_they_are_packed() {
        let Some(gpu) = testing::gpu("gpu_records_and_headers_are_read_as_they_are_packed") else { return };
        // In the second header no two words are equal, nor in the first record: none can be read for another.
        let masks = [(0, Wrap::MirroredRepeat, 0.25), (1, Wrap::Repeat, 0.75)];
        let mut scene = masked_scene(&[4, 6], &masks);
        (scene.images[1].width, scene.images[1].height) = (12, 3);
        scene.samplers[0].mag = Filter::Nearest;
        let tracing = Tracing::new(&scene, ANY);

        let kernel = probe(gpu, "testing/masks", &[], "read_masks");
        let none = wgpu::BufferUsages::empty();
        let words = storage_buffer_of(&gpu.device, "masks", &tracing.masks, none).unwrap();
        let found_records = storage_buffer(&gpu.device, "records", 2 * size_of::<MaskRecord>() as u64).unwrap();
        let found_headers = storage_buffer(&gpu.device, "headers", 2 * size_of::<MaskHeader>() as u64).unwrap();
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let bindings = Bindings::new()
            .buffer("masks", &words)
            .buffer("found_records", &found_records)
            .buffer("found_headers", &found_headers);
        frame.dispatch(&kernel, &bindings, [1, 1, 1]);
        frame.submit();
        let found: Vec<MaskRecord> = read_back(&gpu.device, &gpu.queue, &found_records, 2).unwrap();
        assert_eq!(found, records(&tracing));
        let found: Vec<MaskHeader> = read_back(&gpu.device, &gpu.queue, &found_headers, 2).unwrap();
        let found: Vec<_> = found.into_iter().map(|header| MaskHeader { _pad: 0, ..header }).collect();
        assert_eq!(found, [0, 1].map(|record| header(&tracing, record)));

        let differ = |words: &[u32]| words.iter().collect::<std::collections::BTreeSet<_>>().len() == words.len();
        assert!(differ(&bytemuck::cast_slice(&found[1..])[..HEADER_WORDS - 1]), "{found:?}");
        assert!(differ(&tracing.masks[..RECORD_WORDS]), "{:?}", records(&tracing)[0]);
    }

    #[test]
    fn masks_of_one_image_share_its_texels_and_equal_ones_their_header() {
        // Nine materials of one image: as many bytes as one, but for headers.
        let mut masks: Vec<_> = (0..8).map(|i| (0, Wrap::Repeat, 0.1 * i as f32)).collect();
        masks.push((0, Wrap::MirroredRepeat, 0.0));
        masks.push(masks[3]);
        let scene = masked_scene(&[64], &masks);
        let tracing = Tracing::new(&scene, ANY);
        assert_eq!(tracing.masks.len(), 10 * RECORD_WORDS + 9 * HEADER_WORDS + 64 * 64 / 4);
        let alpha: Vec<u8> = scene.images[0].rgba.iter().skip(3).step_by(4).copied().collect();
        for (record, (_, wrap, cutoff)) in masks.iter().enumerate() {
            let header = header(&tracing, record);
            assert_eq!((header.cutoff, header.wrap.x), (*cutoff, u32::from(*wrap == Wrap::MirroredRepeat)));
            assert_eq!(texels(&tracing, header), alpha);
        }
    }

    #[test]
    fn masks_that_do_not_fit_are_halved_the_largest_first() {
        let masks = [(0, Wrap::Repeat, 0.5), (1, Wrap::Repeat, 0.5), (2, Wrap::Repeat, 0.5)];
        let scene = masked_scene(&[64, 16, 33], &masks);
        let fixed = 4 * (3 * (RECORD_WORDS + HEADER_WORDS)) as u64;
        let full = fixed + 64 * 64 + 16 * 16 + 33 * 33 + 3;
        let sizes = |bytes: u64| {
            let tracing = Tracing::new(&scene, bytes);
            assert!(4 * tracing.masks.len() as u64 <= bytes.max(fixed + 12), "{bytes} bytes");
            [0, 1, 2].map(|record| header(&tracing, record).size.x)
        };
        assert_eq!(sizes(full), [64, 16, 33]);
        assert_eq!(sizes(full - 1), [32, 16, 33]);
        assert_eq!(sizes(fixed + 32 * 32 + 2 * 16 * 16), [32, 16, 16]);
        assert_eq!(sizes(fixed + 3 * 16 * 16), [16, 16, 16]);
        // Records are kept; the device's limit refuses them.
        assert_eq!(sizes(0), [2, 2, 2]);

        // Two by two texels become their mean.
        let tracing = Tracing::new(&scene, full - 1);
        let alpha = |x: usize, y: usize| u32::from(scene.images[0].rgba[4 * (64 * y + x) + 3]);
        let halved = texels(&tracing, header(&tracing, 0));
        for (i, texel) in halved.iter().enumerate() {
            let (x, y) = (2 * (i % 32), 2 * (i / 32));
            let sum = alpha(x, y) + alpha(x + 1, y) + alpha(x, y + 1) + alpha(x + 1, y + 1);
            assert_eq!(u32::from(*texel), (sum + 2) / 4, "texel {i}");
        }
    }

    #[test]
    fn degenerate_and_blended_triangles_are_left_out_and_records_follow_their_triangles() {
        let mut tracing = Tracing::new(&scene(), ANY);
        let of_triangles: Vec<u32> = tracing.triangles.iter().map(|t| t.record).collect();
        assert_eq!(of_triangles, [0, 1, 0, 2]);
        // The mask: one header, three alphas in one word.
        assert_eq!(tracing.masks.len(), 2 * RECORD_WORDS + HEADER_WORDS + 1);
        assert_eq!(
            header(&tracing, 1),
            MaskHeader {
                size: UVec2::new(3, 1),
                linear_filter: 1,
                cutoff: 0.25,
                texels: (2 * RECORD_WORDS + HEADER_WORDS) as u32,
                ..MaskHeader::default()
            }
        );
        assert_eq!(tracing.masks.last(), Some(&0x030201));

        tracing.masks[0] = 7;
        tracing.reorder(&[3, 2, 1, 0]);
        assert_eq!(tracing.triangles.iter().map(|t| t.record).collect::<Vec<_>>(), [1, 0, 2, 0]);
        assert_eq!((tracing.masks[0], tracing.masks[RECORD_WORDS]), (0, 7));
    }
}
