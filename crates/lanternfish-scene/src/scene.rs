//! A scene: everything a frame needs, placed in world space.

use glam::{Affine3A, Vec3};

use crate::{Bounds, Camera, Environment, Image, Light, Material, Mesh, Primitive, Sampler, Texture, motion::Motion};

/// Everything a frame needs. Indices refer into the lists of the same scene.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// What the scene is called: a file's stem, or the name of a generated scene.
    pub name: String,
    /// Geometry, each in its own object space.
    pub meshes: Vec<Mesh>,
    /// Meshes placed in the world.
    pub instances: Vec<Instance>,
    /// Surfaces.
    pub materials: Vec<Material>,
    /// An image seen through a sampler.
    pub textures: Vec<Texture>,
    /// Decoded pixels, each held once however many textures use it.
    pub images: Vec<Image>,
    /// How textures are filtered and wrapped.
    pub samplers: Vec<Sampler>,
    /// Punctual lights, in world space.
    pub lights: Vec<Light>,
    /// Cameras, in world space.
    pub cameras: Vec<Camera>,
    /// Radiance from every direction that no surface covers, nits, linear Rec. 709; nothing where there is an
    /// [`Scene::environment`].
    pub sky: Vec3,
    /// The same as an image; replaces [`Scene::sky`].
    pub environment: Option<Environment>,
    /// What of it moves, and how.
    pub motion: Motion,
}

/// A mesh placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The node's name, or empty.
    pub name: String,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Object to world; may mirror (negative determinant) and shear.
    pub world_from_object: Affine3A,
}

impl Scene {
    /// Radiance that arrives from `direction` (unit length, world space) where no surface is in its way, nits: of the
    /// environment, or where there is none, the sky.
    pub fn background(&self, direction: Vec3) -> Vec3 {
        self.environment.as_ref().map_or(self.sky, |environment| environment.radiance(direction))
    }

    /// World-space box of all instances; [`Bounds::EMPTY`] for a scene without geometry. Conservative: the boxes of
    /// the primitives are transformed, not their vertices.
    pub fn bounds(&self) -> Bounds {
        self.bounds_of(&self.boxes())
    }

    /// World-space box of all instances, by the boxes of their primitives.
    pub(crate) fn bounds_of(&self, boxes: &[Vec<Bounds>]) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for instance in &self.instances {
            for inner in &boxes[instance.mesh] {
                bounds.add_bounds(&inner.transformed(&instance.world_from_object));
            }
        }
        bounds
    }

    /// Object-space boxes of every mesh's primitives.
    pub(crate) fn boxes(&self) -> Vec<Vec<Bounds>> {
        self.meshes.iter().map(|mesh| mesh.primitives.iter().map(Primitive::bounds).collect()).collect()
    }

    /// The first of its cameras; where it has none, one that sees the whole of it ([`Camera::framing`]) at an angle of 45°.
    /// `aspect` is the image's width / height.
    pub fn default_camera(&self, aspect: f32) -> Camera {
        const FOV_Y: f32 = std::f32::consts::FRAC_PI_4;
        self.cameras.first().cloned().unwrap_or_else(|| Camera::framing(&self.bounds(), FOV_Y, aspect))
    }

    /// Triangles stored, and triangles placed in the world (each instance counted).
    pub fn triangle_counts(&self) -> (usize, usize) {
        let count = |mesh: &Mesh| mesh.primitives.iter().map(|p| p.indices.len() / 3).sum::<usize>();
        let counts: Vec<usize> = self.meshes.iter().map(count).collect();
        let placed = self.instances.iter().map(|i| counts[i.mesh]).sum();
        (counts.into_iter().sum(), placed)
    }
}
