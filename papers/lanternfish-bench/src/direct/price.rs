//! The price of a frame by the number of lights, and by its parts.

use std::time::Instant;

use lanternfish::{RenderedImage, settings::Settings};
use lanternfish_cli::{
    error::CliError,
    times::{counter, frame_ms, ms_of},
};

use super::{DirectLight, cases, unlimited};
use crate::{
    case::{Case, changed},
    table::Row,
    view::View,
};

pub const TEXT: &str = "Point lights in the scene's box, whose ranges do not end. *Rays*: shadow rays a pixel. *Direct*: all passes but the \
                        prepass and the output, ms; of these, *choice* is the choice of lights (the pass with the rays, without shadows), *rays* the rest \
                        of that pass, *filter* the passes after it. *Update*: writing the lights and their tree, as when they move, ms.";

impl DirectLight {
    /// A row for each number of lights and technique.
    pub fn prices(&self, counts: &[u32], all_up_to: u32) -> Result<Vec<Row>, CliError> {
        let mut rows = Vec::new();
        for count in counts {
            let view = unlimited(&self.view, *count);
            let is_wanted =
                |name: &str| (name == "all" && *count <= all_up_to) || name == "sampled, 4 rays, denoise on";
            let name = |case: &Case| format!("{count} lights, {}", case.name);
            rows.extend(self.bench.rows("price", cases(&view.look, is_wanted), name, |case| self.price(&view, case))?);
        }
        Ok(rows)
    }

    /// The fastest frame, and the time of an update, ms.
    fn measured(&self, view: &View, settings: &Settings) -> Result<(RenderedImage, f64), CliError> {
        let mut stage = self.bench.stage(&view.scene, settings)?;
        let best = self.bench.timed_on(&mut stage, view)?.image;
        let start = Instant::now();
        stage.update(&view.scene)?;
        Ok((best, 1e3 * start.elapsed().as_secs_f64()))
    }

    fn price(&self, view: &View, Case { name, settings, .. }: &Case) -> Result<Row, CliError> {
        let (image, update) = self.measured(view, settings)?;
        let ms = |start: &str| ms_of(&image.report.passes, start);
        let direct_ms: f64 = ["light_culling/", "shadows/", "direct_light/", "shading/"].map(ms).iter().sum();
        let row = Row::default()
            .count("lights", "lights", view.scene.lights.len() as u64)
            .text("technique", "", name.trim_end_matches(", denoise on"))
            .fixed("rays", "rays", 2, counter(&image.report, "shadows/rays") as f64 / view.pixels())
            .fixed("frame_ms", "frame, ms", 1, frame_ms(&image.report.passes))
            .fixed("direct_ms", "direct", 1, direct_ms)
            .fixed("update_ms", "update", 1, update);
        if settings.direct.is_none() {
            return Ok(row.text("choice_ms", "choice", "").text("rays_ms", "rays", "").text("filter_ms", "filter", ""));
        }
        let trace = ms("direct_light/trace");
        let (unshadowed, _) = self.measured(view, &changed(settings, "shadows none"))?;
        let choice = ms_of(&unshadowed.report.passes, "direct_light/trace");
        let row = row.fixed("choice_ms", "choice", 1, choice).fixed("rays_ms", "rays", 1, trace - choice);
        Ok(row.fixed("filter_ms", "filter", 1, ms("direct_light/") - trace))
    }
}
