use super::DECLARED;
use glam::UVec3;
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, Profiler, primitives::Scan, read_back, storage_buffer, storage_buffer_of, testing,
    uniform_buffer_of,
};

use super::{ClusterGrid, WIDTH};
use crate::shaders::constant;

#[test]
fn rows_are_the_shaders() {
    let row = |module: &str| constant(module, "ROW");
    assert_eq!(row("light_culling/clustered/compact"), row("light_culling/clustered/assign"));
}

/// All visible clusters are dispatched, even if there are more than workgroups in one dimension.
#[test]
fn gpu_more_visible_clusters_than_one_dimension_of_workgroups_are_dispatched() {
    let test = "gpu_more_visible_clusters_than_one_dimension_of_workgroups_are_dispatched";
    let Some(gpu) = testing::gpu(test) else { return };
    let dimensions = UVec3::new(256, 256, 80);
    let clusters = dimensions.element_product();
    let most = gpu.device.limits().max_compute_workgroups_per_dimension;
    assert!(clusters > 64 * most, "{clusters} clusters are too few to show it");
    let shader = DECLARED.link("light_culling/clustered/compact", &[]).unwrap();
    let [flag, compact] =
        ["flag", "compact"].map(|entry| ComputeKernel::new(&gpu.device, &shader, entry, &format!("test/{entry}")));
    let scan = Scan::new(&gpu.device, "test").unwrap();
    let list = |label| storage_buffer(&gpu.device, label, 4 * (u64::from(clusters) + 1)).unwrap();
    let none = wgpu::BufferUsages::empty();
    let fragments = storage_buffer_of(&gpu.device, "fragments", &vec![1u32; clusters as usize], none).unwrap();
    let (indices, visible) = (list("places"), list("visible"));
    let dispatch = lanternfish_gpu::indirect_buffer(&gpu.device, "dispatch");
    let grid = uniform_buffer_of(&gpu.device, "grid", &ClusterGrid { dimensions, ..Default::default() });
    let bindings = Bindings::new()
        .buffer("cluster_grid", &grid)
        .buffer("cluster_fragments", &fragments)
        .buffer("visible_places", &indices)
        .buffer("visible_clusters", &visible)
        .buffer("visible_dispatch", &dispatch);
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let all = [WIDTH, clusters.div_ceil(64 * WIDTH), 1];
    frame.dispatch(&flag, &bindings, all);
    scan.record(&mut frame, &indices, clusters + 1).unwrap();
    frame.dispatch(&compact, &bindings, all);
    frame.submit();
    let dispatched = read_back::<u32>(&gpu.device, &gpu.queue, &dispatch, 3).unwrap();
    assert_eq!(read_back::<u32>(&gpu.device, &gpu.queue, &visible, 1).unwrap(), [clusters]);
    println!("{clusters} clusters: {dispatched:?} workgroups");
    assert!(dispatched.iter().all(|count| *count <= most), "{dispatched:?}");
    assert!(64 * dispatched.iter().product::<u32>() >= clusters, "{dispatched:?}");
}
