//! A window's loop without the window: ten frames with deferred readback.
//!
//! ```text
//! cargo run --release --package lanternfish --example in_flight
//! ```

#[allow(dead_code, reason = "this example reads nothing back")]
mod support;

use lanternfish::{FrameReport, RenderError, Renderer, Settings, Target, ViewRequest};
use lanternfish_scene::Camera;
use support::{Result, open, texture};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Bgra8Unorm;

fn main() -> Result<()> {
    let (device, queue) = open()?;
    for report in frames(&device, &queue, Settings::default(), 10)? {
        let ms: f64 = report.passes.iter().map(|pass| pass.ms).sum();
        println!("{:?}: complete: {}, {ms:.1} ms, {:?}", report.frame, report.is_complete, report.counters);
    }
    Ok(())
}

/// Renders `count` frames of a moving camera and returns their reports.
pub fn frames(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings, count: u32) -> Result<Vec<FrameReport>> {
    let scene = lanternfish_scene::load("demo:cornell")?;
    let camera = scene.default_camera(4.0 / 3.0);
    let mut renderer = Renderer::new(device, queue, settings)?;
    let uploaded = renderer.upload(&scene)?;
    let mut reports = Vec::new();
    let mut made = 0;
    for tick in 0.. {
        if made == count {
            break;
        }
        // The window is minimised for one frame.
        let size = if tick == 3 { [0, 0] } else { [160, 120] };
        let shown = texture(device, size.map(|edge| edge.max(1)), FORMAT);
        let step = glam::Affine3A::from_translation(0.02 * made as f32 * glam::Vec3::X);
        let camera = Camera { world_from_camera: camera.world_from_camera * step, ..camera.clone() };
        let mut commands = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let view = [ViewRequest::of_camera(0, &camera, size, Target::Display(&shown, FORMAT))];
        match renderer.record(&mut commands, &uploaded, &view) {
            Ok(frame) => {
                queue.submit([commands.finish()]);
                renderer.submitted(frame);
                made += 1;
            }
            // A window without pixels: skip the frame.
            Err(RenderError::Size { .. }) => (),
            Err(error) => return Err(error.into()),
        }
        // Does not wait; the reports are of earlier frames.
        reports.extend(std::iter::from_fn(|| renderer.poll()));
    }
    // Wait for the frames in flight before the program ends.
    device.poll(wgpu::PollType::wait_indefinitely())?;
    reports.extend(std::iter::from_fn(|| renderer.poll()));
    Ok(reports)
}
