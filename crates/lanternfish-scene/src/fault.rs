//! What is wrong with a scene.

/// The first fault of a scene that breaks what its types document. `index` is that of the object in the scene's list, `name` its name, and
/// `what` the fault: the field, its value and the valid values.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the fields of every variant are described above")]
pub enum SceneFault {
    /// Of [`Scene::meshes`](crate::Scene::meshes): a list of vertices or indices of a primitive.
    #[error("mesh {index} ({name}), primitive {primitive}: {what}")]
    Mesh { index: usize, name: String, primitive: usize, what: String },
    /// Of [`Scene::instances`](crate::Scene::instances): its mesh, transform or distance from the origin.
    #[error("instance {index} ({name}): {what}")]
    Instance { index: usize, name: String, what: String },
    /// Of [`Scene::materials`](crate::Scene::materials).
    #[error("material {index} ({name}): {what}")]
    Material { index: usize, name: String, what: String },
    /// Of [`Scene::textures`](crate::Scene::textures): its image or sampler.
    #[error("texture {index}: {what}")]
    Texture { index: usize, what: String },
    /// Of [`Scene::images`](crate::Scene::images): the number of its bytes.
    #[error("image {index} ({name}): {what}")]
    Image { index: usize, name: String, what: String },
    /// Of [`Scene::lights`](crate::Scene::lights).
    #[error("light {index} ({name}): {what}")]
    Light { index: usize, name: String, what: String },
    /// Of [`Scene::cameras`](crate::Scene::cameras).
    #[error("camera {index} ({name}): {what}")]
    Camera { index: usize, name: String, what: String },
    /// Of [`Scene::motion`](crate::Scene::motion), or of a moment of it.
    #[error("{what}")]
    Motion { what: String },
    /// Of [`Scene::sky`](crate::Scene::sky).
    #[error("sky: {what}")]
    Sky { what: String },
    /// Of [`Scene::environment`](crate::Scene::environment).
    #[error("environment: {what}")]
    Environment { what: String },
}
