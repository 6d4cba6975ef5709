//! Normals reconstructed from depth, against the geometric normals [Elagabani2025, §4.3.1].

use std::ops::Range;

use glam::Vec3;
use lanternfish::{
    RenderedImage, Renderer, Settings,
    settings::{DebugView, Shadows},
    shaders,
};
use lanternfish_gpu::{Engine, Gpu, ShaderTexts};
use lanternfish_papers::normals::{naive_normals, shown_normals_from_depth};
use lanternfish_scene::{Camera, Scene, generate};

/// Renders with texts that replace those of the library's shaders.
pub fn render_edited(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    (width, height): (u32, u32),
    settings: Settings,
    texts: ShaderTexts,
) -> RenderedImage {
    let engine = Engine::new(&gpu.device, &gpu.queue);
    shaders::edit(&engine, texts);
    let mut renderer = Renderer::with_engine(&engine, settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    renderer.render(&uploaded, camera, [width, height]).unwrap()
}

/// Normals of a demo's first view from a debug view; none in the sky.
fn normals(gpu: &Gpu, demo: &str, size: (u32, u32), view: DebugView, texts: ShaderTexts) -> Vec<Option<Vec3>> {
    let scene = generate::demo(demo).unwrap();
    let settings = Settings::direct_light().with_debug_view(Some(view)).with_shadows(Shadows::None);
    let rendering = render_edited(gpu, &scene, &scene.cameras[0], size, settings, texts);
    let texels = rendering.display.iter().zip(&rendering.radiance);
    let normal = |[r, g, b, _]: &[u8; 4]| (2.0 / 255.0 * Vec3::new(*r as f32, *g as f32, *b as f32) - 1.0).normalize();
    texels.map(|(display, radiance)| (radiance[3] == 1.0).then(|| normal(display))).collect()
}

/// The deviation of a view's normals from the geometric ones.
#[derive(Debug)]
struct Error {
    /// Mean angle, degrees.
    mean: f32,
    /// Fraction of pixels with an angle above ten degrees.
    wrong: f32,
}

fn error(name: &str, actual: &[Option<Vec3>], geometric: &[Option<Vec3>]) -> Error {
    let pairs = actual.iter().zip(geometric).filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)));
    let angles: Vec<f32> = pairs.map(|(a, b)| a.dot(*b).clamp(-1.0, 1.0).acos().to_degrees()).collect();
    let error = Error {
        mean: angles.iter().sum::<f32>() / angles.len() as f32,
        wrong: angles.iter().filter(|angle| **angle > 10.0).count() as f32 / angles.len() as f32,
    };
    println!("{name}: {error:.3?} over {} pixels", angles.len());
    error
}

/// Expected results of a scene: mean angles, degrees, 25 % below and above the measured values.
struct Case {
    demo: &'static str,
    size: (u32, u32),
    naive: Range<f32>,
    improved: Range<f32>,
}

#[gpu_test(crate::gpu)]
fn gpu_normals_from_depth_are_close_to_the_geometry(gpu: &Gpu) {
    for Case { demo, size, naive, improved } in CASES {
        let geometric = normals(gpu, demo, size, DebugView::GeometricNormal, ShaderTexts::new());
        let by = |name, texts| {
            let from_depth = normals(gpu, demo, size, DebugView::Normal, texts);
            error(&format!("{demo} {size:?} {name}"), &from_depth, &geometric)
        };
        let both = naive_normals().into_iter().chain(shown_normals_from_depth()).collect();
        let (two, five) = (by("naive", both), by("improved", shown_normals_from_depth()));
        assert!(naive.contains(&two.mean), "{demo}: {two:?}");
        assert!(improved.contains(&five.mean), "{demo}: {five:?}");
        assert!(five.wrong < two.wrong, "{demo}: {five:?} is not better than {two:?}");
    }
    // Check that the test can fail: the shading normal, changed by normal maps and interpolation, differs.
    let [shading, geometric] = [DebugView::Normal, DebugView::GeometricNormal]
        .map(|view| normals(gpu, "atrium", (160, 90), view, ShaderTexts::new()));
    let shading = error("atrium, shading normals", &shading, &geometric);
    assert!(shading.mean > 1.0, "{shading:?}");
}

const CASES: [Case; 2] = [
    // Two walls and two blocks: two samples are wrong along every edge, five only in corners. Cards that snap vertices
    // to 1/256 of a pixel have 1.5 times the error.
    Case { demo: "cornell", size: (160, 160), naive: 3.1..5.2, improved: 0.12..0.33 },
    // Full of mouldings and leaves that are one or two pixels wide, where more samples do not help.
    Case { demo: "atrium", size: (320, 180), naive: 14.7..24.5, improved: 8.9..14.8 },
];
