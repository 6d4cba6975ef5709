//! Short forms of rendering and comparing.

use glam::{Affine3A, Vec2, Vec3};
use lanternfish::{RenderedImage, Renderer, Settings};
use lanternfish_gpu::Gpu;
use lanternfish_metrics::RgbImage;
use lanternfish_scene::{Camera, Instance, Material, Mesh, Primitive, Projection, Scene};

/// True for an old software driver without anisotropic filtering (Debian 12's Mesa 22.3.6). The test is then skipped with a message that
/// states the result measured there.
pub fn left_out_on_old_software(test: &str, gpu: &Gpu, measured: &str) -> bool {
    let old = lanternfish::gpu_scene::automatic_anisotropy(&gpu.device.adapter_info()) == 1;
    if old {
        lanternfish_gpu::testing::left_out(test, &format!("{}: {measured}", gpu.description.driver));
    }
    old
}

/// Uploads and renders a scene.
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
    renderer.render(&scene, camera, [width, height]).expect("the image fits the device")
}

/// The linear image without alpha.
pub fn linear(rendering: &RenderedImage) -> RgbImage {
    let pixels = rendering.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    RgbImage::new(rendering.width as usize, rendering.height as usize, pixels).expect("the image is complete")
}

/// The bits of all parts of an image that depend only on scene and light.
pub fn bits(rendering: &RenderedImage) -> Vec<[u32; 4]> {
    rendering.radiance.iter().map(|texel| texel.map(f32::to_bits)).collect()
}

/// Number of pixels that differ between two images of one size.
pub fn differing(a: &RenderedImage, b: &RenderedImage) -> usize {
    assert_eq!((a.width, a.height), (b.width, b.height));
    bits(a).iter().zip(bits(b)).filter(|(a, b)| *a != b).count()
}

/// A counter of the image's report.
pub fn counter(rendering: &RenderedImage, name: &str) -> u64 {
    let counter = rendering.report.counters.iter().find(|(key, _)| key == name);
    counter.unwrap_or_else(|| panic!("no counter {name}: {:?}", rendering.report.counters)).1
}

/// A scene of one mesh with one instance.
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

/// A rectangle seen from its front: `half_right` points right and `half_up` up; uv 0..1 from its top left.
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

/// Width and height of the images of [`Front`], pixels.
pub const EDGE: u32 = 64;

/// Orthographic view from z = 10 down −z, x and y from −2 to 2: a pixel is 1/16 m wide.
pub struct Front(pub RenderedImage);

impl Front {
    pub fn camera() -> Camera {
        let projection = Projection::Orthographic { half_height: 2.0, near: 0.0, far: 20.0 };
        Camera::look_at(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, projection)
    }

    pub fn render(gpu: &Gpu, scene: &Scene, settings: Settings) -> Self {
        Self(render(gpu, scene, &Self::camera(), (EDGE, EDGE), settings))
    }

    /// Radiance of the pixel at (x, y).
    pub fn at(&self, x: f32, y: f32) -> Vec3 {
        let pixel = |v: f32| ((v + 2.0) / 4.0 * EDGE as f32) as u32;
        let index = (EDGE - 1 - pixel(y)) * EDGE + pixel(x);
        let [r, g, b, _] = self.0.radiance[index as usize];
        Vec3::new(r, g, b)
    }
}

/// Relative rounding error of a half-float target: one unit in the last place, 2⁻¹⁰; adapters may round in either direction.
pub const HALF: f32 = 9.8e-4;

/// Asserts that two radiances are equal within `times` rounding errors of the target.
pub fn assert_near(actual: Vec3, expected: Vec3, times: f32, what: &str) {
    let near = (actual - expected).abs().cmple(HALF * times * expected.abs() + 1e-6).all();
    assert!(near, "{what}: {actual}, not {expected}");
}
