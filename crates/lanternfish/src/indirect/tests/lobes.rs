//! Sheen, a grain, thin films and coats under an environment and a light.

use glam::{UVec2, Vec3};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Light, Material, Scene, generate::demo};

use crate::{
    settings::Tracer,
    techniques::Sampled,
    testing::{
        image,
        light::{image_of, looking, mean, sampled, settings, traced_of},
    },
};

const SIZE: UVec2 = UVec2::new(102, 48);

/// Adds a lobe of this roughness.
type Lobe = fn(&mut Material, f32);

const LOBES: [(&str, Lobe); 4] = [
    ("sheen", |m, roughness| (m.sheen_color, m.sheen_roughness) = (Vec3::splat(0.9), roughness)),
    ("grain", |m, roughness| {
        (m.metallic, m.perceptual_roughness) = (1.0, 0.2 + 0.4 * roughness);
        (m.anisotropy, m.anisotropy_rotation) = (0.7, 0.5);
    }),
    ("thin film", |m, roughness| {
        m.perceptual_roughness = 0.1 + 0.5 * roughness;
        (m.iridescence, m.iridescence_ior, m.iridescence_thickness) = (1.0, 1.8, 150.0 + 500.0 * roughness);
    }),
    ("coat", |m, roughness| (m.clearcoat, m.clearcoat_roughness) = (1.0, roughness)),
];

/// Two rows of spheres with a white and a dark base, the roughness of their lobe from 0 (left) to 1 (right).
fn spheres(lobe: Lobe) -> (Scene, Camera) {
    let mut scene = demo("furnace").unwrap();
    scene.lights = vec![Light::directional(Vec3::new(-0.5, -0.6, -1.0), Vec3::splat(1.5))];
    scene.sky = Vec3::ZERO;
    // Bands, black behind the spheres.
    let bands = |d: Vec3| Vec3::splat((1.0 + (12.0 * d.y).cos()) * ((d.z + 0.7) / 1.2).clamp(0.0, 1.0));
    scene.environment = Some(image(256, 128, 0.0, bands));
    for (i, material) in scene.materials.iter_mut().enumerate() {
        let base_color = Vec3::splat(if i < 6 { 0.8 } else { 0.1 }).extend(1.0);
        *material = Material { base_color, metallic: 0.0, perceptual_roughness: 0.6, ..Material::default() };
        lobe(material, (i % 6) as f32 / 5.0);
    }
    (scene, looking([0.0, 0.0, 4.2], [0.0, 0.0, 0.0]))
}

/// The energy of each row, relative to the path tracer's, is that of the row without the lobe, and the lobe changes at least a row by more than the
/// tolerance. Images of spheres this small lack up to 3 % at their edges, with and without a lobe.
#[gpu_test]
fn gpu_lobes_agree_with_the_path_tracer(gpu: &Gpu) {
    const TOLERANCE: f64 = 0.03;
    let of = |lobe: Lobe| {
        let (scene, camera) = spheres(lobe);
        let rays = Sampled { diffuse_rays: 16, glossy_rays: 16, ..sampled(Tracer::BVH) };
        let images = [image_of(gpu, SIZE, settings(rays), &scene, &camera), traced_of(SIZE, &scene, &camera, 3, 128)];
        images.map(|image| [0, 1].map(|row| mean(&image[row * image.len() / 2..][..image.len() / 2])))
    };
    let [plain, plain_truth] = of(|_, _| {});
    for (name, lobe) in LOBES {
        let [actual, truth] = of(lobe);
        let mut change = 0.0f64;
        for row in 0..2 {
            let (energy, without) = (actual[row] / truth[row], plain[row] / plain_truth[row]);
            change = change.max((actual[row] / plain[row] - 1.0).abs());
            println!("{name}, row {row}: energy {energy:.4}, without the lobe {without:.4}");
            assert!((energy / without - 1.0).abs() < TOLERANCE, "{name}, row {row}: {energy}, {without}");
            assert!((without - 1.0).abs() < 0.04, "{name}, row {row}: {without}");
        }
        assert!(change > 2.0 * TOLERANCE, "{name}: the lobe changes {change}");
    }
}
