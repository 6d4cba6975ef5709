//! The viewer window: its state, and the order of work in a frame.

mod events;
mod frame;
mod renderings;
mod slices;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use glam::UVec2;
use lanternfish::{RenderError, ResolutionScaling};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{Controls, Recorder, generate::Rain, motion::Moment};
use winit::{
    event_loop::{ActiveEventLoop, OwnedDisplayHandle},
    window::Window,
};

use crate::{
    Keeper, Opened, Opener, Start, ViewerError, Writer,
    background::ProbeResult,
    clusters,
    comparison::Comparison,
    overlay::Overlays,
    panels::{Listing, Memory, State},
    player,
    repaint_limiter::RepaintLimiter,
    slice_scheduler::SliceScheduler,
    source_tree::{self, SourceTree},
    stereo::Stereo,
    surface::{self, Registered, Surface},
    viewport::Viewport,
    window_state::WindowState,
    wipe::Wipe,
};

pub use events::run;

/// Longest time of a frame while the view moves, ms. Above, its resolution is reduced.
const BUDGET: f64 = 60.0;
/// Rest time of the camera before the image is drawn at full resolution.
const REST: Duration = Duration::from_millis(250);
/// Shortest and longest period of device polls while no event arrives.
const POLL_PERIODS: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(8)];
/// Period of paints while something moves and a frame is in flight.
const MOTION_PERIOD: Duration = Duration::from_millis(100);
/// Device polls per frame of the image, within [`POLL_PERIODS`].
const POLLS_PER_FRAME: f64 = 200.0;

/// An open window.
struct Viewer {
    surface: Surface,
    /// A, B, and their difference map, registered with egui.
    renderings: [Registered; 3],
    state: State,
    viewport: Viewport,
    comparison: Comparison,
    name: String,
    resolution_scaling: ResolutionScaling,
    slice_scheduler: SliceScheduler,
    /// The result of a probe that arrived while a frame was in flight.
    probe_result: Option<ProbeResult>,
    /// Size of the image's area in the window, pixels.
    viewport_size: UVec2,
    /// The time of animation and light rain that is on the device.
    moment: Option<Moment>,
    /// Light rain.
    rain: Option<Rain>,
    last: Instant,
    opened: Instant,
    frame_ms: f64,
    memory: Memory,
    repaint_limiter: RepaintLimiter,
    /// Time of the last paint, and the accumulated image that it showed.
    painted: (Instant, Option<u64>),
    moved: Option<Instant>,
    wants_screenshot: bool,
    open: Opener,
    keep: Keeper,
    recorder: Option<Recorder>,
    shaders: Option<SourceTree>,
    write: Writer,
    /// The file of the window state for the next window.
    state_file: Option<PathBuf>,
}

impl Viewer {
    /// Opens the window.
    fn open(events: &ActiveEventLoop, display: &OwnedDisplayHandle, start: Start) -> Result<Self, ViewerError> {
        let window_state = start.kept.as_deref().map(WindowState::read).unwrap_or_default();
        let [width, height] = window_state.size.filter(|_| !start.size_is_chosen).unwrap_or(start.size);
        let mut attributes = Window::default_attributes()
            .with_title(format!("{} – Lanternfish", start.name))
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        // A position on a disconnected screen would hide the window.
        if let Some([x, y]) = window_state.position.filter(|place| is_on_a_screen(events, *place)) {
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
            kept: state_file,
            ..
        } = start;
        let mut controls = Controls::new(camera, scene.bounds().size().length());
        let recorder = record.map(|(step, keep)| Recorder::begin(&mut controls, step, keep));
        let clip = player::clip_at(&scene, rain.is_some(), moment);
        // A software adapter has passes that take seconds. On a second device, the operating system runs paints beside
        // them.
        let (gpu, interface) = match gpu.description.kind {
            wgpu::DeviceType::Cpu => {
                (Gpu::open_listed(&gpu.description).map_err(RenderError::from)?, Some(Arc::new(gpu)))
            }
            _ => (gpu, None),
        };
        let viewport = Viewport::new(gpu, scene, &settings)?.of_window(interface);
        let state = State {
            defaults: settings.clone(),
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
            shows_panels: window_state.shows_panels,
            is_unfolded: false,
            unfold: None,
        };
        let (viewport_size, last) = (UVec2::new(width, height), Instant::now());
        Ok(Self {
            surface,
            renderings: [const { None }; 3],
            state,
            viewport,
            comparison: Comparison::default(),
            name,
            resolution_scaling: ResolutionScaling::new(BUDGET),
            slice_scheduler: SliceScheduler::default(),
            probe_result: None,
            viewport_size,
            // The uploaded scene is in the state at 0 s.
            moment: moment.map(|moment| Moment { time: 0.0, ..moment }),
            rain,
            last,
            opened: last,
            frame_ms: 0.0,
            memory: Memory::default(),
            repaint_limiter: RepaintLimiter::default(),
            painted: (last, None),
            // The first image has a low resolution, since the frame time is unknown.
            moved: Some(last),
            wants_screenshot: false,
            open,
            keep,
            recorder,
            shaders: shaders.map(SourceTree::new),
            write,
            state_file,
        })
    }

    /// Polls the device and threads without blocking. Returns whether to repaint the window.
    fn has_news(&mut self) -> bool {
        let is_news = self.read_shaders() | self.poll();
        let is_next = match self.moves() && self.is_busy() {
            // The camera moves on, though the frame in flight is of the camera before.
            true => self.painted.0.elapsed() >= MOTION_PERIOD,
            false => self.has_more() && !self.only_accumulates(),
        };
        self.proceed(is_news || is_next)
    }

    /// Continues work when the window is not painted.
    fn go_on(&mut self) {
        if self.only_accumulates() {
            self.toggle_birds_eye();
            self.draw_both(0.0);
        }
    }

    /// Time until the next [`Self::has_news`]; `None` waits for an event.
    fn look_again(&self) -> Option<Duration> {
        let works = self.has_more() || self.is_busy() || self.comparison.is_working();
        if works { Some(self.period()) } else { self.shaders.as_ref().map(|_| source_tree::PERIOD) }
    }

    /// Closes the window.
    fn close(mut self) -> Result<(), ViewerError> {
        self.write_window_state();
        let recorder = self.recorder.take();
        drop(self);
        recorder.map_or(Ok(()), Recorder::end).map_err(ViewerError::Record)
    }

    /// True if another frame would change the images. While a frame is in flight, true only if something moves.
    fn has_more(&self) -> bool {
        let camera = &self.state.controls.camera;
        let is_complete = self.viewport.size() == self.viewport_size
            && !self.viewport.has_more(camera)
            && self.viewport.eyes() == self.state.eyes();
        let is_complete = is_complete && !self.comparison.has_more(&self.viewport, &self.state.wipe, camera);
        self.moves() || !(self.is_busy() || is_complete)
    }

    /// True if the next frame only continues the accumulation, and the window was painted recently. Such a frame is
    /// drawn without a paint.
    fn only_accumulates(&self) -> bool {
        let (at, mean) = self.painted;
        let is_painted = mean.is_some() && mean == self.viewport.mean() && self.viewport.size() == self.viewport_size;
        is_painted && !self.moves() && self.has_more() && !self.repaint_limiter.is_due(1e3 * at.elapsed().as_secs_f64())
    }

    /// Time until the next device poll.
    fn period(&self) -> Duration {
        let [least, most] = POLL_PERIODS;
        if self.has_slices() {
            return least;
        }
        Duration::from_secs_f64(1e-3 * self.frame_ms / POLLS_PER_FRAME).clamp(least, most)
    }

    /// True if a frame of either side is still in flight.
    fn is_busy(&self) -> bool {
        self.viewport.is_busy() || self.comparison.is_busy()
    }

    /// True if time goes on from frame to frame: in motion, and always while a recording counts steps.
    fn moves(&self) -> bool {
        self.is_in_motion() || self.recorder.is_some()
    }

    /// True if the view changes from frame to frame: playback, or recent camera motion.
    fn is_in_motion(&self) -> bool {
        self.state.clip.as_ref().is_some_and(|clip| clip.is_playing) || self.moved.is_some()
    }

    /// Polls the frames in flight and the threads. Returns whether to repaint the window: B has changed, or a frame of
    /// A is done and no other follows immediately.
    fn poll(&mut self) -> bool {
        let of_first = self.viewport.poll();
        let news = self.comparison.poll(&self.viewport);
        self.probe_result = news.probe_result.or(self.probe_result.take());
        // Reading of clusters and tiles would wait for the frame in flight.
        let probe_result = self.probe_result.take_if(|_| !self.viewport.is_busy());
        let has_probed = probe_result.is_some();
        if let Some(result) = probe_result
            && let Some(pointed) = &mut self.state.pointed
        {
            let place = result.place.as_ref().filter(|_| self.viewport.shows(&pointed.camera));
            // The cluster and tile contents are read back at once, which blocks for a moment after a click.
            pointed.cluster =
                place.and_then(|place| clusters::at(&self.viewport.clusters().ok()?, pointed.eye, place.p));
            let pixel = (pointed.at * self.viewport.size().as_vec2()).as_uvec2();
            pointed.tile = place.and_then(|_| self.viewport.tiles().ok()?.get(pointed.eye)?.at(pixel));
            pointed.probe_result = Some(result);
        }
        if let Some(failed) = news.failed {
            self.state.message = failed;
        }
        if let Some(ms) = news.ms.or(of_first) {
            let size = self.viewport.size();
            // An incomplete frame is drawn again in its size, with larger lists.
            if self.viewport.report.as_ref().is_some_and(|report| report.is_complete) {
                self.resolution_scaling.took(u64::from(size.x) * u64::from(size.y), ms);
            }
            self.frame_ms = ms;
            self.memory.refresh(&self.viewport);
            let now = 1e3 * self.opened.elapsed().as_secs_f64();
            let period = self.repaint_limiter.ended(now, !self.moves() && self.has_more());
            let passes = self.viewport.report.iter().flat_map(|report| &report.passes);
            let on_device: f64 = passes.map(|pass| pass.ms).sum();
            tracing::debug!(
                "frame of {size} pixels: {ms:.1} ms, {on_device:.1} on the device; mean of {} frames; {period:.1?} since the last; a paint takes {:.1?} ms",
                self.viewport.averaged(),
                self.repaint_limiter.ms()
            );
        }
        if of_first.is_some() {
            self.keep_image();
        }
        news.is_new || has_probed || of_first.is_some() && !self.has_more()
    }

    /// Reloads shaders of the source tree that were saved since the last call. Returns true if there were any.
    fn read_shaders(&mut self) -> bool {
        let Some(texts) = self.shaders.as_mut().and_then(SourceTree::look) else { return false };
        let camera = &self.state.controls.camera;
        let first = self.viewport.edit_shaders(texts.clone(), camera);
        let done = first.and_then(|()| self.comparison.edit_shaders(texts, camera));
        self.state.message =
            done.map_or_else(|error| error.to_string(), |()| "Shaders reloaded from the source tree".to_owned());
        true
    }

    /// Opens a file that was dropped on the window.
    fn open_file(&mut self, path: &Path) {
        let opened = (self.open)(path);
        let done = opened.and_then(|Opened { name, scene, camera, eyes, settings, exposure, moment, rain }| {
            let controls = Controls::new(camera, scene.bounds().size().length());
            let clip = player::clip_at(&scene, rain.is_some(), moment);
            self.comparison.release_scene();
            if let Some(settings) = settings {
                self.viewport.set(&settings).map_err(|error| error.to_string())?;
                (self.state.settings, self.state.defaults, self.state.written) = (settings.clone(), settings, None);
            }
            self.state.settings.image.exposure = exposure.unwrap_or(self.state.settings.image.exposure);
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
            // The recording belongs to the previous scene.
            self.recorder.take().map_or(Ok(()), Recorder::end)
        });
        self.state.message = done.err().unwrap_or_default();
    }

    /// Writes the window state for the next window.
    fn write_window_state(&self) {
        let Some(path) = &self.state_file else { return };
        let window = &self.surface.window;
        let size = window.inner_size().to_logical::<u32>(window.scale_factor());
        let position = window.outer_position().ok().map(|place| [place.x, place.y]);
        WindowState { size: Some([size.width, size.height]), position, shows_panels: self.state.shows_panels }
            .write(path);
    }
}

/// True if the title bar of a window at this position, pixels, is on a screen.
fn is_on_a_screen(events: &ActiveEventLoop, [x, y]: [i32; 2]) -> bool {
    events.available_monitors().any(|screen| {
        let (corner, size) = (screen.position(), screen.size());
        let is_within = |at: i32, from: i32, size: u32| (from..from.saturating_add_unsigned(size)).contains(&at);
        is_within(x.saturating_add(40), corner.x, size.width) && is_within(y.saturating_add(10), corner.y, size.height)
    })
}
