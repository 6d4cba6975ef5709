//! Rendering and comparing in a line.

use lanternfish::{Picture, Renderer, Settings};
use lanternfish_gpu::Gpu;
use lanternfish_metrics::RgbImage;
use lanternfish_scene::{Camera, Scene};

/// Uploads and renders.
pub fn render(gpu: &Gpu, scene: &Scene, camera: &Camera, (width, height): (u32, u32), settings: Settings) -> Picture {
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).expect("the settings fit the device");
    let scene = renderer.upload(scene).expect("the scene fits the device");
    renderer.render(&scene, camera, width, height).expect("the picture fits the device")
}

/// The linear picture without alpha.
pub fn linear(picture: &Picture) -> RgbImage {
    let pixels = picture.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    RgbImage::new(picture.width as usize, picture.height as usize, pixels).expect("a picture is whole")
}
