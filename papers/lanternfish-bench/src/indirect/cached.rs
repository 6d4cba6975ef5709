//! Indirect light with cached radiance at hits, compared with shaded hits.

use lanternfish::{RenderedImage, settings::Settings};
use lanternfish_cli::{
    error::CliError,
    images::{energy, flip},
    times::{counter, frame_ms},
};
use lanternfish_gpu::PassTime;
use lanternfish_papers::WITHIN_TEXEL;

use super::{
    cases::{Brdf, ImageSet, RayCase},
    measure::RayBench,
    times::rays,
};
use crate::{case::changed, table::Row};

/// Number of frames before the frame with a warm cache.
const WARM_FRAMES: u32 = 32;
/// Samples of each cache entry for the image with a warmed cache.
const WARMED_SAMPLES: u32 = 64;

impl RayBench {
    /// Measures rays through the BVH, and through the images of `set` with the within-texel tracer.
    pub fn cached(&self, set: Option<ImageSet>, converged: &RenderedImage) -> Result<Vec<Row>, CliError> {
        let images = [None].into_iter().chain(set.map(|set| Some((set, WITHIN_TEXEL))));
        let cases = images.map(|images| RayCase { images, ..RayCase::plain(Brdf::Diffuse) });
        let light = [("shaded", "1"), ("cached", "1"), ("cached", "all")];
        let all = cases.flat_map(|case| light.map(|light| (case, light)));
        let direct = changed(&RayCase::plain(Brdf::Diffuse).settings(&self.view.look, None), "indirect none");
        let direct = energy(&self.frame(Brdf::Diffuse, &direct)?);
        let ratio = |image: &RenderedImage| (energy(image) - direct) / (energy(converged) - direct);
        let words = |(case, (hit_light, bounces)): &(RayCase, _)| {
            format!("{}, hit light {hit_light}, bounces {bounces}", case.in_words())
        };
        self.bench.rows("cached", all, words, |(case, (hit_light, bounces))| {
            let settings = case.settings(&self.view.look, None);
            let settings = changed(&settings, &format!("hit-light {hit_light}, bounces {bounces}"));
            let image = |settings: &Settings| {
                let mut renderer = self.bench.renderer(settings)?;
                self.frames(&mut renderer, Brdf::Diffuse, 1)?;
                let (mut image, passes) = self.frames(&mut renderer, Brdf::Diffuse, 1)?;
                image.report.passes = passes.concat();
                Ok::<_, CliError>(image)
            };
            let first = image(&settings)?;
            let warmed = image(&changed(&settings, &format!("cache-samples {WARMED_SAMPLES}")))?;
            let accumulate = WARM_FRAMES + 1;
            let mut renderer = self.bench.renderer(&settings.with_accumulate(accumulate))?;
            let (warm, frames) = self.frames(&mut renderer, Brdf::Diffuse, accumulate)?;
            let passes = frames.last().map_or(&[][..], Vec::as_slice);
            let (trace, light) = (sum(passes, is_trace), sum(passes, is_light));
            let covered = first.radiance.iter().map(|pixel| pixel[3]);
            let count = rays(covered, 1, Brdf::Diffuse.counted_rays()) as f64;
            let [traced, with_light] = [trace, trace + light].map(|ms| count / ms / 1e3);
            Ok(Row::default()
                .text("tracer", "tracer", case.tracer().name())
                .text("hit_light", "hit light", hit_light)
                .text("bounces", "bounces", bounces)
                .fixed("first_frame_ms", "first frame, ms", 1, frame_ms(&first.report.passes))
                .fixed("warm_frame_ms", "warm, ms", 1, frame_ms(passes))
                .fixed("rate_traced", "traced, M/s", 2, traced)
                .fixed("rate_with_light", "with light, M/s", 2, with_light)
                .shown("ratio", format_args!("{:.2}", with_light / traced))
                .count("cells", "entries", counter(&warm.report, "radiance_cache/entries"))
                .count("samples", "samples per frame", counter(&warm.report, "radiance_cache/samples"))
                .fixed("energy", "energy", 3, ratio(&first))
                .fixed("warmed_energy", "warmed", 3, ratio(&warmed))
                .fixed("flip", "FLIP", 4, flip(&first, converged)?)
                .fixed("warmed_flip", "warmed", 4, flip(&warmed, converged)?))
        })
    }
}

/// Time of the passes that are `wanted`, ms.
fn sum(passes: &[PassTime], wanted: fn(&PassTime) -> bool) -> f64 {
    passes.iter().filter(|pass| wanted(pass)).map(|pass| pass.ms).sum()
}

fn is_trace(pass: &PassTime) -> bool {
    pass.name == "indirect/trace"
}

/// True for the passes that compute the light at hits, between tracing and filtering.
fn is_light(pass: &PassTime) -> bool {
    let shading = ["indirect/shade", "indirect/shadow", "indirect/emitters"];
    shading.contains(&pass.name.as_str())
        || ["indirect/entries/", "radiance_cache/"].iter().any(|folder| pass.name.starts_with(folder))
}

/// Text of the table.
pub fn text(converged_frames: u32) -> String {
    format!(
        "Frame times exclude building deep images: of an image of one frame with an initially empty cache, and of the frame after \
         {WARM_FRAMES} others (*warm*). Ray rates are those of the warm frame; *with light* includes the light at hits. *Energy* of the \
         indirect light, and *FLIP*, are against the mean of {converged_frames} frames through the BVH with shaded hits: for the image of one \
         frame, and for one whose entries have {WARMED_SAMPLES} samples each (*warmed*). With all bounces there is more light than in that \
         mean."
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_passes_are_all_between_tracing_and_filtering() {
        let of = |name: &str| PassTime { name: name.to_owned(), ms: 1.0 };
        for name in ["indirect/shade", "indirect/shadow", "indirect/entries/find", "radiance_cache/light"] {
            assert!(is_light(&of(name)) && !is_trace(&of(name)), "{name}");
        }
        for name in ["indirect/trace", "indirect/filter", "indirect/resolve", "shadows/trace"] {
            assert!(!is_light(&of(name)), "{name}");
        }
    }
}
