//! Visualization of deep images: their fragments as points in the scene, and one image's texels as images.
//!
//! Fragments are read in one place, `fragments.wesl`, from the lists that tracers read: an image shows what a tracer reads.

mod points;
pub(super) mod shared;
#[cfg(test)]
mod tests;
mod texels;

use lanternfish::RenderError;

pub use self::{
    points::{PointCloud, PointImage, PointSize},
    shared::{PointRange, TexelQuery, TexelScale},
    texels::{Colors, TexelValues, TexelViews},
};
use super::{
    images::{Chunk, DeepImages},
    settings::{DeepImageSettings, DeepStore},
};

/// An error unless fragments can be read by index.
fn check_store(settings: &DeepImageSettings) -> Result<(), RenderError> {
    match settings.store {
        DeepStore::LinearArray => Ok(()),
        DeepStore::LinkedList | DeepStore::SortedLinkedList => {
            Err(RenderError::Together { setting: "an image of deep images", needed: "linear arrays" })
        }
    }
}

/// The chunk that holds an image, and the image's index in it. An error if there is no such image.
fn invocation_index(images: &DeepImages, image: u32) -> Result<(&Chunk, u32), RenderError> {
    let holds = |chunk: &&Chunk| image.checked_sub(chunk.grid.first_image).is_some_and(|i| i < chunk.grid.image_count);
    let chunk = images.chunks.iter().find(holds).ok_or_else(|| RenderError::NoSuch {
        what: "image",
        number: image.into(),
        known: match images.directions.len() {
            1 => "there is only image 0".to_owned(),
            count => format!("{count} directions have images 0 to {}", count - 1),
        },
    })?;
    Ok((chunk, image - chunk.grid.first_image))
}
