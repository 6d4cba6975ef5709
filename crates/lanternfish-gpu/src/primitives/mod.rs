//! Parallel primitives: prefix sum and radix sort.

mod scan;
mod sort;

pub use scan::Scan;
pub use sort::RadixSort;

use crate::ShaderLibrary;

/// The shaders of this crate.
pub const SHADERS: ShaderLibrary = ShaderLibrary::new(&[
    ("capacity_policy/note", include_str!("../capacity_policy/note.wesl")),
    ("primitives/scan/scan", include_str!("scan/scan.wesl")),
    ("primitives/sort/sort", include_str!("sort/sort.wesl")),
    ("primitives/sort/sort_few", include_str!("sort/sort_few.wesl")),
    ("vertex_grid", include_str!("../vertex_grid.wesl")),
]);
