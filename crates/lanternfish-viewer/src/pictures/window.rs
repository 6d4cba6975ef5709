//! The window of pictures of files.

use std::time::{Duration, Instant};

use egui::Vec2;
use lanternfish_gpu::Gpu;
use winit::{
    application::ApplicationHandler,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle},
    window::{Window, WindowId},
};

use super::{
    PictureReader, Pictures,
    panel::{self, Asked, Difference, State},
    shown::Look,
};
use crate::{
    ViewerError, difference,
    surface::{self, Known, Surface},
    texture::{texture, write},
    wipe::Textures,
};

/// How often it is asked whether the comparison is done.
const LOOK_AGAIN: Duration = Duration::from_millis(30);

/// Opens a window on pictures, one at least, and returns when it is closed.
pub fn run(start: Pictures) -> Result<(), ViewerError> {
    let events = EventLoop::new().map_err(|error| ViewerError::Display(error.to_string()))?;
    let mut app = App { display: events.owned_display_handle(), start: Some(start), open: None, failed: None };
    events.run_app(&mut app).map_err(|error| ViewerError::Display(error.to_string()))?;
    app.failed.map_or(Ok(()), Err)
}

struct App {
    display: OwnedDisplayHandle,
    start: Option<Pictures>,
    open: Option<Shown>,
    failed: Option<ViewerError>,
}

/// An open window.
struct Shown {
    surface: Surface,
    input: egui_winit::State,
    gpu: Gpu,
    state: State,
    read: PictureReader,
    /// A, B, and where they differ, as egui knows them.
    known: [Known; 3],
    /// The textures of A and B, and what they are of.
    sides: [Option<(wgpu::TextureView, (usize, Look))>; 2],
    difference: difference::Difference,
    /// Which two were compared last, and what has come of it.
    compared: Option<[(usize, Look); 2]>,
    found: Option<(wgpu::TextureView, f32)>,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match Shown::new(events, &self.display, start) {
            Ok(shown) => self.open = Some(shown),
            Err(error) => {
                self.failed = Some(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.open else { return };
        if shown.input.on_window_event(&shown.surface.window, &event).repaint {
            shown.surface.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                shown.surface.configure(&shown.gpu.device);
            }
            WindowEvent::DroppedFile(path) => {
                match (shown.read)(&path) {
                    Ok(pictures) => {
                        shown.state.add(pictures);
                        shown.state.message.clear();
                    }
                    Err(what) => shown.state.message = what,
                }
                shown.surface.window.request_redraw();
            }
            WindowEvent::RedrawRequested if shown.frame().close => events.exit(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(shown) = &mut self.open else { return };
        if shown.poll() {
            shown.surface.window.request_redraw();
        }
        events.set_control_flow(match shown.difference.is_working() {
            true => ControlFlow::WaitUntil(Instant::now() + LOOK_AGAIN),
            false => ControlFlow::Wait,
        });
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface goes before the display that it is of.
        self.open = None;
    }
}

impl Shown {
    fn new(events: &ActiveEventLoop, display: &OwnedDisplayHandle, start: Pictures) -> Result<Self, ViewerError> {
        let Pictures { pictures, exposure, tone_map, size: [width, height], adapter, read } = start;
        let attributes = Window::default_attributes()
            .with_title(format!("{} – Lanternfish", pictures.first().map_or("", |picture| &picture.name)))
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        let (surface, input, gpu) = surface::open(events, display, attributes, &adapter)?;
        Ok(Self {
            surface,
            input,
            gpu,
            state: State::new(pictures, exposure, tone_map),
            read,
            known: [const { None }; 3],
            sides: [const { None }; 2],
            difference: difference::Difference::default(),
            compared: None,
            found: None,
        })
    }

    /// Whether the comparison has come to something.
    fn poll(&mut self) -> bool {
        let Some(compared) = self.difference.poll() else { return false };
        match compared {
            Ok(compared) => {
                let map = texture(&self.gpu.device, compared.size);
                write(&self.gpu.queue, &map, &compared.map);
                self.found = Some((map, compared.mean));
            }
            Err(what) => self.state.message = what,
        }
        true
    }

    /// Which pictures are on either side, and how they are shown.
    fn wanted(&self) -> [Option<(usize, Look)>; 2] {
        let State { pictures, a, b, look, .. } = &self.state;
        // What is no radiance looks the same under every exposure.
        let of = |index: usize| (index, if pictures[index].is_radiance { *look } else { Look::PLAIN });
        [Some(of(*a)), b.map(of)]
    }

    /// Brings to the device what is shown, and begins to compare it.
    fn bring(&mut self) {
        let wanted = self.wanted();
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        for (side, wanted) in self.sides.iter_mut().zip(wanted) {
            if side.as_ref().map(|(_, of)| *of) == wanted {
                continue;
            }
            *side = None;
            let Some((index, look)) = wanted else { continue };
            let picture = &self.state.pictures[index];
            if picture.size().max_element() > most {
                self.state.message =
                    format!("{}: this adapter shows pictures of {most} pixels a side at most", picture.name);
                continue;
            }
            let view = texture(&self.gpu.device, picture.size());
            write(&self.gpu.queue, &view, picture.bytes(look).as_flattened());
            *side = Some((view, (index, look)));
        }
        let two = match wanted {
            [Some(a), Some(b)] if self.are_comparable() => Some([a, b]),
            _ => None,
        };
        if two == self.compared {
            return;
        }
        self.compared = two;
        self.found = None;
        self.difference.stop();
        if let Some([a, b]) = two {
            let bytes = |(index, look): (usize, Look)| self.state.pictures[index].bytes(look);
            self.difference.compare(bytes(a), bytes(b), self.state.pictures[a.0].size());
        }
    }

    fn are_comparable(&self) -> bool {
        let State { pictures, a, b, .. } = &self.state;
        b.is_some_and(|b| pictures[b].size() == pictures[*a].size())
    }

    fn frame(&mut self) -> Asked {
        self.poll();
        self.bring();
        let ratio = self.input.egui_ctx().pixels_per_point();
        let size = self.state.pictures[self.state.a].size().as_vec2();
        let room = self.input.egui_ctx().content_rect();
        // Pixels are seen as squares once they are enlarged.
        let filter = match ratio * self.state.place.zoom(room, Vec2::new(size.x, size.y)) > 1.0 {
            true => wgpu::FilterMode::Nearest,
            false => wgpu::FilterMode::Linear,
        };
        let map = self.found.as_ref().map(|(map, _)| map);
        let [a, b] = self.sides.each_ref().map(|side| side.as_ref().map(|(view, _)| view));
        for (known, texture) in self.known.iter_mut().zip([a, b, map]) {
            self.surface.know(&self.gpu.device, known, texture, filter);
        }
        let [a, b, map] = self.known.each_ref().map(|known| known.as_ref().map(|(id, ..)| *id));
        let difference = match (&self.found, self.state.b) {
            (_, None) => Difference::OfOne,
            (Some((_, mean)), _) => Difference::Mean(*mean),
            _ if self.are_comparable() => Difference::Pending,
            _ => Difference::Sizes,
        };
        let Self { input, state, surface, gpu, .. } = self;
        let taken = input.take_egui_input(&surface.window);
        let mut asked = Asked::default();
        let context = input.egui_ctx().clone();
        let output = context.run_ui(taken, |ui| {
            let now = panel::show(ui, state, &Textures { a, b, map }, difference);
            asked.close |= now.close;
        });
        input.handle_platform_output(&surface.window, output.platform_output.clone());
        let is_again = output.viewport_output.values().any(|viewport| viewport.repaint_delay.is_zero());
        surface.paint(gpu, &context, output);
        if is_again {
            surface.window.request_redraw();
        }
        asked
    }
}
