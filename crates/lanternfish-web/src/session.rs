//! A renderer with its scene on the page's device, and frames that are awaited.

use std::{cell::RefCell, path::PathBuf};

use js_sys::{Array, Uint8Array, Uint8ClampedArray};
use lanternfish::{Change, GpuScene, Renderer, Settings, Target, ViewRequest};
use lanternfish_gpu::texels;
use lanternfish_scene::{Camera, LoadOptions, Scene};
use wasm_bindgen::{JsCast as _, prelude::*};
use web_sys::ImageData;

use crate::{device::Device, failed, turn::pause};

/// Milliseconds between two polls.
const POLL: i32 = 4;
/// Frames in which lists may grow until one is complete.
const TRIES: usize = 16;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

thread_local! {
    /// The page's device, with all that was compiled for it.
    static DEVICE: RefCell<Option<Device>> = const { RefCell::new(None) };
}

pub struct Session {
    device: Device,
    renderer: Renderer,
    uploaded: GpuScene,
    pub scene: Scene,
    /// The display image.
    shown: Option<wgpu::Texture>,
}

impl Session {
    /// Reads a scene and compiles what its images need. `tell` hears what is done, before the browser shows it and waits.
    pub async fn open(source: &JsValue, settings: Settings, tell: impl Fn(&str)) -> Result<Self, JsValue> {
        tell("reading the scene");
        pause(0).await;
        let scene = read(source)?;
        let cached = DEVICE.take().filter(|device| device.check().is_ok());
        let device = match cached {
            Some(device) => device,
            None => Device::open().await?,
        };
        DEVICE.set(Some(device.clone()));
        tell("compiling shaders");
        pause(0).await;
        let renderer = Renderer::with_engine(&device.engine, settings).map_err(failed)?;
        tell("building the tree of its triangles");
        pause(0).await;
        let uploaded = renderer.upload(&scene).map_err(failed)?;
        Ok(Self { device, renderer, uploaded, scene, shown: None })
    }

    pub fn settings(&self) -> &Settings {
        self.renderer.settings()
    }

    pub fn set(&mut self, settings: Settings) -> Result<(), JsValue> {
        if self.renderer.set(settings).map_err(failed)? == Change::Upload {
            self.uploaded = self.renderer.upload(&self.scene).map_err(failed)?;
        }
        Ok(())
    }

    /// Forgets the frames of a mean.
    pub fn reset(&mut self) {
        self.renderer.reset();
    }

    /// Renders frames of a view until one is complete: each gives the lists that overflow their capacity.
    pub async fn frame(&mut self, camera: &Camera, size: [u32; 2]) -> Result<(), JsValue> {
        for _ in 0..TRIES {
            if self.try_frame(camera, size).await? {
                return Ok(());
            }
        }
        Err(failed("the scene's lists do not fit the device"))
    }

    /// Renders a frame, and says whether it is complete.
    async fn try_frame(&mut self, camera: &Camera, size: [u32; 2]) -> Result<bool, JsValue> {
        let is_of_size = |texture: &wgpu::Texture| [texture.width(), texture.height()] == size;
        let engine = &self.device.engine;
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
            self.device.check()?;
            if let Some(report) = self.renderer.poll() {
                return match report.is_lost {
                    true => Err(failed("the device is lost")),
                    false => Ok(report.is_complete),
                };
            }
        }
    }

    /// The display image of the last frame.
    pub async fn image(&self) -> Result<ImageData, JsValue> {
        let (engine, shown) = (&self.device.engine, self.shown.as_ref().expect("a frame was rendered"));
        let rgba = texels::<[u8; 4]>(&engine.device, &engine.queue, shown).await.map_err(failed)?;
        self.device.check()?;
        // A copy: a view of the module's memory would show what comes after.
        let copy = Uint8ClampedArray::from(rgba.as_flattened());
        ImageData::new_with_js_u8_clamped_array_and_sh(&copy, shown.width(), shown.height())
    }
}

/// The scene of a name, of the bytes of a GLB file, or of a list of names and bytes, whose first is the scene's file.
fn read(source: &JsValue) -> Result<Scene, JsValue> {
    if let Some(name) = source.as_string() {
        return lanternfish_scene::load(name).map_err(failed);
    }
    let wanted =
        || failed("a scene is a name such as demo:cornell, the bytes of a GLB file, or a list of [name, bytes]");
    let file = |name: JsValue, bytes: JsValue| {
        Some((PathBuf::from(name.as_string()?), bytes.dyn_ref::<Uint8Array>()?.to_vec()))
    };
    let files: Option<Vec<_>> = match source.dyn_ref::<Array>() {
        None => file("scene.glb".into(), source.clone()).map(|file| vec![file]),
        Some(list) => list.iter().map(|pair| file(Array::from(&pair).get(0), Array::from(&pair).get(1))).collect(),
    };
    let files = files.filter(|files| !files.is_empty()).ok_or_else(wanted)?;
    lanternfish_scene::load_files(&files[0].0, &files, &LoadOptions::default()).map_err(failed)
}
