//! The window: events of the system, the surface, and the order of a frame.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use egui::ViewportId;
use glam::UVec2;
use lanternfish_gpu::{Gpu, read_texture};
use lanternfish_scene::Scene;
use winit::{
    application::ApplicationHandler,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle},
    window::{Window, WindowId},
};

use crate::{
    Keeper, Opened, Opener, Start, ViewerError,
    controls::Controls,
    pace::Pace,
    panels::{self, Asked, Facts, State},
    player,
    record::Recorder,
    seen::Seen,
};

/// How long the camera rests before the picture is drawn whole.
const REST: Duration = Duration::from_millis(250);
/// How often it is asked whether the device is done, where nothing else happens.
const LOOK_AGAIN: Duration = Duration::from_millis(8);

pub fn run(start: Start) -> Result<(), ViewerError> {
    let events = EventLoop::new().map_err(|error| ViewerError::Display(error.to_string()))?;
    let mut app = App { display: events.owned_display_handle(), start: Some(start), open: None, failed: None };
    events.run_app(&mut app).map_err(|error| ViewerError::Display(error.to_string()))?;
    app.failed.map_or(Ok(()), Err)
}

/// The program, before and while its window is open.
struct App {
    display: OwnedDisplayHandle,
    start: Option<Start>,
    open: Option<Viewer>,
    failed: Option<ViewerError>,
}

/// An open window.
struct Viewer {
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    surface_settings: wgpu::SurfaceConfiguration,
    input: egui_winit::State,
    painter: egui_wgpu::Renderer,
    picture: Option<egui::TextureId>,
    state: State,
    seen: Seen,
    name: String,
    pace: Pace,
    /// Pixels of the window that the picture has.
    room: UVec2,
    /// The moment of the animation that is on the device.
    moment: Option<(usize, f32)>,
    last: Instant,
    frame_ms: f64,
    moved: Option<Instant>,
    wants_screenshot: bool,
    open: Opener,
    keep: Keeper,
    recorder: Option<Recorder>,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match Viewer::new(events, &self.display, start) {
            Ok(viewer) => self.open = Some(viewer),
            Err(error) => {
                self.failed = Some(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(viewer) = &mut self.open else { return };
        let response = viewer.input.on_window_event(&viewer.window, &event);
        if response.repaint {
            viewer.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => viewer.configure(),
            WindowEvent::DroppedFile(path) => viewer.open_file(&path),
            WindowEvent::RedrawRequested if viewer.frame().close => events.exit(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(viewer) = &mut self.open else { return };
        if viewer.poll() || viewer.has_more() {
            viewer.window.request_redraw();
        }
        if viewer.has_more() || viewer.seen.is_busy() {
            events.set_control_flow(ControlFlow::WaitUntil(Instant::now() + LOOK_AGAIN));
        } else {
            events.set_control_flow(ControlFlow::Wait);
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface goes before the display that it is of.
        let recorder = self.open.take().and_then(|viewer| viewer.recorder);
        if let Some(Err(what)) = recorder.map(Recorder::end) {
            self.failed = Some(ViewerError::Record(what));
        }
    }
}

impl Viewer {
    fn new(events: &ActiveEventLoop, display: &OwnedDisplayHandle, start: Start) -> Result<Self, ViewerError> {
        let said = |error: &dyn std::error::Error| ViewerError::Display(error.to_string());
        let [width, height] = start.size;
        let attributes = Window::default_attributes()
            .with_title(format!("{} – Lanternfish", start.name))
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).map_err(|error| said(&error))?);
        let mut descriptor = wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display.clone()));
        descriptor.backends = wgpu::Backends::PRIMARY;
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance.create_surface(Arc::clone(&window)).map_err(|error| said(&error))?;
        let (gpu, adapter) = Gpu::open_for(&instance, &surface, &start.adapter)?;
        let surface_settings = surface_settings(&surface, &adapter, window.inner_size())
            .ok_or_else(|| ViewerError::Display("the adapter cannot draw to this window".to_owned()))?;
        let context = egui::Context::default();
        let most = gpu.device.limits().max_texture_dimension_2d as usize;
        let scale = Some(window.scale_factor() as f32);
        let input = egui_winit::State::new(context, ViewportId::ROOT, &window, scale, None, Some(most));
        let painter = egui_wgpu::Renderer::new(&gpu.device, surface_settings.format, Default::default());
        let Start { name, scene, camera, settings, open, keep, record, .. } = start;
        let mut controls = Controls::new(camera, scene.bounds().size().length());
        let recorder = record.map(|(step, keep)| Recorder::begin(&mut controls, step, keep));
        let clip = player::clip_of(&scene);
        let seen = Seen::new(gpu, scene, &settings)?;
        let state = State {
            usual: settings.clone(),
            settings,
            controls,
            clip,
            message: String::new(),
            shows_keys: false,
            shows_panels: true,
        };
        let (room, last) = (UVec2::new(width, height), Instant::now());
        let mut viewer = Self {
            window,
            instance,
            surface,
            surface_settings,
            input,
            painter,
            picture: None,
            state,
            seen,
            name,
            pace: Pace::default(),
            room,
            moment: None,
            last,
            frame_ms: 0.0,
            // The first picture is a small one: how long a frame takes is not known.
            moved: Some(last),
            wants_screenshot: false,
            open,
            keep,
            recorder,
        };
        viewer.configure();
        viewer.window.request_redraw();
        Ok(viewer)
    }

    /// Fits the surface to the window; a window without a size has none.
    fn configure(&mut self) {
        let size = self.window.inner_size();
        let most = self.seen.gpu.device.limits().max_texture_dimension_2d;
        if size.width > 0 && size.height > 0 {
            (self.surface_settings.width, self.surface_settings.height) = (size.width.min(most), size.height.min(most));
            self.surface.configure(&self.seen.gpu.device, &self.surface_settings);
        }
        self.window.request_redraw();
    }

    /// Whether anything would be drawn that is not there yet. While the device is busy the panels need not be painted again, unless something
    /// moves.
    fn has_more(&self) -> bool {
        let plays = self.state.clip.as_ref().is_some_and(|clip| clip.is_playing);
        let is_whole = self.seen.size() == self.room && !self.seen.has_more(&self.state.controls.camera);
        plays || self.recorder.is_some() || self.moved.is_some() || !(self.seen.is_busy() || is_whole)
    }

    /// Asks what has become of the last frame of the picture: whether it has just ended.
    fn poll(&mut self) -> bool {
        let Some(ms) = self.seen.poll() else { return false };
        let size = self.seen.size();
        self.pace.took(u64::from(size.x) * u64::from(size.y), ms);
        self.frame_ms = ms;
        self.keep_picture();
        true
    }

    fn open_file(&mut self, path: &std::path::Path) {
        let opened = (self.open)(path);
        let done = opened.and_then(|Opened { name, scene, camera }| {
            let controls = Controls::new(camera, scene.bounds().size().length());
            let clip = player::clip_of(&scene);
            self.seen.open(scene).map_err(|error| error.to_string())?;
            // What is recorded is of the scene that was there.
            self.recorder.take().map_or(Ok(()), Recorder::end)?;
            self.window.set_title(&format!("{name} – Lanternfish"));
            (self.name, self.state.controls, self.state.clip, self.moment) = (name, controls, clip, None);
            Ok(())
        });
        self.state.message = done.err().unwrap_or_default();
        self.window.request_redraw();
    }

    /// One frame of the window; now and then one of the picture.
    fn frame(&mut self) -> Asked {
        if let Some(recorder) = &self.recorder {
            // A step takes no less than it lasts, however fast the display is.
            std::thread::sleep(Duration::from_secs_f32(recorder.step()).saturating_sub(self.last.elapsed()));
        }
        let passed = self.last.elapsed().as_secs_f32().min(0.25);
        let seconds = self.recorder.as_ref().map_or(passed, Recorder::step);
        self.last = Instant::now();
        self.poll();
        let (asked, output) = self.panels(seconds);
        if let Some(recorder) = &mut self.recorder {
            recorder.note(&mut self.state.controls);
        }
        self.room = UVec2::new(asked.room.x as u32, asked.room.y as u32).max(UVec2::ONE);
        if asked.is_moving {
            self.moved = Some(Instant::now());
        }
        self.moved = self.moved.filter(|since| since.elapsed() < REST);
        self.wants_screenshot |= asked.screenshot;
        if !self.seen.is_busy() {
            self.keep_picture();
        }
        if !self.seen.is_busy() {
            let drawn = self.draw(seconds);
            if let Err(error) = drawn {
                self.state.message = error.to_string();
                // What was asked for cannot be: what is shown can.
                self.state.settings = self.seen.settings().clone();
            }
        }
        self.present(output);
        asked
    }

    /// What egui makes of the panels; the room that is left for the picture is in pixels.
    fn panels(&mut self, seconds: f32) -> (Asked, egui::FullOutput) {
        let Self { window, input, state, seen, name, picture, frame_ms, .. } = self;
        let taken = input.take_egui_input(window);
        let facts = Facts {
            name,
            counts: counts(&seen.scene),
            adapter: &seen.gpu.description,
            size: seen.size().into(),
            averaged: seen.averaged(),
            report: seen.report.as_ref(),
            frame_ms: *frame_ms,
            picture: *picture,
        };
        let mut asked = Asked::default();
        let context = input.egui_ctx().clone();
        let output = context.run_ui(taken, |ui| {
            let now = panels::show(ui, state, &facts, seconds);
            let before = asked;
            asked = Asked { screenshot: before.screenshot | now.screenshot, close: before.close | now.close, ..now };
        });
        asked.room *= output.pixels_per_point;
        (asked, output)
    }

    /// The next frame of the picture, where there is one.
    fn draw(&mut self, seconds: f32) -> Result<(), lanternfish::RenderError> {
        self.seen.set(&self.state.settings)?;
        if let Some(clip) = &mut self.state.clip
            && player::play(&mut self.seen.scene, clip, &mut self.moment, seconds)
        {
            self.seen.update()?;
        }
        let plays = self.state.clip.as_ref().is_some_and(|clip| clip.is_playing);
        let share = self.pace.scale(u64::from(self.room.x) * u64::from(self.room.y), plays || self.moved.is_some());
        let size = (self.room.as_vec2() * share).as_uvec2().max(UVec2::ONE);
        if self.seen.resize(size) || self.picture.is_none() {
            let (device, texture) = (&self.seen.gpu.device, self.seen.picture());
            let filter = wgpu::FilterMode::Linear;
            match self.picture {
                Some(id) => self.painter.update_egui_texture_from_wgpu_texture(device, texture, filter, id),
                None => self.picture = Some(self.painter.register_native_texture(device, texture, filter)),
            }
        }
        if self.seen.has_more(&self.state.controls.camera) {
            self.seen.draw(&self.state.controls.camera)?;
        }
        Ok(())
    }

    /// Paints what egui made, onto the window.
    fn present(&mut self, output: egui::FullOutput) {
        self.input.handle_platform_output(&self.window, output.platform_output);
        let (device, queue) = (&self.seen.gpu.device, &self.seen.gpu.queue);
        let surface = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) => texture,
            wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                drop(texture);
                return self.configure();
            }
            wgpu::CurrentSurfaceTexture::Outdated => return self.configure(),
            wgpu::CurrentSurfaceTexture::Lost => {
                match self.instance.create_surface(Arc::clone(&self.window)) {
                    Ok(surface) => self.surface = surface,
                    Err(error) => tracing::error!("the window's surface was lost: {error}"),
                }
                return self.configure();
            }
            _ => return,
        };
        for (id, deltas) in &output.textures_delta.set {
            deltas.iter().for_each(|delta| self.painter.update_texture(device, queue, *id, delta));
        }
        let jobs = self.input.egui_ctx().tessellate(output.shapes, output.pixels_per_point);
        let screen = egui_wgpu::ScreenDescriptor {
            size_in_pixels: [self.surface_settings.width, self.surface_settings.height],
            pixels_per_point: output.pixels_per_point,
        };
        let mut commands = device.create_command_encoder(&Default::default());
        let before = self.painter.update_buffers(device, queue, &mut commands, &jobs, &screen);
        let view = surface.texture.create_view(&Default::default());
        let color = wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        };
        let pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewer/panels"),
            color_attachments: &[Some(color)],
            ..Default::default()
        });
        self.painter.render(&mut pass.forget_lifetime(), &jobs, &screen);
        queue.submit(before.into_iter().chain([commands.finish()]));
        self.window.pre_present_notify();
        queue.present(surface);
        for id in &output.textures_delta.free {
            self.painter.free_texture(id);
        }
    }

    /// Writes a screenshot, if one is asked for and the whole picture is there.
    fn keep_picture(&mut self) {
        let size = self.seen.size();
        if !self.wants_screenshot || size != self.room || self.seen.averaged() == 0 {
            return;
        }
        self.wants_screenshot = false;
        let gpu = &self.seen.gpu;
        let read = read_texture::<[u8; 4]>(&gpu.device, &gpu.queue, self.seen.picture().texture());
        let kept =
            read.map_err(|error| error.to_string()).and_then(|texels| (self.keep)(texels.as_flattened(), size.into()));
        self.state.message = kept.unwrap_or_else(|what| format!("no screenshot: {what}"));
    }
}

/// As a display shows bytes: egui encodes by itself. None where the surface is not this adapter's.
fn surface_settings(
    surface: &wgpu::Surface<'_>,
    adapter: &wgpu::Adapter,
    size: winit::dpi::PhysicalSize<u32>,
) -> Option<wgpu::SurfaceConfiguration> {
    let mut settings = surface.get_default_config(adapter, size.width.max(1), size.height.max(1))?;
    let formats = surface.get_capabilities(adapter).formats;
    settings.format = formats.iter().copied().find(|format| !format.is_srgb()).unwrap_or(settings.format);
    settings.present_mode = wgpu::PresentMode::AutoVsync;
    Some(settings)
}

fn counts(scene: &Scene) -> (usize, usize) {
    (scene.triangle_counts().1, scene.lights.len())
}
