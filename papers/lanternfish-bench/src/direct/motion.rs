//! A walk among moving lights, and a light that goes out.

use lanternfish_cli::{error::CliError, images::rgb, times::median};
use lanternfish_scene::generate::light_rain;

use super::{DirectLight, cases};
use crate::{
    case::Case,
    table::Row,
    view::View,
    walked::{STEP, Walked, put_out_brightest, walk},
};

pub const TEXT: &str = "A walk with 1,000 falling lights; in its middle the brightest other light goes out. Every frame is compared with *all*'s \
                        frame of the same moment, on a display, 0..1. *Error*: mean of |difference|; *p99.9*: its 99.9th percentile over all pixels and \
                        frames; *flicker*: mean change of the difference from one frame to the next; *lag*: frames after the light has gone out \
                        until the error is at most 1.25 times its median before.";

/// Falling lights.
const RAIN: u32 = 1000;
/// Frames that are written as images, beside the first after the light has gone out.
const KEPT: u32 = 20;

/// Names of [`super::FRAMES`] that are walked with a history.
const WALKED: [&str; 5] = [
    "all",
    "sampled, 4 rays, denoise on",
    "sampled, 4 rays, denoise off",
    "uniform, 4 rays, denoise on",
    "sampled, 8 rays, denoise on",
];

impl DirectLight {
    /// A row for each technique.
    pub fn walks(&self) -> Result<Vec<Row>, CliError> {
        let with = |case: &Case, history: &str| {
            let history = format!("history {history}");
            Case::of(&case.settings, &format!("{}, {history}", case.name), &history)
        };
        let cases = cases(&self.view.look, |name| WALKED.contains(&name));
        let mut walked: Vec<Case> = cases.iter().map(|case| with(case, "on")).collect();
        walked.insert(2, with(&cases[1], "off"));
        let scene = self.moment(0).scene;
        let stage = |case: &Case| Ok((self.bench.stage(&scene, &case.settings)?, Walked::default()));
        let mut stages = walked.iter().map(stage).collect::<Result<Vec<_>, CliError>>()?;
        let out = self.frames / 2;
        for frame in 0..self.frames {
            let (view, mut all) = (self.moment(frame), None);
            self.bench.step("walk", &format!("frame {frame}"), || {
                for (Case { name, .. }, (stage, walked)) in walked.iter().zip(&mut stages) {
                    stage.update(&view.scene)?;
                    let image = stage.frame(&view)?;
                    let colors = rgb(&image);
                    walked.add(&colors, all.get_or_insert_with(|| colors.clone()));
                    if frame % KEPT == 0 || (out..out + 4).contains(&frame) {
                        self.bench.write(&format!("walk-{name}-{frame:03}"), &image)?;
                    }
                }
                Ok::<_, CliError>(())
            })?;
        }
        Ok(walked.iter().zip(&stages).map(|(case, (_, walked))| self.row(&case.name, walked, out)).collect())
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

    /// The view of a frame: along a track, or on a walk.
    fn moment(&self, frame: u32) -> View {
        let (mut view, time) = (self.view.clone(), frame as f32 * STEP);
        if frame >= self.frames / 2 {
            put_out_brightest(&mut view.scene);
        }
        view.scene.lights.extend(light_rain(&view.scene.bounds(), RAIN, None, 0, time));
        let camera = &self.cameras[frame as usize % self.cameras.len()];
        view.camera = if self.cameras.len() == 1 { walk(camera, time) } else { camera.clone() };
        view
    }
}
