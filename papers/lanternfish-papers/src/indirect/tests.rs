//! What photons and virtual lights both promise. Their own tests use the scenes and helpers of this module.

use glam::{UVec2, Vec3, Vec4};
use lanternfish::{
    RenderedImage, Renderer, Settings,
    settings::{Attenuation, Culling, Indirect, Materials, Samples},
    techniques::{IndirectClamp, Sampled},
};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{Camera, Light, LightKind, Material, Projection, Scene};

use super::{
    photon_splatting::{PhotonSplatting, Splat},
    virtual_lights::{MapSize, MapSource, Ranges, Residual, VirtualLights},
};
use crate::{
    WITHIN_TEXEL,
    testing::{self, light, quad},
};

/// Not a multiple of the workgroup size.
pub(super) const SIZE: UVec2 = UVec2::new(53, 39);
/// Of images whose counters matter, and not their pixels.
pub(super) const TINY: UVec2 = UVec2::new(9, 7);

/// Photons, without the filter.
pub(super) fn photons() -> PhotonSplatting {
    PhotonSplatting { filter_radius: 0, ..PhotonSplatting::default() }
}

/// Virtual lights with as little noise as a small image allows, so that the filter has nothing to spread.
pub(super) fn virtual_lights() -> VirtualLights {
    VirtualLights { stride: 1, filter_radius: 0, clamp: IndirectClamp::Off, ..VirtualLights::default() }
}

/// Rays from every pixel, the ground truth of one bounce.
pub(super) fn rays(diffuse_rays: u32) -> Indirect {
    let clamp = IndirectClamp::Off;
    Sampled { diffuse_rays, filter_radius: 0, clamp, ..Sampled::default().one_bounce() }.into()
}

pub(super) fn settings<I: Into<Indirect>>(indirect: I) -> Settings {
    Settings::direct_light()
        .with_indirect(indirect.into())
        .with_materials(Materials::Lambert)
        .with_attenuation(Attenuation::Physical)
        .with_range_threshold(1e-6)
}

pub(super) fn render(gpu: &Gpu, size: UVec2, settings: Settings, scene: &Scene, camera: &Camera) -> RenderedImage {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    renderer.render(&uploaded, camera, size.into()).unwrap()
}

pub(super) fn energy(rendering: &RenderedImage) -> f64 {
    rendering.radiance.iter().map(|pixel| f64::from(Vec4::from(*pixel).truncate().element_sum())).sum()
}

/// A counter of photons or of virtual lights.
pub(super) fn counter(rendering: &RenderedImage, name: &str) -> f64 {
    let all = &rendering.report.counters;
    let is_it = |label: &str| ["photons", "virtual_lights"].iter().any(|kind| label == format!("{kind}/{name}"));
    all.iter().find(|(label, _)| is_it(label)).unwrap_or_else(|| panic!("no {name} in {all:?}")).1 as f64
}

/// A counted flux of photons, over that of the lights (`FLUX_UNITS` of `photon_splatting/passes.rs`).
pub(super) fn flux(rendering: &RenderedImage, name: &str) -> f64 {
    counter(rendering, name) / f64::from(2).powi(32)
}

pub(super) fn looking(eye: [f32; 3], target: [f32; 3]) -> Camera {
    Camera::look_at(eye.into(), target.into(), Projection::Perspective { fov_y: 0.9, near: 0.02 })
}

/// The Cornell box without its lamp's own light, which rays from pixels would add.
pub(super) fn cornell() -> (Scene, Camera) {
    (light::cornell(), looking([0.0, 1.0, 4.2], [0.0, 1.0, 0.0]))
}

/// A closed cube of 2 m with a lamp in it, and a view of it.
pub(super) fn closed_box() -> (Scene, Camera) {
    let mut scene = light::closed_box(light::matt(0.5));
    scene.lights.push(Light::point(Vec3::new(0.2, 0.3, -0.1), Vec3::splat(2.0)));
    (scene, looking([0.7, -0.3, 0.6], [-1.0, 0.0, -0.6]))
}

/// Every light culling technique lists the lights or photons that reach a pixel in the same order: the image is the same to the bit, also
/// in another renderer.
#[gpu_test]
fn gpu_every_culling_technique_gives_the_same_image(gpu: &Gpu) {
    let (scene, camera) = cornell();
    // Short ranges, so that lists differ from pixel to pixel; far lights, which are in none.
    let lights =
        VirtualLights { ranges: Ranges::Random, most_range: 0.3, count: 300, far_lights: 16, ..virtual_lights() };
    let photons = PhotonSplatting { count: 64, radius: 0.3, ..photons() };
    let techniques = [(Indirect::from(lights), "listed"), (photons.into(), "splatted")];
    for (indirect, listed) in techniques.into_iter().take(if lanternfish_gpu::testing::is_full() { 2 } else { 1 }) {
        let of = |culling, camera: &Camera| {
            render(gpu, SIZE / 2, settings(indirect.clone()).with_culling(culling), &scene, camera)
        };
        let all = of(Culling::NONE, &camera);
        assert!(counter(&all, listed) > 200.0, "{indirect:?}");
        for culling in Culling::all() {
            assert!(of(culling.clone(), &camera).radiance == all.radiance, "{}, {indirect:?}", culling.name());
        }
        let other = of(Culling::NONE, &looking([0.0, 1.0, 4.1], [0.0, 1.0, 0.0]));
        assert!(other.radiance != all.radiance, "insensitive to another view");
    }
}

/// Disks, rectangles and emissive triangles send the flux of their area, in their directions, and their bounce equals that of rays from
/// every pixel.
#[gpu_test]
fn gpu_area_lights_and_emitters_have_their_flux_and_one_bounce(gpu: &Gpu) {
    let (scene, camera) = closed_box();
    // On the ceiling, which they must not light.
    let lamp = |kind| {
        let position = Vec3::new(0.2, 1.0, -0.1);
        let lamp = Light { kind, position, direction: Vec3::NEG_Y, ..scene.lights[0].clone() };
        Scene { lights: vec![lamp], ..scene.clone() }
    };
    let disk = lamp(LightKind::Disk { radius: 0.3 });
    let rectangle = lamp(LightKind::Rectangle { half_width: 0.4, half_height: 0.1, right: Vec3::X });
    let [one_sided, two_sided] = [false, true].map(|double_sided| {
        let mut scene = Scene { lights: Vec::new(), ..scene.clone() };
        scene.meshes[0].primitives.push(quad(1, Vec3::new(0.1, 0.6, 0.0), 0.2 * Vec3::X, 0.2 * Vec3::Z));
        scene.materials.push(Material { emissive: Vec3::splat(10.0), double_sided, ..light::matt(0.0) });
        scene
    });
    // Emissive triangles also contribute their direct light to virtual lights.
    for (what, scene, given) in [
        ("disk", disk, 0.5),
        ("rectangle", rectangle, 0.5),
        ("one side", one_sided, 1.5),
        ("two sides", two_sided, 1.5),
    ] {
        let of = |indirect: Indirect| render(gpu, SIZE / 2, settings(indirect), &scene, &camera);
        let direct = energy(&of(Indirect::NONE));
        let expected = energy(&of(rays(64))) - direct;
        // With redistribution beyond edges for some.
        let photons = of(PhotonSplatting { conserved: what == "two sides", count: 1024, ..photons() }.into());
        let arrived = flux(&photons, "flux_arrived");
        assert!((arrived - 1.0).abs() < 0.01, "{what}: {arrived} of the flux in photons");
        let lights = VirtualLights { map: MapSize::Texels64, count: 2048, far_lights: 512, ..virtual_lights() };
        let lights = of(lights.into());
        // Measured: 6 % in an image of 26 x 19 by 512 photons, whose footprints reach beyond edges.
        for (technique, image) in [("photons", &photons), ("virtual lights", &lights)] {
            let ratio = (energy(image) - direct) / expected;
            assert!((ratio - 1.0).abs() < 0.08, "{what}, {technique}: {ratio} of the energy");
        }
        for source in [MapSource::Rays, MapSource::Raster] {
            let technique = VirtualLights { map: MapSize::Texels64, source, count: 0, ..virtual_lights() };
            let image = render(gpu, TINY, settings(technique), &scene, &camera);
            let sent = counter(&image, "flux_sent") / (256.0 * 64.0 * 64.0);
            assert!((sent / given - 1.0).abs() < 0.02, "{what}, {source}: {sent} of {given} in virtual lights");
        }
    }
}

/// A scene without lights, and one whose light reaches nothing, are dark and give no error.
#[gpu_test]
fn gpu_no_light_is_no_indirect_light(gpu: &Gpu) {
    let (scene, camera) = closed_box();
    let none = Scene { lights: Vec::new(), ..scene.clone() };
    let lost = Light { position: Vec3::splat(50.0), range: Some(1.0), ..scene.lights[0].clone() };
    let lost = Scene { lights: vec![lost], ..scene };
    let lights = |residual| Indirect::from(VirtualLights { count: 64, residual, ..VirtualLights::default() });
    let photons = PhotonSplatting { bounces: 2, conserved: true, ..PhotonSplatting::default() };
    let raster = PhotonSplatting { splat: Splat::Raster, tracer: WITHIN_TEXEL.into(), ..photons };
    for (scene, indirect, samples, counted) in [
        (&none, lights(Residual::Lost), Samples::One, "listed"),
        (&none, lights(Residual::Scaled), Samples::One, "listed"),
        (&none, lights(Residual::FarLights), Samples::Four, "listed"),
        (&lost, lights(Residual::FarLights), Samples::One, "listed"),
        (&none, photons.into(), Samples::One, "landed"),
        (&none, raster.into(), Samples::One, "landed"),
    ] {
        let image = render(gpu, TINY, settings(indirect.clone()).with_samples(samples), scene, &camera);
        assert_eq!((energy(&image), counter(&image, counted)), (0.0, 0.0), "{indirect:?}, {samples}");
    }
}
