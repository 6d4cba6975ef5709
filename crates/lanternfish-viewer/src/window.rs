//! The window: events of the system, and the order of a frame.

mod frame;
mod pictures;

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use egui::ViewportId;
use glam::UVec2;
use lanternfish_gpu::Gpu;
use winit::{
    application::ApplicationHandler,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle},
    window::{Window, WindowId},
};

use crate::{
    Keeper, Opened, Opener, Start, ViewerError, Writer,
    beside::Beside,
    controls::Controls,
    pace::Pace,
    paints::Paints,
    panels::{Listing, State},
    player,
    record::Recorder,
    seen::Seen,
    source_tree::{self, SourceTree},
    surface::{Known, Surface},
    wipe::Wipe,
};

/// How long the camera rests before the picture is drawn whole.
const REST: Duration = Duration::from_millis(250);
/// How often it is asked whether the device is done, where nothing else happens: at most and at least, and of how many times in a frame.
const LOOK_AGAIN: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(8)];
const LOOKS_IN_A_FRAME: f64 = 200.0;

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
    surface: Surface,
    input: egui_winit::State,
    /// A, B, and where they differ, as egui knows them.
    pictures: [Known; 3],
    state: State,
    seen: Seen,
    beside: Beside,
    name: String,
    pace: Pace,
    /// Pixels of the window that the picture has.
    room: UVec2,
    /// The moment of the animation that is on the device.
    moment: Option<(usize, f32)>,
    last: Instant,
    opened: Instant,
    frame_ms: f64,
    paints: Paints,
    /// When the window was last painted, and which mean of frames that showed.
    painted: (Instant, Option<u64>),
    /// When the panels want to be painted again though nothing happens: a hint opens, a cursor blinks.
    repaint_at: Option<Instant>,
    moved: Option<Instant>,
    wants_screenshot: bool,
    open: Opener,
    keep: Keeper,
    recorder: Option<Recorder>,
    shaders: Option<SourceTree>,
    write: Writer,
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
        let response = viewer.input.on_window_event(&viewer.surface.window, &event);
        // That it is to be painted is no reason to paint it again.
        if response.repaint && event != WindowEvent::RedrawRequested {
            viewer.surface.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                viewer.surface.configure(&viewer.seen.gpu.device)
            }
            WindowEvent::DroppedFile(path) => viewer.open_file(&path),
            WindowEvent::RedrawRequested if viewer.frame().close => events.exit(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(viewer) = &mut self.open else { return };
        let is_news = viewer.read_shaders() | viewer.poll();
        let only_gets_better = viewer.only_gets_better();
        let is_asked_for = viewer.repaint_at.take_if(|at| *at <= Instant::now()).is_some();
        if is_news || is_asked_for || viewer.has_more() && !only_gets_better {
            viewer.surface.window.request_redraw();
        } else if only_gets_better {
            viewer.draw_both(0.0);
        }
        let works = viewer.has_more() || viewer.is_busy() || viewer.beside.is_working();
        let looks =
            if works { Some(viewer.look_again()) } else { viewer.shaders.as_ref().map(|_| source_tree::PERIOD) };
        let looks_at = looks.map(|period| Instant::now() + period);
        let next = looks_at.into_iter().chain(viewer.repaint_at).min();
        events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
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
        let context = egui::Context::default();
        // A frame of the window may take as long as one of the picture: nothing unfolds step by step.
        context.all_styles_mut(|style| style.animation_time = 0.0);
        let most = gpu.device.limits().max_texture_dimension_2d as usize;
        let scale = Some(window.scale_factor() as f32);
        let input = egui_winit::State::new(context, ViewportId::ROOT, &window, scale, None, Some(most));
        let surface = Surface::new(window, instance, surface, &adapter, &gpu.device)?;
        let Start { name, scene, camera, settings, open, keep, write, record, shaders, .. } = start;
        let mut controls = Controls::new(camera, scene.bounds().size().length());
        let recorder = record.map(|(step, keep)| Recorder::begin(&mut controls, step, keep));
        let clip = player::clip_of(&scene);
        let seen = Seen::new(gpu, scene, &settings)?;
        let state = State {
            usual: settings.clone(),
            wipe: Wipe::new(&settings),
            pointed: None,
            listing: Listing::default(),
            settings,
            controls,
            clip,
            message: String::new(),
            shows_keys: false,
            shows_panels: true,
        };
        let (room, last) = (UVec2::new(width, height), Instant::now());
        let mut viewer = Self {
            surface,
            input,
            pictures: [const { None }; 3],
            state,
            seen,
            beside: Beside::default(),
            name,
            pace: Pace::default(),
            room,
            moment: None,
            last,
            opened: last,
            frame_ms: 0.0,
            paints: Paints::default(),
            painted: (last, None),
            repaint_at: None,
            // The first picture is a small one: how long a frame takes is not known.
            moved: Some(last),
            wants_screenshot: false,
            open,
            keep,
            recorder,
            shaders: shaders.map(SourceTree::new),
            write,
        };
        viewer.surface.configure(&viewer.seen.gpu.device);
        viewer.surface.window.request_redraw();
        Ok(viewer)
    }

    /// Whether anything would be drawn that is not there yet. While the device is busy the panels need not be painted again, unless something
    /// moves.
    fn has_more(&self) -> bool {
        let camera = &self.state.controls.camera;
        let is_whole = self.seen.size() == self.room && !self.seen.has_more(camera);
        let is_whole = is_whole && !self.beside.has_more(&self.seen, &self.state.wipe, camera);
        self.moves() || !(self.is_busy() || is_whole)
    }

    /// Whether the next frame changes nothing but means, which were painted a short while ago: it is drawn, and not painted.
    fn only_gets_better(&self) -> bool {
        let (at, mean) = self.painted;
        let is_painted = mean.is_some() && mean == self.seen.mean() && self.seen.size() == self.room;
        is_painted && !self.moves() && self.has_more() && !self.paints.is_due(1e3 * at.elapsed().as_secs_f64())
    }

    /// How long it is until it is asked again whether the device is done.
    fn look_again(&self) -> Duration {
        let [least, most] = LOOK_AGAIN;
        Duration::from_secs_f64(1e-3 * self.frame_ms / LOOKS_IN_A_FRAME).clamp(least, most)
    }

    /// Whether the device has not yet done what it was told of one of the pictures.
    fn is_busy(&self) -> bool {
        self.seen.is_busy() || self.beside.is_busy()
    }

    /// Whether the next frame shows something else than the last, whoever sits there.
    fn moves(&self) -> bool {
        let plays = self.state.clip.as_ref().is_some_and(|clip| clip.is_playing);
        plays || self.recorder.is_some() || self.moved.is_some()
    }

    /// Asks what has become of the last frame of the pictures: whether anything is there that was not, and nothing better comes at once.
    fn poll(&mut self) -> bool {
        let of_first = self.seen.poll();
        let news = self.beside.poll(&self.seen);
        if let Some(found) = news.found
            && let Some(pointed) = &mut self.state.pointed
        {
            pointed.found = Some(found);
        }
        if let Some(failed) = news.failed {
            self.state.message = failed;
        }
        if let Some(ms) = news.ms.or(of_first) {
            let size = self.seen.size();
            self.pace.took(u64::from(size.x) * u64::from(size.y), ms);
            self.frame_ms = ms;
            let now = 1e3 * self.opened.elapsed().as_secs_f64();
            let period = self.paints.ended(now, !self.moves() && self.has_more());
            tracing::debug!(
                "frame of {size}: {ms:.1} ms; {} are averaged; {period:.1?} since the one before; a paint takes {:.1?} ms",
                self.seen.averaged(),
                self.paints.ms()
            );
        }
        if of_first.is_some() {
            self.keep_picture();
        }
        news.is_new || of_first.is_some() && !self.has_more()
    }

    /// Takes the shaders of the source tree that were saved since the last time: whether there are any.
    fn read_shaders(&mut self) -> bool {
        let Some(texts) = self.shaders.as_mut().and_then(SourceTree::look) else { return false };
        let camera = &self.state.controls.camera;
        let first = self.seen.edit_shaders(texts.clone(), camera);
        let done = first.and_then(|()| self.beside.edit_shaders(texts, camera));
        self.state.message =
            done.map_or_else(|error| error.to_string(), |()| "The shaders are those of the source tree".to_owned());
        true
    }

    fn open_file(&mut self, path: &std::path::Path) {
        let opened = (self.open)(path);
        let done = opened.and_then(|Opened { name, scene, camera }| {
            let controls = Controls::new(camera, scene.bounds().size().length());
            let clip = player::clip_of(&scene);
            self.beside.let_go();
            self.seen.open(scene).map_err(|error| error.to_string())?;
            self.surface.window.set_title(&format!("{name} – Lanternfish"));
            (self.name, self.state.controls, self.state.clip, self.moment) = (name, controls, clip, None);
            self.state.pointed = None;
            // What was recorded is of the scene that was there.
            self.recorder.take().map_or(Ok(()), Recorder::end)
        });
        self.state.message = done.err().unwrap_or_default();
        self.surface.window.request_redraw();
    }
}
