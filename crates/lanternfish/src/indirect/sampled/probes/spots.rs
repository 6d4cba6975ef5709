//! Bright spots among the entries of the radiance cache, at which rays of probes are aimed.

use lanternfish_gpu::{ComputeKernel, Frame, uniform_buffer_of};

use super::DECLARED;
use crate::{common::workgroups, context::ViewContext, error::RenderError, indirect::radiance_cache::CacheOfFrame};

/// Size of `BrightSpots` of `spot_list.wesl`, and of a `Spot`, bytes.
const LIST_BYTES: u64 = 16 + 32 * SPOT_BYTES;
const SPOT_BYTES: u64 = 32;
/// Groups of entries: `spots.wesl`.
const GROUPS: u64 = 256;

/// The passes, and the list.
#[derive(Debug)]
pub(super) struct Spots {
    rank: ComputeKernel,
    find: ComputeKernel,
    list: ComputeKernel,
    /// The list, which is empty at first.
    pub listed: wgpu::Buffer,
}

impl Spots {
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let kernel = |entry: &str| {
            let shader = DECLARED.link("indirect/sampled/probes/spots", &[])?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &format!("indirect/probes/spots/{entry}")))
        };
        let listed = uniform_buffer_of(device, "indirect/probes/spots", &[0u8; LIST_BYTES as usize]);
        Ok(Self { rank: kernel("rank")?, find: kernel("find")?, list: kernel("list")?, listed })
    }

    /// Lists no spots: before entries are known.
    pub fn forget(&self, frame: &mut Frame<'_>) {
        frame.encoder().clear_buffer(&self.listed, 0, None);
    }

    /// Lists the bright spots of the entries.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        cache: &CacheOfFrame,
    ) -> Result<(), RenderError> {
        let brightest = frame.zeroed("indirect/probes/spots/brightest", 4 * GROUPS)?;
        let spots = frame.zeroed("indirect/probes/spots/entries", SPOT_BYTES * GROUPS)?;
        let listed = frame.zeroed("indirect/probes/spots/listed", LIST_BYTES)?;
        let bindings = cache.bindings().with(&view.buffer.bindings());
        let bindings = bindings.buffer("brightest", &brightest).buffer("brightest_entries", &spots);
        let bindings = bindings.buffer("listed_spots", &listed);
        for kernel in [&self.rank, &self.find] {
            frame.dispatch(kernel, &bindings, workgroups(cache.slots()));
        }
        frame.dispatch(&self.list, &bindings, [1; 3]);
        frame.encoder().copy_buffer_to_buffer(&listed, 0, &self.listed, 0, LIST_BYTES);
        Ok(())
    }
}
