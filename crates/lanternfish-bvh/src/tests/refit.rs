//! Refits, and that a wrong box is noticed.

use lanternfish_gpu::testing;
use obvhs::cwbvh::node::CwBvhNode;

use super::{
    Device, Kind, inputs,
    validity::{box_around, check},
};

#[gpu_test]
fn gpu_a_refit_holds_moved_triangles(gpu: &Gpu) {
    let mut device = Device::new(gpu);
    for count in [0, 1, 3, 4, 40, 5_000] {
        let mut triangles = inputs::foliage(count);
        let points = inputs::packed(&triangles);
        let bvh = device.build(Kind::Triangles, &points);
        let (built, levels) = device.checked_tree("built", Kind::Triangles, &points, &bvh);
        device.refit(Kind::Triangles, &points, &bvh);
        assert!(device.checked_tree("at rest", Kind::Triangles, &points, &bvh).0 == built, "{count}");
        for (i, triangle) in triangles.iter_mut().enumerate() {
            *triangle = triangle.map(|corner| 0.5 * corner + 30.0 * inputs::point(i));
        }
        let moved = inputs::packed(&triangles);
        device.refit(Kind::Triangles, &moved, &bvh);
        let (refit, same) = device.checked_tree("moved", Kind::Triangles, &moved, &bvh);
        assert!(refit.indices == built.indices && levels == same, "{count}");
    }
}

/// Moving a side inwards by a step, losing a primitive, or a child elsewhere: all are noticed.
#[gpu_test]
fn gpu_a_broken_tree_is_noticed(gpu: &Gpu) {
    let mut device = Device::new(gpu);
    let points = inputs::packed(&inputs::foliage(300));
    let boxes: Vec<_> = points.chunks(3).map(box_around).collect();
    let (tree, _) = device.checked("foliage", Kind::Triangles, &points);
    let is_wrong = |nodes: &[CwBvhNode], indices: &[u32]| check(nodes, indices, &boxes).is_err();
    assert!(!is_wrong(&tree.nodes, &tree.indices));
    let mut broken = tree.clone();
    broken.indices[7] = broken.indices[8];
    assert!(is_wrong(&broken.nodes, &broken.indices));
    for index in 0..tree.nodes.len() {
        let mut nodes = tree.nodes.clone();
        nodes[index].child_base_idx += u32::from(nodes[index].imask != 0);
        nodes[index].primitive_base_idx += 1;
        assert!(is_wrong(&nodes, &tree.indices), "node {index}");
        for child in (0..8).filter(|child| !tree.nodes[index].is_child_empty(*child)) {
            let mut nodes = tree.nodes.clone();
            nodes[index].child_min_x[child] += 2;
            assert!(is_wrong(&nodes, &tree.indices), "node {index}, child {child}: least x");
            let mut nodes = tree.nodes.clone();
            nodes[index].child_max_z[child] -= 2;
            assert!(is_wrong(&nodes, &tree.indices), "node {index}, child {child}: greatest z");
        }
    }
}
