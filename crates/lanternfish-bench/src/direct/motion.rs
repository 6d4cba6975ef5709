//! A walk among moving lights, and a light that goes out.

use glam::Vec3;
use lanternfish::{
    Renderer,
    settings::{Direct, History},
    techniques::{Denoise, LightRays},
};
use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Scene, generate::light_rain};

use super::{Bench, Case, cases, sampled};
use crate::{
    image::rgb,
    run::median,
    table::Row,
    walked::{Walked, walk},
};

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
            let settings = self.look.clone().with_direct(direct.clone()).with_history(*history);
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
                    let colors = rgb(&image);
                    walked.add(&colors, all.get_or_insert_with(|| colors.clone()));
                    if frame % KEPT == 0 || (out..out + 4).contains(&frame) {
                        let path =
                            self.run.folder.join(format!("walk-{}-{frame:03}.png", name.replace([' ', ','], "-")));
                        write_png(&path, image.width, image.height, ColorType::Rgb, &colors)?;
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
        Row::default()
            .text("technique", "", name)
            .fixed("error", "error", 4, walked.mean())
            .fixed("p999", "p99.9", 3, walked.percentile(0.999))
            .fixed("flicker", "flicker", 4, walked.flicker())
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
            camera = walk(&camera, time);
        }
        (scene, camera)
    }
}
