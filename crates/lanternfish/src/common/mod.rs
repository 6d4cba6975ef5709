//! Shared functions: numbers (`math.wesl`), colours (`color.wesl`) and random numbers (`random.wesl`), their counterparts on the host, and
//! the size of dispatches over lists.

pub mod random;
#[cfg(test)]
mod tests;

use lanternfish_gpu::gpu_constants;

gpu_constants! {
    /// Workgroups along x of passes over lists.
    pub(crate) const WIDTH: u32 = 1024;
    /// Invocations of one workgroup of those passes.
    pub(crate) const WORKGROUP: u32 = 64;
}

/// Workgroups along x, y and z of a pass over a list with this many invocations: rows of 1,024.
pub fn workgroups(invocations: u32) -> [u32; 3] {
    workgroups_of(invocations, WORKGROUP)
}

/// The same for workgroups of another size.
pub fn workgroups_of(invocations: u32, size: u32) -> [u32; 3] {
    let groups = invocations.div_ceil(size);
    [WIDTH.min(groups), groups.div_ceil(WIDTH), 1]
}
