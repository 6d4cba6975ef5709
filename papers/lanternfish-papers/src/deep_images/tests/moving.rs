//! Deep images of moving scenes, of rotated direction sets, and cached ones.

use glam::{Quat, Vec4};
use lanternfish::{Renderer, Settings, settings::Shadows, view::rotations::frame_rotation};
use lanternfish_gpu::{Bindings, Frame, Profiler, read_back, storage_buffer, storage_buffer_of};

use super::{builders::compare, lists, record, settings, upload};
use crate::{
    DeepBuilder, DeepImageSettings,
    deep_images::{DeepImageBuilder, DeepImages, KeptDeepImages, directions::DirectionSet},
    testing::{self, Random, apart, moved, probe},
};

/// Depths of all lists.
fn depths(gpu: &lanternfish_gpu::Gpu, images: &DeepImages) -> Vec<Vec<f32>> {
    let all = images.chunks.iter().flat_map(|chunk| lists(gpu, images, chunk));
    all.map(|list| list.iter().map(|fragment| fragment.depth).collect()).collect()
}

#[gpu_test]
fn gpu_deep_images_follow_moving_objects(gpu: &Gpu) {
    let before = apart(&lanternfish_scene::generate::demo("cornell").unwrap());
    let after = moved(&before, 5, 0.2);
    let renderer =
        Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(Shadows::BVH)).unwrap();
    let fresh_scene = upload(gpu, &after);
    for builder in [DeepBuilder::SinglePass, DeepBuilder::PerTriangle, DeepBuilder::PerDirection] {
        let mut uploaded = renderer.upload(&before).unwrap();
        let mut of = DeepImageBuilder::new(&gpu.device, settings(builder)).unwrap();
        let first = depths(gpu, &record(gpu, &mut of, &uploaded));
        renderer.update(&mut uploaded, &after).unwrap();
        let [actual, fresh] = [&uploaded, &fresh_scene].map(|scene| depths(gpu, &record(gpu, &mut of, scene)));
        assert!(actual == fresh, "{builder}: lists differ");
        let changed = actual.iter().zip(&first).filter(|(a, b)| a != b).count();
        assert!(5 * changed > actual.len(), "{builder}: {changed} of {} lists", actual.len());
    }
}

#[gpu_test]
fn gpu_the_nearest_image_is_the_hosts_for_any_rotation_of_the_set(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let kernel = probe(gpu, "testing/directions", &[], "nearest");
    let mut random = Random::new(12);
    let queries: Vec<Vec4> = (0..10_000).map(|_| random.direction().extend(0.0)).collect();
    for (set, rotation) in [
        (DirectionSet::ZonalEqualArea { count: 169 }, frame_rotation(1)),
        (DirectionSet::StacksSlices { stacks: 5, slices: 7 }, frame_rotation(2)),
        (DirectionSet::Cube { k: 4 }, frame_rotation(3)),
        (DirectionSet::StacksSlices { stacks: 13, slices: 13 }, Quat::IDENTITY),
        (DirectionSet::ZonalEqualArea { count: 1 }, Quat::IDENTITY),
    ] {
        let settings = DeepImageSettings { directions: set, resolution: 8, ..settings(DeepBuilder::SinglePass) };
        let mut builder = DeepImageBuilder::new(&gpu.device, settings).unwrap();
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let straight = builder.record(&mut frame, &scene).unwrap();
        builder.set_rotation(rotation);
        let images = builder.record(&mut frame, &scene).unwrap();
        let requested = storage_buffer_of(&gpu.device, "queries", &queries, wgpu::BufferUsages::empty()).unwrap();
        let answers = storage_buffer(&gpu.device, "answers", 16 * queries.len() as u64).unwrap();
        let (chunk, of_directions) = (images.chunks[0].bindings(&images.frames), images.direction_bindings());
        let bindings =
            Bindings::new().buffer("queries", &requested).buffer("answers", &answers).with(&chunk).with(&of_directions);
        frame.dispatch(&kernel, &bindings, [queries.len().div_ceil(64) as u32, 1, 1]);
        frame.submit();
        let actual = read_back::<Vec4>(&gpu.device, &gpu.queue, &answers, queries.len()).unwrap();
        let mut elsewhere = 0;
        for (query, actual) in queries.iter().zip(actual) {
            let direction = query.truncate();
            let (image, reversed) = images.directions.nearest(direction);
            let cosine = |image: usize| images.directions.axes()[image].dot(direction);
            // Between two axes that are equally near, either is correct: the rotation is rounded.
            let tied = (cosine(actual.x as usize).abs() - cosine(image as usize).abs()).abs() < 2e-6;
            assert!(tied, "{set:?} {direction}: {actual}, not {image}");
            assert!(actual.x as u32 != image || (actual.y == 1.0) == reversed, "{set:?} {direction}: {actual}");
            elsewhere += usize::from(straight.directions.nearest(direction).0 != image);
        }
        // A set without rotation has other answers.
        assert_eq!(elsewhere > queries.len() / 2, rotation != Quat::IDENTITY, "{elsewhere}");
    }
}

/// A rotated set's images are exact along its own axes, like those of a set without rotation.
#[gpu_test]
fn gpu_images_of_a_rotated_set_follow_its_axes(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let mut builder = DeepImageBuilder::new(&gpu.device, settings(DeepBuilder::PerDirection)).unwrap();
    let mut record = |rotation: Quat| {
        builder.set_rotation(rotation);
        super::record(gpu, &mut builder, &scene)
    };
    let (straight, rotated, back) = (record(Quat::IDENTITY), record(frame_rotation(6)), record(Quat::IDENTITY));
    for (chunk, other) in rotated.chunks.iter().zip(&straight.chunks) {
        let (actual, exact) = (lists(gpu, &rotated, chunk), super::exact(gpu, &scene, &rotated, chunk));
        let texel = 1.0 / chunk.grid.texels_per_metre;
        let (empty, off, false_hits) = compare(&actual, &exact, texel);
        assert!(empty < 0.005 && off < 0.005 && false_hits < 0.005, "{empty} {off} {false_hits}");
        let (_, off, _) = compare(&lists(gpu, &straight, other), &exact, texel);
        assert!(off > 0.2, "{off}");
    }
    assert!(depths(gpu, &back) == depths(gpu, &straight), "a rotation changes later images");
}

#[gpu_test]
fn gpu_images_are_built_again_only_when_something_has_changed(gpu: &Gpu) {
    let renderer =
        Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(Shadows::BVH)).unwrap();
    let mut scene = apart(&lanternfish_scene::generate::demo("cornell").unwrap());
    let mut uploaded = renderer.upload(&scene).unwrap();
    let mut kept = KeptDeepImages::new(&gpu.device, settings(DeepBuilder::SinglePass)).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut evaluate = |kept: &mut KeptDeepImages, uploaded: &lanternfish::GpuScene, rotation: Quat| {
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let images = kept.get(&mut frame, uploaded, rotation).unwrap();
        assert_eq!(images.directions.rotation(), rotation);
        let ends = images.chunks[0].list_starts.clone();
        frame.submit();
        (kept.builds(), ends)
    };
    let straight = Quat::IDENTITY;
    let first = evaluate(&mut kept, &uploaded, straight);
    assert_eq!(first.0, 1);
    // Nothing moves; a light changes.
    assert_eq!(evaluate(&mut kept, &uploaded, straight), first);
    renderer.update(&mut uploaded, &scene).unwrap();
    scene.lights.clear();
    renderer.update(&mut uploaded, &scene).unwrap();
    assert_eq!(evaluate(&mut kept, &uploaded, straight), first);
    // An object moves.
    renderer.update(&mut uploaded, &moved(&scene, 1, 0.1)).unwrap();
    let second = evaluate(&mut kept, &uploaded, straight);
    assert!(second.0 == 2 && second.1 != first.1);
    assert_eq!(evaluate(&mut kept, &uploaded, straight), second);
    // The set is rotated once.
    let rotated = frame_rotation(3);
    assert_eq!(evaluate(&mut kept, &uploaded, rotated).0, 3);
    assert_eq!(evaluate(&mut kept, &uploaded, rotated).0, 3);
    // Another scene.
    let other = renderer.upload(&scene).unwrap();
    assert_eq!(evaluate(&mut kept, &other, rotated).0, 4);
}
