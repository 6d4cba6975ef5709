//! Light culling: lists of the lights that may reach a point.
//!
//! Every technique produces one structure, read through `light_list.wesl`: cell c lists `light_indices[light_cells[c]
//! .. light_cells[c + 1]]`, ascending. Techniques: [`all`] (the baseline), [`tiled`], [`clustered`].

pub mod all;
pub mod clustered;
#[cfg(test)]
mod tests;
pub mod tiled;

use std::{any::Any, fmt};

use glam::Vec4;
use lanternfish_gpu::{
    Bindings, BufferPart, FAULTY_LOOP_STEPS, Feature, Frame, ListCapacity, SharedStruct, faulty_software, gpu_struct,
};
use lanternfish_scene::named_enum;

use crate::{
    context::ViewContext,
    error::RenderError,
    lights::LightSet,
    shaders::Shaders,
    technique::{AnyTechnique, Choice, Technique, clone_of},
};

gpu_struct! {
    /// The volume of a tile or a cluster, in a space that has the eye at its origin and looks down −z.
    pub struct Volume {
        /// Slopes of its planes: left, right, bottom, top.
        slopes: Vec4,
        /// Least distance along the axis, m.
        nearest: f32,
        /// Greatest distance along the axis, m; less than nearest if the volume is empty.
        farthest: f32,
        /// 1: the sides are parallel.
        parallel: u32,
        /// Unused.
        _pad: u32,
    }
}

/// Technique of light culling; none: every light is evaluated at every point.
pub type Culling = Choice<dyn CullingTechnique>;

impl<T: Technique + CullingTechnique> From<T> for Culling {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

named_enum! {
    /// Edge of a screen tile, pixels.
    TileSize {
        /// 8 × 8.
        Px8 = "8": "Fewest lights a pixel, most lists",
        /// 16 × 16.
        Px16 = "16": "A good balance",
        /// 32 × 32.
        Px32 = "32": "Fewest lists, most lights a pixel",
    }
}

impl TileSize {
    /// Edge, pixels.
    pub const fn pixels(self) -> u32 {
        match self {
            Self::Px8 => 8,
            Self::Px16 => 16,
            Self::Px32 => 32,
        }
    }
}

/// A technique of light culling.
pub trait CullingTechnique: AnyTechnique {
    /// The feature that makes `light_list.wesl` read this technique's lists.
    fn feature(&self) -> Feature;

    /// True if it has clusters, for their debug views.
    fn has_clusters(&self) -> bool {
        false
    }

    /// True if one invocation tests all lights.
    fn tests_every_light(&self) -> bool {
        false
    }

    /// Compiles its passes, for images of so many samples per pixel.
    fn build(&self, device: &wgpu::Device, samples: u32) -> Result<Box<dyn LightCullingPasses>, RenderError>;
}

/// The passes of a technique.
pub trait LightCullingPasses: Send + Any + fmt::Debug {
    /// Fills the lists of views of one scene, in their order, with the lights of a set.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        reach: Reach,
        lights: &LightSet,
    ) -> Result<Vec<LightLists>, RenderError>;
}

/// The shaders of this folder, without those of its techniques.
pub(crate) const DECLARED: Shaders = Shaders::new(&[], &[SharedStruct::of::<Volume>()]);

/// The lists of one view.
#[derive(Clone, Debug)]
pub struct LightLists {
    /// Starts of the cells' lists; one element more than there are cells.
    pub cells: wgpu::Buffer,
    /// Indices of lights, cell after cell.
    pub indices: wgpu::Buffer,
    /// Uniform that `cell_from_fragment` reads, under its name in the technique's shader.
    pub grid: Option<(&'static str, BufferPart)>,
    /// Number of entries of all lists.
    pub listed: u64,
    /// Number of tests of a light, or of a node of a tree over lights, against a cell.
    pub tests: u64,
    /// Further exact counts by name, without those shared with an earlier view.
    pub counters: Vec<(&'static str, u64)>,
    /// Number of visible fragments of every cluster.
    pub fragments: Option<wgpu::Buffer>,
}

impl LightLists {
    /// Bindings under the names that the shaders use.
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

/// Points for which lights are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Points of the surfaces in the depth buffer.
    Surface,
    /// Any point of the view: for transparent surfaces, which the depth buffer does not hold.
    Anywhere,
}

/// The passes of the chosen technique.
#[derive(Debug)]
pub struct LightCulling {
    /// None: every light at every point.
    passes: Option<Box<dyn LightCullingPasses>>,
    tests_every_light: bool,
}

impl LightCulling {
    /// Compiles the technique's passes.
    pub fn new(device: &wgpu::Device, culling: &Culling, samples: u32) -> Result<Self, RenderError> {
        let passes = culling.technique().map(|technique| technique.build(device, samples)).transpose()?;
        let tests_every_light = culling.technique().is_none_or(|technique| technique.tests_every_light());
        Ok(Self { passes, tests_every_light })
    }

    /// The feature that makes `light_list.wesl` use this technique.
    pub fn feature(culling: &Culling) -> Feature {
        culling.technique().map_or(all::CULLING_ALL, |technique| technique.feature())
    }

    /// The features of all techniques.
    pub fn every_feature() -> Vec<Feature> {
        std::iter::once(Culling::NONE).chain(Culling::all()).map(|culling| Self::feature(&culling)).collect()
    }

    /// Fills the lists of views of one scene, in their order, with the lights of a set.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        reach: Reach,
        lights: &LightSet,
    ) -> Result<Vec<LightLists>, RenderError> {
        if self.tests_every_light {
            check_driver(&frame.device.adapter_info(), lights.capacity)?;
        }
        match &mut self.passes {
            None => views.iter().map(|_| all::record(frame, lights)).collect(),
            Some(passes) => passes.record(frame, views, reach, lights),
        }
    }

    /// The passes, if they are of this type.
    pub fn passes<P: LightCullingPasses>(&self) -> Option<&P> {
        let passes: &dyn Any = &**self.passes.as_ref()?;
        passes.downcast_ref()
    }
}

/// An error for a driver that ends a loop over so many lights too early.
fn check_driver(adapter: &wgpu::AdapterInfo, light_count: u32) -> Result<(), RenderError> {
    if light_count <= FAULTY_LOOP_STEPS || !faulty_software(adapter) {
        return Ok(());
    }
    let driver = adapter.driver_info.clone();
    let fault = "ends loops after 65,535 steps, and there are more lights";
    Err(RenderError::Driver { setting: "a test of every light", driver, fault, instead: "the default `culling`" })
}

/// Greatest number of entries of `light_indices` in one binding.
pub fn most_indices(device: &wgpu::Device) -> u64 {
    // Buffer sizes are multiples of 16 bytes.
    (device.limits().max_storage_buffer_binding_size / 16 * 4).min(u32::MAX.into())
}

/// An error if the count exceeds the entries that one binding holds.
pub fn check_capacity(
    capacity: &ListCapacity,
    limit: u64,
    lights: &LightSet,
    remedy: &'static str,
) -> Result<(), RenderError> {
    if capacity.elements <= limit {
        return Ok(());
    }
    let remedy = lights.remedy.unwrap_or(remedy);
    Err(RenderError::Overflow { list: lights.list, needed: capacity.elements, limit, remedy })
}

#[test]
fn more_lights_than_a_faulty_drivers_loops_have_steps_are_refused() {
    let adapter = |driver: &str| wgpu::AdapterInfo {
        driver_info: driver.to_owned(),
        ..wgpu::AdapterInfo::new(wgpu::DeviceType::Cpu, wgpu::Backend::Vulkan)
    };
    let error = check_driver(&adapter("Mesa 22.3.6"), 65_536).unwrap_err().to_string();
    assert!(error.contains("Mesa 22.3.6 ends loops after 65,535 steps") && error.contains("`culling`"), "{error}");
    assert!(check_driver(&adapter("Mesa 22.3.6"), 65_535).is_ok());
    assert!(check_driver(&adapter("Mesa 25.0.7"), 100_000).is_ok());
}
