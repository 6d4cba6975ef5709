//! The window's surface: egui's input and painter, repaint times, and textures that are registered with egui.

use std::{sync::Arc, time::Instant};

use egui::{TextureId, Ui, ViewportId};
use lanternfish_gpu::{AdapterChoice, Gpu, instance_flags};
use winit::{
    event::WindowEvent,
    event_loop::{ActiveEventLoop, OwnedDisplayHandle},
    window::{Window, WindowAttributes},
};

use crate::ViewerError;

/// A window with its surface, egui's input state and painter.
pub struct Surface {
    /// The window.
    pub window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    settings: wgpu::SurfaceConfiguration,
    painter: egui_wgpu::Renderer,
    input: egui_winit::State,
    /// Time of egui's next repaint without input, as for tooltips and blinking cursors.
    repaint_at: Option<Instant>,
    /// Number of paints so far.
    paint_count: u64,
}

/// A texture that is registered with egui: its id and view.
pub type Registered = Option<(TextureId, wgpu::TextureView)>;

/// Opens a window with egui, and a device that can present to it.
pub fn open(
    events: &ActiveEventLoop,
    display: &OwnedDisplayHandle,
    attributes: WindowAttributes,
    adapter: &AdapterChoice,
) -> Result<(Surface, Gpu), ViewerError> {
    let display_error = |error: &dyn std::error::Error| ViewerError::Display(error.to_string());
    let window = Arc::new(events.create_window(attributes).map_err(|error| display_error(&error))?);
    let mut descriptor = wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display.clone()));
    descriptor.backends = wgpu::Backends::PRIMARY;
    descriptor.flags = instance_flags();
    let instance = wgpu::Instance::new(descriptor);
    let surface = instance.create_surface(Arc::clone(&window)).map_err(|error| display_error(&error))?;
    let (gpu, adapter) = Gpu::open_for(&instance, &surface, adapter)?;
    let context = egui::Context::default();
    // A paint may wait for a frame of the image, so egui's animations are off.
    context.all_styles_mut(|style| style.animation_time = 0.0);
    let most = gpu.device.limits().max_texture_dimension_2d as usize;
    let scale = Some(window.scale_factor() as f32);
    let input = egui_winit::State::new(context, ViewportId::ROOT, &window, scale, None, Some(most));
    let mut surface = Surface::new(window, input, instance, surface, &adapter, &gpu.device)?;
    surface.configure(&gpu.device);
    Ok((surface, gpu))
}

impl Surface {
    /// Creates a surface. `surface` belongs to the window and instance; `device` can present to it.
    fn new(
        window: Arc<Window>,
        input: egui_winit::State,
        instance: wgpu::Instance,
        surface: wgpu::Surface<'static>,
        adapter: &wgpu::Adapter,
        device: &wgpu::Device,
    ) -> Result<Self, ViewerError> {
        let settings = surface_settings(&surface, adapter, window.inner_size())
            .ok_or_else(|| ViewerError::Display("the adapter cannot present to this window".to_owned()))?;
        let painter = egui_wgpu::Renderer::new(device, settings.format, Default::default());
        Ok(Self { window, instance, surface, settings, painter, input, repaint_at: None, paint_count: 0 })
    }

    /// Resizes the surface to the window, and requests a redraw. A window of size 0 is skipped.
    pub fn configure(&mut self, device: &wgpu::Device) {
        self.fit(device);
        self.window.request_redraw();
    }

    /// Resizes the surface to the window. Returns true if its size has changed.
    fn fit(&mut self, device: &wgpu::Device) -> bool {
        let size = self.window.inner_size();
        let most = device.limits().max_texture_dimension_2d;
        if size.width == 0 || size.height == 0 {
            return false;
        }
        let before = [self.settings.width, self.settings.height];
        (self.settings.width, self.settings.height) = (size.width.min(most), size.height.min(most));
        self.surface.configure(device, &self.settings);
        before != [self.settings.width, self.settings.height]
    }

    /// Passes an event to egui. Returns true if egui requests a repaint.
    pub fn takes(&mut self, event: &WindowEvent) -> bool {
        self.input.on_window_event(&self.window, event).repaint
    }

    /// egui's context.
    pub fn context(&self) -> &egui::Context {
        self.input.egui_ctx()
    }

    /// Runs the panels with the input since the last call. [`Self::paint`] paints the output.
    pub fn panels(&mut self, show: impl FnMut(&mut Ui)) -> egui::FullOutput {
        let taken = self.input.take_egui_input(&self.window);
        let context = self.input.egui_ctx().clone();
        let mut output = context.run_ui(taken, show);
        self.input.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|panels| panels.repaint_delay);
        self.repaint_at = delay.and_then(|delay| Instant::now().checked_add(delay));
        output
    }

    /// Time of egui's next repaint without input.
    pub fn repaint_at(&self) -> Option<Instant> {
        self.repaint_at
    }

    /// True once when the time of `repaint_at` has come.
    pub fn is_due(&mut self) -> bool {
        self.repaint_at.take_if(|at| *at <= Instant::now()).is_some()
    }

    /// Registers a texture with egui in place of the previous one. `None` removes the registration.
    pub fn register(
        &mut self,
        device: &wgpu::Device,
        registered: &mut Registered,
        texture: Option<&wgpu::TextureView>,
    ) {
        let filter = wgpu::FilterMode::Linear;
        match (&mut *registered, texture) {
            (Some((_, before)), Some(texture)) if before == texture => {}
            (Some((id, before)), Some(texture)) => {
                self.painter.update_egui_texture_from_wgpu_texture(device, texture, filter, *id);
                before.clone_from(texture);
            }
            (None, Some(texture)) => {
                let id = self.painter.register_native_texture(device, texture, filter);
                *registered = Some((id, texture.clone()));
            }
            (_, None) => {
                if let Some((id, _)) = registered.take() {
                    self.painter.free_texture(&id);
                }
            }
        }
    }

    /// Paints egui's output.
    pub fn paint(&mut self, gpu: &Gpu, mut output: egui::FullOutput) {
        self.paint_count += 1;
        tracing::debug!("paint {} of the window", self.paint_count);
        // Texture changes are delivered once, so they are applied even without a surface.
        for (id, deltas) in &output.textures_delta.set {
            deltas.iter().for_each(|delta| self.painter.update_texture(&gpu.device, &gpu.queue, *id, delta));
        }
        let mut deltas = std::mem::take(&mut output.textures_delta);
        self.paint_shapes(gpu, output);
        for id in &deltas.free {
            self.painter.free_texture(id);
        }
        deltas.clear();
    }

    fn paint_shapes(&mut self, gpu: &Gpu, output: egui::FullOutput) {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let (surface, is_suboptimal) = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) => (texture, false),
            wgpu::CurrentSurfaceTexture::Suboptimal(texture) => (texture, true),
            wgpu::CurrentSurfaceTexture::Outdated => return self.configure(device),
            wgpu::CurrentSurfaceTexture::Lost => {
                match self.instance.create_surface(Arc::clone(&self.window)) {
                    Ok(surface) => self.surface = surface,
                    Err(error) => tracing::error!("the window's surface was lost: {error}"),
                }
                return self.configure(device);
            }
            _ => return,
        };
        let jobs = self.input.egui_ctx().tessellate(output.shapes, output.pixels_per_point);
        let screen = egui_wgpu::ScreenDescriptor {
            size_in_pixels: [self.settings.width, self.settings.height],
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
        // A suboptimal surface is still presented. Only a changed size requests a redraw, to avoid an endless loop.
        if is_suboptimal && self.fit(device) {
            self.window.request_redraw();
        }
    }
}

/// Configuration of the surface with a format that is not sRGB, since egui encodes its output. `None` if the adapter
/// cannot present to it.
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
