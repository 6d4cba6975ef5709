//! The price of a frame by the number of lights, and by its parts.

use lanternfish::{
    RenderedImage,
    settings::{Direct, Settings, Shadows},
    techniques::{Denoise, LightRays},
};
use lanternfish_cli::{error::CliError, progress::Progress};

use super::{Bench, sampled};
use crate::{
    run::{counter, frame_ms, least, ms_of},
    table::Row,
};

pub const TEXT: &str = "Point lights in the scene's box, whose ranges do not end. *Rays*: shadow rays a pixel. *Direct*: all passes but the \
                        prepass and the output, ms; of these, *choice* is the choice of lights (the pass with the rays, without shadows), *rays* the rest \
                        of that pass, *filter* the passes after it. *Update*: writing the lights and their tree, as when they move, ms.";

impl Bench {
    /// A row for each number of lights and technique.
    pub fn prices(&self, counts: &[u32], all_up_to: u32, progress: &mut Progress) -> Result<Vec<Row>, CliError> {
        let mut rows = Vec::new();
        for count in counts {
            let techniques = [("all", Direct::NONE), ("sampled, 4 rays", sampled(LightRays::Four, Denoise::On))];
            for (name, direct) in techniques.into_iter().filter(|(name, _)| *name != "all" || *count <= all_up_to) {
                rows.push(
                    progress.step("price", &format!("{count} lights, {name}"), || self.price(*count, name, direct))?,
                );
            }
        }
        Ok(rows)
    }

    fn price(&self, count: u32, name: &str, direct: Direct) -> Result<Row, CliError> {
        let (scene, look) = self.unlimited(count);
        let measured = |settings: Settings| {
            let mut renderer = self.renderer(settings)?;
            let mut uploaded = renderer.upload(&scene)?;
            let frame = || self.frame(&mut renderer, &uploaded, &self.cameras[0]);
            let (_, best) = least(self.run.runs, frame, |image: &RenderedImage| frame_ms(&image.report.passes))?;
            let start = std::time::Instant::now();
            renderer.update(&mut uploaded, &scene)?;
            Ok::<_, CliError>((best, 1e3 * start.elapsed().as_secs_f64()))
        };
        let is_sampled = direct.is_some();
        let settings = look.with_direct(direct);
        let (image, update) = measured(settings.clone())?;
        let passes = &image.report.passes;
        let direct_ms: f64 =
            ["light_culling/", "shadows/", "direct_light/", "shading/"].iter().map(|start| ms_of(passes, start)).sum();
        let row = Row::default()
            .count("lights", "lights", u64::from(count))
            .text("technique", "", name)
            .fixed("rays", "rays", 2, counter(&image.report, "shadows/rays") as f64 / self.pixels())
            .fixed("frame_ms", "frame, ms", 1, frame_ms(passes))
            .fixed("direct_ms", "direct", 1, direct_ms)
            .fixed("update_ms", "update", 1, update);
        if !is_sampled {
            return Ok(row.text("choice_ms", "choice", "").text("rays_ms", "rays", "").text("filter_ms", "filter", ""));
        }
        let trace = ms_of(passes, "direct_light/trace");
        let (unshadowed, _) = measured(settings.with_shadows(Shadows::None))?;
        let choice = ms_of(&unshadowed.report.passes, "direct_light/trace");
        Ok(row.fixed("choice_ms", "choice", 1, choice).fixed("rays_ms", "rays", 1, trace - choice).fixed(
            "filter_ms",
            "filter",
            1,
            ms_of(passes, "direct_light/") - trace,
        ))
    }
}
