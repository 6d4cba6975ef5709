//! The data of a scene that must be unchanged for an update in place.

use std::hash::{BuildHasher, Hasher};

use foldhash::fast::FixedState;
use glam::Vec3;
use lanternfish_scene::{
    AlphaMode, Environment, Image, Material, Mesh, Primitive, Sampler, Scene, Texture, TextureRef,
};
use rayon::prelude::*;

use crate::error::RenderError;

/// Number of texels of an image that are hashed to identify it, in addition to its size; all texels of a smaller image
/// are hashed.
const TEXELS: usize = 1024;

/// All data of a scene that an update in place does not write; large lists by a hash.
#[derive(Debug, PartialEq)]
pub struct UploadSignature {
    meshes: Vec<MeshSignature>,
    /// Mesh of each instance.
    instances: Vec<usize>,
    materials: Vec<MaterialShape>,
    textures: Vec<Texture>,
    samplers: Vec<Sampler>,
    images: Vec<u64>,
    environment: Option<u64>,
}

/// The signatures of a mesh's primitives.
type MeshSignature = Vec<PrimitiveSignature>;

#[derive(Debug, PartialEq)]
struct PrimitiveSignature {
    /// See [`counts`].
    counts: [usize; 3],
    /// A hash of indices and of the vertex data that an update does not write.
    content: u64,
}

impl UploadSignature {
    pub fn of(scene: &Scene) -> Self {
        Self {
            meshes: scene.meshes.iter().map(mesh).collect(),
            instances: scene.instances.iter().map(|instance| instance.mesh).collect(),
            materials: scene.materials.iter().map(MaterialShape::of).collect(),
            textures: scene.textures.clone(),
            samplers: scene.samplers.clone(),
            images: scene.images.iter().map(image).collect(),
            environment: scene.environment.as_ref().map(environment),
        }
    }

    /// The mesh of each instance.
    pub fn meshes(&self) -> impl Iterator<Item = usize> + '_ {
        self.instances.iter().copied()
    }

    /// An error if `scene` differs from the upload in the number of meshes, of their primitives, vertices or indices,
    /// or of instances, or in the meshes of instances: the checks that do not read vertices.
    pub fn check_counts(&self, scene: &Scene) -> Result<(), RenderError> {
        let changed = |what: String| Err(RenderError::NeedsUpdate { what });
        for (what, was, is) in [
            ("meshes", self.meshes.len(), scene.meshes.len()),
            ("instances", self.instances.len(), scene.instances.len()),
        ] {
            if was != is {
                return changed(format!("{was} {what} were uploaded, and there are {is}"));
            }
        }
        let same = |(was, is): (&MeshSignature, &Mesh)| {
            was.iter().map(|primitive| primitive.counts).eq(is.primitives.iter().map(counts))
        };
        if let Some(i) = self.meshes.iter().zip(&scene.meshes).position(|pair| !same(pair)) {
            return changed(format!("mesh {i} ({}) has other triangles or materials", scene.meshes[i].name));
        }
        let meshes = scene.instances.iter().map(|instance| instance.mesh);
        match self.meshes().zip(meshes).position(|(was, is)| was != is) {
            Some(i) => changed(format!("instance {i} ({}) has another mesh", scene.instances[i].name)),
            None => Ok(()),
        }
    }

    pub fn texture_count(&self) -> usize {
        self.textures.len()
    }

    /// True if a material differs from the one of this index only in factors; none: there is no such material.
    pub fn has_shape_of(&self, index: usize, material: &Material) -> Option<bool> {
        self.materials.get(index).map(|uploaded| *uploaded == MaterialShape::of(material))
    }

    /// True if image `index` is the same in `now`.
    pub fn has_image_of(&self, now: &Self, index: usize) -> bool {
        self.images.get(index).is_some_and(|image| now.images.get(index) == Some(image))
    }

    /// True if all images are the same in `now`.
    pub fn has_images_of(&self, now: &Self) -> bool {
        self.images == now.images
    }

    /// True if the environment is the same in `now`.
    pub fn has_environment_of(&self, now: &Self) -> bool {
        self.environment == now.environment
    }

    /// Notes that the device has the environment of `now`.
    pub fn take_environment_of(&mut self, now: &Self) {
        self.environment = now.environment;
    }
}

/// Index of the material; numbers of vertices and of indices.
fn counts(primitive: &Primitive) -> [usize; 3] {
    [primitive.material, primitive.positions.len(), primitive.indices.len()]
}

fn mesh(mesh: &Mesh) -> MeshSignature {
    let primitive = |primitive: &Primitive| {
        let Primitive { material: _, positions: _, normals: _, tangents, uv0, uv1, colors, indices, deformation: _ } =
            primitive;
        let lists: [&[u8]; 4] = [
            bytemuck::cast_slice(uv0),
            bytemuck::cast_slice(uv1),
            bytemuck::cast_slice(colors),
            bytemuck::cast_slice(indices),
        ];
        let content = hash(lists) ^ tangents.len() as u64;
        PrimitiveSignature { counts: counts(primitive), content }
    };
    mesh.primitives.par_iter().map(primitive).collect()
}

/// A hash of each mesh's positions and normals.
pub fn vertices(scene: &Scene) -> Vec<u64> {
    let primitive = |primitive: &Primitive| {
        let Primitive { positions, normals, tangents, .. } = primitive;
        hash([bytemuck::cast_slice(positions), bytemuck::cast_slice(normals), bytemuck::cast_slice(tangents)])
    };
    let mesh = |mesh: &Mesh| {
        let hashes: Vec<u64> = mesh.primitives.par_iter().map(primitive).collect();
        hash([bytemuck::cast_slice(&hashes)])
    };
    scene.meshes.iter().map(mesh).collect()
}

/// What an update does not write of a material. It writes all else: the factors.
#[derive(Debug, PartialEq)]
struct MaterialShape {
    textures: [Option<TextureRef>; Material::TEXTURES],
    alpha_mode: AlphaMode,
    /// The alpha factor of a mask, which is part of the traced masks.
    mask_alpha: Option<f32>,
    double_sided: bool,
    /// Other passes draw what transmits light.
    transmission: f32,
    is_thin_dielectric: bool,
    /// Thickness of the volume, m; its colour over a distance, m.
    volume: (f32, Vec3, f32),
}

impl MaterialShape {
    fn of(material: &Material) -> Self {
        let is_mask = matches!(material.alpha_mode, AlphaMode::Mask { .. });
        Self {
            textures: material.textures(),
            alpha_mode: material.alpha_mode,
            mask_alpha: is_mask.then_some(material.base_color.w),
            double_sided: material.double_sided,
            transmission: material.transmission,
            is_thin_dielectric: material.is_thin_dielectric(),
            volume: (material.thickness, material.attenuation_color, material.attenuation_distance),
        }
    }
}

fn image(Image { name: _, width, height, rgba }: &Image) -> u64 {
    some_of(rgba.as_chunks::<4>().0, &[*width, *height])
}

fn environment(Environment { width, height, pixels, rotation }: &Environment) -> u64 {
    some_of(pixels, &[*width as u32, *height as u32, rotation.to_bits()])
}

/// A hash of `size` and of all texels; above [`TEXELS`], of that many texels at golden-ratio intervals.
fn some_of<T: bytemuck::NoUninit>(texels: &[T], size: &[u32]) -> u64 {
    const GOLDEN_RATIO: u64 = 0x9e37_79b9_7f4a_7c15;
    let at = |i: usize| ((u128::from((i as u64).wrapping_mul(GOLDEN_RATIO)) * texels.len() as u128) >> 64) as usize;
    let some: Vec<T> = match texels.len() {
        ..=TEXELS => texels.to_vec(),
        _ => (0..TEXELS).map(|i| texels[at(i)]).collect(),
    };
    hash([bytemuck::cast_slice(size), bytemuck::cast_slice(&some)])
}

fn hash<const N: usize>(lists: [&[u8]; N]) -> u64 {
    let mut hasher = FixedState::default().build_hasher();
    for list in lists {
        hasher.write_usize(list.len());
        hasher.write(list);
    }
    hasher.finish()
}
