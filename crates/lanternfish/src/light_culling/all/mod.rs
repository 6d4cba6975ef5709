//! Every light for every point: slow and right, what the other rooms are tested against.

use lanternfish_gpu::{Feature, Frame};

use super::LightLists;
use crate::{error::RenderError, gpu_scene::GpuScene};

/// This room is behind `light_list`.
pub(crate) const CULLING_ALL: Feature = Feature("culling_all");

/// One cell with all lights.
pub fn record(frame: &mut Frame<'_>, scene: &GpuScene) -> Result<LightLists, RenderError> {
    let indices: Vec<u32> = (0..scene.light_count).collect();
    Ok(LightLists {
        cells: frame.storage_of("light_culling/cells", &[0, scene.light_count])?,
        indices: frame.storage_of("light_culling/indices", &indices)?,
        grid: None,
        listed: u64::from(scene.light_count),
        tests: 0,
        clusters: None,
        fragments: None,
    })
}
