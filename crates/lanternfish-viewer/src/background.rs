//! A background thread on the CPU: path-traces the reference image of the view, sample by sample, and probes pixels.
//!
//! The path tracer's own threads share the work. The host BVH is built once per scene and stored until another scene is requested.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed},
        mpsc::{Receiver, Sender, TryRecvError, channel},
    },
    thread,
    time::{Duration, Instant},
};

use glam::UVec2;
use lanternfish::{
    output::display,
    settings::{Settings, ToneMap},
};
use lanternfish_reference::{Film, LightAt, Probed, RayFrom, Settings as Transport, Tracer};
use lanternfish_scene::{Camera, Scene};

/// Samples per pixel after which tracing stops.
const MOST_SAMPLES: u64 = 1 << 16;
/// Shortest time between two reports of an image in progress.
const REPORT_PERIOD: Duration = Duration::from_millis(100);
/// Maximum number of lights in a probe result.
const MOST_LIGHTS: usize = 64;
/// Number of indirect rays in a probe result.
const RAYS: u32 = 64;

/// The subject of a request: a scene and its light transport settings.
#[derive(Clone, Debug)]
pub struct Subject {
    scene: Arc<Scene>,
    transport: Transport,
}

impl Subject {
    /// Creates a subject with the settings that define materials, attenuation and size of lights. The path tracer computes full light transport, including
    /// what the render settings leave out.
    pub fn new(scene: &Arc<Scene>, settings: &Settings) -> Self {
        let transport = Transport {
            materials: settings.materials.model,
            attenuation: settings.lights.attenuation,
            attenuation_near_radius: settings.lights.near_radius,
            attenuation_coefficients: settings.lights.coefficients,
            range_threshold: settings.lights.range_threshold,
            light_radius: settings.lights.radius,
            sun_diameter: settings.lights.sun_diameter,
            ..Transport::default()
        };
        Self { scene: Arc::clone(scene), transport }
    }

    fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene) && self.transport == other.transport
    }
}

/// Exposure and tone mapping of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Exposure, EV.
    pub ev: f32,
    /// Tone-mapping curve.
    pub tone_map: ToneMap,
}

/// An image of the path tracer.
#[derive(Clone, Debug)]
pub struct Traced {
    number: u64,
    /// Display-encoded RGBA, rows from the top.
    pub bytes: Vec<u8>,
    /// Width and height, pixels.
    pub size: UVec2,
    /// Samples per pixel.
    pub samples: u64,
}

/// The surface at a pixel, and its light.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeResult {
    /// The surface; `None` where the pixel shows the environment.
    pub place: Option<Probed>,
    /// Lights that illuminate the surface if unoccluded, by decreasing irradiance.
    pub lights: Vec<LightAt>,
    /// Number of such lights, including those not in `lights`.
    pub light_count: usize,
    /// Indirect rays from the surface.
    pub rays: Vec<RayFrom>,
}

/// A report of the thread.
#[derive(Debug)]
pub enum Report {
    /// The image with the samples so far.
    RenderedImage(Traced),
    /// The result of the last requested probe.
    Pixel(ProbeResult),
    /// The error message of a failed request.
    Failed(String),
}

enum Order {
    RenderedImage {
        number: u64,
        subject: Subject,
        camera: Camera,
        size: UVec2,
    },
    Pixel {
        subject: Subject,
        camera: Camera,
        at: [f64; 2],
        size: UVec2,
    },
    Look(Look),
    /// Releases the scene.
    Forget,
}

/// State that both threads access during tracing.
#[derive(Debug, Default)]
struct Shared {
    /// Number of the requested image; 0 for none.
    requested: AtomicU64,
    /// Number of orders in the queue.
    waiting: AtomicUsize,
}

/// A handle to the thread. The thread ends when the handle is dropped.
#[derive(Debug)]
pub struct Background {
    orders: Sender<Order>,
    reports: Receiver<Report>,
    shared: Arc<Shared>,
    /// Number of the last requested image.
    last: u64,
    /// True if the image has all its samples.
    is_done: bool,
    /// Number of pending probes.
    pixels: usize,
    has_ended: bool,
}

impl Background {
    /// Starts the thread.
    pub fn start() -> Self {
        let ((orders, taken), (sender, reports)) = (channel(), channel());
        let shared = Arc::new(Shared::default());
        let worker = Worker { orders: taken, sender, shared: Arc::clone(&shared), look: None };
        thread::spawn(move || worker.run());
        Self { orders, reports, shared, last: 0, is_done: false, pixels: 0, has_ended: false }
    }

    /// Starts an image, and cancels the previous one.
    pub fn trace(&mut self, subject: Subject, camera: &Camera, size: UVec2) {
        self.last += 1;
        self.is_done = false;
        self.shared.requested.store(self.last, Relaxed);
        self.order(Order::RenderedImage { number: self.last, subject, camera: camera.clone(), size });
    }

    /// Cancels the image.
    pub fn stop(&mut self) {
        self.shared.requested.store(0, Relaxed);
    }

    /// Sets exposure and tone mapping of the image.
    pub fn show_as(&mut self, look: Look) {
        self.order(Order::Look(look));
    }

    /// Requests a probe at a position of the image, pixels from its top left. It interrupts the image in progress.
    pub fn probe(&mut self, subject: Subject, camera: &Camera, at: [f64; 2], size: UVec2) {
        self.pixels += 1;
        self.order(Order::Pixel { subject, camera: camera.clone(), at, size });
    }

    /// Cancels the image and releases the scene.
    pub fn forget(&mut self) {
        self.stop();
        self.order(Order::Forget);
    }

    /// True if further reports will come.
    pub fn is_working(&self) -> bool {
        !self.has_ended && (self.pixels > 0 || (self.shared.requested.load(Relaxed) != 0 && !self.is_done))
    }

    /// The next report, if there is one. Does not block.
    pub fn poll(&mut self) -> Option<Report> {
        loop {
            let report = match self.reports.try_recv() {
                Ok(report) => report,
                Err(TryRecvError::Disconnected) if !std::mem::replace(&mut self.has_ended, true) => {
                    Report::Failed("the path tracer stopped".to_owned())
                }
                Err(_) => return None,
            };
            match &report {
                Report::RenderedImage(traced) if traced.number != self.shared.requested.load(Relaxed) => continue,
                // A finished image is reported again if its exposure changes.
                Report::RenderedImage(traced) => self.is_done = traced.samples >= MOST_SAMPLES,
                Report::Pixel(_) => {
                    self.pixels = self.pixels.saturating_sub(1);
                    if self.pixels > 0 {
                        // A newer probe is pending.
                        continue;
                    }
                }
                Report::Failed(_) => {
                    self.pixels = 0;
                    self.stop();
                }
            }
            return Some(report);
        }
    }

    fn order(&self, order: Order) {
        self.shared.waiting.fetch_add(1, Relaxed);
        // Sending fails only if the thread panicked, which `poll` reports.
        let _ = self.orders.send(order);
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.stop();
    }
}

/// The state of the thread.
struct Worker {
    orders: Receiver<Order>,
    sender: Sender<Report>,
    shared: Arc<Shared>,
    look: Option<Look>,
}

/// An image in progress.
struct RenderedImage {
    number: u64,
    camera: Camera,
    film: Film,
    reported: Option<Instant>,
}

impl Worker {
    fn run(mut self) {
        let mut next = self.take();
        while let Some(order) = next {
            next = match &order {
                Order::RenderedImage { subject, .. } | Order::Pixel { subject, .. } => {
                    let subject = subject.clone();
                    match Tracer::new(&subject.scene, subject.transport.clone()) {
                        Ok(tracer) => self.serve(&tracer, &subject, order),
                        Err(error) => {
                            self.send(Report::Failed(error.to_string()));
                            self.take()
                        }
                    }
                }
                Order::Look(look) => {
                    self.look = Some(*look);
                    self.take()
                }
                Order::Forget => self.take(),
            };
        }
    }

    /// Executes orders for one scene. Returns the first order for another scene, or `None` if the handle was dropped.
    fn serve(&mut self, tracer: &Tracer<'_>, about: &Subject, first: Order) -> Option<Order> {
        let mut rendering: Option<RenderedImage> = None;
        let mut order = Some(first);
        loop {
            match order.take() {
                None => {}
                Some(Order::Forget) => return Some(Order::Forget),
                Some(Order::RenderedImage { number, camera, size, .. }) => match Film::new(size.into()) {
                    Ok(film) => rendering = Some(RenderedImage { number, camera, film, reported: None }),
                    Err(error) => self.send(Report::Failed(error.to_string())),
                },
                Some(Order::Pixel { camera, at, size, .. }) => {
                    let place = tracer.probe(&camera, at, size.as_usizevec2().to_array());
                    let (lights, light_count) =
                        place.map_or((Vec::new(), 0), |place| tracer.lights_at(&place, MOST_LIGHTS));
                    let rays = place.map_or(Vec::new(), |place| tracer.rays_from(&place, RAYS));
                    self.send(Report::Pixel(ProbeResult { place, lights, light_count, rays }));
                }
                Some(Order::Look(look)) => {
                    self.look = Some(look);
                    if let Some(rendering) = &mut rendering {
                        rendering.reported = None;
                        self.report(rendering);
                    }
                }
            }
            rendering = rendering.filter(|rendering| self.shared.requested.load(Relaxed) == rendering.number);
            let is_done = |rendering: &RenderedImage| rendering.film.samples() >= MOST_SAMPLES;
            let next = match rendering.as_mut().filter(|rendering| !is_done(rendering)) {
                Some(rendering) => {
                    let pause = || self.shared.waiting.load(Relaxed) > 0;
                    let stop = || self.shared.requested.load(Relaxed) != rendering.number;
                    tracer.render_unless(&rendering.camera, &mut rendering.film, 1, pause, stop);
                    self.report(rendering);
                    match self.orders.try_recv() {
                        Ok(order) => self.taken(order),
                        Err(TryRecvError::Empty) => continue,
                        Err(TryRecvError::Disconnected) => return None,
                    }
                }
                None => self.take()?,
            };
            match &next {
                Order::RenderedImage { subject, .. } | Order::Pixel { subject, .. } if !subject.is(about) => {
                    return Some(next);
                }
                _ => order = Some(next),
            }
        }
    }

    /// Reports the image if all pixels have equally many samples and [`REPORT_PERIOD`] is over.
    fn report(&self, rendering: &mut RenderedImage) {
        let (Some(look), samples) = (self.look, rendering.film.samples()) else { return };
        let is_soon = rendering.reported.is_some_and(|at| at.elapsed() < REPORT_PERIOD) && samples < MOST_SAMPLES;
        if samples == 0 || !rendering.film.is_even() || is_soon {
            return;
        }
        let rgb = display::encoded(&rendering.film.mean(), look.ev, look.tone_map);
        let bytes = rgb.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        let size = UVec2::from(rendering.film.size());
        rendering.reported = Some(Instant::now());
        self.send(Report::RenderedImage(Traced { number: rendering.number, bytes, size, samples }));
    }

    fn send(&self, report: Report) {
        // Sending fails only while the window closes.
        let _ = self.sender.send(report);
    }

    /// Waits for the next order. `None` if the handle was dropped.
    fn take(&self) -> Option<Order> {
        self.orders.recv().ok().map(|order| self.taken(order))
    }

    fn taken(&self, order: Order) -> Order {
        self.shared.waiting.fetch_sub(1, Relaxed);
        order
    }
}

#[cfg(test)]
mod tests;
