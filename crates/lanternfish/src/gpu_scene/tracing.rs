//! The surfaces that stop light, in world space: triangles, and the alpha masks of those that have holes.
//!
//! Blended surfaces are left out: they cast no shadow.

use std::collections::HashMap;

use glam::{Vec2, Vec3};
use lanternfish_scene::{AlphaMode, Filter, Material, Primitive, Scene, Wrap};
use rayon::prelude::*;

use super::mask_cutoff;

/// A triangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedTriangle {
    /// World space, m.
    pub corners: [Vec3; 3],
    /// 0: solid; else the index of its mask record plus one.
    pub record: u32,
}

/// Words of a masked triangle's record, and of a mask's header; `mask.wesl` says what they hold.
pub const RECORD_WORDS: usize = 12;
const HEADER_WORDS: usize = 8;

/// Everything that stops light.
#[derive(Debug, Default)]
pub struct Tracing {
    /// In no particular order until [`Tracing::reorder`].
    pub triangles: Vec<TracedTriangle>,
    /// Records, then headers and texels.
    pub masks: Vec<u32>,
    /// How many of the triangles have a record.
    pub record_count: usize,
}

/// A masked triangle before the masks have their addresses.
struct Record {
    uv: [Vec2; 3],
    alpha: [f32; 3],
    material: usize,
}

impl Tracing {
    /// Gathers the triangles of every instance. Triangles without three distinct finite corners are left out.
    pub fn new(scene: &Scene) -> Self {
        let parts: Vec<(Vec<TracedTriangle>, Vec<Record>)> = scene
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
        let masks = pack_masks(scene, &records);
        Self { triangles, masks, record_count: records.len() }
    }

    /// Puts the triangles into this order, and the mask records into the order of their triangles.
    pub fn reorder(&mut self, order: &[u32]) {
        self.triangles = order.iter().map(|i| self.triangles[*i as usize]).collect();
        let mut records = Vec::with_capacity(RECORD_WORDS * self.record_count);
        let mut count = 0;
        for triangle in &mut self.triangles {
            if triangle.record > 0 {
                let old = RECORD_WORDS * (triangle.record as usize - 1);
                records.extend_from_slice(&self.masks[old..old + RECORD_WORDS]);
                count += 1;
                triangle.record = count;
            }
        }
        self.masks[..records.len()].copy_from_slice(&records);
    }
}

fn gather(
    primitive: &Primitive,
    material: &Material,
    world_from_object: &glam::Affine3A,
    triangles: &mut Vec<TracedTriangle>,
    records: &mut Vec<Record>,
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

fn mask_record(primitive: &Primitive, material: &Material, triangle: [u32; 3]) -> Record {
    let uv = triangle.map(|i| {
        let Some(reference) = &material.base_color_texture else { return Vec2::ZERO };
        let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
        reference.texture_from_uv.transform_point2(set.get(i as usize).copied().unwrap_or_default())
    });
    let vertex_alpha = |i: u32| primitive.colors.get(i as usize).map_or(1.0, |c| c.w);
    Record { uv, alpha: triangle.map(|i| material.base_color.w * vertex_alpha(i)), material: primitive.material }
}

/// Records, then a header and texels for every material that is in use by one.
fn pack_masks(scene: &Scene, records: &[Record]) -> Vec<u32> {
    let mut words = vec![0; RECORD_WORDS * records.len()];
    let mut headers: HashMap<usize, u32> = HashMap::new();
    for (i, record) in records.iter().enumerate() {
        let header = *headers.entry(record.material).or_insert_with(|| {
            let at = words.len() as u32;
            push_mask(scene, &scene.materials[record.material], &mut words);
            at
        });
        let uv = record.uv.iter().flat_map(|uv| uv.to_array());
        let floats = uv.chain(record.alpha).map(f32::to_bits);
        for (word, value) in words[RECORD_WORDS * i..].iter_mut().zip(floats.chain([header])) {
            *word = value;
        }
    }
    words
}

fn push_mask(scene: &Scene, material: &Material, words: &mut Vec<u32>) {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    let cutoff = mask_cutoff(material).unwrap_or(0.0);
    let texels = (words.len() + HEADER_WORDS) as u32;
    let Some(reference) = &material.base_color_texture else {
        // No texture: one opaque texel.
        words.extend_from_slice(&[1, 1, 0, 0, 0, cutoff.to_bits(), texels, 0, 255]);
        return;
    };
    let texture = scene.textures[reference.texture];
    let image = &scene.images[texture.image];
    let sampler = scene.samplers[texture.sampler];
    let linear = u32::from(sampler.mag == Filter::Linear);
    words.extend_from_slice(&[
        image.width,
        image.height,
        wrap(sampler.wrap_u),
        wrap(sampler.wrap_v),
        linear,
        cutoff.to_bits(),
        texels,
        0,
    ]);
    let alphas: Vec<u8> = image.rgba.iter().skip(3).step_by(4).copied().collect();
    words.extend(alphas.chunks(4).map(|four| four.iter().rev().fold(0, |word, a| word << 8 | u32::from(*a))));
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::{Image, Instance, Mesh, Sampler, Texture, TextureRef};

    use super::*;

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

    #[test]
    fn words_are_the_shaders() {
        let file = "shadows/mask";
        assert_eq!(crate::shaders::constant(file, "RECORD_WORDS"), RECORD_WORDS as f64);
        let mut scene = scene();
        for (wrap, name) in [(Wrap::Repeat, "REPEAT"), (Wrap::MirroredRepeat, "MIRRORED_REPEAT")] {
            (scene.samplers[0].wrap_u, scene.samplers[0].wrap_v) = (wrap, wrap);
            let header = Tracing::new(&scene).masks[2 * RECORD_WORDS..].to_vec();
            assert_eq!(
                header[2..4].iter().map(|w| f64::from(*w)).collect::<Vec<_>>(),
                [crate::shaders::constant(file, name); 2]
            );
        }
    }

    #[test]
    fn degenerate_and_blended_triangles_are_left_out_and_records_follow_their_triangles() {
        let mut tracing = Tracing::new(&scene());
        let records: Vec<u32> = tracing.triangles.iter().map(|t| t.record).collect();
        assert_eq!(records, [0, 1, 0, 2]);
        // The mask: header after two records, three alphas in one word.
        assert_eq!(tracing.masks.len(), 2 * RECORD_WORDS + 8 + 1);
        assert_eq!(tracing.masks[24..], [3, 1, 0, 0, 1, 0.25f32.to_bits(), 32, 0, 0x030201]);
        assert_eq!(tracing.masks[9], 24);

        tracing.masks[0] = 7;
        tracing.reorder(&[3, 2, 1, 0]);
        assert_eq!(tracing.triangles.iter().map(|t| t.record).collect::<Vec<_>>(), [1, 0, 2, 0]);
        assert_eq!((tracing.masks[0], tracing.masks[RECORD_WORDS]), (0, 7));
    }
}
