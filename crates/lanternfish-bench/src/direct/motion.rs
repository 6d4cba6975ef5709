//! A walk among moving lights, and a light that goes out.

use std::f32::consts::PI;

use glam::Vec3;
use lanternfish::{
    RenderedImage, Renderer,
    settings::{Direct, History, Settings},
    techniques::{Denoise, LightRays},
};
use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Scene, generate::light_rain};

use super::{Bench, Case, cases, sampled};
use crate::{image::rgb, run::median, table::Row};

pub const TEXT: &str = "A walk with 1,000 falling lights; in its middle the brightest other light goes out. Every frame is compared with *all*'s \
                        frame of the same moment, on a display, 0..1. *Error*: mean of |difference|; *p99.9*: its 99.9th percentile over all pixels and \
                        frames; *flicker*: mean change of the difference from one frame to the next; *lag*: frames after the light has gone out \
                        until the error is at most 1.25 times its median before.";

/// Falling lights.
const RAIN: u32 = 1000;
/// Seconds of a frame.
const STEP: f32 = 1.0 / 30.0;
/// Frames that are written as images, beside the first after the light has gone out.
const KEPT: u32 = 20;

/// Sums over a walk.
#[derive(Default)]
struct Walked {
    /// Mean of |difference| of every frame.
    errors: Vec<f64>,
    /// Counts of |difference| in steps of 1/255.
    counts: Vec<u64>,
    flicker: f64,
    before: Vec<[i16; 3]>,
}

impl Walked {
    fn add(&mut self, image: &RenderedImage, all: &RenderedImage) {
        self.counts.resize(256, 0);
        let difference = |(a, b): (&[u8; 4], &[u8; 4])| std::array::from_fn(|i| i16::from(a[i]) - i16::from(b[i]));
        let differences: Vec<[i16; 3]> = image.display.iter().zip(&all.display).map(difference).collect();
        let mut sum = 0u64;
        for value in differences.as_flattened() {
            self.counts[usize::from(value.unsigned_abs())] += 1;
            sum += u64::from(value.unsigned_abs());
        }
        let count = differences.as_flattened().len() as f64;
        self.errors.push(sum as f64 / 255.0 / count);
        let changes = differences.as_flattened().iter().zip(self.before.as_flattened());
        let changed: u64 = changes.map(|(now, before)| u64::from((now - before).unsigned_abs())).sum();
        self.flicker += changed as f64 / 255.0 / count;
        self.before = differences;
    }

    fn percentile(&self, rank: f64) -> f64 {
        let total: u64 = self.counts.iter().sum();
        let mut left = ((total as f64) * (1.0 - rank)) as u64;
        for (value, count) in self.counts.iter().enumerate().rev() {
            if *count > left {
                return value as f64 / 255.0;
            }
            left -= count;
        }
        0.0
    }
}

impl Bench {
    /// A row for each technique.
    pub fn walks(&self, progress: &mut Progress) -> Result<Vec<Row>, CliError> {
        let mut cases: Vec<Case> = cases();
        cases.retain(|case| {
            ["all", "sampled, 4 rays, denoise on", "sampled, 4 rays, denoise off", "uniform, 4 rays, denoise on"]
                .contains(&&*case.name)
        });
        cases.push(Case {
            name: "sampled, 8 rays, denoise on".to_owned(),
            direct: sampled(LightRays::Eight, Denoise::On),
        });
        let configurations: Vec<(String, Direct, History)> = cases
            .into_iter()
            .flat_map(|Case { name, direct }| {
                let both = if name == "sampled, 4 rays, denoise on" {
                    &[History::On, History::Off][..]
                } else {
                    &[History::On]
                };
                both.iter()
                    .map(move |history| (format!("{name}, history {history}"), direct.clone(), *history))
                    .collect::<Vec<_>>()
            })
            .collect();
        let mut renderers = Vec::new();
        let (scene, _) = self.moment(0);
        for (_, direct, history) in &configurations {
            let settings = Settings { direct: direct.clone(), history: *history, ..self.look.clone() };
            let renderer = self.renderer(settings)?;
            let uploaded = renderer.upload(&scene)?;
            renderers.push((renderer, uploaded, Walked::default()));
        }
        let out = self.frames / 2;
        for frame in 0..self.frames {
            let (scene, camera) = self.moment(frame);
            let mut all = None;
            let mut step = || {
                for ((name, ..), (renderer, uploaded, walked)) in configurations.iter().zip(&mut renderers) {
                    let renderer: &mut Renderer = renderer;
                    renderer.update(uploaded, &scene)?;
                    let image = self.frame(renderer, uploaded, &camera)?;
                    let all = all.get_or_insert_with(|| image.clone());
                    walked.add(&image, all);
                    if frame % KEPT == 0 || (out..out + 4).contains(&frame) {
                        let path =
                            self.run.folder.join(format!("walk-{}-{frame:03}.png", name.replace([' ', ','], "-")));
                        write_png(&path, image.width, image.height, ColorType::Rgb, &rgb(&image))?;
                    }
                }
                Ok::<_, CliError>(())
            };
            progress.step("walk", &format!("frame {frame}"), &mut step)?;
        }
        Ok(configurations
            .iter()
            .zip(&renderers)
            .map(|((name, ..), (.., walked))| self.row(name, walked, out))
            .collect())
    }

    fn row(&self, name: &str, walked: &Walked, out: u32) -> Row {
        let out = out as usize;
        let before = median(&mut walked.errors[out / 2..out].to_vec());
        let lag = walked.errors[out..].iter().position(|error| *error <= 1.25 * before);
        let mean = walked.errors.iter().sum::<f64>() / walked.errors.len() as f64;
        Row::default()
            .text("technique", "", name)
            .fixed("error", "error", 4, mean)
            .fixed("p999", "p99.9", 3, walked.percentile(0.999))
            .fixed("flicker", "flicker", 4, walked.flicker / walked.errors.len() as f64)
            .optional("lag", "lag, frames", lag)
            .data("errors", &walked.errors)
    }

    /// The scene and the camera of a frame: a track, or a walk of a metre forwards with a slow turn.
    fn moment(&self, frame: u32) -> (Scene, Camera) {
        let mut scene = self.scene.clone();
        let time = frame as f32 * STEP;
        if frame >= self.frames / 2
            && let Some(brightest) = (0..scene.lights.len()).max_by(|a, b| {
                let intensity = |i: usize| scene.lights[i].intensity.max_element();
                intensity(*a).total_cmp(&intensity(*b))
            })
        {
            scene.lights[brightest].intensity = Vec3::ZERO;
        }
        scene.lights.extend(light_rain(&scene.bounds(), RAIN, None, 0, time));
        let mut camera = self.cameras[frame as usize % self.cameras.len()].clone();
        if self.cameras.len() == 1 {
            let place = &mut camera.world_from_camera;
            let (aside, forwards) = (place.matrix3.x_axis, -place.matrix3.z_axis);
            place.translation += forwards * (0.3 * time) + aside * (0.2 * (PI * time / 2.0).sin());
        }
        (scene, camera)
    }
}
