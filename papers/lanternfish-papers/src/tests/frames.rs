//! Resource creation, caching and results of frames with techniques of this crate.

use glam::{Vec3, Vec4};
use lanternfish::{
    RenderError, Renderer, Settings, Target, ViewRequest,
    settings::{History, Materials, Samples, Shadows},
    techniques::Sampled,
};
use lanternfish_gpu::{Frame, Gpu, Growth, Profiler, read_texture};
use lanternfish_scene::{Camera, Light, Material, Scene, generate::demo};

use crate::{
    ACROSS_TEXELS, Deep, DeepImageSettings, DirectionSet, Hbao, PhotonSplatting, RasterGrid, VirtualLights,
    WITHIN_TEXEL,
    deep_images::DeepImageBuilder,
    testing::{
        self, engine, inside,
        light::{cornell, rendering, sampled, settings},
        shared::{self, shared_and_refused},
        steady::{Frames, check_steady},
    },
};

fn bvh() -> Settings {
    Settings::direct_light().with_shadows(Shadows::BVH)
}

fn coarse() -> DeepImageSettings {
    DeepImageSettings { directions: DirectionSet::Cube { k: 1 }, resolution: 8, ..DeepImageSettings::default() }
}

fn occlusion(resolution: u32, others: Settings) -> Settings {
    others
        .with_occlusion(Deep::default())
        .with_structure(DeepImageSettings { resolution, ..DeepImageSettings::default() })
}

#[gpu_test]
fn gpu_a_steady_state_frame_creates_no_resources(gpu: &Gpu) {
    let scene = demo("atrium").unwrap();
    let few = VirtualLights { count: 500, ..VirtualLights::default() };
    let settings = bvh().with_indirect(few).with_culling(RasterGrid::default());
    let name = "virtual lights in a raster grid";
    check_steady(gpu, &scene, Frames { name, is_averaged: false, growth: Growth::Deferred, settings });
}

/// After an error no cached result of a frame is used: the device may have failed to create it, or never have run the passes that fill it.
#[gpu_test]
fn gpu_after_an_error_frames_begin_again(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let structure = DeepImageSettings { resolution: 16, ..DeepImageSettings::default() };
    let settings = Settings::direct_light().with_shadows(Shadows::Traced(ACROSS_TEXELS)).with_structure(structure);
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let render = |renderer: &mut Renderer| {
        let rendering = renderer.render(&uploaded, &scene.cameras[0], [32, 24]).unwrap();
        (rendering.radiance, inside::structure_builds(renderer), inside::kept_bytes(renderer))
    };
    let (radiance, builds, bytes) = render(&mut renderer);
    assert_eq!(render(&mut renderer), (radiance.clone(), builds, bytes), "a cached result is used after an error");
    inside::fail(&mut renderer);
    assert!(inside::kept_bytes(&mut renderer) < bytes, "nothing was dropped");
    assert_eq!(render(&mut renderer), (radiance, builds.map(|builds| builds + 1), bytes));
}

#[gpu_test]
fn gpu_deep_images_are_built_for_each_rotation_of_the_set(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let views = [(&scene.cameras[0], [32, 24])];
    let structure = DeepImageSettings { resolution: 16, ..DeepImageSettings::default() };
    let indirect = Sampled { tracer: WITHIN_TEXEL.into(), ..Sampled::default() };
    let settings = Settings::default().with_accumulate(10).with_structure(structure).with_indirect(indirect);
    let mut renderer = Renderer::with_engine(&engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let after: Vec<_> = (0..10)
        .map(|_| {
            renderer.refine(&uploaded, &views).unwrap();
            inside::structure_builds(&renderer).unwrap()
        })
        .collect();
    assert_eq!(after, [1, 1, 1, 1, 2, 2, 2, 2, 3, 3]);
    // Another mean starts with the first rotation again.
    renderer.render_views(&uploaded, &views).unwrap();
    assert_eq!(inside::structure_builds(&renderer), Some(6));
}

#[gpu_test]
fn gpu_a_shared_scene_is_the_same_image_or_is_refused(gpu: &Gpu) {
    let rays = Sampled { diffuse_rays: 2, glossy_rays: 1, tracer: WITHIN_TEXEL.into(), ..Sampled::default() };
    let direct = || bvh().with_structure(coarse());
    let choices = vec![
        ("no shadows", direct().with_shadows(Shadows::None)),
        ("bvh", direct()),
        ("hbao", direct().with_occlusion(Hbao { radius: 1.0, ..Hbao::default() }).with_shadows(Shadows::None)),
        ("indirect, deep images", direct().with_indirect(rays)),
    ];
    let (same, refused) = shared_and_refused(gpu, choices);
    assert!(same >= 6 && refused >= 6, "{same} shared, {refused} refused");

    let without = shared::renderer(gpu, Settings::direct_light().with_shadows(Shadows::None));
    let uploaded = without.upload(&shared::scene()).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let built = DeepImageBuilder::new(&gpu.device, coarse()).unwrap().record(&mut frame, &uploaded);
    assert!(matches!(built, Err(RenderError::OtherSettings { .. })), "{built:?}");
}

/// A single image and a mean of frames use no history, with the history setting on or off.
#[gpu_test]
fn gpu_a_first_frame_and_its_mean_use_no_history(gpu: &Gpu) {
    let scene = Scene { sky: Vec3::ONE, ..cornell() };
    let usual = settings(sampled(lanternfish::settings::Tracer::BVH));
    for (accumulate, samples) in [(1, Samples::One), (3, Samples::Four)] {
        for (name, settings) in [
            ("lights", usual.clone().with_indirect(VirtualLights { count: 256, ..VirtualLights::default() })),
            ("photons", usual.clone().with_indirect(PhotonSplatting { count: 256, ..PhotonSplatting::default() })),
            ("occlusion", occlusion(32, bvh().with_shadows(Shadows::None))),
        ] {
            let settings = settings.with_accumulate(accumulate).with_samples(samples);
            let [off, on] = [History::Off, History::On]
                .map(|history| rendering(gpu, settings.clone().with_history(history), &scene, &scene.cameras[0]));
            assert!(off == on, "{accumulate} frames, {samples:?}, {name}");
        }
    }
}

fn texture(gpu: &Gpu) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width: 48, height: 32, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

fn halves(gpu: &Gpu, view: &wgpu::TextureView) -> Vec<[f32; 4]> {
    let texels: Vec<[u16; 4]> = read_texture(&gpu.device, &gpu.queue, view.texture()).unwrap();
    texels.into_iter().map(|texel| texel.map(|bits| half::f16::from_bits(bits).to_f32())).collect()
}

/// The sums of a white surface are direct light plus that of the environment; surfaces are the scene's.
#[gpu_test]
fn gpu_sums_of_white_surfaces_are_the_image_with_occlusion(gpu: &Gpu) {
    let mut scene = demo("cornell").unwrap();
    for material in &mut scene.materials {
        *material = Material { base_color: Vec4::ONE, double_sided: material.double_sided, ..Material::default() };
    }
    scene.lights.push(Light::point(Vec3::new(0.3, 1.2, 0.4), Vec3::splat(2.0)));
    scene.sky = Vec3::splat(0.2);
    let camera: &Camera = &scene.cameras[0];
    let settings = occlusion(32, bvh().with_materials(Materials::Lambert));
    let mut waiting = Renderer::new(&gpu.device, &gpu.queue, settings.clone()).unwrap();
    let uploaded = waiting.upload(&scene).unwrap();
    let expected = waiting.render(&uploaded, camera, [48, 32]).unwrap().radiance;
    let [direct, indirect] = [(); 2].map(|()| texture(gpu));
    let view =
        [ViewRequest::of_camera(1, camera, [48, 32], Target::Demodulated { direct: &direct, indirect: &indirect })];
    let mut renderer = Renderer::with_engine(waiting.engine(), settings).unwrap();
    renderer.ready(&uploaded, &view).unwrap();
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    let frame = renderer.record(&mut commands, &uploaded, &view).unwrap();
    gpu.queue.submit([commands.finish()]);
    renderer.submitted(frame);
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let (direct, indirect) = (halves(gpu, &direct), halves(gpu, &indirect));
    assert!(indirect.iter().any(|texel| texel[..3].iter().any(|c| *c > 0.01)));
    // Halves are rounded by 2^-11, and normals and positions differ slightly: at edges of shadows a ray may end elsewhere.
    let covered = || expected.iter().enumerate().filter(|(_, texel)| texel[3] == 1.0);
    let is_off = |(i, expected): &(usize, &[f32; 4])| {
        (0..3).any(|c| (direct[*i][c] + indirect[*i][c] - expected[c]).abs() > 0.004 * expected[c] + 1e-4)
    };
    let (off, covered) = (covered().filter(is_off).count(), covered().count());
    assert!(covered > 500 && off * 50 < covered, "{off} of {covered} pixels are off");
}
