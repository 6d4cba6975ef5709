//! Your own frame: Lanternfish draws into your texture, in your command encoder.
//!
//! ```text
//! cargo run --release --package lanternfish --example own_texture [FILE.png]
//! ```

mod support;

use std::path::PathBuf;

use lanternfish::{Renderer, Settings, Target, ViewRequest};
use lanternfish_metrics::{ColorType, write_png};
use support::{Result, open, pixels, texture};

/// Width and height, pixels.
pub const SIZE: [u32; 2] = [320, 240];
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

fn main() -> Result<()> {
    let path = std::env::args_os().nth(1).map_or("own_texture.png".into(), PathBuf::from);
    let (device, queue) = open()?;
    let rendering = draw(&device, &queue, Settings::default())?;
    write_png(&path, SIZE, ColorType::Rgba, rendering.as_flattened())?;
    println!("{}", path.display());
    Ok(())
}

/// One frame of a program that already has a device, a texture and commands.
pub fn draw(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Vec<[u8; 4]>> {
    let scene = lanternfish_scene::load("demo:cornell")?;
    let camera = scene.default_camera(SIZE[0] as f32 / SIZE[1] as f32);
    let mut renderer = Renderer::new(device, queue, settings)?;
    let uploaded = renderer.upload(&scene)?;

    // A window's texture works too. The view matrices may be the program's own: see `ViewRequest`.
    let shown = texture(device, SIZE, FORMAT);
    let views = [ViewRequest::of_camera(0, &camera, SIZE, Target::Display(&shown, FORMAT))];
    // Once, before the first frame: compiles the pipelines and allocates the lists.
    renderer.ready(&uploaded, &views)?;

    let mut commands = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    // … passes of the program …
    let frame = renderer.record(&mut commands, &uploaded, &views)?;
    // … further passes of the program …
    queue.submit([commands.finish()]);
    renderer.submitted(frame);

    pixels(device, queue, &shown)
}
