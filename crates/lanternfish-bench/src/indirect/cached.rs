//! Indirect light with cached radiance at hits, compared with shaded hits.

use lanternfish::{
    RenderedImage, Renderer,
    settings::Settings,
    techniques::{Bounces, HitLight, Sampled},
};
use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_gpu::PassTime;
use lanternfish_papers::WITHIN_TEXEL;

use super::{
    cases::{Brdf, Case, ImageSet},
    measure::Bench,
    times::rays,
};
use crate::{
    image::{energy, flip},
    run::{counter, frame_ms},
    table::Row,
    technique,
};

/// Number of frames before the frame with a warm cache.
const WARM_FRAMES: u32 = 32;
/// Samples of each cache entry for the image with a warmed cache.
const WARMED_SAMPLES: u32 = 64;

impl Bench<'_> {
    /// Measures rays through the BVH, and through the images of `set` with the within-texel tracer.
    pub fn cached(
        &self,
        set: Option<ImageSet>,
        converged: &RenderedImage,
        progress: &mut Progress,
    ) -> Result<Vec<Row>, CliError> {
        let through_images = set.map(|set| (set, WITHIN_TEXEL));
        let techniques =
            [(HitLight::Shaded, Bounces::ONE), (HitLight::Cached, Bounces::ONE), (HitLight::Cached, Bounces::All)];
        let direct = Case::plain(Brdf::Diffuse).settings(self.look, None).with_indirect(technique::NO_INDIRECT);
        let direct = energy(&self.rendering(direct)?);
        let mut rows = Vec::new();
        for images in [None].into_iter().chain(through_images.map(Some)) {
            for (hit_light, bounces) in techniques {
                let case = Case { images, ..Case::plain(Brdf::Diffuse) };
                let settings = |cache_samples| {
                    let mut settings = case.settings(self.look, None);
                    if let Some(sampled) = settings.indirect.get_mut::<Sampled>() {
                        *sampled = Sampled { hit_light, bounces, cache_samples, ..*sampled };
                    }
                    settings
                };
                let words = format!("{}, hit light {hit_light}, bounces {bounces}", case.in_words());
                let row = progress.step("cached", &words, || {
                    let usual = Sampled::default().cache_samples;
                    let first = self.rendering(settings(usual))?;
                    let warmed = self.rendering(settings(WARMED_SAMPLES))?;
                    let warm = self.warm_frame(settings(usual))?;
                    let fraction =
                        |rendering: &RenderedImage| (energy(rendering) - direct) / (energy(converged) - direct);
                    let (trace, light) = (sum(&warm, is_trace), sum(&warm, is_light));
                    let covered = first.radiance.iter().map(|pixel| pixel[3]);
                    let count = rays(covered, 1, Brdf::Diffuse.counted_rays()) as f64;
                    let [traced, with_light] = [trace, trace + light].map(|ms| count / ms / 1e3);
                    Ok::<_, CliError>(
                        Row::default()
                            .text("tracer", "tracer", case.tracer().name())
                            .text("hit_light", "hit light", hit_light.name())
                            .text("bounces", "bounces", bounces)
                            .fixed("first_frame_ms", "first frame, ms", 1, frame_ms(&first.report.passes))
                            .fixed("warm_frame_ms", "warm, ms", 1, frame_ms(&warm.report.passes))
                            .fixed("rate_traced", "traced, M/s", 2, traced)
                            .fixed("rate_with_light", "with light, M/s", 2, with_light)
                            .shown("ratio", format_args!("{:.2}", with_light / traced))
                            .count("cells", "entries", counter(&warm.report, "radiance_cache/entries"))
                            .count("samples", "samples per frame", counter(&warm.report, "radiance_cache/samples"))
                            .fixed("energy", "energy", 3, fraction(&first))
                            .fixed("warmed_energy", "warmed", 3, fraction(&warmed))
                            .fixed("flip", "FLIP", 4, flip(&first, converged)?)
                            .fixed("warmed_flip", "warmed", 4, flip(&warmed, converged)?),
                    )
                })?;
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// Renders an image of one frame, after a warm-up frame.
    fn rendering(&self, settings: Settings) -> Result<RenderedImage, CliError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        let mut render = || renderer.render(self.scene(Brdf::Diffuse), self.camera, self.size.width, self.size.height);
        render()?;
        Ok(render()?)
    }

    /// Renders the frame after [`WARM_FRAMES`] frames of one accumulation.
    fn warm_frame(&self, settings: Settings) -> Result<RenderedImage, CliError> {
        let settings = settings.with_accumulate(WARM_FRAMES + 1);
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        renderer.reset();
        let view = [(self.camera, self.size.width, self.size.height)];
        for _ in 0..WARM_FRAMES {
            renderer.refine(self.scene(Brdf::Diffuse), &view)?;
        }
        Ok(renderer.refine(self.scene(Brdf::Diffuse), &view)?.remove(0))
    }
}

/// Time of the passes that are `wanted`, ms.
fn sum(rendering: &RenderedImage, wanted: fn(&PassTime) -> bool) -> f64 {
    rendering.report.passes.iter().filter(|pass| wanted(pass)).map(|pass| pass.ms).sum()
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
