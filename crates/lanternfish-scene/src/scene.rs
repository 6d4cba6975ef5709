//! A scene: everything needed to render a frame, in world space.

use glam::{Affine3A, Vec3};

use crate::{Bounds, Camera, Environment, Image, Light, Material, Mesh, Primitive, Sampler, Texture, motion::Motion};

/// Everything needed to render a frame. Indices refer to the lists of the same scene.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name of the scene: the file's stem, or the name of a generated scene.
    pub name: String,
    /// Geometry, each mesh in its own object space.
    pub meshes: Vec<Mesh>,
    /// Meshes placed in the world.
    pub instances: Vec<Instance>,
    /// Semantic class of each instance: `extras.semantic` of its glTF node, else of the nearest ancestor that has one. 0: none, as for instances
    /// beyond the end of the list. It changes no image.
    pub semantics: Vec<u32>,
    /// Surfaces.
    pub materials: Vec<Material>,
    /// Names of the file's variants of its materials ([`crate::LoadOptions::variant`]). [`Scene::materials`] are those of one.
    pub variants: Vec<String>,
    /// Pairs of image and sampler.
    pub textures: Vec<Texture>,
    /// Decoded images, each stored once, even if several textures use it.
    pub images: Vec<Image>,
    /// How textures are filtered and wrapped.
    pub samplers: Vec<Sampler>,
    /// Punctual lights, in world space.
    pub lights: Vec<Light>,
    /// Cameras, in world space.
    pub cameras: Vec<Camera>,
    /// Background radiance, the same in every direction, nits, linear Rec. 709. Ignored if there is an
    /// [`Scene::environment`].
    pub sky: Vec3,
    /// Background radiance as an image; replaces [`Scene::sky`].
    pub environment: Option<Environment>,
    /// Node hierarchy and animations.
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
    /// Background radiance from `direction` (unit length, world space), nits: of the environment, or of the sky if there is
    /// none.
    #[doc(hidden)]
    pub fn background(&self, direction: Vec3) -> Vec3 {
        self.environment.as_ref().map_or(self.sky, |environment| environment.radiance(direction))
    }

    /// World-space bounding box of all instances; [`Bounds::EMPTY`] for a scene without geometry. Conservative: it
    /// transforms the primitives' boxes, not their vertices.
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

    /// The scene's first camera, or if it has none, a camera that frames the scene ([`Camera::framing`]) with a vertical angle
    /// of 45°. `aspect` is the image's width / height.
    pub fn default_camera(&self, aspect: f32) -> Camera {
        const FOV_Y: f32 = std::f32::consts::FRAC_PI_4;
        self.cameras.first().cloned().unwrap_or_else(|| Camera::framing(&self.bounds(), FOV_Y, aspect))
    }

    /// Number of triangles stored, and number of triangles in the world, where each instance counts.
    #[doc(hidden)]
    pub fn triangle_counts(&self) -> (usize, usize) {
        let count = |mesh: &Mesh| mesh.primitives.iter().map(|p| p.indices.len() / 3).sum::<usize>();
        let counts: Vec<usize> = self.meshes.iter().map(count).collect();
        let placed = self.instances.iter().map(|i| counts[i.mesh]).sum();
        (counts.into_iter().sum(), placed)
    }
}
