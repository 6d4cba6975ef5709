//! Trees of all sizes and of hostile primitives, against brute force on the host.

mod cost;
mod hostile;
mod inputs;
mod rays;
mod refit;
mod shaders;
mod validity;
mod walk;

use lanternfish_gpu::{Frame, Gpu, Profiler, read_back, storage_buffer_of, testing};
use obvhs::cwbvh::node::CwBvhNode;

use crate::{BvhBuilder, DeviceBvh, Primitives, wide::levels_for};
use validity::{box_around, check};

/// A tree that was read back.
#[derive(Clone, Debug, PartialEq)]
struct Tree {
    nodes: Vec<CwBvhNode>,
    indices: Vec<u32>,
}

/// Builds trees on a device.
struct Device<'a> {
    gpu: &'a Gpu,
    builder: BvhBuilder,
    profiler: Profiler,
}

/// Points of a primitive: three of a triangle, two of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Triangles = 3,
    Boxes = 2,
}

impl Kind {
    fn of(self, buffer: &wgpu::Buffer) -> Primitives<'_> {
        match self {
            Self::Triangles => Primitives::Triangles(buffer),
            Self::Boxes => Primitives::Boxes(buffer),
        }
    }
}

impl<'a> Device<'a> {
    fn new(gpu: &'a Gpu) -> Self {
        let builder = testing::engine(gpu).within(|| BvhBuilder::new(&gpu.device)).unwrap();
        Self { gpu, builder, profiler: Profiler::new(&gpu.device, &gpu.queue) }
    }

    fn upload(&self, points: &[[f32; 4]]) -> wgpu::Buffer {
        storage_buffer_of(&self.gpu.device, "primitives", points, wgpu::BufferUsages::empty()).unwrap()
    }

    fn build(&mut self, kind: Kind, points: &[[f32; 4]]) -> DeviceBvh {
        let count = (points.len() / kind as usize) as u32;
        let mut bvh = DeviceBvh::new(&self.gpu.device, count).unwrap();
        let buffer = self.upload(points);
        let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
        self.builder.build(&mut frame, kind.of(&buffer), count, &mut bvh).unwrap();
        frame.submit();
        bvh
    }

    fn refit(&mut self, kind: Kind, points: &[[f32; 4]], bvh: &DeviceBvh) {
        let buffer = self.upload(points);
        let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
        self.builder.refit(&mut frame, kind.of(&buffer), bvh).unwrap();
        frame.submit();
    }

    fn read<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer, count: usize) -> Vec<T> {
        read_back(&self.gpu.device, &self.gpu.queue, buffer, count).unwrap()
    }

    /// The tree, whose table of levels is checked against the nodes of each level.
    fn tree(&self, bvh: &DeviceBvh, levels: &[usize]) -> Result<Tree, String> {
        let table: Vec<[u32; 8]> = self.read(&bvh.levels, levels.len() + 1);
        let mut first = 0;
        for (level, count) in levels.iter().chain([&0]).enumerate().take(levels_for(bvh.count) as usize + 1) {
            if table[level][3..5] != [*count as u32, first] {
                return Err(format!("level {level} of {levels:?}: {:?}", table[level]));
            }
            first += *count as u32;
        }
        let nodes = self.read(&bvh.nodes, levels.iter().sum());
        Ok(Tree { nodes, indices: self.read(&bvh.indices, bvh.count as usize) })
    }

    /// Builds a tree and checks it. Returns it with the number of nodes of each level.
    fn checked(&mut self, what: &str, kind: Kind, points: &[[f32; 4]]) -> (Tree, Vec<usize>) {
        let bvh = self.build(kind, points);
        self.checked_tree(what, kind, points, &bvh)
    }

    fn checked_tree(&self, what: &str, kind: Kind, points: &[[f32; 4]], bvh: &DeviceBvh) -> (Tree, Vec<usize>) {
        let boxes: Vec<_> = points.chunks(kind as usize).map(box_around).collect();
        let nodes: Vec<CwBvhNode> = self.read(&bvh.nodes, bvh.nodes.size() as usize / size_of::<CwBvhNode>());
        let indices: Vec<u32> = self.read(&bvh.indices, bvh.count as usize);
        let levels = check(&nodes, &indices, &boxes).unwrap_or_else(|error| panic!("{what}: {error}"));
        let tree = if bvh.count == 0 { Ok(Tree { nodes, indices }) } else { self.tree(bvh, &levels) };
        (tree.unwrap_or_else(|error| panic!("{what}: {error}")), levels)
    }
}

#[gpu_test]
fn gpu_trees_of_every_size_are_right(gpu: &Gpu) {
    let mut device = Device::new(gpu);
    for count in (0..36).chain([255, 256, 257, 511, 513, 4096, 4097, 65_535, 65_537]) {
        let points = inputs::packed(&inputs::foliage(count));
        device.checked(&format!("{count} triangles"), Kind::Triangles, &points);
        device.checked(&format!("{count} boxes"), Kind::Boxes, &boxes(&points));
    }
}

/// Boxes around the triangles' first two corners.
fn boxes(points: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let corners = |triangle: &[[f32; 4]]| {
        let least = std::array::from_fn(|axis| triangle[0][axis].min(triangle[1][axis]));
        let greatest = std::array::from_fn(|axis| triangle[0][axis].max(triangle[1][axis]));
        [least, greatest]
    };
    points.chunks(3).flat_map(corners).collect()
}

#[gpu_test]
fn gpu_two_builds_give_the_same_bits(gpu: &Gpu) {
    let mut device = Device::new(gpu);
    let points = inputs::packed(&inputs::terrain(40_000));
    let [first, second] = [0; 2].map(|_| device.checked("terrain", Kind::Triangles, &points).0);
    assert!(first == second);
}

/// The second build of a frame takes the lists of the first.
#[gpu_test]
fn gpu_a_frame_may_build_several_trees(gpu: &Gpu) {
    let mut device = Device::new(gpu);
    let inputs = [4_000, 5_000, 3_000].map(|count| inputs::packed(&inputs::foliage(count)));
    let buffers = inputs.each_ref().map(|points| device.upload(points));
    let mut trees = [4_000, 5_000, 3_000].map(|count| DeviceBvh::new(&gpu.device, count).unwrap());
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut device.profiler);
    for (tree, buffer) in trees.iter_mut().zip(&buffers) {
        device.builder.build(&mut frame, Primitives::Triangles(buffer), tree.capacity, tree).unwrap();
    }
    frame.submit();
    for (tree, points) in trees.iter().zip(&inputs) {
        let read = device.checked_tree("of several", Kind::Triangles, points, tree).0;
        assert!(read == device.checked("alone", Kind::Triangles, points).0);
    }
}
