//! Trees built on the device beside those of obvhs: time, SAH cost, and what rays visit.
//!
//! `cargo run --release -p lanternfish-bvh --example compare -- [TRIANGLES …]`, on the adapter that `LANTERNFISH_TEST_ADAPTER` names. Every
//! repetition times each builder once, in turn.

#[path = "../src/tests/cost.rs"]
mod cost;
#[path = "../src/tests/inputs.rs"]
mod inputs;
#[path = "../src/tests/walk.rs"]
mod walk;

use std::{
    collections::BTreeMap,
    error::Error,
    time::{Duration, Instant},
};

use glam::Vec3;
use lanternfish_bvh::{BvhBuilder, DeviceBvh, Primitives};
use lanternfish_gpu::{Frame, Gpu, Pool, Profiler, read_back, storage_buffer_of, testing};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    cwbvh::{CwBvh, builder::build_cwbvh},
};
use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};

use cost::{bounds, sah_cost};
use inputs::{Corners, direction, point};

const REPETITIONS: usize = 5;
const RAYS: usize = 20_000;

/// A name and milliseconds of each repetition.
type Times = Vec<(String, Vec<f64>)>;

struct Device<'a> {
    gpu: &'a Gpu,
    builder: BvhBuilder,
    profiler: Profiler,
    pool: Pool,
    bvh: DeviceBvh,
    corners: wgpu::Buffer,
    count: u32,
    /// Of the last run.
    dispatches: u32,
}

impl<'a> Device<'a> {
    fn new(gpu: &'a Gpu, triangles: &[Corners]) -> Result<Self, Box<dyn Error>> {
        let (device, none) = (&gpu.device, wgpu::BufferUsages::empty());
        let count = triangles.len() as u32;
        Ok(Self {
            gpu,
            builder: BvhBuilder::new(device)?,
            profiler: Profiler::new(device, &gpu.queue),
            pool: Pool::new(device),
            bvh: DeviceBvh::new(device, count)?,
            corners: storage_buffer_of(device, "corners", &inputs::packed(triangles), none)?,
            count,
            dispatches: 0,
        })
    }

    /// Milliseconds of a build, or of a refit, from the first command recorded to the device's last; and of its passes, by label.
    fn run(&mut self, builds: bool) -> Result<(f64, BTreeMap<String, f64>), Box<dyn Error>> {
        let start = Instant::now();
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let mut frame = Frame::pooled(device, queue, &mut self.profiler, &mut self.pool);
        let primitives = Primitives::Triangles(&self.corners);
        match builds {
            true => self.builder.build(&mut frame, primitives, self.count, &mut self.bvh)?,
            false => self.builder.refit(&mut frame, primitives, &self.bvh)?,
        }
        let number = frame.number();
        frame.submit();
        self.dispatches = self.profiler.commands_of(number).iter().map(|pass| pass.dispatches).sum();
        device.poll(wgpu::PollType::wait_indefinitely())?;
        let ms = 1e3 * start.elapsed().as_secs_f64();
        let mut passes = BTreeMap::new();
        self.profiler.finished().into_iter().for_each(|pass| *passes.entry(pass.name).or_default() += pass.ms);
        Ok((ms, passes))
    }

    fn read<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer, count: usize) -> Result<Vec<T>, Box<dyn Error>> {
        Ok(read_back(&self.gpu.device, &self.gpu.queue, buffer, count)?)
    }

    /// The tree, the number of clusters of each iteration, and the number of levels.
    fn tree(&self) -> Result<(CwBvh, Vec<u64>, usize), Box<dyn Error>> {
        let levels: Vec<[u32; 8]> = self.read(&self.bvh.levels, self.bvh.levels.size() as usize / 32)?;
        let count = levels.iter().map(|level| level[3] as usize).sum();
        let nodes = self.read(&self.bvh.nodes, count)?;
        let primitive_indices = self.read(&self.bvh.indices, self.count as usize)?;
        let rows: Vec<[u32; 4]> = self.read(&self.bvh.iterations, self.bvh.iterations.size() as usize / 16)?;
        let lists = rows.iter().map(|row| u64::from(row[3] & 0x7fff_ffff)).take_while(|count| *count > 1).collect();
        let depth = levels.iter().filter(|level| level[3] > 0).count();
        Ok((CwBvh { nodes, primitive_indices, ..CwBvh::default() }, lists, depth))
    }
}

/// Bytes that the passes of a build read and write for each triangle, by the shaders' loads and stores. Reading the same element again
/// counts once if it is of the same workgroup, so a card's caches move less, not more.
fn bytes_per_triangle(count: u64, nodes: u64, lists: &[u64]) -> [(&'static str, f64); 4] {
    let of = |bytes: u64| bytes as f64 / count as f64;
    let clusters: u64 = lists.iter().sum();
    // Corners, box; box, code, index; index, box, leaf, cluster.
    let prepare = 80 + 40 + 4 + 32 + 40;
    // Eight digits: keys twice, values, both written; six times the counts of 16 digits for 128 pairs.
    let sort = 8 * (20 + 3);
    // A cluster and its box, of 9/8 as many as there are; partners; the list again, and the next. A merge: two boxes, two plans, both written.
    let clustering = clusters * 9 / 8 * 40 + clusters * (4 + 12) + (clusters - count) * 8 + count * (8 + 128 + 64);
    // Root; 7 nodes opened; 8 boxes and summaries twice, roots of the next level; the node.
    let wide = nodes * (16 + 7 * 32 + 8 * (32 + 16) + 32 + 32 + 8 * 32 + 4 + 80) + count * (4 + 16);
    [("prepare", prepare as f64), ("sort", sort as f64), ("clustering", of(clustering)), ("wide nodes", of(wide))]
}

/// Mean numbers of nodes and triangles of random rays within the scene's box, and their hits.
fn visits(tree: &CwBvh, triangles: &[Corners]) -> [f64; 3] {
    let all = triangles.iter().fold(Aabb::empty(), |all, corners| all.union(&bounds(corners)));
    let ray = |i: usize| {
        let origin = Vec3::from(all.min) + point(2 * i) * Vec3::from(all.max - all.min);
        let found = walk::closest(&tree.nodes, &tree.primitive_indices, triangles, origin, direction(2 * i + 1));
        [f64::from(found.nodes), f64::from(found.triangles), f64::from(u8::from(found.t.is_finite()))]
    };
    let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
    (0..RAYS).into_par_iter().map(ray).reduce(|| [0.0; 3], sum).map(|sum| sum / RAYS as f64)
}

fn row(name: &str, tree: &CwBvh, triangles: &[Corners]) {
    let [nodes, tests, hits] = visits(tree, triangles);
    let (cost, count) = (sah_cost(&tree.nodes, &tree.primitive_indices, triangles), tree.nodes.len());
    println!(
        "  {name:<24} {cost:8.2} SAH, {nodes:7.2} nodes {tests:6.2} triangles a ray ({hits:.3} hit), {count} nodes"
    );
}

fn add(times: &mut Times, name: String, ms: f64) {
    match times.iter_mut().find(|(known, _)| *known == name) {
        Some((_, list)) => list.push(ms),
        None => times.push((name, vec![ms])),
    }
}

fn compare(gpu: &Gpu, pools: &[ThreadPool], what: &str, triangles: &[Corners]) -> Result<(), Box<dyn Error>> {
    println!("{what}: {} triangles", triangles.len());
    let presets = [
        ("fastest", BvhBuildParams::fastest_build()),
        ("medium", BvhBuildParams::medium_build()),
        ("slow", BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() }),
    ];
    let boxes: Vec<Aabb> = triangles.iter().map(bounds).collect();
    let mut device = Device::new(gpu, triangles)?;
    // Compiles, and fills the pool.
    device.run(true)?;
    device.run(false)?;
    let (mut times, mut passes) = (Times::new(), Times::new());
    let (mut trees, mut dispatches) = (Vec::new(), [0; 2]);
    for _ in 0..REPETITIONS {
        trees.clear();
        let (ms, by_pass) = device.run(true)?;
        add(&mut times, "device, build".to_owned(), ms);
        by_pass.into_iter().for_each(|(name, ms)| add(&mut passes, name, ms));
        dispatches[0] = device.dispatches;
        let (tree, ..) = device.tree()?;
        trees.push(("device", tree));
        add(&mut times, "device, refit".to_owned(), device.run(false)?.0);
        dispatches[1] = device.dispatches;
        for (name, preset) in presets {
            for (pool, first) in pools.iter().zip([true, false]) {
                let start = Instant::now();
                let tree = pool.install(|| build_cwbvh(&boxes, preset, &mut Duration::default()));
                let ms = 1e3 * start.elapsed().as_secs_f64();
                add(&mut times, format!("{name}, {} threads", pool.current_num_threads()), ms);
                if first {
                    trees.push((name, tree));
                }
            }
        }
    }
    for (name, mut list) in times.into_iter().chain(passes) {
        list.sort_by(f64::total_cmp);
        println!("  {name:<24} {:8.2} ms least, {:8.2} ms median", list[0], list[list.len() / 2]);
    }
    trees.iter().for_each(|(name, tree)| row(name, tree, triangles));
    let (tree, lists, depth) = device.tree()?;
    println!("  device: {dispatches:?} dispatches, {} iterations, {depth} levels, {lists:?}", lists.len());
    let bytes = bytes_per_triangle(triangles.len() as u64, tree.nodes.len() as u64, &lists);
    let total: f64 = bytes.iter().map(|(_, bytes)| bytes).sum();
    println!("  bytes a triangle: {bytes:.0?}, together {total:.0}");
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let gpu = testing::gpu("compare").ok_or("no adapter")?;
    let _idle = gpu.idle_at_end();
    println!("{} ({})", gpu.description.name, gpu.description.driver);
    let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(1)?, pool(0)?];
    let mut counts: Vec<usize> = std::env::args().skip(1).map(|count| count.parse()).collect::<Result<_, _>>()?;
    if counts.is_empty() {
        counts = vec![262_144, 1_048_576];
    }
    for count in counts {
        compare(gpu, &pools, "terrain", &inputs::terrain(count))?;
        compare(gpu, &pools, "foliage", &inputs::foliage(count))?;
        compare(gpu, &pools, "objects", &inputs::objects(count))?;
    }
    Ok(())
}
