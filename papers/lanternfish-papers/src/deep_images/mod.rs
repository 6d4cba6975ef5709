//! The scene as sorted rays: orthographic images of every direction of a set, each texel a list of all surfaces along
//! its axis [Archer2019, §3.1; Niessner2010, §3.1].
//!
//! 1. Grid: a sphere around the scene; images of one size around it; as many images per chunk as fit one binding.
//! 2. Build (`build/`): every triangle is put into every texel, of every image, whose axis intersects it (or the scene
//!    is drawn once, and its samples are put into the images; or it is drawn once per direction, as a baseline).
//! 3. Store (`store/`): fragments go to the lists of their texels: into an array (scan, fill, sort, merge, compact), or
//!    into linked lists.
//! 4. Trace (`rays/within_texel/`, `rays/across_texels/`): rays read lists through one interface, `fragments.wesl`.

mod build;
pub mod directions;
mod holes;
mod images;
mod kept;
mod of_papers;
pub mod settings;
mod shaders;
mod store;
mod structure;
#[cfg(test)]
mod tests;

#[cfg(test)]
mod cpu_reference;
mod validate;

pub use build::{DeepImageBuilder, PeeledFragment};
pub use holes::Holes;
pub use images::{Chunk, DeepCounts, DeepImages};
pub use kept::KeptDeepImages;
pub use of_papers::PaperImages;
pub(crate) use shaders::{DECLARED, LINEAR_STEPS, LINKED_LIST, PAYLOAD, SLOPES, SORTED_LINKED_LIST};
pub use shaders::{DeepFrame, DeepGrid, SurfaceSample};
pub use structure::{ACROSS_TEXELS, WITHIN_TEXEL};
pub use validate::{Fragment, ListFault};
