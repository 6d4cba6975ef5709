//! Where probes are: one in each tile of pixels, and more where its surfaces differ.

use glam::UVec2;
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Counted, Frame, primitives::Scan};

use super::{DECLARED, ProbeParameters, groups};
use crate::{error::RenderError, texture::frame_layers};

/// Name of the list of further probes in the capacity policy.
const FURTHER: &str = "indirect/probes/further";
/// Further probes of a tile at most: `list.wesl`.
pub(super) const MOST_FURTHER: u32 = 3;

#[cfg(test)]
thread_local! {
    /// Capacity of the list before probes have been counted, in tests.
    pub(crate) static FIRST_FURTHER_IN_TESTS: std::cell::Cell<Option<u64>> = const { std::cell::Cell::new(None) };
}

/// Capacity of the list before probes have been counted.
fn first_capacity(tiles: u64) -> u64 {
    #[cfg(test)]
    if let Some(capacity) = FIRST_FURTHER_IN_TESTS.get() {
        return capacity;
    }
    tiles / 2
}

/// The passes.
#[derive(Debug)]
pub(super) struct Placement {
    place: ComputeKernel,
    refine: ComputeKernel,
    scan: Scan,
    compact: ComputeKernel,
}

/// The probes of a view.
#[derive(Debug)]
pub(super) struct Placed {
    /// Probes, across and down.
    pub grid: UVec2,
    /// The pixel of each.
    pixels: wgpu::TextureView,
    /// Starts of the further probes of each tile.
    starts: wgpu::Buffer,
}

impl Placement {
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |file: &str| {
            let shader = DECLARED.link(&format!("indirect/sampled/probes/{file}"), &[])?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, file, &format!("indirect/probes/{file}")))
        };
        Ok(Self {
            place: kernel("place")?,
            refine: kernel("refine")?,
            scan: Scan::new(device, "indirect/probes")?,
            compact: kernel("compact")?,
        })
    }

    /// Places the probes. `surfaces`: bindings of the view and its surface; `parameters`: those of the frame.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        surfaces: &Bindings<'_>,
        parameters: &ProbeParameters,
        uniform: &BufferPart,
    ) -> Result<Placed, RenderError> {
        let tiles = parameters.tiles;
        let count = tiles.x * tiles.y;
        let format = wgpu::TextureFormat::R32Uint;
        let base = frame_layers(frame, "indirect/probes/base", tiles, format, 1);
        let starts = frame.zeroed("indirect/probes/starts", 4 * (u64::from(count) + 1))?;
        let further = frame.scratch("indirect/probes/further", 4 * u64::from(MOST_FURTHER * count))?;
        let bindings = surfaces.clone().part("probes", uniform);
        frame.dispatch(&self.place, &bindings.clone().texture("placed_probes", &base), [tiles.x, tiles.y, 1]);
        let bindings = bindings.texture("base_probes", &base).buffer("further_pixels", &further);
        frame.dispatch(&self.refine, &bindings.clone().buffer("further_counts", &starts), [tiles.x, tiles.y, 1]);
        let total = self.scan.record(frame, &starts, count + 1)?;
        let capacity = frame.capacity_for(&Counted {
            list: FURTHER,
            words: &total,
            starts: (&starts, count as usize + 1),
            may_wrap: &|_| false,
            guess: first_capacity(count.into()),
            limit: u64::from(MOST_FURTHER * count),
        })?;
        let rows = u32::try_from(capacity.capacity).unwrap_or(u32::MAX).div_ceil(tiles.x);
        let grid = UVec2::new(tiles.x, tiles.y + rows);
        let pixels = frame_layers(frame, "indirect/probes/pixels", grid, format, 1);
        let compacting = bindings.buffer("further_starts", &starts).texture("placed_probes", &pixels);
        frame.dispatch(&self.compact, &compacting, groups(&self.compact, grid));
        Ok(Placed { grid, pixels, starts })
    }
}

impl Placed {
    /// Bindings of `list.wesl`.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("probe_pixels", &self.pixels).buffer("further_starts", &self.starts)
    }
}

#[cfg(test)]
mod tests;
