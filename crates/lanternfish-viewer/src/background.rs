//! What the processor does beside the window, in a thread that the path tracer's own threads help: the ground truth of what is seen, sample
//! by sample, and what lies under a pixel. The scene's tree is built once, and kept until another scene is asked about.

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

/// Samples of a pixel after which the image is left as it is.
const MOST_SAMPLES: u64 = 1 << 16;
/// How often an image in the making is told of, at most.
const TELL_AGAIN: Duration = Duration::from_millis(100);
/// Lights that are told of at a place.
const MOST_LIGHTS: usize = 64;
/// Rays that look for indirect light from a place.
const RAYS: u32 = 64;

/// What is asked about: a scene, and how light goes about in it.
#[derive(Clone, Debug)]
pub struct Subject {
    scene: Arc<Scene>,
    transport: Transport,
}

impl Subject {
    /// The scene under those of the settings that say what light there is. All of the light is traced, whatever the settings leave out.
    pub fn new(scene: &Arc<Scene>, settings: &Settings) -> Self {
        let transport = Transport {
            materials: settings.materials,
            attenuation: settings.attenuation,
            range_threshold: settings.range_threshold,
            light_radius: settings.light_radius,
            ..Transport::default()
        };
        Self { scene: Arc::clone(scene), transport }
    }

    fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene) && self.transport == other.transport
    }
}

/// How radiance is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Exposure, EV.
    pub ev: f32,
    /// The curve.
    pub tone_map: ToneMap,
}

/// The path tracer's image.
#[derive(Clone, Debug)]
pub struct Traced {
    number: u64,
    /// As a display shows it: RGBA, rows from the top.
    pub bytes: Vec<u8>,
    /// Pixels across and down.
    pub size: UVec2,
    /// Samples of each pixel.
    pub samples: u64,
}

/// What lies under a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The surface; none where the environment is seen.
    pub place: Option<Probed>,
    /// Lights that reach it, those first that would bring most.
    pub lights: Vec<LightAt>,
    /// How many there are in all.
    pub light_count: usize,
    /// Rays that look for indirect light from there.
    pub rays: Vec<RayFrom>,
}

/// What the thread has to say.
#[derive(Debug)]
pub enum Told {
    /// The image, as far as it is.
    RenderedImage(Traced),
    /// What is under the pixel that was asked about.
    Pixel(Found),
    /// Why there is neither.
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
    /// The scene is not asked about any more.
    Forget,
}

/// What both threads look at while one of them traces.
#[derive(Debug, Default)]
struct Shared {
    /// The number of the image that is wanted; 0: none.
    wanted: AtomicU64,
    /// Orders that have not been taken.
    waiting: AtomicUsize,
}

/// The thread, as the window sees it. When this is dropped it ends.
#[derive(Debug)]
pub struct Background {
    orders: Sender<Order>,
    told: Receiver<Told>,
    shared: Arc<Shared>,
    /// The number of the last image that was requested.
    last: u64,
    /// True if the image has all its samples.
    is_done: bool,
    /// Answers that have not come.
    pixels: usize,
    has_ended: bool,
}

impl Background {
    /// Starts the thread.
    pub fn start() -> Self {
        let ((orders, taken), (says, told)) = (channel(), channel());
        let shared = Arc::new(Shared::default());
        let worker = Worker { orders: taken, says, shared: Arc::clone(&shared), look: None };
        thread::spawn(move || worker.run());
        Self { orders, told, shared, last: 0, is_done: false, pixels: 0, has_ended: false }
    }

    /// Begins an image; the one before is given up.
    pub fn trace(&mut self, subject: Subject, camera: &Camera, size: UVec2) {
        self.last += 1;
        self.is_done = false;
        self.shared.wanted.store(self.last, Relaxed);
        self.order(Order::RenderedImage { number: self.last, subject, camera: camera.clone(), size });
    }

    /// Gives the image up.
    pub fn stop(&mut self) {
        self.shared.wanted.store(0, Relaxed);
    }

    /// Shows the image so from now on.
    pub fn show_as(&mut self, look: Look) {
        self.order(Order::Look(look));
    }

    /// Asks what is seen at a place of an image: pixels from its top left. The image in the making waits.
    pub fn probe(&mut self, subject: Subject, camera: &Camera, at: [f64; 2], size: UVec2) {
        self.pixels += 1;
        self.order(Order::Pixel { subject, camera: camera.clone(), at, size });
    }

    /// Lets go of the scene.
    pub fn forget(&mut self) {
        self.stop();
        self.order(Order::Forget);
    }

    /// True if more will be told.
    pub fn is_working(&self) -> bool {
        !self.has_ended && (self.pixels > 0 || (self.shared.wanted.load(Relaxed) != 0 && !self.is_done))
    }

    /// What there is to tell, if anything. It never waits.
    pub fn poll(&mut self) -> Option<Told> {
        loop {
            let told = match self.told.try_recv() {
                Ok(told) => told,
                Err(TryRecvError::Disconnected) if !std::mem::replace(&mut self.has_ended, true) => {
                    Told::Failed("the path tracer stopped".to_owned())
                }
                Err(_) => return None,
            };
            match &told {
                Told::RenderedImage(traced) if traced.number != self.shared.wanted.load(Relaxed) => continue,
                // One that is done waits for another exposure.
                Told::RenderedImage(traced) => self.is_done = traced.samples >= MOST_SAMPLES,
                Told::Pixel(_) => {
                    self.pixels = self.pixels.saturating_sub(1);
                    if self.pixels > 0 {
                        // Another pixel was asked about since.
                        continue;
                    }
                }
                Told::Failed(_) => {
                    self.pixels = 0;
                    self.stop();
                }
            }
            return Some(told);
        }
    }

    fn order(&self, order: Order) {
        self.shared.waiting.fetch_add(1, Relaxed);
        // A thread that is gone has panicked, and has said so.
        let _ = self.orders.send(order);
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.stop();
    }
}

/// The thread.
struct Worker {
    orders: Receiver<Order>,
    says: Sender<Told>,
    shared: Arc<Shared>,
    look: Option<Look>,
}

/// An image in the making.
struct RenderedImage {
    number: u64,
    camera: Camera,
    film: Film,
    told: Option<Instant>,
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
                            self.say(Told::Failed(error.to_string()));
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

    /// Does what is ordered of a scene, until something is ordered of another, which is returned. None: nobody orders any more.
    fn serve(&mut self, tracer: &Tracer<'_>, about: &Subject, first: Order) -> Option<Order> {
        let mut rendering: Option<RenderedImage> = None;
        let mut order = Some(first);
        loop {
            match order.take() {
                None => {}
                Some(Order::Forget) => return Some(Order::Forget),
                Some(Order::RenderedImage { number, camera, size, .. }) => {
                    match Film::new(size.x as usize, size.y as usize) {
                        Ok(film) => rendering = Some(RenderedImage { number, camera, film, told: None }),
                        Err(error) => self.say(Told::Failed(error.to_string())),
                    }
                }
                Some(Order::Pixel { camera, at, size, .. }) => {
                    let place = tracer.probe(&camera, at, size.as_usizevec2().to_array());
                    let (lights, light_count) =
                        place.map_or((Vec::new(), 0), |place| tracer.lights_at(&place, MOST_LIGHTS));
                    let rays = place.map_or(Vec::new(), |place| tracer.rays_from(&place, RAYS));
                    self.say(Told::Pixel(Found { place, lights, light_count, rays }));
                }
                Some(Order::Look(look)) => {
                    self.look = Some(look);
                    if let Some(rendering) = &mut rendering {
                        rendering.told = None;
                        self.tell(rendering);
                    }
                }
            }
            rendering = rendering.filter(|rendering| self.shared.wanted.load(Relaxed) == rendering.number);
            let is_done = |rendering: &RenderedImage| rendering.film.samples() >= MOST_SAMPLES;
            let next = match rendering.as_mut().filter(|rendering| !is_done(rendering)) {
                Some(rendering) => {
                    let pause = || self.shared.waiting.load(Relaxed) > 0;
                    let stop = || self.shared.wanted.load(Relaxed) != rendering.number;
                    tracer.render_unless(&rendering.camera, &mut rendering.film, 1, pause, stop);
                    self.tell(rendering);
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

    /// Tells of the image, if it is a whole one, and not too soon.
    fn tell(&self, rendering: &mut RenderedImage) {
        let (Some(look), samples) = (self.look, rendering.film.samples()) else { return };
        let is_soon = rendering.told.is_some_and(|told| told.elapsed() < TELL_AGAIN) && samples < MOST_SAMPLES;
        if samples == 0 || !rendering.film.is_even() || is_soon {
            return;
        }
        let (width, height) = rendering.film.size();
        let rgb = display::encoded(&rendering.film.mean(), look.ev, look.tone_map);
        let bytes = rgb.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        let size = UVec2::new(width as u32, height as u32);
        rendering.told = Some(Instant::now());
        self.say(Told::RenderedImage(Traced { number: rendering.number, bytes, size, samples }));
    }

    fn say(&self, told: Told) {
        // Who does not listen any more is closing.
        let _ = self.says.send(told);
    }

    /// The next order. None: there will be none.
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
