//! A canvas that shows images of the device, without their way through the program's memory.

use std::cell::Cell;

use wasm_bindgen::JsValue;
use web_sys::OffscreenCanvas;

use crate::{device::Device, failed, session::FORMAT};

pub struct Canvas {
    surface: wgpu::Surface<'static>,
    /// Its size, pixels.
    size: Cell<[u32; 2]>,
}

impl Canvas {
    pub fn new(device: &Device, canvas: OffscreenCanvas) -> Result<Self, JsValue> {
        let surface = device.instance.create_surface(wgpu::SurfaceTarget::OffscreenCanvas(canvas));
        Ok(Self { surface: surface.map_err(failed)?, size: Cell::default() })
    }

    /// Shows an image; with a second one of its size, that to the right of a fraction of the width.
    pub fn show(
        &self,
        device: &Device,
        first: &wgpu::Texture,
        second: Option<(&wgpu::Texture, f32)>,
    ) -> Result<(), JsValue> {
        let wgpu::Extent3d { width, height, .. } = first.size();
        let engine = &device.engine;
        if self.size.replace([width, height]) != [width, height] {
            let config = wgpu::SurfaceConfiguration {
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_DST,
                format: FORMAT,
                width,
                height,
                present_mode: wgpu::PresentMode::Fifo,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Opaque,
                view_formats: Vec::new(),
                color_space: Default::default(),
            };
            self.surface.configure(&engine.device, &config);
        }
        let wgpu::CurrentSurfaceTexture::Success(frame) = self.surface.get_current_texture() else {
            return Err(failed("the canvas has no image"));
        };
        let mut commands = engine.device.create_command_encoder(&Default::default());
        let split = second.map_or(width, |(_, part)| (width as f32 * part.clamp(0.0, 1.0)) as u32);
        let mut copy = |texture: &wgpu::Texture, from: u32, to: u32| {
            let place = |texture| wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: from, y: 0, z: 0 },
                aspect: wgpu::TextureAspect::All,
            };
            let size = wgpu::Extent3d { width: to - from, height, depth_or_array_layers: 1 };
            commands.copy_texture_to_texture(place(texture), place(&frame.texture), size);
        };
        copy(first, 0, split);
        if let Some((second, _)) = second {
            copy(second, split, width);
        }
        engine.queue.submit([commands.finish()]);
        engine.queue.present(frame);
        Ok(())
    }
}
