use super::DECLARED;
use glam::UVec3;
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, Profiler, read_back, storage_buffer, storage_buffer_of, testing, uniform_buffer_of,
};

use super::{ClusterGrid, WIDTH};
use crate::shaders::constant;

#[test]
fn rows_are_the_shaders() {
    let row = |module: &str| constant(module, "ROW");
    assert_eq!(row("light_culling/clustered/compact"), row("light_culling/clustered/assign"));
}

/// All visible clusters are dispatched, even if there are more than workgroups in one dimension.
#[gpu_test]
fn gpu_more_visible_clusters_than_one_dimension_of_workgroups_are_dispatched(gpu: &Gpu) {
    let dimensions = UVec3::new(256, 256, 80);
    let clusters = dimensions.element_product();
    let most = gpu.device.limits().max_compute_workgroups_per_dimension;
    assert!(clusters > 64 * most, "{clusters} clusters are too few to show it");
    let shader = DECLARED.link("light_culling/clustered/compact", &[]).unwrap();
    let compact = ComputeKernel::new(&gpu.device, &shader, "compact", "test/compact");
    let none = wgpu::BufferUsages::empty();
    let fragments = storage_buffer_of(&gpu.device, "fragments", &vec![1u32; clusters as usize], none).unwrap();
    let visible = storage_buffer(&gpu.device, "visible", 4 * (u64::from(clusters) + 1)).unwrap();
    let dispatch = lanternfish_gpu::indirect_buffer(&gpu.device, "dispatch");
    let grid = uniform_buffer_of(&gpu.device, "grid", &ClusterGrid { dimensions, ..Default::default() });
    let bindings = Bindings::new()
        .buffer("cluster_grid", &grid)
        .buffer("cluster_fragments", &fragments)
        .buffer("visible_clusters", &visible)
        .buffer("visible_dispatch", &dispatch);
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    frame.dispatch(&compact, &bindings, [WIDTH, clusters.div_ceil(64 * WIDTH), 1]);
    frame.submit();
    let dispatched = read_back::<u32>(&gpu.device, &gpu.queue, &dispatch, 3).unwrap();
    let mut listed = read_back::<u32>(&gpu.device, &gpu.queue, &visible, 1 + clusters as usize).unwrap();
    assert_eq!(listed[0], clusters);
    listed[1..].sort_unstable();
    assert!(listed[1..].iter().copied().eq(0..clusters), "each cluster is in the list once");
    println!("{clusters} clusters: {dispatched:?} workgroups");
    assert!(dispatched.iter().all(|count| *count <= most), "{dispatched:?}");
    assert!(64 * dispatched.iter().product::<u32>() >= clusters, "{dispatched:?}");
}
