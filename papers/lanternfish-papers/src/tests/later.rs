//! Frames with deferred readback.

use glam::Vec3;
use lanternfish::{
    RenderError, Renderer, Target, ViewRequest,
    settings::{Culling, Exposure, Shadows},
    techniques::Sampled,
};
use lanternfish_gpu::{Growth, faulty_software};
use lanternfish_scene::{Camera, Light, Material, Projection, Scene, generate::demo};

use crate::{
    ACROSS_TEXELS, Deep, DeepBuilder, DeepImageSettings, DeepStore, DirectionSet, RasterGrid, VirtualLights,
    WITHIN_TEXEL,
    indirect::virtual_lights::MapSize,
    testing::{
        self, inside,
        later::{Path, check, settings, walk},
        quad, scene_of,
    },
};

#[gpu_test]
fn gpu_deferred_frames_with_a_raster_grid_show_only_complete_images(gpu: &Gpu) {
    let scene = demo("atrium").unwrap();
    let camera = scene.cameras[0].clone();
    let step = |i: usize| (camera.clone(), [10, 3000, 10, 6000][i / 6 % 4]);
    let path = Path { scene: scene.clone(), range: 3.0, size: [32, 24], step: &step, frames: 24 };
    check(&walk(gpu, &settings(RasterGrid::default().into()), &path));
}

/// Thin dielectrics behind each other: more fragments per texel than the initial capacity.
fn thin_dielectrics() -> Scene {
    let thin_dielectric = |i: usize| quad(0, Vec3::new(0.0, 0.0, -0.02 * i as f32), Vec3::X, Vec3::Y);
    let mut scene =
        scene_of((0..90).map(thin_dielectric).collect(), vec![Material { double_sided: true, ..Material::default() }]);
    scene.lights.push(Light::point(Vec3::new(0.3, 0.4, 2.0), Vec3::splat(9.0)));
    scene.sky = Vec3::splat(0.4);
    scene
}

/// With deep images too: for shadows, indirect light, occlusion, and ranges of virtual lights, whose lists grow as well.
#[gpu_test]
fn gpu_deep_images_grow_in_later_frames(gpu: &Gpu) {
    let test = "gpu_deep_images_grow_in_later_frames";
    if faulty_software(&gpu.device.adapter_info()) {
        return testing::left_out(test, "this driver crashes on shadows through deep images");
    }
    let scene = thin_dielectrics();
    let camera =
        Camera::look_at(Vec3::new(0.4, 0.2, 2.5), Vec3::ZERO, Projection::Perspective { fov_y: 0.9, near: 0.02 });
    let step = |i: usize| (camera.clone(), [0, 300][i / 6 % 2]);
    let path = Path { scene: scene.clone(), range: 3.0, size: [48, 32], step: &step, frames: 18 };
    let deep_images =
        DeepImageSettings { resolution: 96, directions: DirectionSet::Cube { k: 3 }, ..DeepImageSettings::default() };
    let direct = settings(Culling::default()).with_structure(deep_images).with_exposure(Exposure::Ev(0.0));
    let sampled =
        Sampled { tracer: WITHIN_TEXEL.into(), diffuse_rays: 1, glossy_rays: 0, ..Sampled::default().one_bounce() };
    let few = VirtualLights { count: 300, map: MapSize::Texels64, ..VirtualLights::default() };
    for (name, settings) in [
        ("shadows", direct.clone().with_shadows(Shadows::Traced(ACROSS_TEXELS))),
        ("indirect", direct.clone().with_indirect(sampled)),
        ("occlusion", direct.clone().with_occlusion(Deep::default())),
        ("virtual lights", direct.clone().with_indirect(few)),
    ] {
        let outcome = walk(gpu, &settings, &path);
        println!("{name}: {outcome:?}");
        check(&outcome);
    }
}

#[gpu_test]
fn gpu_deferred_frames_replace_builders_and_refuse_stores_that_need_blocking_readback(gpu: &Gpu) {
    let coarse = DeepImageSettings { resolution: 8, ..DeepImageSettings::default() };
    let renderer = |deep_images: DeepImageSettings| {
        let settings = settings(Culling::default()).with_occlusion(Deep::default()).with_structure(deep_images);
        Renderer::with_engine(&testing::engine(gpu), settings).unwrap()
    };
    let mut linked = renderer(DeepImageSettings { store: DeepStore::LinkedList, ..coarse });
    assert!(matches!(linked.set_growth(Growth::Deferred), Err(RenderError::Together { .. })));
    let mut scene = demo("cornell").unwrap();
    scene.sky = Vec3::ONE;
    // A frame in the caller's commands does not wait either.
    let uploaded = linked.upload(&scene).unwrap();
    let view = [ViewRequest::of_camera(1, &scene.cameras[0], [16, 16], Target::Own)];
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    assert!(matches!(linked.record(&mut commands, &uploaded, &view), Err(RenderError::Together { .. })));
    assert_eq!(inside::growth(&mut linked), Growth::Blocking);
    linked.set_growth(Growth::Blocking).unwrap();

    let image = |builder: DeepBuilder, growth: Growth| {
        let mut renderer = renderer(DeepImageSettings { builder, ..coarse });
        renderer.set_growth(growth).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.render(&uploaded, &scene.default_camera(1.0), [16, 16]).unwrap().radiance
    };
    let expected = image(DeepBuilder::PerTriangle, Growth::Deferred);
    for builder in [DeepBuilder::SinglePass, DeepBuilder::DepthPeeling] {
        assert!(image(builder, Growth::Deferred) == expected, "{builder:?}");
    }
    assert!(image(DeepBuilder::SinglePass, Growth::Blocking) != expected, "with few texels a single pass misses some");
}
