//! Normals rebuilt from depth, against the triangles' own [Elagabani2025, §4.3.1].

use std::ops::Range;

use glam::Vec3;
use lanternfish::{
    Settings,
    settings::{DebugView, Shadows},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::generate;

use crate::support::render;

/// Normals of a demo's first view as a debug view shows them; none where the sky is.
fn normals(gpu: &Gpu, demo: &str, size: (u32, u32), view: DebugView) -> Vec<Option<Vec3>> {
    let scene = generate::demo(demo).unwrap();
    let settings = Settings { debug_view: Some(view), shadows: Shadows::None, ..Settings::direct_light() };
    let rendering = render(gpu, &scene, &scene.cameras[0], size, settings);
    let texels = rendering.display.iter().zip(&rendering.radiance);
    let normal = |[r, g, b, _]: &[u8; 4]| (2.0 / 255.0 * Vec3::new(*r as f32, *g as f32, *b as f32) - 1.0).normalize();
    texels.map(|(display, radiance)| (radiance[3] == 1.0).then(|| normal(display))).collect()
}

/// How far a view's normals are from the geometric ones.
#[derive(Debug)]
struct Error {
    /// Degrees.
    mean: f32,
    /// Share of pixels that are off by more than ten degrees.
    wrong: f32,
}

fn error(name: &str, found: &[Option<Vec3>], geometric: &[Option<Vec3>]) -> Error {
    let pairs = found.iter().zip(geometric).filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)));
    let angles: Vec<f32> = pairs.map(|(a, b)| a.dot(*b).clamp(-1.0, 1.0).acos().to_degrees()).collect();
    let error = Error {
        mean: angles.iter().sum::<f32>() / angles.len() as f32,
        wrong: angles.iter().filter(|angle| **angle > 10.0).count() as f32 / angles.len() as f32,
    };
    println!("{name}: {error:.3?} over {} pixels", angles.len());
    error
}

/// What one scene must show: means in degrees, as measured, a quarter less and more.
struct Case {
    demo: &'static str,
    size: (u32, u32),
    naive: Range<f32>,
    improved: Range<f32>,
}

#[test]
fn gpu_normals_from_depth_are_close_to_the_geometry() {
    let Some(gpu) = testing::gpu("gpu_normals_from_depth_are_close_to_the_geometry") else { return };
    for Case { demo, size, naive, improved } in CASES {
        let geometric = normals(gpu, demo, size, DebugView::GeometricNormal);
        let by = |view| error(&format!("{demo} {size:?} {view}"), &normals(gpu, demo, size, view), &geometric);
        let (two, five) = (by(DebugView::NormalNaive), by(DebugView::NormalImproved));
        assert!(naive.contains(&two.mean), "{demo}: {two:?}");
        assert!(improved.contains(&five.mean), "{demo}: {five:?}");
        assert!(five.wrong < two.wrong, "{demo}: {five:?} is not better than {two:?}");
    }
    // It can fail: the shading normal, bent by normal maps and smoothing, is another one.
    let [shading, geometric] =
        [DebugView::Normal, DebugView::GeometricNormal].map(|view| normals(gpu, "atrium", (160, 90), view));
    let shading = error("atrium, shading normals", &shading, &geometric);
    assert!(shading.mean > 1.0, "{shading:?}");
}

const CASES: [Case; 3] = [
    // Two walls and two blocks: two samples are wrong along every edge, five nowhere but in corners. Cards that move vertices to a grid of
    // 256 points a pixel have half as much again.
    Case { demo: "cornell", size: (160, 160), naive: 3.1..5.2, improved: 0.12..0.33 },
    // Full of mouldings and leaves a pixel or two wide, where no number of samples helps: the larger the image, the
    // fewer of them.
    Case { demo: "atrium", size: (320, 180), naive: 14.7..24.5, improved: 8.9..14.8 },
    Case { demo: "atrium", size: (1280, 720), naive: 5.8..9.7, improved: 2.2..3.7 },
];
