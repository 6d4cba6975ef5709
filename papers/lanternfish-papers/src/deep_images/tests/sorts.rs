//! The sorts of a linear array's lists: the same result as on the CPU.

use lanternfish::common::workgroups;
use lanternfish_gpu::{Feature, Gpu, ShaderLibrary, testing::Memory};

use super::cpu_reference;
use crate::{
    DeepSort,
    deep_images::{DeepGrid, Fragment, PAYLOAD, store::sort_feature},
    testing::{self, Random},
};

/// Lists whose fragments have random depths, of which some are equal, and different triangles.
fn random_lists(lengths: impl IntoIterator<Item = usize>) -> Vec<Vec<Fragment>> {
    let mut random = Random::new(19);
    let mut list = |length: usize| {
        let fragment = |i: usize| Fragment {
            depth: match i % 5 {
                0 => (8.0 * random.unit()).floor() / 8.0,
                _ => random.between(-1.0, 1.0),
            },
            triangle: Some((i * 617 % 1009) as u32),
        };
        (0..length).map(fragment).collect()
    };
    lengths.into_iter().map(&mut list).collect()
}

/// Sorts and merges lists by the shader, and compares with the CPU. An error names the first list that differs.
fn compare(
    gpu: &Gpu,
    library: &ShaderLibrary,
    lists: &[Vec<Fragment>],
    (sort, payload, merge_distance): (DeepSort, bool, f32),
) -> Result<(), String> {
    // A square image of as many texels.
    let resolution = (lists.len() as f64).sqrt().ceil() as u32;
    let grid = DeepGrid { resolution, image_count: 1, merge_distance, ..DeepGrid::default() };
    let mut starts = vec![0u32, 0];
    for list in 0..grid.list_count() as usize {
        starts.push(starts[list + 1] + lists.get(list).map_or(0, Vec::len) as u32);
    }
    let all: Vec<Fragment> = lists.iter().flatten().copied().collect();
    let triangles: Vec<u32> = all.iter().map(|fragment| fragment.triangle.unwrap()).collect();
    let mut memory = Memory::new();
    memory.bind(&["deep_grid"], &[grid]);
    memory.bind(&["filled_starts"], &starts);
    memory.bind(&["filled_depths"], &all.iter().map(|fragment| fragment.depth).collect::<Vec<_>>());
    memory.bind(&["filled_triangles"], &triangles);
    memory.bind(&["block_depths"], &vec![f32::NAN; all.len()]);
    memory.bind(&["block_triangles"], &vec![u32::MAX; all.len()]);
    memory.bind(&["kept"], &vec![7u32; starts.len()]);
    let features: Vec<Feature> = payload.then_some(PAYLOAD).into_iter().chain(sort_feature(sort)).collect();
    let shader = library.link("deep_images/store/sort", &features).unwrap_or_else(|error| panic!("{error}"));
    memory.run_on(gpu, &shader, "sort", workgroups(grid.list_count()));
    let (depths, triangles) = (memory.get::<f32>("filled_depths"), memory.get::<u32>("filled_triangles"));
    let kept = memory.get::<u32>("kept");
    for (index, list) in lists.iter().enumerate() {
        let mut expected = list.clone();
        expected.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.triangle.cmp(&b.triangle)));
        let expected = cpu_reference::merge(&expected, merge_distance);
        let first = starts[index + 1] as usize;
        let range = first..first + kept[index + 1] as usize;
        // An edited shader may report any number.
        let same_depths =
            depths.get(range.clone()).is_some_and(|depths| depths.iter().eq(expected.iter().map(|f| &f.depth)));
        let same_triangles = triangles
            .get(range)
            .is_some_and(|all| all.iter().copied().map(Some).eq(expected.iter().map(|f| f.triangle)));
        if !same_depths || (payload && !same_triangles) {
            return Err(format!("{sort}, payload {payload}: list {index} of {} fragments", list.len()));
        }
    }
    Ok(())
}

/// With triangles and without, merged and not.
const KINDS: [(bool, f32); 3] = [(true, 0.0), (true, 0.01), (false, 0.01)];

/// Every network with every number of free lanes, two to sixteen blocks, and lists that are too long for blocks.
fn few_lengths() -> impl Iterator<Item = usize> {
    (0..=34).chain([48, 49, 63, 64, 65, 100, 256, 333, 500, 511, 512, 513])
}

#[gpu_test]
fn gpu_both_sorts_give_the_list_of_the_cpu(gpu: &Gpu) {
    for sort in DeepSort::ALL {
        let lists = if *sort == DeepSort::Blocks { random_lists(0..=520) } else { random_lists(few_lengths()) };
        for (payload, merge_distance) in KINDS {
            compare(gpu, &testing::library(), &lists, (*sort, payload, merge_distance)).unwrap();
        }
    }
}

/// The comparison detects a network with a wrong comparison, and a wrong merge.
#[gpu_test(full)]
fn gpu_wrong_sorts_are_detected(gpu: &Gpu) {
    let edits = [
        ("network", "vec4<bool>(true, true, false, false)", "vec4<bool>(true, false, true, false)"),
        ("network", "vec4<bool>(true, false, false, true)", "vec4<bool>(true, false, true, false)"),
        ("network", "a.triangle < b.triangle", "a.triangle > b.triangle"),
        (
            "network",
            "Eight(sorted4(eight.a), reversed4(sorted4(eight.b)))",
            "Eight(sorted4(eight.a), sorted4(eight.b))",
        ),
        ("network", "exchanged(all.a.b.a, all.b.b.a)", "exchanged(all.a.b.a, all.b.a.a)"),
        ("block_sort", "index + 3u, end", "index + 2u, end"),
        ("block_sort", "count <= 8u", "count <= 9u"),
        ("block_sort", "heads[least].depth = BEYOND", "heads[least].depth = -BEYOND"),
        ("block_sort", "is_before(heads[block], heads[least])", "is_before(heads[least], heads[block])"),
    ];
    let lists = random_lists((0..=17).chain([32, 33, 70]));
    for (module, text, by) in edits {
        let module = format!("deep_images/store/{module}");
        let library = testing::edited_library(&module, text, by);
        let compared = compare(gpu, &library, &lists, (DeepSort::Blocks, true, 0.0));
        assert!(compared.is_err(), "{module}: {by:?} is not detected");
    }
}
