//! The binary tree: primitives along a curve, and locally ordered clustering.

use lanternfish_gpu::{Bindings, ComputeKernel, Frame, GpuError, primitives::RadixSort};

use crate::{
    BOX_BYTES, DeviceBvh, Primitives,
    builder::{ByKind, kernel, step, workgroups},
    parameters::{MAX_ITERATIONS, WORKGROUP},
};

/// The binary tree of a build, and its lists, which later builds of the frame use again.
pub(crate) struct BinaryTree {
    pub count: u32,
    /// Boxes of the primitives, and later the plans of inner nodes.
    boxes: wgpu::Buffer,
    leaves: wgpu::Buffer,
    inner: wgpu::Buffer,
    codes: wgpu::Buffer,
    sorted_primitives: wgpu::Buffer,
    partners: wgpu::Buffer,
    clusters: [wgpu::Buffer; 2],
    block_sums: wgpu::Buffer,
}

impl BinaryTree {
    pub fn new(frame: &mut Frame<'_>, count: u32) -> Result<Self, GpuError> {
        let mut list = |label: &str, bytes: u64| frame.scratch(label, bytes * u64::from(count));
        Ok(Self {
            count,
            boxes: list("bvh/boxes", BOX_BYTES)?,
            leaves: list("bvh/leaves", BOX_BYTES)?,
            inner: list("bvh/inner", BOX_BYTES)?,
            codes: list("bvh/codes", 4)?,
            sorted_primitives: list("bvh/sorted_primitives", 4)?,
            partners: list("bvh/partners", 4)?,
            clusters: [list("bvh/clusters", 8)?, list("bvh/clusters", 8)?],
            block_sums: frame.scratch("bvh/block_sums", 8 * u64::from(count.div_ceil(WORKGROUP)))?,
        })
    }

    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .buffer("leaves", &self.leaves)
            .buffer("inner", &self.inner)
            .buffer("plans", &self.boxes)
            .buffer("block_sums", &self.block_sums)
    }

    pub fn release(self, frame: &mut Frame<'_>) {
        let Self { boxes, leaves, inner, codes, sorted_primitives, partners, clusters: [a, b], block_sums, .. } = self;
        let lists = [boxes, leaves, inner, codes, sorted_primitives, partners, a, b, block_sums];
        lists.iter().for_each(|list| frame.release(list));
    }
}

/// Passes of `binary/`.
#[derive(Debug)]
pub(crate) struct Clustering {
    prepare: ByKind,
    encode: ComputeKernel,
    sort: RadixSort,
    gather: ComputeKernel,
    nearest: ComputeKernel,
    plan: ComputeKernel,
    merge: ComputeKernel,
}

impl Clustering {
    pub fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        let of = |module, entry| kernel(device, module, entry, &[]);
        Ok(Self {
            prepare: ByKind::new(device, "binary/prepare", "prepare")?,
            encode: of("binary/prepare", "encode")?,
            sort: RadixSort::new(device, "bvh/sort")?,
            gather: of("binary/prepare", "gather")?,
            nearest: of("binary/nearest", "nearest")?,
            plan: of("binary/plan", "plan_iteration")?,
            merge: of("binary/merge", "merge")?,
        })
    }

    /// Adds the passes that build the tree. The last one writes the root into the first wide node.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        primitives: Primitives<'_>,
        tree: &BinaryTree,
        bvh: &DeviceBvh,
    ) -> Result<(), GpuError> {
        let count = tree.count;
        let center_bounds = frame.zeroed("bvh/center_bounds", 24)?;
        let first = step(frame, count, 0, 0);
        let bindings = tree
            .bindings()
            .part("bvh_step", &first)
            .buffer("primitives", primitives.buffer(frame.device, count)?)
            .buffer("boxes", &tree.boxes)
            .buffer("center_bounds", &center_bounds)
            .buffer("codes", &tree.codes)
            .buffer("sorted_primitives", &tree.sorted_primitives)
            .buffer("clusters_out", &tree.clusters[0])
            .buffer("iterations", &bvh.iterations)
            .buffer("levels", &bvh.levels)
            .buffer("bvh_nodes", &bvh.nodes);
        frame.dispatch(self.prepare.of(primitives), &bindings, workgroups(count));
        frame.dispatch(&self.encode, &bindings, workgroups(count));
        self.sort.record(frame, &tree.codes, &tree.sorted_primitives, count, 32)?;
        frame.dispatch(&self.gather, &bindings, workgroups(count));

        let iterations = iterations_for(count);
        for iteration in 0..iterations {
            let own = step(frame, count, iteration, iterations);
            let [from, to] = [0, 1].map(|offset| &tree.clusters[(iteration as usize + offset) % 2]);
            let bindings = tree
                .bindings()
                .part("bvh_step", &own)
                .buffer("iterations", &bvh.iterations)
                .buffer("clusters", from)
                .buffer("clusters_out", to)
                .buffer("partners", &tree.partners);
            let offset = 16 * u64::from(iteration);
            frame.dispatch_indirect(&self.nearest, &bindings, &bvh.iterations, offset);
            frame.dispatch(&self.plan, &bindings, [1; 3]);
            frame.dispatch_indirect(&self.merge, &bindings, &bvh.iterations, offset);
        }
        Ok(())
    }
}

/// Most iterations for this many primitives: four times as many as halving takes, and 16. Where large triangles lie among small ones, the
/// list shrinks slowly. Sponza needs 71, Bistro 87; with three times as many their last 150 clusters were paired in order, and rays visited
/// a sixth more nodes.
pub(crate) fn iterations_for(count: u32) -> u32 {
    let halvings = count.next_power_of_two().ilog2();
    (4 * halvings + 16).min(MAX_ITERATIONS).min(count.saturating_sub(1))
}
