//! Every light for every point: slow and exact, the baseline for tests of the other techniques.

use lanternfish_gpu::{Feature, Frame};

use super::LightLists;
use crate::{error::RenderError, lights::LightSet};

/// Selects this technique for `light_list`.
pub(crate) const CULLING_ALL: Feature = Feature::choosing("culling_all", "culling", "light_culling/all/cell", None);

/// One cell that lists all lights.
pub fn record(frame: &mut Frame<'_>, set: &LightSet) -> Result<LightLists, RenderError> {
    let indices: Vec<u32> = (0..set.capacity).collect();
    let cells = frame.storage_of("light_culling/cells", &[0, set.capacity])?;
    if let Some(counted) = &set.counted {
        frame.encoder().copy_buffer_to_buffer(counted, 0, &cells, 4, 4);
    }
    Ok(LightLists {
        cells,
        indices: frame.storage_of("light_culling/indices", &indices)?,
        grid: None,
        listed: u64::from(set.capacity),
        tests: 0,
        counters: Vec::new(),
        fragments: None,
    })
}
