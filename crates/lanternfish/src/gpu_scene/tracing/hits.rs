//! Data for shading ray hits on triangles, beside the corners: normals, texture coordinates, materials. Hits of indirect light are shaded
//! with it; no rasterizer supplies geometry and material there.
//!
//! Textures are read at one coarse level, from an array of square images: indirect light averages over a large angle.

use std::collections::HashMap;

use glam::{Mat3, Vec2, Vec3};
use half::f16;
use lanternfish_gpu::{Bindings, storage_buffer_of};
use lanternfish_scene::{Image, Material, Primitive, Scene, TextureRef, linear_from_srgb};
use rayon::prelude::*;

use super::{
    super::{
        shaders::{EMITS_FROM_BACK, HitMaterial, HitTriangle, LAMBERT, NO_LAYER, UNLIT},
        upload::{
            geometry::stored_normal,
            lobes::{MaterialStorage, Shading},
            materials::dielectric_f0,
            mips::{mean, mean_alpha, srgb_from_linear},
        },
    },
    levels::BOX,
    triangles::{Part, Source, TracedTriangle},
};
use crate::error::RenderError;

/// Texels along an edge of a hit texture.
const SIDE: u32 = 128;

/// Buffers and textures for shading hits.
#[derive(Debug)]
pub struct Hits {
    triangles: wgpu::Buffer,
    materials: wgpu::Buffer,
    /// Textures of each material, in the form that hits use.
    read: Vec<HitTextures>,
    textures: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl Hits {
    /// Uploads the traced triangles, in their order, with their materials and textures.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        storage: MaterialStorage,
        (parts, traced): (&[Part], &[TracedTriangle]),
    ) -> Result<Self, RenderError> {
        let sources: Vec<Source> = traced.iter().map(|triangle| triangle.source).collect();
        let mut layers = Layers { most: device.limits().max_texture_array_layers, ..Layers::default() };
        let read = scene.materials.iter().map(|material| HitTextures::of(scene, material, &mut layers));
        let read: Vec<HitTextures> = read.collect();
        let none = wgpu::BufferUsages::empty();
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("scene/hit_sampler"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(Self {
            triangles: storage_buffer_of(device, "scene/hit_triangles", &triangles(scene, parts, &sources), none)?,
            materials: storage_buffer_of(device, "scene/hit_materials", &packed(scene, &read, storage), none)?,
            read,
            textures: layers.upload(device, queue, scene),
            sampler,
        })
    }

    /// Writes the triangles again with the current transforms.
    pub fn update(&self, queue: &wgpu::Queue, scene: &Scene, parts: &[Part], sources: &[Source]) {
        queue.write_buffer(&self.triangles, 0, bytemuck::cast_slice(&triangles(scene, parts, sources)));
    }

    /// Writes the materials again; their textures must be unchanged.
    pub fn update_materials(&self, queue: &wgpu::Queue, scene: &Scene, storage: MaterialStorage) {
        let materials = packed(scene, &self.read, storage);
        queue.write_buffer(&self.materials, 0, bytemuck::cast_slice(&materials));
    }

    /// Writes one material again, whose textures must be unchanged; returns its size, bytes.
    pub fn set_material(
        &self,
        queue: &wgpu::Queue,
        index: usize,
        material: &Material,
        storage: MaterialStorage,
    ) -> u64 {
        let packed = pack(material, &self.read[index], storage);
        queue.write_buffer(&self.materials, (index * size_of::<HitMaterial>()) as u64, bytemuck::bytes_of(&packed));
        size_of::<HitMaterial>() as u64
    }

    /// The [`HitTriangle`]s.
    pub fn triangles(&self) -> &wgpu::Buffer {
        &self.triangles
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .buffer("hit_triangles", &self.triangles)
            .buffer("hit_materials", &self.materials)
            .texture("hit_textures", &self.textures)
            .sampler("hit_sampler", &self.sampler)
    }
}

fn triangles(scene: &Scene, parts: &[Part], sources: &[Source]) -> Vec<HitTriangle> {
    let normal_matrices: Vec<Mat3> = parts.par_iter().map(|part| normal_matrix_of(scene, part)).collect();
    let triangle = |source: &Source| {
        if source.part == BOX {
            return HitTriangle::default();
        }
        let (_, primitive) = parts[source.part as usize].of(scene);
        let material = &scene.materials[primitive.material];
        let first = 3 * source.triangle as usize;
        let corners: [usize; 3] = std::array::from_fn(|i| primitive.indices[first + i] as usize);
        let uv = coordinates(primitive, material, corners);
        let normal = corners.map(|i| {
            let normal = normal_matrices[source.part as usize] * stored_normal(primitive.normals[i]);
            packed_normal(normal.try_normalize().unwrap_or(Vec3::Y))
        });
        let color = corners.map(|i| primitive.colors.get(i).copied().unwrap_or(glam::Vec4::ONE));
        let color = (color[0] + color[1] + color[2]) / 3.0;
        let bytes = color.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        HitTriangle {
            uv_a: uv[0],
            uv_b: uv[1],
            uv_c: uv[2],
            material: primitive.material as u32,
            normal_a: normal[0],
            normal_b: normal[1],
            normal_c: normal[2],
            color: u32::from_le_bytes(bytes),
        }
    };
    sources.par_iter().map(triangle).collect()
}

/// The matrix from object-space normals of a part to those of the tree that it is in, up to a positive factor.
pub(in crate::gpu_scene) fn normal_matrix_of(scene: &Scene, part: &Part) -> Mat3 {
    if part.mesh.is_some() {
        return Mat3::IDENTITY;
    }
    let m = Mat3::from(part.of(scene).0.world_from_object.matrix3);
    // The cofactors: the inverse transpose up to a positive factor; they also exist for singular transforms.
    let cofactors = Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    cofactors * if m.determinant() < 0.0 { -1.0 } else { 1.0 }
}

/// The texture whose coordinates hits use: the base colour's, or without that the emission's.
fn coordinates_of(material: &Material) -> Option<&TextureRef> {
    material.base_color_texture.as_ref().or(material.emissive_texture.as_ref())
}

/// Texture coordinates, shifted by whole repeats towards zero, where half floats have more precision.
fn coordinates(primitive: &Primitive, material: &Material, corners: [usize; 3]) -> [u32; 3] {
    let Some(reference) = coordinates_of(material) else { return [0; 3] };
    let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
    let uv = corners.map(|i| reference.texture_from_uv.transform_point2(set.get(i).copied().unwrap_or_default()));
    let repeats = uv[0].min(uv[1]).min(uv[2]).floor();
    uv.map(|uv| {
        let Vec2 { x, y } = uv - repeats;
        u32::from(f16::from_f32(x).to_bits()) | (u32::from(f16::from_f32(y).to_bits()) << 16)
    })
}

/// A unit normal, packed for `unit_from_octahedral(unpack2x16snorm(bits))`.
fn packed_normal(n: Vec3) -> u32 {
    let p = Vec2::new(n.x, n.y) / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
    let folded = Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y));
    let e = if n.z >= 0.0 { p } else { folded };
    let snorm = |v: f32| u32::from((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    snorm(e.x) | (snorm(e.y) << 16)
}

/// Textures of a material in the form that hits use.
#[derive(Clone, Copy, Debug)]
struct HitTextures {
    /// [`HitMaterial::base_color_layer`].
    base_color_layer: u32,
    /// The texture's mean if there is no layer, or one without a texture.
    base_color: Vec3,
    /// [`HitMaterial::emissive_layer`].
    emissive_layer: u32,
    /// As `base_color`.
    emissive: Vec3,
    /// Mean of the texture, or one.
    metallic: f32,
    /// Mean of the texture, or one.
    perceptual_roughness: f32,
    /// Mean of the texture, or one.
    specular: f32,
    /// Mean of the texture, or one.
    specular_color: Vec3,
    /// Mean of the texture, or one.
    diffuse_transmission: f32,
    /// Mean of the texture, over that of the base colour's layer, which multiplies it; or one.
    diffuse_transmission_color: Vec3,
}

impl HitTextures {
    fn of(scene: &Scene, material: &Material, layers: &mut Layers) -> Self {
        let coordinates = coordinates_of(material);
        let mut layer = |reference: &Option<TextureRef>| {
            let Some(reference) = reference else { return (NO_LAYER, Vec3::ONE) };
            let image = scene.textures[reference.texture].image;
            let same_coordinates = coordinates
                .is_some_and(|c| (c.uv_set, c.texture_from_uv) == (reference.uv_set, reference.texture_from_uv));
            match same_coordinates.then(|| layers.of(image)).flatten() {
                Some(layer) => (layer, Vec3::ONE),
                // Other coordinates, or all layers are used: the mean.
                None => (NO_LAYER, mean(&scene.images[image], true)),
            }
        };
        let (base_color_layer, base_color) = layer(&material.base_color_texture);
        let (emissive_layer, emissive) = layer(&material.emissive_texture);
        let metallic_roughness = material
            .metallic_roughness_texture
            .map_or(Vec3::ONE, |reference| mean(&scene.images[scene.textures[reference.texture].image], false));
        let [_, perceptual_roughness, metallic] = metallic_roughness.to_array();
        let image = |reference: TextureRef| &scene.images[scene.textures[reference.texture].image];
        let of_layer = match base_color_layer {
            NO_LAYER => Vec3::ONE,
            _ => material.base_color_texture.map_or(Vec3::ONE, |r| mean(image(r), true)),
        };
        Self {
            base_color_layer,
            base_color,
            emissive_layer,
            emissive,
            metallic,
            perceptual_roughness,
            specular: material.specular_texture.map_or(1.0, |reference| mean_alpha(image(reference))),
            specular_color: material.specular_color_texture.map_or(Vec3::ONE, |r| mean(image(r), true)),
            diffuse_transmission: material.diffuse_transmission_texture.map_or(1.0, |r| mean_alpha(image(r))),
            diffuse_transmission_color: material
                .diffuse_transmission_color_texture
                .map_or(Vec3::ONE, |r| mean(image(r), true))
                / of_layer.max(Vec3::splat(0.01)),
        }
    }
}

fn packed(scene: &Scene, read: &[HitTextures], storage: MaterialStorage) -> Vec<HitMaterial> {
    scene.materials.iter().zip(read).map(|(material, read)| pack(material, read, storage)).collect()
}

fn pack(material: &Material, read: &HitTextures, storage: MaterialStorage) -> HitMaterial {
    let flag = |on: bool, bit: u32| if on { bit } else { 0 };
    let MaterialStorage { shading, light_unit } = storage;
    let mut base_color = material.base_color.truncate() * read.base_color;
    let mut through = 0.0;
    if shading == Shading::File && material.scatters_from_behind() {
        let color = (material.diffuse_transmission_color * read.diffuse_transmission_color).min(Vec3::ONE);
        let fraction = material.diffuse_transmission * read.diffuse_transmission;
        let weight = |color: Vec3| color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        // All that is scattered, from both sides.
        base_color = base_color.lerp(color, fraction);
        through = fraction * weight(color) / weight(base_color).max(1e-6);
    }
    HitMaterial {
        base_color,
        base_color_layer: read.base_color_layer,
        emissive: material.emissive / light_unit * read.emissive,
        emissive_layer: read.emissive_layer,
        dielectric_f0: dielectric_f0(material, read.specular_color, read.specular),
        dielectric_f90: material.specular * read.specular,
        metallic: material.metallic * read.metallic,
        perceptual_roughness: material.perceptual_roughness * read.perceptual_roughness,
        flags: flag(shading == Shading::File && material.unlit, UNLIT)
            | flag(shading == Shading::Lambert, LAMBERT)
            | flag(material.double_sided, EMITS_FROM_BACK),
        through,
    }
}

/// The images of the hit textures, in the order of their layers.
#[derive(Default)]
struct Layers {
    images: Vec<usize>,
    of_image: HashMap<usize, u32>,
    most: u32,
}

impl Layers {
    /// The layer of an image; none if all layers are used.
    fn of(&mut self, image: usize) -> Option<u32> {
        if let Some(layer) = self.of_image.get(&image) {
            return Some(*layer);
        }
        let layer = self.images.len() as u32;
        (layer < self.most).then(|| {
            self.images.push(image);
            self.of_image.insert(image, layer);
            layer
        })
    }

    fn upload(&self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> wgpu::TextureView {
        let layer_count = self.images.len().max(1) as u32;
        let size = wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: layer_count };
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("scene/hit_textures"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let small: Vec<Vec<u8>> = self.images.par_iter().map(|image| shrunk(&scene.images[*image])).collect();
        if !small.is_empty() {
            queue.write_texture(
                texture.as_image_copy(),
                &small.concat(),
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIDE), rows_per_image: Some(SIDE) },
                size,
            );
        }
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
    }
}

/// An image resampled to [`SIDE`]² texels, each the mean of the texels that it covers, in linear light.
fn shrunk(image: &Image) -> Vec<u8> {
    let (width, height) = (image.width as usize, image.height as usize);
    let covered = |i: usize, n: usize| {
        let first = i * n / SIDE as usize;
        first..((i + 1) * n / SIDE as usize).max(first + 1)
    };
    let mut texels = Vec::with_capacity(4 * (SIDE * SIDE) as usize);
    for y in 0..SIDE as usize {
        for x in 0..SIDE as usize {
            let (rows, columns) = (covered(y, height), covered(x, width));
            let count = (rows.len() * columns.len()) as f32;
            let mut sum = Vec3::ZERO;
            for row in rows {
                for column in columns.clone() {
                    let at = 4 * (row * width + column);
                    sum += Vec3::from_array(std::array::from_fn(|c| linear_from_srgb(image.rgba[at + c])));
                }
            }
            texels.extend((sum / count).to_array().map(srgb_from_linear));
            texels.push(255);
        }
    }
    texels
}

/// Hits use the mean of specular textures, whose colours vary little.
#[cfg(test)]
#[test]
fn textures_of_specular_layers_weigh_what_hits_reflect() {
    use lanternfish_scene::{Sampler, Texture};
    const FILE: MaterialStorage = MaterialStorage { shading: Shading::File, light_unit: 1.0 };
    let rgba = vec![255, 255, 255, 255, 0, 0, 0, 153];
    let scene = Scene {
        images: vec![Image { name: String::new(), width: 2, height: 1, rgba }],
        samplers: vec![Sampler::default()],
        textures: vec![Texture { image: 0, sampler: 0 }],
        ..Scene::default()
    };
    let of = |material: &Material| {
        let packed = pack(material, &HitTextures::of(&scene, material, &mut Layers::default()), FILE);
        (packed.dielectric_f0, packed.dielectric_f90)
    };
    let usual = Material::default();
    let texture = Some(TextureRef::new(0));
    let (f0, f90) = of(&Material { specular_texture: texture, specular_color_texture: texture, ..usual.clone() });
    assert!(f0.abs_diff_eq(0.8 * 0.5 * of(&usual).0, 1e-6) && (f90 - 0.8).abs() < 1e-6, "{f0} {f90}");
}
