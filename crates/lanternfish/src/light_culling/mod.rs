//! Which lights a point must consider.
//!
//! Every scheme ends in one structure, read through `light_list.wesl`: cell c lists
//! `light_indices[light_cells[c] .. light_cells[c + 1]]`, ascending. A scheme is a room: [`all`] (the oracle), [`tiled`].

pub mod all;
#[cfg(test)]
mod tests;
pub mod tiled;

use lanternfish_gpu::{Bindings, Frame};

use crate::{error::RenderError, gpu_scene::GpuScene, prepass::Surface, settings::Culling, view::ViewBuffer};

/// The lists of one view.
#[derive(Clone, Debug)]
pub struct LightLists {
    /// Starts of the cells' lists; one more than there are cells.
    pub cells: wgpu::Buffer,
    /// Indices of lights, cell after cell.
    pub indices: wgpu::Buffer,
    /// What `cell_from_fragment` needs, under the name its room gives it.
    pub grid: Option<(&'static str, wgpu::Buffer)>,
    /// Entries of all lists.
    pub listed: u64,
    /// Pairs of a light and a cell that were tested to find them.
    pub tests: u64,
}

impl LightLists {
    /// What shaders call them.
    pub fn bindings(&self) -> Bindings<'_> {
        let bindings = Bindings::new().buffer("light_cells", &self.cells).buffer("light_indices", &self.indices);
        match &self.grid {
            Some((name, buffer)) => bindings.buffer(name, buffer),
            None => bindings,
        }
    }
}

/// Lights in reach of which points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Of the surfaces in the depth buffer.
    Surface,
    /// Of any point of the view: for transparent surfaces, which the depth buffer does not hold.
    Anywhere,
}

/// The room that was chosen.
#[derive(Debug)]
pub enum LightCulling {
    /// Every light for every point.
    All,
    /// Screen tiles.
    Tiled(Box<tiled::TiledCulling>),
}

impl LightCulling {
    /// Compiles the room's passes.
    pub fn new(device: &wgpu::Device, culling: Culling) -> Result<Self, RenderError> {
        Ok(match culling {
            Culling::All => Self::All,
            Culling::Tiled(settings) => Self::Tiled(Box::new(tiled::TiledCulling::new(device, settings)?)),
        })
    }

    /// The feature that makes `light_list.wesl` use this room; none for the default.
    pub fn feature(culling: Culling) -> Option<&'static str> {
        match culling {
            Culling::All => Some("culling_all"),
            Culling::Tiled(_) => None,
        }
    }

    /// Fills the lists of a view.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &ViewBuffer,
        surface: &Surface,
        reach: Reach,
    ) -> Result<LightLists, RenderError> {
        match self {
            Self::All => all::record(frame, scene),
            Self::Tiled(tiled) => tiled.record(frame, scene, view, surface, reach),
        }
    }
}
