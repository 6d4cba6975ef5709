//! Runs one check: renders an image, compares it with its reference, and applies limits.

use std::{
    collections::{HashMap, hash_map::Entry},
    path::{Path, PathBuf},
};

use lanternfish::{
    GpuScene, RenderError, RenderedImage, Renderer, Settings,
    settings::{Exposure, Materials},
};
use lanternfish_gpu::{
    Engine, Frame, Gpu, GpuError, Profiler, drawn_subpixel_bits, is_lost, primitives::RadixSort, read_back,
    storage_buffer_of,
};
use lanternfish_metrics::{ColorType, PIXELS_PER_DEGREE, Pair, RgbImage, write_png};
use lanternfish_reference::{
    Film, Random, Settings as TracerSettings, Tracer,
    settings::{Integrator, UNLIMITED},
};

use super::{
    checks::Plan,
    report::Figure,
    scenes::{Name, Subject, changed},
};
use crate::{
    error::CliError,
    images::{self, linear},
};

/// The kind of a check.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Sorts keys on the device and on the host.
    Sort,
    /// Measures the grid to which the rasterizer snaps vertices.
    VertexGrid,
    /// Renders with two settings whose images must be identical to the bit.
    Same(Box<[Settings; 2]>),
    /// Renders and compares with the path tracer.
    Against(Reference, Box<Settings>, Limits),
    /// Renders twice, with separate renderers and scenes: identical to the bit.
    Twice(Box<Settings>),
    /// Renders an updated scene, and the changed scene uploaded as new: identical to the bit.
    Update(Box<Settings>),
}

/// The reference that the path tracer renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reference {
    /// Paths of two segments: direct light from lights or from the environment.
    Direct,
    /// Paths of two segments, and of one more for each of so many bounces.
    Bounces(u32),
    /// Paths of any length.
    Full,
    /// Visibility of the hemisphere above each surface.
    Visibility,
    /// The same, where an occluder within a metre weighs less the farther it is.
    Obscurance,
}

impl Reference {
    fn settings(self, settings: &Settings) -> TracerSettings {
        let (integrator, max_depth) = match self {
            Self::Direct => (Integrator::Path, 2),
            Self::Bounces(bounces) => (Integrator::Path, 2 + bounces),
            Self::Full => (Integrator::Path, UNLIMITED),
            Self::Visibility => (Integrator::Occlusion, UNLIMITED),
            Self::Obscurance => (Integrator::Obscurance { max_distance: 1.0 }, UNLIMITED),
        };
        TracerSettings {
            integrator,
            max_depth,
            materials: Materials::File,
            attenuation: settings.lights.attenuation,
            attenuation_near_radius: settings.lights.near_radius,
            attenuation_coefficients: settings.lights.coefficients,
            range_threshold: settings.lights.range_threshold,
            ..TracerSettings::default()
        }
    }

    /// Samples per pixel: short paths are cheap, and references that judge most checks should have the least noise.
    fn samples(self) -> u64 {
        match self {
            Self::Direct | Self::Visibility | Self::Obscurance => 256,
            Self::Bounces(_) | Self::Full => 192,
        }
    }
}

/// Limits of the difference between an image and its reference. Each is 1.5 to 2 times the value measured on Mesa's
/// software adapter, so that another driver's texture filters and rounding pass and a wrong constant fails.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest mean LDR-FLIP.
    pub flip: f64,
    /// Largest deviation of the ratio of total energy from 1.
    pub energy: f64,
    /// Largest fraction of outliers: pixels off by more than half of their radiance and of the mean radiance.
    pub outliers: f64,
}

impl Limits {
    pub const fn new(flip: f64, energy: f64, outliers: f64) -> Self {
        Self { flip, energy, outliers }
    }
}

/// State that all checks of one adapter share.
pub struct Bench {
    pub gpu: Gpu,
    pub engine: Engine,
    subjects: HashMap<Name, Subject>,
    references: HashMap<(Name, Reference), RgbImage>,
    /// Folder for images and their references.
    images: Option<PathBuf>,
}

impl Bench {
    pub fn new(gpu: Gpu, engine: Engine, images: Option<PathBuf>) -> Self {
        Self { gpu, engine, subjects: HashMap::new(), references: HashMap::new(), images }
    }

    /// The measured values of a check, or the reason why this adapter cannot run it.
    pub fn run(&mut self, plan: &Plan) -> Result<Result<Vec<Figure>, String>, CliError> {
        match self.figures(plan) {
            Ok(figures) => Ok(Ok(figures)),
            Err(Fault::Cannot(reason)) => Ok(Err(reason)),
            Err(Fault::Broken(error)) => Err(error),
        }
    }

    /// True if the device is lost.
    pub fn is_lost(&self) -> bool {
        is_lost(&self.gpu.device)
    }

    fn figures(&mut self, plan: &Plan) -> Result<Vec<Figure>, Fault> {
        let (scene, kind) = (plan.scene, &plan.kind);
        if let Entry::Vacant(entry) = self.subjects.entry(scene) {
            entry.insert(scene.subject()?);
        }
        match kind {
            Kind::Sort => self.sort(),
            Kind::VertexGrid => self.vertex_grid(),
            Kind::Same(both) => {
                let subject = &self.subjects[&scene];
                let [a, b] = [self.rendering(subject, &both[0])?, self.rendering(subject, &both[1])?];
                Ok(differing(&a, &b))
            }
            Kind::Twice(settings) => {
                let subject = &self.subjects[&scene];
                let [a, b] = [self.rendering(subject, settings)?, self.rendering(subject, settings)?];
                Ok(differing(&a, &b))
            }
            Kind::Update(settings) => {
                let subject = &self.subjects[&scene];
                let later = Subject { scene: changed(&subject.scene), camera: subject.camera.clone(), ..*subject };
                let mut renderer = Renderer::with_engine(&self.engine, (**settings).clone())?;
                let mut uploaded = renderer.upload(&subject.scene)?;
                // Render a frame before the update, so that stale history would show.
                let before = render(&mut renderer, &uploaded, subject)?;
                renderer.update(&mut uploaded, &later.scene)?;
                let updated = render(&mut renderer, &uploaded, &later)?;
                let fresh = self.rendering(&later, settings)?;
                let mut figures = differing(&updated, &fresh);
                let moved = differing(&before, &updated)[0].value;
                let all = updated.radiance.len() as f64;
                figures.push(Figure::new("changed pixels", moved, 1.0, all));
                Ok(figures)
            }
            Kind::Against(reference, settings, limits) => {
                let reference_image = self.reference(scene, *reference, settings)?.clone();
                let rendering = self.rendering(&self.subjects[&scene], settings)?;
                let image = linear(&rendering)?.box_downsampled(Subject::FACTOR as usize)?;
                let pair = Shown::new(image, reference_image)?;
                if let Some(folder) = &self.images {
                    pair.write(&folder.join(format!("{}.png", plan.file_name())))?;
                }
                pair.judge(limits)
            }
        }
    }

    fn reference(&mut self, name: Name, reference: Reference, settings: &Settings) -> Result<&RgbImage, Fault> {
        if !self.references.contains_key(&(name, reference)) {
            let subject = &self.subjects[&name];
            let scene = subject.posed();
            let tracer = Tracer::new(&scene, reference.settings(settings))?;
            let [width, height] = subject.size.map(|edge| edge as usize);
            let mut film = Film::new(subject.size)?;
            tracer.render(&subject.camera, &mut film, reference.samples());
            self.references.insert((name, reference), RgbImage::new(width, height, film.mean())?);
        }
        Ok(&self.references[&(name, reference)])
    }

    fn rendering(&self, subject: &Subject, settings: &Settings) -> Result<RenderedImage, Fault> {
        let mut renderer = Renderer::with_engine(&self.engine, settings.clone())?;
        let mut uploaded = renderer.upload(&subject.scene)?;
        if subject.moment.is_some() {
            renderer.animate(&mut uploaded, &subject.scene, subject.moment)?;
        }
        render(&mut renderer, &uploaded, subject)
    }

    /// The grid by a draw, which must not be coarser than the one that rays are offset for.
    fn vertex_grid(&self) -> Result<Vec<Figure>, Fault> {
        let bits = drawn_subpixel_bits(&self.gpu.device, &self.gpu.queue)?.map_or(f64::NAN, f64::from);
        Ok(vec![Figure::new("bits by a draw", bits, f64::from(self.engine.subpixel_bits()), 15.0)])
    }

    /// Sorts lists with lengths around a block's size, and one of a million keys.
    fn sort(&self) -> Result<Vec<Figure>, Fault> {
        let Gpu { device, queue, .. } = &self.gpu;
        let sort = RadixSort::new(device, "doctor/sort")?;
        let mut profiler = Profiler::new(device, queue);
        let mut wrong = 0;
        for count in [127, 128, 16_385, 1_000_000] {
            let pairs = keys(count);
            let [keys, values] = [0, 1].map(|i| pairs.iter().map(|pair| [pair.0, pair.1][i]).collect::<Vec<u32>>());
            let upload = |values: &[u32]| storage_buffer_of(device, "doctor/sort", values, wgpu::BufferUsages::empty());
            let (on_device, values) = (upload(&keys)?, upload(&values)?);
            let mut frame = Frame::new(device, queue, &mut profiler);
            sort.record(&mut frame, &on_device, &values, count, 32)?;
            frame.submit();
            let mut expected = pairs;
            expected.sort_by_key(|pair| pair.0);
            let actual = read_back::<u32>(device, queue, &on_device, count as usize)?;
            let places = read_back::<u32>(device, queue, &values, count as usize)?;
            wrong += actual.iter().zip(&places).zip(&expected).filter(|((k, v), e)| (**k, **v) != **e).count();
        }
        Ok(vec![Figure::new("pairs in a wrong place", wrong as f64, 0.0, 0.0)])
    }
}

/// Keys, each with its index.
fn keys(count: u32) -> Vec<(u32, u32)> {
    let mut random = Random::new(5, u64::from(count), 0);
    (0..count).map(|i| ((random.unit() * f64::from(u32::MAX)) as u32, i)).collect()
}

fn render(renderer: &mut Renderer, scene: &GpuScene, subject: &Subject) -> Result<RenderedImage, Fault> {
    let [width, height] = subject.size.map(|edge| edge * Subject::FACTOR);
    Ok(renderer.render(scene, &subject.camera, [width, height])?)
}

/// Counts the pixels that differ in any bit.
fn differing(a: &RenderedImage, b: &RenderedImage) -> Vec<Figure> {
    vec![Figure::new("pixels that differ", images::differing(a, b) as f64, 0.0, 0.0)]
}

/// An image and its reference, as linear radiance and as display colours at the reference's automatic exposure.
struct Shown {
    linear: Pair,
    display: Pair,
    outliers: f64,
}

impl Shown {
    fn new(image: RgbImage, reference: RgbImage) -> Result<Self, Fault> {
        let ev = Exposure::Auto.of(reference.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]));
        let outliers = outliers(&image, &reference);
        let linear = Pair::new(image, reference)?;
        let display = linear.shown(ev);
        Ok(Self { linear, display, outliers })
    }

    fn judge(&self, limits: &Limits) -> Result<Vec<Figure>, Fault> {
        let Self { linear, display, outliers } = self;
        let flip = display.mean_of(&display.flip_ldr(PIXELS_PER_DEGREE)?);
        Ok(vec![
            Figure::new("FLIP", flip, 0.0, limits.flip),
            Figure::new("energy", linear.errors().energy_ratio, 1.0 - limits.energy, 1.0 + limits.energy),
            Figure::new("outliers", *outliers, 0.0, limits.outliers),
            Figure::new("NaN or infinite", linear.faults()[0].not_finite as f64, 0.0, 0.0),
        ])
    }

    /// Writes the image and its reference side by side, at four times the size.
    fn write(&self, file: &Path) -> Result<(), Fault> {
        const SCALE: usize = 4;
        let (image, reference) = (self.display.image(), self.display.reference());
        let (width, height) = (image.width, image.height);
        let mut rgb = Vec::with_capacity(3 * 2 * SCALE * SCALE * width * height);
        for y in 0..SCALE * height {
            for side in [image, reference] {
                for x in 0..SCALE * width {
                    let pixel = side.pixels[y / SCALE * width + x / SCALE];
                    rgb.extend(pixel.map(|v| (255.0 * v.clamp(0.0, 1.0) + 0.5) as u8));
                }
            }
        }
        let [width, height] = [2 * SCALE * width, SCALE * height].map(|edge| edge as u32);
        Ok(write_png(file, [width, height], ColorType::Rgb, &rgb)?)
    }
}

/// See [`Limits::outliers`].
fn outliers(image: &RgbImage, reference: &RgbImage) -> f64 {
    let luminance = |pixel: &[f32; 3]| 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2];
    let mean = reference.pixels.iter().map(luminance).sum::<f32>() / reference.pixels.len() as f32;
    let pixels = image.pixels.iter().zip(&reference.pixels).map(|(a, r)| (luminance(a), luminance(r)));
    let far = pixels.filter(|(a, r)| a.is_nan() || (a - r).abs() > 0.5 * (r + mean)).count();
    far as f64 / reference.pixels.len() as f64
}

/// Why a check has no measured values.
enum Fault {
    /// The adapter lacks support; the renderer's message says why.
    Cannot(String),
    /// Something went wrong.
    Broken(CliError),
}

impl From<RenderError> for Fault {
    fn from(error: RenderError) -> Self {
        match &error {
            RenderError::MissingFeature { .. } | RenderError::Driver { .. } => Self::Cannot(error.to_string()),
            _ => Self::Broken(error.into()),
        }
    }
}

macro_rules! broken {
    ($($error:ty),+) => { $(
        impl From<$error> for Fault {
            fn from(error: $error) -> Self {
                Self::Broken(error.into())
            }
        }
    )+ };
}
broken!(CliError, GpuError, lanternfish_metrics::MetricsError, lanternfish_reference::ReferenceError);

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> RgbImage {
        RgbImage::new(values.len(), 1, values.iter().map(|v| [*v; 3]).collect()).unwrap()
    }

    fn failing(image: &[f32], limits: Limits) -> Vec<String> {
        let reference = grey(&[1.0; 64]);
        let Ok(figures) = Shown::new(grey(image), reference).and_then(|shown| shown.judge(&limits)) else {
            panic!("it can be compared")
        };
        figures.into_iter().filter(|figure| !figure.passes()).map(|figure| figure.name).collect()
    }

    #[test]
    fn each_limit_can_fail_alone() {
        let limits = Limits::new(0.05, 0.02, 0.01);
        assert_eq!(failing(&[1.0; 64], limits), Vec::<String>::new());
        assert_eq!(failing(&[1.03; 64], limits), ["energy"]);
        let mut one_off = [1.0; 64];
        one_off[5] = 3.0;
        assert_eq!(failing(&one_off, Limits { flip: 1.0, energy: 0.1, ..limits }), ["outliers"]);
        let checkers: Vec<f32> = (0..64).map(|i| if i / 8 % 2 == 0 { 0.6 } else { 1.4 }).collect();
        assert_eq!(failing(&checkers, limits), ["FLIP"]);
        let mut nan = [1.0; 64];
        nan[3] = f32::NAN;
        assert_eq!(failing(&nan, Limits { outliers: 1.0, ..limits }), ["NaN or infinite"]);
    }
}
