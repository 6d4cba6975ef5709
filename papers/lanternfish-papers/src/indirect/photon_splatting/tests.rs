mod differentials;
mod emission;

use std::f32::consts::PI;

use glam::{UVec2, Vec3, Vec4};
use lanternfish::{
    RenderedImage, Renderer, Settings,
    rays::Structure,
    settings::{Attenuation, Culling, Indirect, Materials, Tracer},
    techniques::{IndirectClamp, Sampled},
};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{Camera, Light, LightKind, Material, Primitive, Projection, Scene, generate::demo};

use super::{PhotonSplatting, Splat, passes};
use crate::{
    DeepImageSettings, WITHIN_TEXEL,
    testing::{self, quad, scene_of},
};

/// The size is not a multiple of the workgroup size.
const SIZE: UVec2 = UVec2::new(53, 39);

/// Photon splatting without the filter.
fn technique() -> PhotonSplatting {
    PhotonSplatting { filter_radius: 0, ..PhotonSplatting::default() }
}

fn settings(indirect: Indirect) -> Settings {
    Settings::direct_light()
        .with_indirect(indirect)
        .with_materials(Materials::Lambert)
        .with_attenuation(Attenuation::Physical)
        .with_range_threshold(1e-6)
}

fn render(gpu: &Gpu, settings: Settings, scene: &Scene, camera: &Camera, size: UVec2) -> RenderedImage {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    renderer.render(&uploaded, camera, size.into()).unwrap()
}

fn render_technique(gpu: &Gpu, technique: PhotonSplatting, scene: &Scene, camera: &Camera) -> RenderedImage {
    render(gpu, settings(Indirect::from(technique)), scene, camera, SIZE)
}

fn energy(rendering: &RenderedImage) -> f64 {
    rendering.radiance.iter().map(|pixel| f64::from(Vec4::from(*pixel).truncate().element_sum())).sum()
}

fn counter(rendering: &RenderedImage, name: &str) -> f64 {
    let counter = rendering.report.counters.iter().find(|(label, _)| label.strip_prefix("photons/") == Some(name));
    counter.unwrap_or_else(|| panic!("no {name} in {:?}", rendering.report.counters)).1 as f64
}

fn looking(eye: [f32; 3], target: [f32; 3]) -> Camera {
    Camera::look_at(eye.into(), target.into(), Projection::Perspective { fov_y: 0.9, near: 0.02 })
}

fn matt(albedo: f32) -> Material {
    Material { base_color: Vec3::splat(albedo).extend(1.0), double_sided: true, ..Material::default() }
}

/// The walls of a closed cube of 2 m, of the first material.
fn walls() -> Vec<Primitive> {
    let wall = |normal: Vec3, right: Vec3, up: Vec3| quad(0, normal, right, up);
    vec![
        wall(Vec3::X, Vec3::Y, Vec3::Z),
        wall(-Vec3::X, Vec3::Y, Vec3::Z),
        wall(Vec3::Y, Vec3::Z, Vec3::X),
        wall(-Vec3::Y, Vec3::Z, Vec3::X),
        wall(Vec3::Z, Vec3::X, Vec3::Y),
        wall(-Vec3::Z, Vec3::X, Vec3::Y),
    ]
}

/// A closed cube with a lamp in it.
fn closed_box(albedo: f32) -> Scene {
    let mut scene = scene_of(walls(), vec![matt(albedo)]);
    scene.lights.push(Light::point(Vec3::new(0.2, 0.3, -0.1), Vec3::splat(2.0)));
    scene
}

/// The Cornell box without its lamp's own light, which the reference here does not sample.
fn cornell() -> (Scene, Camera) {
    let mut scene = demo("cornell").unwrap();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.lights = vec![Light::point(Vec3::new(0.0, 1.2, 0.5), Vec3::new(3.0, 2.5, 2.0))];
    (scene, looking([0.0, 1.0, 4.2], [0.0, 1.0, 0.0]))
}

/// Light is conserved: the flux that lands after each bounce is the lights' flux times the albedo to the power of the bounce, through the
/// BVH and through deep images [the furnace's series].
#[gpu_test]
fn gpu_landed_flux_is_the_lights_flux_times_the_albedo(gpu: &Gpu) {
    let scene = closed_box(0.5);
    let camera = looking([0.7, -0.3, 0.6], [-1.0, 0.0, -0.6]);
    // Through deep images a few photons in a hundred start in a texel beside the wall that they leave.
    for (tracer, most) in [(Tracer::BVH, 1e-3), (WITHIN_TEXEL, 0.015)] {
        let mut before = 0.0;
        for bounces in 1..=3 {
            let technique = PhotonSplatting { tracer: tracer.into(), bounces, count: 1024, ..technique() };
            let rendering = render_technique(gpu, technique, &scene, &camera);
            let fraction = |name| counter(&rendering, name) / f64::from(passes::FLUX_UNITS);
            // A texel's fraction of the sphere is evaluated at one of its points.
            assert!((fraction("flux_arrived") - 1.0).abs() < 0.01, "{tracer}: {}", fraction("flux_arrived"));
            let of_bounce = (fraction("flux_landed") - before) / fraction("flux_arrived");
            before = fraction("flux_landed");
            let expected = 0.5f64.powi(bounces as i32);
            assert!(
                (of_bounce / expected - 1.0).abs() < most * f64::from(bounces),
                "{tracer}, bounce {bounces}: {of_bounce} of {expected}"
            );
        }
    }
    // Negative control: a box without one wall loses flux.
    let mut open = walls();
    open.pop();
    let open = Scene { lights: scene.lights.clone(), ..scene_of(open, vec![matt(0.5)]) };
    let rendering = render_technique(gpu, technique(), &open, &camera);
    assert!(
        counter(&rendering, "escaped") > 0.0
            && counter(&rendering, "flux_landed") < 0.9 * counter(&rendering, "flux_reflected")
    );
}

/// Pixels show all of the light that lands on the walls of a closed cube, visible from its middle: nothing is lost at edges or in the sums.
#[gpu_test]
fn gpu_all_of_the_light_that_lands_is_visible(gpu: &Gpu) {
    let (albedo, size) = (0.5, UVec2::splat(20));
    let scene = closed_box(albedo);
    let ways = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let flux_of = |technique: PhotonSplatting| {
        let (mut flux, mut reflected) = (0.0, 0.0);
        for way in ways {
            let up = if way.y == 0.0 { Vec3::Y } else { Vec3::X };
            let projection = Projection::Perspective { fov_y: 0.5 * PI, near: 0.02 };
            let mut camera = Camera::look_at(Vec3::ZERO, way, projection);
            let axes = glam::Mat3::from_cols(way.cross(up), up, -way);
            camera.world_from_camera = glam::Affine3A::from_mat3(axes);
            let direct = energy(&render(gpu, settings(Indirect::NONE), &scene, &camera, size));
            let rendering = render(gpu, settings(Indirect::from(technique)), &scene, &camera, size);
            // Each pixel shows the same area of a wall: 4 m² in total.
            flux += (energy(&rendering) - direct) / 3.0 * f64::from(PI / albedo) * 4.0 / f64::from(size.x * size.y);
            reflected = counter(&rendering, "flux_reflected") / f64::from(passes::FLUX_UNITS);
        }
        // The lamp has 2 cd.
        flux / (8.0 * std::f64::consts::PI * reflected)
    };
    for (what, technique) in [
        ("usual", technique()),
        ("larger", PhotonSplatting { radius: 0.5, count: 1024, ..technique() }),
        ("conserved", PhotonSplatting { conserved: true, radius: 0.5, count: 1024, ..technique() }),
        ("raster", PhotonSplatting { splat: Splat::Raster, count: 256, radius: 0.5, conserved: true, ..technique() }),
        ("deep images", PhotonSplatting { tracer: WITHIN_TEXEL.into(), ..technique() }),
    ] {
        let visible = flux_of(technique);
        let most = match technique.tracer.fixed() {
            tracer if tracer == WITHIN_TEXEL => 0.06,
            // Loss beyond a footprint's reach at grazing incidence.
            _ if technique.conserved => 0.01,
            _ => 0.03,
        };
        assert!((visible - 1.0).abs() < most, "{what}: {visible}");
    }
}

/// Every light culling technique, any chunk size and every run give the same image to the bit; rasterized splats differ only by the order
/// of sums.
#[gpu_test]
fn gpu_photons_are_the_same_for_every_splatting_method(gpu: &Gpu) {
    let (scene, camera) = cornell();
    let technique = PhotonSplatting { count: 200, radius: 0.5, bounces: 2, ..technique() };
    let of = |technique, culling| {
        render(gpu, settings(Indirect::from(technique)).with_culling(culling), &scene, &camera, SIZE)
    };
    let all = of(technique, Culling::NONE);
    assert!(counter(&all, "splatted") > 10_000.0);
    for culling in Culling::all() {
        assert!(of(technique, culling.clone()).radiance == all.radiance, "{}", culling.name());
    }
    let chunks = of(PhotonSplatting { chunk: 1024, ..technique }, Culling::NONE);
    assert!(chunks.radiance == all.radiance, "chunks");
    assert!(
        of(PhotonSplatting { radius: 0.4, ..technique }, Culling::NONE).radiance != all.radiance,
        "insensitive to the radius"
    );
    let drawn = of(PhotonSplatting { splat: Splat::Raster, ..technique }, Culling::NONE);
    let again = of(PhotonSplatting { splat: Splat::Raster, chunk: 4096, ..technique }, Culling::NONE);
    for rendering in [&drawn, &again] {
        let far = rendering.radiance.iter().zip(&all.radiance).filter(|(a, b)| {
            let (a, b) = (Vec4::from(**a).truncate(), Vec4::from(**b).truncate());
            (a - b).abs().max_element() > 2e-3 * b.max_element().max(1e-3)
        });
        assert_eq!(far.count(), 0);
    }
    assert!(
        of(PhotonSplatting { splat: Splat::Raster, ..technique }, Culling::NONE).radiance == drawn.radiance,
        "runs differ"
    );
}

/// One bounce in the Cornell box has the energy of rays from every pixel, and a mean of frames is nearer to them per pixel than one frame.
#[gpu_test]
fn gpu_the_light_of_photons_is_that_of_one_bounce(gpu: &Gpu) {
    let (scene, camera) = cornell();
    // Frames of a mean sample other positions in their pixels: all three are means of the same number of frames.
    let rendering =
        |indirect, accumulate| render(gpu, settings(indirect).with_accumulate(accumulate), &scene, &camera, SIZE);
    let of_frames = |frames: u32| {
        let rays = Sampled {
            diffuse_rays: 256 / frames,
            filter_radius: 0,
            clamp: IndirectClamp::Off,
            ..Sampled::default().one_bounce()
        };
        (rendering(Indirect::NONE, frames), rendering(Indirect::from(rays), frames))
    };
    let references = [(1, of_frames(1)), (4, of_frames(4))];
    let of = |technique: PhotonSplatting| {
        references.each_ref().map(|(frames, (direct, ground_truth))| {
            let photons = rendering(Indirect::from(technique), *frames);
            let one_bounce = energy(ground_truth) - energy(direct);
            let off = |(a, b): (&[f32; 4], &[f32; 4])| f64::from((Vec4::from(*a) - Vec4::from(*b)).abs().max_element());
            let distance = photons.radiance.iter().zip(&ground_truth.radiance).map(off).sum::<f64>() / one_bounce;
            ((energy(&photons) - energy(direct)) / one_bounce, distance)
        })
    };
    for tracer in [Tracer::BVH, WITHIN_TEXEL] {
        let [(one, _), (many, _)] = of(PhotonSplatting { tracer: tracer.into(), ..technique() });
        // 4 % are lost beyond the blocks' edges, where a pixel is 5 cm wide; deep images lose another 1 % beside walls.
        let lost = if tracer == Tracer::BVH { 0.05 } else { 0.07 };
        assert!((one - 1.0).abs() < lost && (many - 1.0).abs() < lost, "{tracer}: {one}, 4 frames {many}");
    }
    // With so few photons, noise dominates the error.
    let [(_, one_off), (_, many_off)] = of(PhotonSplatting { count: 128, ..technique() });
    println!("{many_off} of {one_off}");
    assert!(many_off < 0.6 * one_off, "{many_off} of {one_off}");
}

/// A mirror reflects a beam: it lights the wall that it hits, with the flux that the mirror reflects.
#[gpu_test]
fn gpu_a_mirror_reflects_light_onto_a_wall(gpu: &Gpu) {
    // The floor is a mirror, the lamp a narrow spot that points at it at 45 degrees.
    let mut primitives = walls();
    primitives[3] = quad(1, -Vec3::Y, Vec3::Z, Vec3::X);
    let mirror = Material {
        metallic: 1.0,
        perceptual_roughness: 0.05,
        base_color: Vec4::ONE,
        double_sided: true,
        ..Material::default()
    };
    let wall = Material { metallic: 0.0, specular: 0.0, ..matt(0.5) };
    let mut scene = scene_of(primitives, vec![wall, mirror]);
    let spot = LightKind::Spot { inner_angle: 0.1, outer_angle: 0.2 };
    let light = Light::point(Vec3::new(-0.9, -0.1, 0.0), Vec3::splat(5.0));
    scene.lights.push(Light { kind: spot, direction: Vec3::new(1.0, -1.0, 0.0).normalize(), ..light });
    let camera = looking([-0.9, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let of = |technique| {
        let settings = settings(Indirect::from(technique)).with_materials(Materials::File);
        render(gpu, settings, &scene, &camera, SIZE)
    };
    let rendering = of(PhotonSplatting { radius: 1.0, ..technique() });
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

/// A scene without lights is dark and gives no error, for every splatting method.
#[gpu_test]
fn gpu_no_lights_are_no_photons(gpu: &Gpu) {
    let scene = Scene { lights: Vec::new(), ..closed_box(0.5) };
    let camera = looking([0.7, -0.3, 0.6], [-1.0, 0.0, -0.6]);
    for splat in [Splat::Gather, Splat::Raster] {
        for tracer in [Tracer::BVH, WITHIN_TEXEL] {
            let technique = PhotonSplatting {
                splat,
                tracer: tracer.into(),
                bounces: 2,
                conserved: true,
                ..PhotonSplatting::default()
            };
            let rendering = render_technique(gpu, technique, &scene, &camera);
            assert_eq!((energy(&rendering), counter(&rendering, "landed")), (0.0, 0.0), "{splat}, {tracer}");
        }
    }
}

/// Photons that light nothing visible are culled, and the image does not get darker.
#[gpu_test]
fn gpu_photons_that_light_nothing_in_view_are_culled(gpu: &Gpu) {
    let scene = closed_box(0.5);
    let technique = PhotonSplatting { count: 512, radius: 0.5, ..technique() };
    let far = looking([0.0, 0.0, 0.9], [0.0, 0.0, -1.0]);
    let rendering = render_technique(gpu, technique, &scene, &far);
    let [landed, off, hidden, splatted] =
        ["landed", "off_screen", "hidden", "splatted"].map(|name| counter(&rendering, name));
    assert!(off > 0.2 * landed && off + hidden + splatted == landed, "{off}, {hidden}, {splatted} of {landed}");
    // The middle of the image equals that of a wider view, which culls fewer photons.
    let wide = Camera::look_at(
        Vec3::new(0.0, 0.0, 0.9),
        Vec3::NEG_Z,
        Projection::Perspective { fov_y: 2.0 * (3.0 * 0.45f32.tan()).atan(), near: 0.02 },
    );
    let settings = settings(Indirect::from(technique));
    let wider = render(gpu, settings, &scene, &wide, 3 * SIZE);
    let at = |rendering: &RenderedImage, p: UVec2| {
        Vec4::from(rendering.radiance[(p.y * rendering.width + p.x) as usize]).truncate()
    };
    for y in 0..SIZE.y {
        for x in 0..SIZE.x {
            let (a, b) = (at(&rendering, UVec2::new(x, y)), at(&wider, SIZE + UVec2::new(x, y)));
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
    assert_eq!(names.len(), passes::COUNTERS.len());
    use crate::indirect::light_views::Source;
    let sources = ["CONE", "PARALLEL", "AREA", "TRIANGLE"];
    let of = |name| crate::shaders::SHADERS.constant("indirect/light_views/rays", name) as u32;
    let ours = [Source::Cone, Source::Parallel, Source::Area, Source::Triangle].map(|source| source as u32);
    assert_eq!(sources.map(of), ours);
}
