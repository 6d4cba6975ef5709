//! The window: what it shows, and the order of a frame.

mod frame;
mod renderings;

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use glam::UVec2;
use lanternfish_scene::generate::Rain;
use winit::{
    event_loop::{ActiveEventLoop, OwnedDisplayHandle},
    window::Window,
};

use crate::{
    Keeper, Moment, Opened, Opener, Start, ViewerError, Writer, clusters,
    comparison::Comparison,
    controls::Controls,
    events::{self, Program},
    overlay::Overlays,
    panels::{Listing, Memory, State},
    player,
    record::Recorder,
    repaint_limiter::RepaintLimiter,
    resolution_scaling::ResolutionScaling,
    source_tree::{self, SourceTree},
    stereo::Stereo,
    surface::{self, Known, Surface},
    viewport::Viewport,
    window_state::WindowState,
    wipe::Wipe,
};

/// How long the camera rests before the image is drawn whole.
const REST: Duration = Duration::from_millis(250);
/// How often it is asked whether the device is done, where nothing else happens: at most and at least, and of how many times in a frame.
const LOOK_AGAIN: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(8)];
const LOOKS_IN_A_FRAME: f64 = 200.0;

/// An open window.
struct Viewer {
    surface: Surface,
    /// A, B, and where they differ, as egui knows them.
    renderings: [Known; 3],
    state: State,
    viewport: Viewport,
    comparison: Comparison,
    name: String,
    resolution_scaling: ResolutionScaling,
    /// Pixels of the window that the image has.
    room: UVec2,
    /// The moment of animations and rain that is on the device.
    moment: Option<Moment>,
    /// Lights that fall while time passes.
    rain: Option<Rain>,
    last: Instant,
    opened: Instant,
    frame_ms: f64,
    memory: Memory,
    repaint_limiter: RepaintLimiter,
    /// When the window was last painted, and which mean of frames that showed.
    painted: (Instant, Option<u64>),
    moved: Option<Instant>,
    wants_screenshot: bool,
    open: Opener,
    keep: Keeper,
    recorder: Option<Recorder>,
    shaders: Option<SourceTree>,
    write: Writer,
    /// Where it is written what the next window is told.
    kept: Option<PathBuf>,
}

/// Opens the window, and returns when it is closed.
pub fn run(start: Start) -> Result<(), ViewerError> {
    events::run::<Viewer>(start)
}

impl Program for Viewer {
    type Start = Start;

    fn open(events: &ActiveEventLoop, display: &OwnedDisplayHandle, start: Start) -> Result<Self, ViewerError> {
        let kept = start.kept.as_deref().map(WindowState::read).unwrap_or_default();
        let [width, height] = kept.size.filter(|_| !start.size_is_chosen).unwrap_or(start.size);
        let mut attributes = Window::default_attributes()
            .with_title(format!("{} – Lanternfish", start.name))
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        // A screen that is gone would hide it.
        if let Some([x, y]) = kept.position.filter(|place| is_on_a_screen(events, *place)) {
            attributes = attributes.with_position(winit::dpi::PhysicalPosition::new(x, y));
        }
        let (surface, gpu) = surface::open(events, display, attributes, &start.adapter)?;
        let Start {
            name,
            scene,
            camera,
            eyes,
            settings,
            open,
            keep,
            write,
            record,
            shaders,
            moment,
            rain,
            kept: keeps,
            ..
        } = start;
        let mut controls = Controls::new(camera, scene.bounds().size().length());
        let recorder = record.map(|(step, keep)| Recorder::begin(&mut controls, step, keep));
        let clip = player::clip_at(&scene, rain.is_some(), moment);
        let viewport = Viewport::new(gpu, scene, &settings)?;
        let state = State {
            usual: settings.clone(),
            wipe: Wipe::new(&settings),
            stereo: Stereo::new(eyes),
            pointed: None,
            listing: Listing::default(),
            written: None,
            overlays: Overlays::default(),
            settings,
            controls,
            clip,
            message: String::new(),
            shows_keys: false,
            shows_panels: kept.shows_panels,
            is_unfolded: false,
            unfold: None,
        };
        let (room, last) = (UVec2::new(width, height), Instant::now());
        Ok(Self {
            surface,
            renderings: [const { None }; 3],
            state,
            viewport,
            comparison: Comparison::default(),
            name,
            resolution_scaling: ResolutionScaling::default(),
            room,
            // The scene is as it is at the start of what it plays.
            moment: moment.map(|moment| Moment { time: 0.0, ..moment }),
            rain,
            last,
            opened: last,
            frame_ms: 0.0,
            memory: Memory::default(),
            repaint_limiter: RepaintLimiter::default(),
            painted: (last, None),
            // The first image is a small one: how long a frame takes is not known.
            moved: Some(last),
            wants_screenshot: false,
            open,
            keep,
            recorder,
            shaders: shaders.map(SourceTree::new),
            write,
            kept: keeps,
        })
    }

    fn surface(&mut self) -> (&mut Surface, &wgpu::Device) {
        (&mut self.surface, &self.viewport.gpu.device)
    }

    fn dropped(&mut self, path: &Path) {
        self.open_file(path);
    }

    fn frame(&mut self) -> bool {
        self.show().close
    }

    fn has_news(&mut self) -> bool {
        let is_news = self.read_shaders() | self.poll();
        is_news || self.has_more() && !self.only_gets_better()
    }

    fn go_on(&mut self) {
        if self.only_gets_better() {
            self.look_from_above();
            self.draw_both(0.0);
        }
    }

    fn look_again(&self) -> Option<Duration> {
        let works = self.has_more() || self.is_busy() || self.comparison.is_working();
        if works { Some(self.period()) } else { self.shaders.as_ref().map(|_| source_tree::PERIOD) }
    }

    fn close(mut self) -> Result<(), ViewerError> {
        self.leave();
        let recorder = self.recorder.take();
        drop(self);
        recorder.map_or(Ok(()), Recorder::end).map_err(ViewerError::Record)
    }
}

impl Viewer {
    /// Whether anything would be drawn that is not there yet. While the device is busy the panels need not be painted again, unless something
    /// moves.
    fn has_more(&self) -> bool {
        let camera = &self.state.controls.camera;
        let is_complete = self.viewport.size() == self.room
            && !self.viewport.has_more(camera)
            && self.viewport.eyes() == self.state.eyes();
        let is_complete = is_complete && !self.comparison.has_more(&self.viewport, &self.state.wipe, camera);
        self.moves() || !(self.is_busy() || is_complete)
    }

    /// Whether the next frame changes nothing but means, which were painted a short while ago: it is drawn, and not painted.
    fn only_gets_better(&self) -> bool {
        let (at, mean) = self.painted;
        let is_painted = mean.is_some() && mean == self.viewport.mean() && self.viewport.size() == self.room;
        is_painted && !self.moves() && self.has_more() && !self.repaint_limiter.is_due(1e3 * at.elapsed().as_secs_f64())
    }

    /// How long it is until it is asked again whether the device is done.
    fn period(&self) -> Duration {
        let [least, most] = LOOK_AGAIN;
        Duration::from_secs_f64(1e-3 * self.frame_ms / LOOKS_IN_A_FRAME).clamp(least, most)
    }

    /// True if the device has not yet done what it was told of one of the images.
    fn is_busy(&self) -> bool {
        self.viewport.is_busy() || self.comparison.is_busy()
    }

    /// Whether the next frame shows something else than the last, whoever sits there.
    fn moves(&self) -> bool {
        let plays = self.state.clip.as_ref().is_some_and(|clip| clip.is_playing);
        plays || self.recorder.is_some() || self.moved.is_some()
    }

    /// Asks what has become of the last frame of the images: whether anything is there that was not, and nothing better comes at once.
    fn poll(&mut self) -> bool {
        let of_first = self.viewport.poll();
        let news = self.comparison.poll(&self.viewport);
        if let Some(found) = news.found
            && let Some(pointed) = &mut self.state.pointed
        {
            let place = found.place.as_ref().filter(|_| self.viewport.shows(&pointed.camera));
            // Who has clicked waits a moment for what the device knows.
            pointed.cluster =
                place.and_then(|place| clusters::at(&self.viewport.clusters().ok()?, pointed.eye, place.p));
            let pixel = (pointed.at * self.viewport.size().as_vec2()).as_uvec2();
            pointed.tile = place.and_then(|_| self.viewport.tiles().ok()?.get(pointed.eye)?.at(pixel));
            pointed.found = Some(found);
        }
        if let Some(failed) = news.failed {
            self.state.message = failed;
        }
        if let Some(ms) = news.ms.or(of_first) {
            let size = self.viewport.size();
            self.resolution_scaling.took(u64::from(size.x) * u64::from(size.y), ms);
            self.frame_ms = ms;
            self.memory.ask_again(&self.viewport);
            let now = 1e3 * self.opened.elapsed().as_secs_f64();
            let period = self.repaint_limiter.ended(now, !self.moves() && self.has_more());
            tracing::debug!(
                "frame of {size}: {ms:.1} ms; {} are averaged; {period:.1?} since the one before; a paint takes {:.1?} ms",
                self.viewport.averaged(),
                self.repaint_limiter.ms()
            );
        }
        if of_first.is_some() {
            self.keep_image();
        }
        news.is_new || of_first.is_some() && !self.has_more()
    }

    /// Takes the shaders of the source tree that were saved since the last time: whether there are any.
    fn read_shaders(&mut self) -> bool {
        let Some(texts) = self.shaders.as_mut().and_then(SourceTree::look) else { return false };
        let camera = &self.state.controls.camera;
        let first = self.viewport.edit_shaders(texts.clone(), camera);
        let done = first.and_then(|()| self.comparison.edit_shaders(texts, camera));
        self.state.message =
            done.map_or_else(|error| error.to_string(), |()| "The shaders are those of the source tree".to_owned());
        true
    }

    fn open_file(&mut self, path: &Path) {
        let opened = (self.open)(path);
        let done = opened.and_then(|Opened { name, scene, camera, eyes, settings, moment, rain }| {
            let controls = Controls::new(camera, scene.bounds().size().length());
            let clip = player::clip_at(&scene, rain.is_some(), moment);
            self.comparison.let_go();
            if let Some(settings) = settings {
                self.viewport.set(&settings).map_err(|error| error.to_string())?;
                (self.state.settings, self.state.usual, self.state.written) = (settings.clone(), settings, None);
            }
            self.viewport.open(scene).map_err(|error| error.to_string())?;
            self.surface.window.set_title(&format!("{name} – Lanternfish"));
            (self.name, self.state.controls, self.state.clip) = (name, controls, clip);
            if eyes.is_some() {
                self.state.stereo = Stereo::new(eyes);
                self.state.show_stereo(true);
            }
            (self.moment, self.rain) = (moment.map(|moment| Moment { time: 0.0, ..moment }), rain);
            (self.state.pointed, self.memory) = (None, Memory::default());
            (self.state.overlays.birds_eye, self.state.overlays.wants_birds_eye) = (None, false);
            // What was recorded is of the scene that was there.
            self.recorder.take().map_or(Ok(()), Recorder::end)
        });
        self.state.message = done.err().unwrap_or_default();
    }

    /// Tells the next window of this one.
    fn leave(&self) {
        let Some(path) = &self.kept else { return };
        let window = &self.surface.window;
        let size = window.inner_size().to_logical::<u32>(window.scale_factor());
        let position = window.outer_position().ok().map(|place| [place.x, place.y]);
        WindowState { size: Some([size.width, size.height]), position, shows_panels: self.state.shows_panels }
            .write(path);
    }
}

/// True if a window whose frame begins there can be taken hold of.
fn is_on_a_screen(events: &ActiveEventLoop, [x, y]: [i32; 2]) -> bool {
    events.available_monitors().any(|screen| {
        let (corner, size) = (screen.position(), screen.size());
        let is_within = |at: i32, from: i32, size: u32| (from..from.saturating_add_unsigned(size)).contains(&at);
        is_within(x.saturating_add(40), corner.x, size.width) && is_within(y.saturating_add(10), corner.y, size.height)
    })
}
