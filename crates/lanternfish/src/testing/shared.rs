//! A check that a renderer gets the same image from another renderer's uploaded scene as from its own, or an error.

use glam::Vec3;
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Camera, Environment, Image, Light, Material, Projection, Scene, TextureRef};

use super::{quad, scene_of};
use crate::{GpuScene, RenderError, Renderer, Settings};

/// A textured floor, a lamp above it, an occluder, and an environment image.
pub fn scene() -> Scene {
    let textured = Material {
        base_color_texture: Some(TextureRef::new(0)),
        metallic: 0.0,
        perceptual_roughness: 0.4,
        ..Material::default()
    };
    let shining = Material { emissive: Vec3::new(0.4, 0.2, 0.1), double_sided: true, ..Material::default() };
    let floor = quad(0, Vec3::ZERO, 2.0 * Vec3::X, -2.0 * Vec3::Z);
    let shade = quad(1, Vec3::new(0.2, 0.8, 0.1), 0.4 * Vec3::X, -0.4 * Vec3::Z);
    let mut scene = scene_of(vec![floor, shade], vec![textured, shining]);
    let rgba = vec![255, 40, 40, 255, 40, 255, 40, 255, 40, 40, 255, 255, 200, 200, 200, 255];
    scene.images.push(Image { name: String::new(), width: 2, height: 2, rgba });
    scene.samplers.push(Default::default());
    scene.textures.push(lanternfish_scene::Texture { image: 0, sampler: 0 });
    scene.lights.push(Light::point(Vec3::new(0.3, 1.6, 0.2), Vec3::splat(3.0)));
    let pixels = vec![Vec3::new(0.2, 0.3, 0.5), Vec3::new(0.5, 0.3, 0.2)];
    scene.environment = Some(Environment { width: 2, height: 1, pixels, rotation: 0.0 });
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// A camera that views it.
pub fn camera() -> Camera {
    let projection = Projection::Perspective { fov_y: 0.9, near: 0.01 };
    Camera::look_at(Vec3::new(0.5, 2.0, 3.0), Vec3::new(0.0, 0.3, 0.0), projection)
}

/// A renderer on the shared engine of the tests.
pub fn renderer(gpu: &Gpu, settings: Settings) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), settings).unwrap()
}

/// Renders the uploads of all settings under each of them. Returns the number of images that equal those of an upload of their own, and the
/// number of errors.
///
/// Panics if an image differs.
pub fn shared_and_refused(gpu: &Gpu, choices: Vec<(&'static str, Settings)>) -> (usize, usize) {
    let (scene, camera) = (scene(), camera());
    let mut renderers: Vec<_> = choices.into_iter().map(|(name, s)| (name, renderer(gpu, s))).collect();
    let uploads: Vec<(&str, GpuScene)> = renderers.iter().map(|(name, r)| (*name, r.upload(&scene).unwrap())).collect();
    let (mut same, mut refused) = (0, 0);
    for (i, (name, renderer)) in renderers.iter_mut().enumerate() {
        let own = renderer.render(&uploads[i].1, &camera, [16, 12]).unwrap_or_else(|error| panic!("{name}: {error}"));
        for (uploader, uploaded) in &uploads {
            match renderer.render(uploaded, &camera, [16, 12]) {
                Ok(rendering) => {
                    assert_eq!(rendering.radiance, own.radiance, "uploaded for {uploader}, rendered with {name}");
                    same += 1;
                }
                Err(error @ RenderError::OtherSettings { .. }) => {
                    assert!(error.to_string().contains("upload it with"), "{error}");
                    refused += 1;
                }
                Err(error) => panic!("uploaded for {uploader}, rendered with {name}: {error}"),
            }
        }
    }
    println!("{same} shared, {refused} refused");
    (same, refused)
}
