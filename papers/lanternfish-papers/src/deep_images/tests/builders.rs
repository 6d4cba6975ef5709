//! The builders against exact intersection, and against each other.

use glam::Vec3;
use lanternfish::gpu_scene::GpuScene;
use lanternfish_gpu::Gpu;

use super::{build, exact, lists, settings, upload};
use crate::{
    DeepBuilder, DeepImageSettings,
    deep_images::{DeepGrid, DeepImages, Fragment, Holes, build::sound_builder, directions::DirectionSet},
    testing::{self, quad, scene_of},
};

/// Over the texels whose exact axis hits a surface: the fraction that is empty, the fraction whose first surface is off by more than a
/// texel, and the number of texels with a surface where there is none, over the same number.
pub(super) fn compare(actual: &[Vec<Fragment>], exact: &[Vec<Fragment>], texel: f32) -> (f64, f64, f64) {
    let (mut hit_count, mut empty, mut off, mut false_hits) = (0, 0, 0, 0);
    for (actual, exact) in actual.iter().zip(exact) {
        match (actual.first(), exact.first()) {
            (None, Some(_)) => (hit_count, empty) = (hit_count + 1, empty + 1),
            (Some(actual), Some(exact)) => {
                hit_count += 1;
                off += usize::from((actual.depth - exact.depth).abs() > texel);
            }
            (Some(_), None) => false_hits += 1,
            (None, None) => {}
        }
    }
    let fraction = |count: usize| count as f64 / hit_count as f64;
    (fraction(empty), fraction(off), fraction(false_hits))
}

/// Two fractions of all lists: those whose depths differ by more than a thousandth of a texel, and those with the same depths but other
/// triangles.
///
/// Tiles have different positions in their target, so the middle of a texel differs in its last place, and a surface that is seen edge-on
/// amplifies that. This changes which of two touching surfaces comes first and is kept when they are merged.
fn differing(actual: &[Vec<Fragment>], other: &[Vec<Fragment>], grid: &DeepGrid) -> (f64, f64) {
    let near = 1e-3 / grid.texels_per_metre;
    let all = |a: &[Fragment], b: &[Fragment], same: &dyn Fn(&Fragment, &Fragment) -> bool| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
    };
    let (mut depths, mut triangles) = (0, 0);
    for (a, b) in actual.iter().zip(other) {
        if !all(a, b, &|a, b| (a.depth - b.depth).abs() <= near) {
            depths += 1;
        } else if !all(a, b, &|a, b| a.triangle == b.triangle) {
            triangles += 1;
        }
    }
    assert_eq!(actual.len(), other.len());
    let fraction = |count: usize| count as f64 / actual.len() as f64;
    (fraction(depths), fraction(triangles))
}

/// All lists, of every chunk.
fn all_lists(gpu: &Gpu, images: &DeepImages) -> Vec<Vec<Fragment>> {
    images.chunks.iter().flat_map(|chunk| lists(gpu, images, chunk)).collect()
}

/// Builders that sample the middles of texels agree with exact intersection and with each other.
#[gpu_test]
fn gpu_builders_are_exact_except_at_edges(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let mut baseline = None;
    for builder in [DeepBuilder::PerDirection, DeepBuilder::PerTriangle, DeepBuilder::DepthPeeling] {
        // Touching surfaces may come in either order.
        let images = build(gpu, &scene, DeepImageSettings { merge_texels: 0.5, ..settings(builder) });
        let (chunk, actual) = (&images.chunks[0], all_lists(gpu, &images));
        let exact = exact(gpu, &scene, &images, chunk);
        let (empty, off, false_hits) = compare(&actual, &exact, 1.0 / chunk.grid.texels_per_metre);
        println!("{builder}: empty {empty:.4}, off {off:.4}, false {false_hits:.4}");
        // A texel's middle that lies on an edge may count either way; this affects 0.5 % of them.
        assert!(empty < 0.005 && off < 0.005 && false_hits < 0.005, "{builder}: {empty} {off} {false_hits}");
        let (expected, drawn) = baseline.get_or_insert_with(|| (actual.clone(), images.counts.drawn));
        let (depths, triangles) = differing(&actual, expected, &chunk.grid);
        let more = images.counts.drawn as f64 / *drawn as f64;
        println!(
            "{builder}: {depths:.5} of the lists differ, {triangles:.5} in triangles; {more:.5} times the fragments"
        );
        // Where two surfaces intersect, each builder rounds its depths differently.
        assert!(
            depths < 0.006 && triangles < 0.02 && (more - 1.0).abs() < 1e-3,
            "{builder}: {depths} {triangles} {more}"
        );
        // Negative control: the lists of another image differ.
        let shifted: Vec<_> = exact.iter().cycle().skip(48 * 48).take(exact.len()).cloned().collect();
        let (_, off, _) = compare(&actual, &shifted, 1.0 / chunk.grid.texels_per_metre);
        assert!(off > 0.2 && differing(&actual, &shifted, &chunk.grid).0 > 0.2, "{builder}: {off}");
    }
}

/// Checks the holes of a single pass, without supersampling and with some.
fn check_single_pass(gpu: &Gpu, name: &str) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo(name).unwrap());
    let single =
        |supersampling| holes(gpu, &scene, DeepImageSettings { supersampling, ..settings(DeepBuilder::SinglePass) });
    let [one, two] = [1, 2].map(single);
    println!("{name}: {one:.5?}, with supersampling {two:.5?}");
    assert!(two.missing <= one.missing && two.missing < 0.02, "{name}: {one:?} {two:?}");
    // Negative control of the next check.
    assert!(one.missing > 0.02, "{name}: {one:?}");
}

#[gpu_test]
fn gpu_a_single_pass_leaves_few_holes(gpu: &Gpu) {
    check_single_pass(gpu, "cornell");
}

/// Every surface is stored, not only the first of a texel.
#[gpu_test(full)]
fn gpu_large_scenes_are_stored_by_every_builder(gpu: &Gpu) {
    check_single_pass(gpu, "atrium");
    // One draw per layer of the atrium is slow: three images only.
    let set = |builder, stacks| DeepImageSettings {
        directions: DirectionSet::StacksSlices { stacks, slices: 3 },
        ..settings(builder)
    };
    for (name, settings) in [
        ("atrium", set(DeepBuilder::PerTriangle, 4)),
        ("hall", set(DeepBuilder::PerTriangle, 4)),
        ("atrium", set(DeepBuilder::DepthPeeling, 1)),
    ] {
        let scene = upload(gpu, &lanternfish_scene::generate::demo(name).unwrap());
        let actual = holes(gpu, &scene, settings);
        println!("{name}: {actual:.5?}");
        // A texel's middle on an edge may count either way.
        assert!(actual.missing < 0.002 && actual.spurious < 0.002, "{name}, {}: {actual:?}", settings.builder);
    }
}

/// Points that fragments stand for on the axes of their texels, world space, with their lists.
fn points(gpu: &Gpu, images: &DeepImages) -> Vec<(usize, Vec3)> {
    let chunk = &images.chunks[0];
    let (grid, width) = (&chunk.grid, chunk.grid.resolution as usize);
    let middle = |at: usize| (at as f32 + 0.5) / grid.texels_per_metre - grid.radius;
    let point = |list: usize, depth: f32| {
        let axes = images.directions.frame((list / (width * width)) as u32);
        let across = middle(list % width) * axes.x_axis + middle(list / width % width) * axes.y_axis;
        (list, grid.center + across + depth * axes.z_axis)
    };
    let lists = lists(gpu, images, chunk).into_iter().enumerate();
    lists.flat_map(|(list, all)| all.into_iter().map(move |fragment| point(list, fragment.depth))).collect()
}

/// [Archer2019, fig. 3]: every sample is a fragment of every image, at its own depth. Ours are where the axes of their texels hit.
#[gpu_test]
fn gpu_a_literal_single_pass_keeps_every_sample_as_it_is(gpu: &Gpu) {
    let (right, up) = (Vec3::new(1.0, 0.0, 0.4), Vec3::new(0.0, 1.0, 0.2));
    let scene = upload(gpu, &scene_of(vec![quad(0, Vec3::ZERO, right, up)], vec![Default::default()]));
    let built = |directions, builder| {
        build(gpu, &scene, DeepImageSettings { directions, merge_texels: 0.0, ..settings(builder) })
    };
    // The image that looks as the draw does has every sample on the axis of its texel: there the builders agree.
    let [samples, ours] = [DeepBuilder::SinglePassLiteral, DeepBuilder::SinglePass].map(|builder| {
        let images = built(DirectionSet::Cube { k: 1 }, builder);
        let (image, texels) = (images.directions.nearest(Vec3::Z).0 as usize, 48 * 48);
        let points = points(gpu, &images).into_iter().filter(|(list, _)| list / texels == image);
        points.map(|(_, point)| point).collect::<Vec<_>>()
    });
    assert!(samples.len() > 500 && samples.len() == ours.len(), "{} {}", samples.len(), ours.len());
    assert!(samples.iter().zip(&ours).all(|(a, b)| a.distance(*b) < 1e-4));
    // All images, by his loop.
    let set = settings(DeepBuilder::PerDirection).directions;
    let literal = built(set, DeepBuilder::SinglePassLiteral);
    let grid = &literal.chunks[0].grid;
    let mut expected = vec![Vec::new(); grid.list_count() as usize];
    for image in 0..grid.image_count {
        let axes = literal.directions.frame(image);
        for sample in samples.iter().map(|sample| *sample - grid.center) {
            let texel = |axis: Vec3| (sample.dot(axis) * grid.texels_per_metre + 24.0).floor() as usize;
            let list = (image as usize * 48 + texel(axes.y_axis)) * 48 + texel(axes.x_axis);
            expected[list].push(sample.dot(axes.z_axis));
        }
    }
    let actual = lists(gpu, &literal, &literal.chunks[0]);
    expected.iter_mut().for_each(|depths| depths.sort_by(f32::total_cmp));
    let differs = |(actual, expected): &(&Vec<Fragment>, &Vec<f32>)| {
        let mut depths = actual.iter().zip(*expected);
        actual.len() != expected.len() || depths.any(|(a, b)| (a.depth - b).abs() > 1e-4)
    };
    let differing = actual.iter().zip(&expected).filter(differs).count();
    let filled = expected.iter().filter(|list| !list.is_empty()).count();
    // Samples within rounding of a texel's border.
    assert!(100 * differing < filled, "{differing} of {filled} lists");
    assert_eq!(literal.counts.drawn, samples.len() as u64 * u64::from(grid.image_count));
    let ours = built(set, DeepBuilder::SinglePass);
    assert!(5 * ours.counts.drawn < 4 * literal.counts.drawn, "{:?} {:?}", ours.counts, literal.counts);
    // Fraction of points that are off the surface by more than a tenth of a texel.
    let normal = right.cross(up).normalize();
    let off = |images| {
        let points = points(gpu, images);
        let is_off = |(_, point): &&(usize, Vec3)| normal.dot(*point).abs() * grid.texels_per_metre > 0.1;
        points.iter().filter(is_off).count() as f64 / points.len() as f64
    };
    let (off_literal, off_ours) = (off(&literal), off(&ours));
    assert!(off_ours < 0.02 && off_literal > 0.25, "{off_ours} {off_literal}");
}

/// Difference of the images of `settings` from those of a draw for each direction.
fn holes(gpu: &Gpu, scene: &GpuScene, settings: DeepImageSettings) -> Holes {
    let images = build(gpu, scene, settings);
    let baseline = build(gpu, scene, DeepImageSettings { builder: DeepBuilder::PerDirection, ..settings });
    images.holes(&gpu.device, &gpu.queue, scene, &baseline).unwrap()
}

/// Images of several chunks and slices, the last of which are not full, equal those of one chunk.
#[gpu_test]
fn gpu_images_continue_across_chunks(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let entries = gpu.device.limits().max_storage_buffer_binding_size / 4;
    for (builder, count, images_a_chunk, expected) in [
        (DeepBuilder::PerTriangle, 45, 7, vec![7, 7, 7, 7, 7, 7, 3]),
        (DeepBuilder::PerTriangle, 45, 40, vec![40, 5]),
        (DeepBuilder::DepthPeeling, 20, 7, vec![7, 7, 6]),
    ] {
        let settings = DeepImageSettings { directions: DirectionSet::ZonalEqualArea { count }, ..settings(builder) };
        let single = build(gpu, &scene, settings);
        assert_eq!(single.chunks.len(), 1);
        let fragments_a_texel = entries / (48 * 48 * images_a_chunk);
        let parts = build(gpu, &scene, DeepImageSettings { fragments_a_texel, ..settings });
        let chunks: Vec<u32> = parts.chunks.iter().map(|chunk| chunk.grid.image_count).collect();
        assert_eq!(chunks, expected);
        let [actual, expected] = [&parts, &single].map(|images| all_lists(gpu, images));
        let (depths, triangles) = differing(&actual, &expected, &single.chunks[0].grid);
        assert!(depths < 0.002 && triangles < 0.02, "{builder}, {images_a_chunk} a chunk: {depths} {triangles}");
    }
}

/// All surfaces at one depth are stored.
#[gpu_test]
fn gpu_peeling_keeps_all_surfaces_at_one_depth(gpu: &Gpu) {
    let sheet = quad(0, Vec3::ZERO, 0.4 * Vec3::X, 0.4 * Vec3::Y);
    let scene = upload(gpu, &scene_of(vec![sheet; 5], vec![Default::default()]));
    let [actual, expected] = [DeepBuilder::DepthPeeling, DeepBuilder::PerDirection].map(|builder| {
        let settings = DeepImageSettings {
            directions: DirectionSet::Cube { k: 1 },
            resolution: 16,
            merge_texels: 0.0,
            ..settings(builder)
        };
        all_lists(gpu, &build(gpu, &scene, settings))
    });
    assert!(expected.iter().any(|list| list.len() == 5 && list[0].depth == list[4].depth), "no list of five sheets");
    let triangles = |list: &Vec<Fragment>| list.iter().map(|fragment| fragment.triangle).collect::<Vec<_>>();
    assert!(actual.iter().map(triangles).eq(expected.iter().map(triangles)));
}

/// A triangle much smaller than a texel is in the texel whose axis intersects it.
#[gpu_test]
fn gpu_tiny_triangles_are_in_coarse_images(gpu: &Gpu) {
    let settings = DeepImageSettings {
        directions: DirectionSet::ZonalEqualArea { count: 5 },
        resolution: 4,
        merge_texels: 0.0,
        ..settings(DeepBuilder::PerTriangle)
    };
    // Two corners of a scene of 600 m; between them a square of 1 mm that an axis passes through.
    let corners = [-200.0f32, 200.0].map(|x| quad(0, Vec3::splat(x), 0.1 * Vec3::X, 0.1 * Vec3::Y));
    let built = |primitives: Vec<_>| {
        let scene = upload(gpu, &scene_of(primitives, vec![Default::default()]));
        build(gpu, &scene, settings)
    };
    let without = built(corners.to_vec());
    let grid = &without.chunks[0].grid;
    for image in 0..5 {
        let axes = without.directions.frame(image);
        let at = grid.center + 0.5 / grid.texels_per_metre * (axes.x_axis + axes.y_axis);
        let square = quad(0, at, 5e-4 * axes.x_axis, 5e-4 * axes.y_axis);
        let with = built([corners.to_vec(), vec![square]].concat());
        assert!(with.counts.drawn > without.counts.drawn, "image {image}: {:?}", with.counts);
    }
}

#[test]
fn drivers_that_end_loops_early_get_the_single_pass() {
    let adapter = |driver: &str| wgpu::AdapterInfo {
        driver_info: driver.to_owned(),
        ..wgpu::AdapterInfo::new(wgpu::DeviceType::Cpu, wgpu::Backend::Vulkan)
    };
    let builder = |requested, driver| sound_builder(requested, &adapter(driver));
    assert_eq!(builder(DeepBuilder::PerTriangle, "Mesa 22.3.6"), DeepBuilder::SinglePass);
    assert_eq!(builder(DeepBuilder::PerDirection, "Mesa 22.3.6"), DeepBuilder::PerDirection);
    assert_eq!(builder(DeepBuilder::PerTriangle, "Mesa 25.0.7"), DeepBuilder::PerTriangle);
}
