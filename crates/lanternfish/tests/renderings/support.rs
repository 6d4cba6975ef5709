//! Rendering and comparing in a line.

use glam::{Affine3A, Vec2, Vec3};
use lanternfish::{RenderedImage, Renderer, Settings};
use lanternfish_gpu::Gpu;
use lanternfish_metrics::RgbImage;
use lanternfish_scene::{Camera, Instance, Material, Mesh, Primitive, Projection, Scene};

/// Whether the driver is an old software one, without anisotropic filtering (Debian 12's own, Mesa 22.3.6); the test is
/// then left out and says so, with what was measured there.
pub fn left_out_on_old_software(test: &str, gpu: &Gpu, measured: &str) -> bool {
    let old = lanternfish::gpu_scene::automatic_anisotropy(&gpu.device.adapter_info()) == 1;
    if old {
        lanternfish_gpu::testing::left_out(test, &format!("{}: {measured}", gpu.description.driver));
    }
    old
}

/// Uploads and renders.
pub fn render(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    (width, height): (u32, u32),
    settings: Settings,
) -> RenderedImage {
    let mut renderer =
        Renderer::with_engine(&lanternfish_gpu::testing::engine(gpu), settings).expect("the settings fit the device");
    let scene = renderer.upload(scene).expect("the scene fits the device");
    renderer.render(&scene, camera, width, height).expect("the image fits the device")
}

/// The linear image without alpha.
pub fn linear(rendering: &RenderedImage) -> RgbImage {
    let pixels = rendering.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    RgbImage::new(rendering.width as usize, rendering.height as usize, pixels).expect("an image is whole")
}

/// Everything of an image that a scene and its light decide, bit for bit.
pub fn bits(rendering: &RenderedImage) -> Vec<[u32; 4]> {
    rendering.radiance.iter().map(|texel| texel.map(f32::to_bits)).collect()
}

/// Pixels in which two images of one size differ.
pub fn differing(a: &RenderedImage, b: &RenderedImage) -> usize {
    assert_eq!((a.width, a.height), (b.width, b.height));
    bits(a).iter().zip(bits(b)).filter(|(a, b)| *a != b).count()
}

/// A number of the image's report.
pub fn counter(rendering: &RenderedImage, name: &str) -> u64 {
    let found = rendering.report.counters.iter().find(|(known, _)| known == name);
    found.unwrap_or_else(|| panic!("no counter {name}: {:?}", rendering.report.counters)).1
}

/// A scene of one mesh, placed once.
pub fn scene_of(primitives: Vec<Primitive>, materials: Vec<Material>) -> Scene {
    let scene = Scene {
        name: "test".to_owned(),
        meshes: vec![Mesh { name: String::new(), primitives }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials,
        ..Scene::default()
    };
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// A rectangle whose front is where `half_right` runs to the right and `half_up` upwards; uv 0..1 from its top left.
pub fn quad(material: usize, center: Vec3, half_right: Vec3, half_up: Vec3) -> Primitive {
    let corner = |s: f32, t: f32| center + s * half_right + t * half_up;
    Primitive {
        material,
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![half_right.cross(half_up).normalize(); 4],
        uv0: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// A square across the view at height z, facing +z.
pub fn thin_dielectric(material: usize, z: f32, half: f32) -> Primitive {
    quad(material, Vec3::new(0.0, 0.0, z), Vec3::X * half, Vec3::Y * half)
}

/// Edge of the images of [`Front`], pixels.
pub const EDGE: u32 = 64;

/// Looks down −z from z = 10 along parallel lines, at x and y from −2 to 2: a pixel is 1/16 m wide.
pub struct Front(pub RenderedImage);

impl Front {
    pub fn camera() -> Camera {
        let projection = Projection::Orthographic { half_height: 2.0, near: 0.0, far: 20.0 };
        Camera::look_at(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, projection)
    }

    pub fn render(gpu: &Gpu, scene: &Scene, settings: Settings) -> Self {
        Self(render(gpu, scene, &Self::camera(), (EDGE, EDGE), settings))
    }

    /// Radiance of the pixel that shows (x, y).
    pub fn at(&self, x: f32, y: f32) -> Vec3 {
        let pixel = |v: f32| ((v + 2.0) / 4.0 * EDGE as f32) as u32;
        let index = (EDGE - 1 - pixel(y)) * EDGE + pixel(x);
        let [r, g, b, _] = self.0.radiance[index as usize];
        Vec3::new(r, g, b)
    }
}

/// What a target of half floats may be off by: a unit in the last place, 2⁻¹⁰; adapters may round either way.
pub const HALF: f32 = 9.8e-4;

/// Asserts that two radiances are one but for the rounding of the target, `times` over.
pub fn assert_near(found: Vec3, expected: Vec3, times: f32, what: &str) {
    let near = (found - expected).abs().cmple(HALF * times * expected.abs() + 1e-6).all();
    assert!(near, "{what}: {found}, not {expected}");
}
