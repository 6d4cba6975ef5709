//! A scene on the page's device, and frames that are awaited.

use std::cell::RefCell;

use js_sys::Uint8ClampedArray;
use lanternfish::{Change, GpuScene, Renderer, Settings, Target, ViewRequest};
use lanternfish_cli::{opened::Loaded, scene_with_lights, shot::Shot};
use lanternfish_gpu::texels;
use lanternfish_scene::Camera;
use wasm_bindgen::prelude::*;
use web_sys::ImageData;

use crate::{device::Device, failed, turn::pause};

/// Milliseconds between two polls.
const POLL: i32 = 4;
/// Frames in which lists may grow until one is complete.
const TRIES: usize = 16;
/// The format of images, which every canvas takes.
pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

thread_local! {
    /// The page's device, with all that was compiled for it.
    static DEVICE: RefCell<Option<Device>> = const { RefCell::new(None) };
}

/// A scene on the device.
pub struct Session {
    pub device: Device,
    pub loaded: Loaded,
}

impl Session {
    /// Reads a scene. `tell` hears what is done.
    pub async fn open(shot: Shot, tell: impl Fn(&str)) -> Result<Self, JsValue> {
        tell("reading the scene");
        pause(0).await;
        let lit = scene_with_lights(&shot.args).map_err(failed)?;
        let loaded = Loaded::of(shot, lit, |note| tell(note)).map_err(failed)?;
        let cached = DEVICE.take().filter(|device| device.check().is_ok());
        let device = match cached {
            Some(device) => device,
            None => Device::open().await?,
        };
        DEVICE.set(Some(device.clone()));
        tell("building the tree of its triangles");
        pause(0).await;
        Ok(Self { device, loaded })
    }
}

/// A renderer of a session's scene, and its image.
pub struct Side {
    pub renderer: Renderer,
    uploaded: GpuScene,
    shown: Option<wgpu::Texture>,
}

impl Side {
    pub fn new(Session { device, loaded }: &Session, settings: Settings) -> Result<Self, JsValue> {
        let renderer = Renderer::with_engine(&device.engine, settings.for_scene(&loaded.scene)).map_err(failed)?;
        let uploaded = renderer.upload(&loaded.scene).map_err(failed)?;
        Ok(Self { renderer, uploaded, shown: None })
    }

    pub fn set(&mut self, session: &Session, settings: Settings) -> Result<(), JsValue> {
        if self.renderer.set(settings.for_scene(&session.loaded.scene)).map_err(failed)? == Change::Upload {
            self.uploaded = self.renderer.upload(&session.loaded.scene).map_err(failed)?;
        }
        Ok(())
    }

    /// Shows what has moved in the scene.
    pub fn update(&mut self, session: &Session) -> Result<(), JsValue> {
        self.renderer.update(&mut self.uploaded, &session.loaded.scene).map(drop).map_err(failed)
    }

    /// Renders frames of a view until one is complete: each gives the lists that overflow their capacity.
    pub async fn frame(&mut self, session: &Session, camera: &Camera, size: [u32; 2]) -> Result<(), JsValue> {
        for _ in 0..TRIES {
            if self.try_frame(&session.device, camera, size).await? {
                return Ok(());
            }
        }
        Err(failed("the scene's lists do not fit the device"))
    }

    /// Renders a frame, and says whether it is complete.
    async fn try_frame(&mut self, device: &Device, camera: &Camera, size: [u32; 2]) -> Result<bool, JsValue> {
        let is_of_size = |texture: &wgpu::Texture| [texture.width(), texture.height()] == size;
        let engine = &device.engine;
        let shown = self.shown.take_if(|texture| is_of_size(texture)).unwrap_or_else(|| {
            engine.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("shown"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        });
        let view = shown.create_view(&Default::default());
        self.shown = Some(shown);
        let request = [ViewRequest::of_camera(0, camera, size, Target::Display(&view, FORMAT))];
        let mut commands = engine.device.create_command_encoder(&Default::default());
        let pending = self.renderer.record(&mut commands, &self.uploaded, &request).map_err(failed)?;
        engine.queue.submit([commands.finish()]);
        self.renderer.submitted(pending);
        loop {
            pause(POLL).await;
            device.check()?;
            if let Some(report) = self.renderer.poll() {
                return match report.is_lost {
                    true => Err(failed("the device is lost")),
                    false => Ok(report.is_complete),
                };
            }
        }
    }

    /// The display image of the last frame.
    pub fn texture(&self) -> Result<&wgpu::Texture, JsValue> {
        self.shown.as_ref().ok_or_else(|| failed("no frame was rendered"))
    }

    /// The same, read back.
    pub async fn image(&self, session: &Session) -> Result<ImageData, JsValue> {
        let (engine, shown) = (&session.device.engine, self.texture()?);
        let rgba = texels::<[u8; 4]>(&engine.device, &engine.queue, shown).await.map_err(failed)?;
        session.device.check()?;
        // A copy: a view of the module's memory would show what comes after.
        let copy = Uint8ClampedArray::from(rgba.as_flattened());
        ImageData::new_with_js_u8_clamped_array_and_sh(&copy, shown.width(), shown.height())
    }
}
