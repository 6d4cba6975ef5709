//! Deep images against exact intersection, and against each other.

mod builders;
mod combinations;
mod crossings;
mod faults;
mod moving;
mod plain;
mod slices;
mod sorts;
mod stores;
mod tracers;

use glam::Vec3;
use lanternfish::{
    Renderer, Settings,
    gpu_scene::GpuScene,
    rays::{RayTracer, TracedRay, TracedStructure},
    settings::{Shadows, Tracer},
};
use lanternfish_gpu::{Frame, Gpu, Profiler, read_back};
use lanternfish_scene::Scene;

use super::{Chunk, DeepFrame, DeepImageBuilder, DeepImages, Fragment, cpu_reference, directions::DirectionSet};
use crate::{DeepBuilder, DeepImageSettings};

/// Uploads for the BVH, whose triangles the builders draw.
pub(super) fn upload(gpu: &Gpu, scene: &Scene) -> GpuScene {
    let settings = Settings::direct_light().with_shadows(Shadows::BVH);
    Renderer::with_engine(&crate::testing::engine(gpu), settings).unwrap().upload(scene).unwrap()
}

pub(super) fn build(gpu: &Gpu, scene: &GpuScene, settings: DeepImageSettings) -> DeepImages {
    record(gpu, &mut DeepImageBuilder::new(&gpu.device, settings).unwrap(), scene)
}

fn record(gpu: &Gpu, builder: &mut DeepImageBuilder, scene: &GpuScene) -> DeepImages {
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let images = builder.record(&mut frame, scene).unwrap();
    frame.submit();
    images
}

/// A chunk's lists, after checking every invariant.
pub(super) fn lists(gpu: &Gpu, images: &DeepImages, chunk: &Chunk) -> Vec<Vec<Fragment>> {
    images.read_lists(&gpu.device, &gpu.queue, chunk).unwrap()
}

/// Hit distances of rays, m; −1 if they hit nothing.
fn distances(
    gpu: &Gpu,
    tracer: &RayTracer,
    scene: &GpuScene,
    (through, images): (Tracer, Option<&DeepImages>),
    rays: &[TracedRay],
) -> Vec<f32> {
    let buffer = tracer.upload(&gpu.device, rays).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let distances = tracer
        .record(
            &mut frame,
            scene,
            through,
            images.map(|images| images as &dyn TracedStructure),
            &buffer,
            rays.len() as u32,
        )
        .unwrap();
    frame.submit();
    read_back::<f32>(&gpu.device, &gpu.queue, &distances, rays.len()).unwrap()
}

/// Triangles in the device's order.
pub(super) fn triangles(gpu: &Gpu, scene: &GpuScene) -> Vec<[Vec3; 3]> {
    let count = scene.traced_triangles() as usize;
    let words = read_back::<[f32; 12]>(&gpu.device, &gpu.queue, scene.bvh_triangles().unwrap(), count).unwrap();
    words.iter().map(|w| [Vec3::from_slice(w), Vec3::from_slice(&w[4..]), Vec3::from_slice(&w[8..])]).collect()
}

/// Axes of an image.
fn frame_of(images: &DeepImages, image: u32) -> DeepFrame {
    let axes = images.directions.frame(image);
    DeepFrame { x: axes.x_axis, y: axes.y_axis, z: axes.z_axis, ..DeepFrame::default() }
}

/// The lists of a chunk by exact intersection.
fn exact(gpu: &Gpu, scene: &GpuScene, images: &DeepImages, chunk: &Chunk) -> Vec<Vec<Fragment>> {
    let triangles = triangles(gpu, scene);
    let all = (0..chunk.grid.image_count).flat_map(|image| {
        cpu_reference::image(&chunk.grid, &frame_of(images, chunk.grid.first_image + image), &triangles)
    });
    all.map(|list| cpu_reference::merge(&list, chunk.grid.merge_distance)).collect()
}

pub(super) fn settings(builder: DeepBuilder) -> DeepImageSettings {
    DeepImageSettings {
        directions: DirectionSet::StacksSlices { stacks: 4, slices: 5 },
        resolution: 48,
        builder,
        ..DeepImageSettings::default()
    }
}
