//! Which lights a point must consider.
//!
//! Every scheme ends in one structure, read through `light_list.wesl`: cell c lists
//! `light_indices[light_cells[c] .. light_cells[c + 1]]`, ascending. A scheme is a room: [`all`] (the oracle), [`tiled`],
//! [`clustered`].

pub mod all;
pub mod clustered;
#[cfg(test)]
mod tests;
pub mod tiled;

use glam::Vec4;
use lanternfish_gpu::{
    Bindings, BufferPart, FAULTY_LOOP_STEPS, Feature, Frame, ListRoom, SharedStruct, faulty_software, gpu_struct,
};

use crate::{
    context::ViewContext,
    error::RenderError,
    settings::{Assignment, Culling, Samples},
    shaders::Shaders,
};

gpu_struct! {
    /// The volume of a tile or a cluster, in a space that has the eye at its origin and looks down −z.
    pub struct Volume {
        /// Slopes of its planes: left, right, bottom, top.
        slopes: Vec4,
        /// Least distance along the axis, m.
        nearest: f32,
        /// Greatest distance along the axis, m; less than nearest where there is no volume.
        farthest: f32,
        /// 1: the sides are parallel.
        parallel: u32,
        /// Unused.
        _pad: u32,
    }
}

/// Schemes behind `light_list`, each with the feature that chooses it.
pub(crate) const SCHEMES: &[&[Feature]] = &[&[], &[all::CULLING_ALL], &[clustered::CULLING_CLUSTERED]];

/// The shaders of this folder, but for those of its rooms.
pub(crate) const DECLARED: Shaders = Shaders { roots: &[], structs: &[SharedStruct::of::<Volume>()] };

/// The lists of one view.
#[derive(Clone, Debug)]
pub struct LightLists {
    /// Starts of the cells' lists; one more than there are cells.
    pub cells: wgpu::Buffer,
    /// Indices of lights, cell after cell.
    pub indices: wgpu::Buffer,
    /// What `cell_from_fragment` needs, under the name its room gives it.
    pub grid: Option<(&'static str, BufferPart)>,
    /// Entries of all lists.
    pub listed: u64,
    /// Tests of a light, or of a node of a tree over lights, against a cell.
    pub tests: u64,
    /// What the grid came to, where there are clusters.
    pub clusters: Option<clustered::ClusterCounts>,
    /// Visible fragments of every cluster.
    pub fragments: Option<wgpu::Buffer>,
}

impl LightLists {
    /// What shaders call them.
    pub fn bindings(&self) -> Bindings<'_> {
        let bindings = Bindings::new().buffer("light_cells", &self.cells).buffer("light_indices", &self.indices);
        let bindings = match &self.grid {
            Some((name, part)) => bindings.part(name, part),
            None => bindings,
        };
        match &self.fragments {
            Some(fragments) => bindings.buffer("cluster_fragments", fragments),
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
    /// Clusters.
    Clustered(Box<clustered::ClusteredCulling>),
}

impl LightCulling {
    /// Compiles the room's passes.
    pub fn new(device: &wgpu::Device, culling: Culling, samples: Samples) -> Result<Self, RenderError> {
        Ok(match culling {
            Culling::All => Self::All,
            Culling::Tiled(settings) => Self::Tiled(Box::new(tiled::TiledCulling::new(device, settings)?)),
            Culling::Clustered(settings) => {
                Self::Clustered(Box::new(clustered::ClusteredCulling::new(device, settings, samples)?))
            }
        })
    }

    /// The feature that makes `light_list.wesl` use this room; none for the default.
    pub fn feature(culling: Culling) -> Option<Feature> {
        match culling {
            Culling::All => Some(all::CULLING_ALL),
            Culling::Tiled(_) => None,
            Culling::Clustered(_) => Some(clustered::CULLING_CLUSTERED),
        }
    }

    /// Whether one invocation tests all lights, or shades them.
    fn tests_every_light(&self) -> bool {
        match self {
            Self::All => true,
            Self::Tiled(_) => false,
            Self::Clustered(clustered) => clustered.settings.assignment == Assignment::BruteForce,
        }
    }

    /// Fills the lists of views of one scene, in their order.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        reach: Reach,
    ) -> Result<Vec<LightLists>, RenderError> {
        let Some(ViewContext { scene, .. }) = views.first() else { return Ok(Vec::new()) };
        if self.tests_every_light() {
            check_driver(&frame.device.adapter_info(), scene.light_count)?;
        }
        match self {
            Self::All => views.iter().map(|_| all::record(frame, scene)).collect(),
            Self::Tiled(tiled) => {
                let record = |view: &ViewContext<'_>| {
                    // Shading looks at a pixel's centre, where there may be none of the samples' depths.
                    let reach = if view.surface.samples > 1 { Reach::Anywhere } else { reach };
                    tiled.record(frame, view, reach)
                };
                views.iter().map(record).collect()
            }
            // The clusters of blended fragments are among those of the surfaces.
            Self::Clustered(clustered) if reach == Reach::Anywhere => Ok(clustered.lists.clone()),
            Self::Clustered(clustered) => clustered.record(frame, views),
        }
    }
}

/// An error where a loop over so many lights ends too early.
fn check_driver(adapter: &wgpu::AdapterInfo, light_count: u32) -> Result<(), RenderError> {
    if light_count <= FAULTY_LOOP_STEPS || !faulty_software(adapter) {
        return Ok(());
    }
    let driver = adapter.driver_info.clone();
    let fault = "ends loops after 65,535 steps, and there are more lights";
    Err(RenderError::Driver { setting: "a test of every light", driver, fault, instead: "the default --culling" })
}

/// The list that every room fills.
const INDICES: &str = "light_culling/indices";

/// Entries of it that one binding holds.
fn most_indices(device: &wgpu::Device) -> u64 {
    (device.limits().max_storage_buffer_binding_size / 4).min(u32::MAX.into())
}

/// An error where more entries were counted than one binding holds.
fn check_room(room: &ListRoom, limit: u64, remedy: &'static str) -> Result<(), RenderError> {
    if room.elements <= limit {
        return Ok(());
    }
    Err(RenderError::Overflow { list: INDICES, needed: room.elements, limit, remedy })
}

#[test]
fn more_lights_than_a_faulty_drivers_loops_have_steps_are_refused() {
    let adapter = |driver: &str| wgpu::AdapterInfo {
        driver_info: driver.to_owned(),
        ..wgpu::AdapterInfo::new(wgpu::DeviceType::Cpu, wgpu::Backend::Vulkan)
    };
    let error = check_driver(&adapter("Mesa 22.3.6"), 65_536).unwrap_err().to_string();
    assert!(error.contains("Mesa 22.3.6 ends loops after 65,535 steps") && error.contains("--culling"), "{error}");
    assert!(check_driver(&adapter("Mesa 22.3.6"), 65_535).is_ok());
    assert!(check_driver(&adapter("Mesa 25.0.7"), 100_000).is_ok());
}
