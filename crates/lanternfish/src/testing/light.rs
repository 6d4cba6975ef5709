//! Scenes and images for tests of indirect light, and references by the path tracer.

use glam::{UVec2, Vec3};
use lanternfish_gpu::Gpu;
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer as PathTracer,
    settings::{Integrator, LightChoice},
};
use lanternfish_scene::{Camera, Light, Material, Projection, Scene, generate::demo};

use super::{quad, scene_of, walks};
use crate::{
    RenderedImage, Settings,
    settings::{Attenuation, Tracer},
    techniques::{IndirectClamp, Sampled},
};

/// Not a multiple of a workgroup.
pub const SIZE: UVec2 = UVec2::new(31, 23);
/// Size of images in which edges, blocks or cache entries are tested; not a multiple either.
pub const LARGE: UVec2 = UVec2::new(61, 45);

/// Many rays through a tracer, direct light only at their hits, no filter.
pub fn sampled(tracer: Tracer) -> Sampled {
    let clamp = IndirectClamp::Off;
    Sampled {
        diffuse_rays: 64,
        glossy_rays: 32,
        tracer: tracer.into(),
        filter_radius: 0,
        clamp,
        ..Sampled::default().one_bounce()
    }
}

/// Settings with this indirect light and inverse-square falloff.
pub fn settings(sampled: Sampled) -> Settings {
    Settings::direct_light().with_indirect(sampled).with_attenuation(Attenuation::Physical).with_range_threshold(1e-6)
}

/// An image and its report, of a new renderer.
pub fn rendered(gpu: &Gpu, size: UVec2, settings: Settings, scene: &Scene, camera: &Camera) -> RenderedImage {
    let mut renderer = walks::renderer(gpu, settings);
    let uploaded = renderer.upload(scene).unwrap();
    renderer.render(&uploaded, camera, size.into()).unwrap()
}

/// Radiance of an image, nits.
pub fn rendering(gpu: &Gpu, settings: Settings, scene: &Scene, camera: &Camera) -> Vec<Vec3> {
    image_of(gpu, SIZE, settings, scene, camera)
}

/// Radiance of an image of another size, pixels, in nits.
pub fn image_of(gpu: &Gpu, size: UVec2, settings: Settings, scene: &Scene, camera: &Camera) -> Vec<Vec3> {
    walks::pixels(&rendered(gpu, size, settings, scene, camera))
}

/// Mean of all channels.
pub fn mean(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel.element_sum()) / 3.0).sum::<f64>() / pixels.len() as f64
}

/// Mean absolute difference of pixels over the mean of the ground truth.
pub fn off(actual: &[Vec3], ground_truth: &[Vec3]) -> f64 {
    let apart = actual.iter().zip(ground_truth).map(|(a, b)| f64::from((*a - *b).abs().element_sum()) / 3.0);
    apart.sum::<f64>() / ground_truth.len() as f64 / mean(ground_truth)
}

/// A camera at `eye` that looks at `target`, world space, m.
pub fn looking(eye: [f32; 3], target: [f32; 3]) -> Camera {
    Camera::look_at(eye.into(), target.into(), Projection::Perspective { fov_y: 0.8, near: 0.02 })
}

/// A diffuse material.
pub fn matt(albedo: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        perceptual_roughness: 1.0,
        double_sided: true,
        ..Material::default()
    }
}

/// A floor of 20 m.
pub fn floor(material: Material) -> Scene {
    scene_of(vec![quad(0, Vec3::ZERO, 10.0 * Vec3::X, -10.0 * Vec3::Z)], vec![material])
}

/// A box of 2 m around the origin whose sides look inwards.
pub fn closed_box(material: Material) -> Scene {
    let side = |axis: Vec3| {
        let (right, up) = axis.any_orthonormal_pair();
        quad(0, -axis, right, up)
    };
    let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    scene_of(axes.map(side).to_vec(), vec![material])
}

/// The Cornell box with a lamp at its centre: no surface is so close that few rays carry most of the light.
pub fn cornell() -> Scene {
    let mut scene = demo("cornell").unwrap();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.lights = vec![Light::point(Vec3::new(0.0, 1.2, 0.5), Vec3::new(3.0, 2.5, 2.0))];
    scene
}

/// The image by the path tracer, with paths of up to `max_depth` segments and `samples` samples per pixel.
pub fn traced(scene: &Scene, camera: &Camera, max_depth: u32, samples: u64) -> Vec<Vec3> {
    traced_of(SIZE, scene, camera, max_depth, samples)
}

/// The path tracer's image of another size, pixels.
pub fn traced_of(size: UVec2, scene: &Scene, camera: &Camera, max_depth: u32, samples: u64) -> Vec<Vec3> {
    let settings = TracerSettings {
        integrator: Integrator::Path,
        max_depth,
        attenuation: Attenuation::Physical,
        range_threshold: 1e-6,
        light_choice: LightChoice::Uniform,
        ..TracerSettings::default()
    };
    let mut film = Film::new(size.into()).unwrap();
    PathTracer::new(scene, settings).unwrap().render(camera, &mut film, samples);
    film.mean().iter().map(|pixel| Vec3::from(*pixel)).collect()
}
