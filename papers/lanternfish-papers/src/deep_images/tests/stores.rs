//! The lists of each store.

use glam::{Affine3A, Vec3};
use lanternfish::{GpuScene, Renderer, Settings, settings::Shadows};
use lanternfish_gpu::{Frame, Profiler};

use super::{build, lists, settings, upload};
use crate::{
    DeepBuilder, DeepImageSettings,
    deep_images::{DeepImageBuilder, directions::DirectionSet},
    testing::{self, quad, scene_of},
};

#[gpu_test]
fn gpu_lists_do_not_depend_on_the_order_of_atomics(gpu: &Gpu) {
    let scene = upload(gpu, &lanternfish_scene::generate::demo("atrium").unwrap());
    for builder in [DeepBuilder::SinglePass, DeepBuilder::PerTriangle] {
        let once = build(gpu, &scene, settings(builder));
        for _ in 0..2 {
            let again = build(gpu, &scene, settings(builder));
            assert_eq!(once.counts, again.counts);
            for (a, b) in once.chunks.iter().zip(&again.chunks) {
                assert_eq!(lists(gpu, &once, a), lists(gpu, &again, b));
            }
        }
    }
}

/// More fragments than a binding holds, in three images: each single image fits.
#[gpu_test(full)]
fn gpu_images_that_are_too_full_for_one_chunk_are_split(gpu: &Gpu) {
    let test = "gpu_images_that_are_too_full_for_one_chunk_are_split";
    let limit = gpu.device.limits().max_storage_buffer_binding_size / 4;
    let (sheets, resolution) = (150u32, 512u32);
    if limit > 1 << 25 {
        // Overflow would need a larger scene.
        return testing::left_out(test, "this adapter's bindings are too large to be filled");
    }
    let sheet = |axis: Vec3, i: u32| {
        let (right, up) = axis.any_orthonormal_pair();
        quad(0, (i as f32 / sheets as f32 - 0.5) * 0.8 * axis, 0.4 * right, 0.4 * up)
    };
    let all = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| (0..sheets).map(move |i| sheet(axis, i)));
    let mut flat = scene_of(all.collect(), vec![Default::default()]);
    let with_rays = Settings::direct_light().with_shadows(Shadows::BVH);
    let renderer = Renderer::with_engine(&testing::engine(gpu), with_rays).unwrap();
    let mut scene = renderer.upload(&flat).unwrap();
    let settings = DeepImageSettings {
        directions: DirectionSet::Cube { k: 1 },
        resolution,
        fragments_a_texel: 1,
        merge_texels: 0.0,
        ..settings(DeepBuilder::PerTriangle)
    };
    let images = build(gpu, &scene, settings);
    let chunks: Vec<u32> = images.chunks.iter().map(|chunk| chunk.grid.image_count).collect();
    println!("{} fragments in chunks of {chunks:?} images", images.counts.drawn);
    assert!(images.counts.drawn > limit && images.counts.kept == images.counts.drawn, "{:?}", images.counts);
    assert_eq!(chunks, [1, 1, 1]);
    // A moved scene is not tried in one chunk again.
    let mut builder = DeepImageBuilder::new(&gpu.device, settings).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut passes = |uploaded: &GpuScene| {
        let before = profiler.compute_passes();
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        builder.record(&mut frame, uploaded).unwrap();
        frame.submit();
        profiler.compute_passes() - before
    };
    let [first, again] = [(), ()].map(|()| passes(&scene));
    flat.instances[0].world_from_object = Affine3A::from_translation(0.01 * Vec3::X);
    let generation = scene.generation();
    renderer.update(&mut scene, &flat).unwrap();
    assert_ne!(scene.generation(), generation);
    let then = passes(&scene);
    assert!(then == again && again < first, "{first} passes, {again}, {then} after a motion");
}

/// 10,000 surfaces behind each other: a list of this length is sorted in subquadratic time.
#[gpu_test]
fn gpu_long_lists_are_sorted(gpu: &Gpu) {
    let test = "gpu_long_lists_are_sorted";
    if lanternfish::gpu_scene::automatic_anisotropy(&gpu.device.adapter_info()) == 1 {
        return testing::left_out(
            test,
            "this driver ends a shader's loops after 65,536 iterations: 4 of 40,000 fragments are left",
        );
    }
    let sheets = (0..10_000u32).map(|i| {
        // In no order of depth.
        let z = (i * 7919 % 10_000) as f32 / 5_000.0 - 1.0;
        quad(0, Vec3::new(0.0, 0.0, z), 0.4 * Vec3::X, 0.4 * Vec3::Y)
    });
    let scene = upload(gpu, &scene_of(sheets.collect(), vec![Default::default()]));
    let settings = DeepImageSettings {
        directions: DirectionSet::Cube { k: 1 },
        resolution: 4,
        merge_texels: 0.0,
        ..settings(DeepBuilder::SinglePass)
    };
    let images = build(gpu, &scene, settings);
    let longest =
        images.chunks.iter().flat_map(|chunk| lists(gpu, &images, chunk)).map(|list| list.len()).max().unwrap();
    assert!(longest >= 10_000, "{longest}");
}
