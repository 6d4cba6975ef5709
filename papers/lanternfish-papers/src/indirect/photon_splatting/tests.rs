mod differentials;

use std::f32::consts::PI;

use glam::{UVec2, Vec3, Vec4};
use lanternfish::{
    RenderedImage,
    rays::Structure,
    settings::{Indirect, Materials, Tracer},
};
use lanternfish_scene::{Camera, Light, LightKind, Material, Projection};

use super::{PhotonSplatting, Splat, passes};
use crate::{
    DeepImageSettings, WITHIN_TEXEL,
    indirect::tests::{
        SIZE, TINY, closed_box, cornell, counter, energy, flux, looking, photons, rays, render, settings,
    },
    testing::{self, quad},
};

/// Light is conserved: the flux that lands after each bounce is the lights' flux times the albedo to the power of the bounce, through the
/// BVH and through deep images [the furnace's series].
#[gpu_test]
fn gpu_landed_flux_is_the_lights_flux_times_the_albedo(gpu: &Gpu) {
    let (scene, camera) = closed_box();
    // Through deep images a few photons in a hundred start in a texel beside the wall that they leave.
    for (tracer, bounces, most) in [(Tracer::BVH, 1, 1e-3), (Tracer::BVH, 3, 3e-3), (WITHIN_TEXEL, 2, 0.03)] {
        let technique = PhotonSplatting { tracer: tracer.into(), bounces, count: 1024, ..photons() };
        let rendering = render(gpu, TINY, settings(technique), &scene, &camera);
        // A texel's fraction of the sphere is evaluated at one of its points.
        let arrived = flux(&rendering, "flux_arrived");
        assert!((arrived - 1.0).abs() < 0.01, "{tracer}: {arrived}");
        let (landed, expected) = (flux(&rendering, "flux_landed") / arrived, 1.0 - 0.5f64.powi(bounces as i32));
        assert!((landed / expected - 1.0).abs() < most, "{tracer}, {bounces} bounces: {landed} of {expected}");
    }
    // Negative control: a box without one wall loses flux.
    let mut open = scene;
    open.meshes[0].primitives.pop();
    let rendering = render(gpu, TINY, settings(photons()), &open, &camera);
    let [landed, reflected] = ["flux_landed", "flux_reflected"].map(|name| flux(&rendering, name));
    assert!(counter(&rendering, "escaped") > 0.0 && landed < 0.9 * reflected, "{landed} of {reflected}");
}

/// Pixels show all of the light that lands on the walls of a closed cube, visible from its middle: nothing is lost at edges or in the sums.
#[gpu_test]
fn gpu_all_of_the_light_that_lands_is_visible(gpu: &Gpu) {
    let size = UVec2::splat(20);
    let (scene, _) = closed_box();
    let cameras = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z].map(|way| {
        let up = if way.y == 0.0 { Vec3::Y } else { Vec3::X };
        let camera = Camera::look_at(Vec3::ZERO, way, Projection::Perspective { fov_y: 0.5 * PI, near: 0.02 });
        Camera {
            world_from_camera: glam::Affine3A::from_mat3(glam::Mat3::from_cols(way.cross(up), up, -way)),
            ..camera
        }
    });
    let seen = |indirect: Indirect| {
        let images = cameras.each_ref().map(|camera| render(gpu, size, settings(indirect.clone()), &scene, camera));
        (images.iter().map(energy).sum::<f64>(), images.into_iter().next().expect("six"))
    };
    let (direct, _) = seen(Indirect::NONE);
    let few = PhotonSplatting { count: 512, ..photons() };
    for (what, most, technique) in [
        ("usual", 0.03, few),
        // Loss beyond a footprint's reach at grazing incidence.
        ("conserved", 0.01, PhotonSplatting { conserved: true, radius: 0.5, ..few }),
        ("raster", 0.01, PhotonSplatting { splat: Splat::Raster, count: 128, radius: 0.5, conserved: true, ..few }),
        ("deep images", 0.06, PhotonSplatting { tracer: WITHIN_TEXEL.into(), ..few }),
    ] {
        let (all, image) = seen(technique.into());
        // Each pixel shows the same area of a wall, 4 m² in total, of albedo 0.5. The lamp has 2 cd.
        let lumen = (all - direct) / 3.0 * f64::from(PI / 0.5) * 4.0 / f64::from(size.element_product());
        let visible = lumen / (8.0 * std::f64::consts::PI * flux(&image, "flux_reflected"));
        assert!((visible - 1.0).abs() < most, "{what}: {visible}");
    }
}

/// Any chunk size gives the same image to the bit; rasterized splats differ only by the order of sums.
#[gpu_test]
fn gpu_photons_are_the_same_for_every_splatting_method(gpu: &Gpu) {
    let (scene, camera) = cornell();
    let technique = PhotonSplatting { count: 200, radius: 0.5, bounces: 2, ..photons() };
    let of = |technique| render(gpu, SIZE, settings(technique), &scene, &camera);
    let all = of(technique);
    assert!(counter(&all, "splatted") > 10_000.0);
    assert!(of(PhotonSplatting { chunk: 1024, ..technique }).radiance == all.radiance, "chunks");
    assert!(of(PhotonSplatting { radius: 0.4, ..technique }).radiance != all.radiance, "insensitive to the radius");
    let drawn = of(PhotonSplatting { splat: Splat::Raster, ..technique });
    let again = of(PhotonSplatting { splat: Splat::Raster, chunk: 4096, ..technique });
    for rendering in [&drawn, &again] {
        let far = rendering.radiance.iter().zip(&all.radiance).filter(|(a, b)| {
            let (a, b) = (Vec4::from(**a).truncate(), Vec4::from(**b).truncate());
            (a - b).abs().max_element() > 2e-3 * b.max_element().max(1e-3)
        });
        assert_eq!(far.count(), 0);
    }
    assert!(of(PhotonSplatting { splat: Splat::Raster, ..technique }).radiance == drawn.radiance, "runs differ");
}

/// One bounce in the Cornell box has the energy of rays from every pixel, and a mean of frames is nearer to them per pixel than one frame.
#[gpu_test]
fn gpu_the_light_of_photons_is_that_of_one_bounce(gpu: &Gpu) {
    let (scene, camera) = cornell();
    // Frames of a mean sample other positions in their pixels: all three are means of the same number of frames.
    let rendering = |indirect: Indirect, accumulate| {
        render(gpu, SIZE, settings(indirect).with_accumulate(accumulate), &scene, &camera)
    };
    let references =
        [1, 4].map(|frames| (frames, rendering(Indirect::NONE, frames), rendering(rays(64 / frames), frames)));
    // Energy, and distance of pixels, over the energy of one bounce.
    let of = |technique: PhotonSplatting, which: usize| {
        let (frames, direct, ground_truth) = &references[which];
        let photons = rendering(Indirect::from(technique), *frames);
        let one_bounce = energy(ground_truth) - energy(direct);
        let off = |(a, b): (&[f32; 4], &[f32; 4])| f64::from((Vec4::from(*a) - Vec4::from(*b)).abs().max_element());
        let distance = photons.radiance.iter().zip(&ground_truth.radiance).map(off).sum::<f64>();
        [(energy(&photons) - energy(direct)) / one_bounce, distance / one_bounce]
    };
    // 4 % are lost beyond the blocks' edges, where a pixel is 5 cm wide; deep images lose another 1 % beside walls.
    for (tracer, lost) in [(Tracer::BVH, 0.05), (WITHIN_TEXEL, 0.07)] {
        let [ratio, _] = of(PhotonSplatting { tracer: tracer.into(), ..photons() }, 0);
        assert!((ratio - 1.0).abs() < lost, "{tracer}: {ratio}");
    }
    // With so few photons, noise dominates the error.
    let [[_, one_off], [many, many_off]] = [0, 1].map(|which| of(PhotonSplatting { count: 128, ..photons() }, which));
    assert!(many_off < 0.7 * one_off && (many - 1.0).abs() < 0.07, "{many_off} of {one_off}; energy {many}");
}

/// A mirror reflects a beam: it lights the wall that it hits, with the flux that the mirror reflects.
#[gpu_test]
fn gpu_a_mirror_reflects_light_onto_a_wall(gpu: &Gpu) {
    // The floor is a mirror, the lamp a narrow spot that points at it at 45 degrees.
    let mut scene = closed_box().0;
    scene.meshes[0].primitives[2] = quad(1, -Vec3::Y, Vec3::Z, Vec3::X);
    let mirror = Material {
        metallic: 1.0,
        perceptual_roughness: 0.05,
        base_color: Vec4::ONE,
        double_sided: true,
        ..Material::default()
    };
    scene.materials.push(mirror);
    let spot = LightKind::Spot { inner_angle: 0.1, outer_angle: 0.2 };
    let light = Light::point(Vec3::new(-0.9, -0.1, 0.0), Vec3::splat(5.0));
    scene.lights = vec![Light { kind: spot, direction: Vec3::new(1.0, -1.0, 0.0).normalize(), ..light }];
    let camera = looking([-0.9, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let settings = settings(PhotonSplatting { radius: 1.0, ..photons() }).with_materials(Materials::File);
    let rendering = render(gpu, SIZE, settings, &scene, &camera);
    // The beam continues to the right wall, 1 m above the floor, which reflects it in the middle: (1, 0, 0).
    let about = |x: usize, y: usize| -> f32 {
        let pixels = (y - 3..y + 4).flat_map(|y| (x - 3..x + 4).map(move |x| y * SIZE.x as usize + x));
        pixels.map(|i| Vec4::from(rendering.radiance[i]).truncate().element_sum()).sum::<f32>() / 49.0
    };
    // 5 cd from a distance of 2.69 m, at 45 degrees, on a surface of albedo 0.5; summed over three channels.
    let expected = 3.0 * 5.0 / (2.687 * 2.687) * 0.707 * 0.5 / PI;
    let (middle, aside) = (about(26, 19), about(8, 19));
    assert!((middle / expected - 1.0).abs() < 0.15 && aside < 0.05 * middle, "{middle} of {expected}, beside {aside}");
    // Nearly all of the flux is mirrored.
    assert!(counter(&rendering, "flux_reflected") > 0.9 * counter(&rendering, "flux_arrived"));
}

/// Photons that light nothing visible are culled, and the image does not get darker.
#[gpu_test]
fn gpu_photons_that_light_nothing_in_view_are_culled(gpu: &Gpu) {
    let (scene, size) = (closed_box().0, SIZE / 2);
    let settings = settings(PhotonSplatting { count: 512, radius: 0.5, ..photons() });
    let rendering = render(gpu, size, settings.clone(), &scene, &looking([0.0, 0.0, 0.9], [0.0, 0.0, -1.0]));
    let [landed, off, hidden, splatted] =
        ["landed", "off_screen", "hidden", "splatted"].map(|name| counter(&rendering, name));
    assert!(off > 0.2 * landed && off + hidden + splatted == landed, "{off}, {hidden}, {splatted} of {landed}");
    // The middle of the image equals that of a wider view, which culls fewer photons.
    let wide = Camera::look_at(
        Vec3::new(0.0, 0.0, 0.9),
        Vec3::NEG_Z,
        Projection::Perspective { fov_y: 2.0 * (3.0 * 0.45f32.tan()).atan(), near: 0.02 },
    );
    let wider = render(gpu, 3 * size, settings, &scene, &wide);
    let at = |rendering: &RenderedImage, p: UVec2| {
        Vec4::from(rendering.radiance[(p.y * rendering.width + p.x) as usize]).truncate()
    };
    for y in 0..size.y {
        for x in 0..size.x {
            let (a, b) = (at(&rendering, UVec2::new(x, y)), at(&wider, size + UVec2::new(x, y)));
            assert!((a - b).abs().max_element() < 2e-3 * b.max_element() + 1e-4, "{x}, {y}: {a} and {b}");
        }
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    let images = Structure::NONE;
    let usual = PhotonSplatting::default();
    assert!(passes::check(&usual, &images).is_ok());
    let wrong = [
        PhotonSplatting { count: 15, ..usual },
        PhotonSplatting { count: 300_000, ..usual },
        PhotonSplatting { bounces: 17, ..usual },
        PhotonSplatting { chunk: 10, ..usual },
        PhotonSplatting { radius: f32::NAN, ..usual },
        PhotonSplatting { radius: 0.0, ..usual },
        PhotonSplatting { filter_radius: 65, ..usual },
    ];
    for technique in wrong {
        assert!(passes::check(&technique, &images).is_err(), "{technique:?}");
    }
    let deep = PhotonSplatting { tracer: WITHIN_TEXEL.into(), ..usual };
    let without = DeepImageSettings { payload: false, ..DeepImageSettings::default() }.into();
    assert!(passes::check(&deep, &without).is_err() && passes::check(&usual, &without).is_ok());
}

#[test]
fn constants_are_the_shaders() {
    let constant =
        |file: &str, name| crate::shaders::SHADERS.constant(&format!("indirect/photon_splatting/{file}"), name) as u32;
    let names = [
        "EMITTED",
        "REFLECTED",
        "ESCAPED",
        "LANDED",
        "OFF_SCREEN",
        "HIDDEN",
        "SPLATTED",
        "FLUX_ARRIVED",
        "FLUX_REFLECTED",
        "FLUX_LANDED",
        "FLUX_SPLATTED",
    ];
    for (i, name) in names.iter().enumerate() {
        assert_eq!(constant("counters", name) as usize, i);
        assert_eq!(passes::COUNTERS[i], format!("photons/{}", name.to_lowercase()));
    }
    assert_eq!(constant("counters", "COLUMNS") as usize, names.len());
    assert_eq!((names.len(), passes::FLUX_UNITS), (passes::COUNTERS.len(), 2f32.powi(32)));
    use crate::indirect::light_views::Source;
    let sources = ["CONE", "PARALLEL", "AREA", "TRIANGLE"];
    let of = |name| crate::shaders::SHADERS.constant("indirect/light_views/rays", name) as u32;
    let ours = [Source::Cone, Source::Parallel, Source::Area, Source::Triangle].map(|source| source as u32);
    assert_eq!(sources.map(of), ours);
}
