//! Rays whose ends bring what the radiance cache keeps, beside rays whose ends are shaded.

use std::fmt::Write;

use lanternfish::{
    Picture, Renderer,
    settings::{Bounces, HitLight, Indirect, Sampled, Settings, Tracer},
};
use lanternfish_gpu::PassTime;
use serde::Serialize;

use super::{
    configurations::{Brdf, Configuration, ImageSet},
    errors::{energy, flip},
    measure::Bench,
    times::rays,
};
use lanternfish_cli::{error::CliError, progress::Progress, report::grouped};

/// Frames after which the cache counts as warm.
pub const WARM_FRAMES: u32 = 32;
/// Samples of each cell in a picture whose cache is warmed before its rays are looked at.
const WARMED_SAMPLES: u32 = 64;

/// Figures of one way to light what rays meet: diffuse light, [`Brdf::Diffuse`].
#[derive(Clone, Debug, Serialize)]
pub struct CachedRow {
    pub tracer: &'static str,
    pub hit_light: &'static str,
    pub bounces: String,
    /// Device time of a picture of one frame, and of the frame after [`WARM_FRAMES`] others, milliseconds; without building deep images.
    pub first_frame_ms: f64,
    pub warm_frame_ms: f64,
    /// Of that frame: million rays a second, traced alone and with the light that their ends bring.
    pub rate_traced: f64,
    pub rate_with_light: f64,
    /// Of that frame: cells of the cache, and samples of them that were taken; 0 without it.
    pub cells: u64,
    pub samples: u64,
    /// Energy of the indirect light over that of the mean of many frames whose hits are shaded; of a picture of one frame, and of one whose
    /// cache was warmed before. With every bounce there is more.
    pub energy: f64,
    pub warmed_energy: f64,
    /// FLIP of the two pictures against that mean.
    pub flip: f64,
    pub warmed_flip: f64,
}

impl Bench<'_> {
    /// Rows through the BVH, and within a texel of the plan's first images.
    pub fn cached(
        &self,
        set: Option<ImageSet>,
        converged: &Picture,
        progress: &mut Progress,
    ) -> Result<Vec<CachedRow>, CliError> {
        let through_images = set.map(|set| (set, Tracer::WithinTexel));
        let ways =
            [(HitLight::Shaded, Bounces::ONE), (HitLight::Cached, Bounces::ONE), (HitLight::Cached, Bounces::All)];
        let direct =
            Settings { indirect: Indirect::None, ..Configuration::plain(Brdf::Diffuse).settings(self.look, None) };
        let direct = energy(&self.picture(direct)?);
        let mut rows = Vec::new();
        for images in [None].into_iter().chain(through_images.map(Some)) {
            for (hit_light, bounces) in ways {
                let configuration = Configuration { images, ..Configuration::plain(Brdf::Diffuse) };
                let settings = |cache_samples| {
                    let mut settings = configuration.settings(self.look, None);
                    if let Indirect::Sampled(sampled) = &mut settings.indirect {
                        *sampled = Sampled { hit_light, bounces, cache_samples, ..*sampled };
                    }
                    settings
                };
                let words = format!("{}, hit light {hit_light}, bounces {bounces}", configuration.in_words());
                let row = progress.step("cached", &words, || {
                    let usual = Sampled::default().cache_samples;
                    let first = self.picture(settings(usual))?;
                    let warmed = self.picture(settings(WARMED_SAMPLES))?;
                    let warm = self.warm_frame(settings(usual))?;
                    let share = |picture: &Picture| (energy(picture) - direct) / (energy(converged) - direct);
                    let (trace, light) = (sum(&warm, is_trace), sum(&warm, is_light));
                    let count =
                        rays(first.radiance.iter().map(|pixel| pixel[3]), 1, Brdf::Diffuse.counted_rays()) as f64;
                    let counted = |name: &str| {
                        warm.report.counters.iter().find(|(known, _)| known == name).map_or(0, |(_, count)| *count)
                    };
                    Ok::<_, CliError>(CachedRow {
                        tracer: configuration.tracer().name(),
                        hit_light: hit_light.name(),
                        bounces: bounces.to_string(),
                        first_frame_ms: sum(&first, is_of_frame),
                        warm_frame_ms: sum(&warm, is_of_frame),
                        rate_traced: count / trace / 1e3,
                        rate_with_light: count / (trace + light) / 1e3,
                        cells: counted("radiance_cache/cells"),
                        samples: counted("radiance_cache/samples"),
                        energy: share(&first),
                        warmed_energy: share(&warmed),
                        flip: flip(&first, converged)?,
                        warmed_flip: flip(&warmed, converged)?,
                    })
                })?;
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// A picture of one frame, after one whose times do not count.
    fn picture(&self, settings: Settings) -> Result<Picture, CliError> {
        let mut renderer = Renderer::new(&self.gpu.device, &self.gpu.queue, settings)?;
        let mut render = || renderer.render(self.scene(Brdf::Diffuse), self.camera, self.size.width, self.size.height);
        render()?;
        Ok(render()?)
    }

    /// The frame after [`WARM_FRAMES`] others of one mean.
    fn warm_frame(&self, settings: Settings) -> Result<Picture, CliError> {
        let settings = Settings { accumulate: WARM_FRAMES + 1, ..settings };
        let mut renderer = Renderer::new(&self.gpu.device, &self.gpu.queue, settings)?;
        renderer.reset();
        let view = [(self.camera, self.size.width, self.size.height)];
        for _ in 0..WARM_FRAMES {
            renderer.refine(self.scene(Brdf::Diffuse), &view)?;
        }
        Ok(renderer.refine(self.scene(Brdf::Diffuse), &view)?.remove(0))
    }
}

fn sum(picture: &Picture, counts: fn(&PassTime) -> bool) -> f64 {
    picture.report.passes.iter().filter(|pass| counts(pass)).map(|pass| pass.ms).sum()
}

fn is_trace(pass: &PassTime) -> bool {
    pass.name == "indirect/trace"
}

/// All that light takes, between tracing and smoothing.
fn is_light(pass: &PassTime) -> bool {
    let shading = ["indirect/shade", "indirect/shadow", "indirect/emitters"];
    shading.contains(&pass.name.as_str())
        || ["indirect/cells/", "radiance_cache/"].iter().any(|room| pass.name.starts_with(room))
}

fn is_of_frame(pass: &PassTime) -> bool {
    !pass.name.starts_with("deep_images/")
}

const HEAD: &str = "| tracer | hit light | bounces | first frame, ms | warm, ms | traced, M/s | with light, M/s | share | cells | samples a frame \
                    | energy | warmed | FLIP | warmed |";
const RULE: &str = "|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|";

/// The rows as a table with what it says.
pub fn section(rows: &[CachedRow], converged_frames: u32) -> String {
    let mut text = format!(
        "\n## Radiance cache, diffuse light\n\nThe whole frame, without building deep images: a picture of one frame, whose cache is empty before it, \
         and the frame after {WARM_FRAMES} others (*warm*). Rays a second are of the warm frame; *with light*: and all that is done for the light that their ends \
         bring. *Energy*, of the indirect light, and *FLIP* are against the mean of {converged_frames} frames through the BVH whose hits are shaded: of the picture of \
         one frame, and of one whose cells had {WARMED_SAMPLES} samples each before (*warmed*). With every bounce there is more light than in that mean.\n\n{HEAD}\n{RULE}\n"
    );
    for row in rows {
        writeln!(text, "{}", table_row(row)).expect("String");
    }
    text
}

fn table_row(row: &CachedRow) -> String {
    format!(
        "| {} | {} | {} | {:.1} | {:.1} | {:.2} | {:.2} | {:.2} | {} | {} | {:.3} | {:.3} | {:.4} | {:.4} |",
        row.tracer,
        row.hit_light,
        row.bounces,
        row.first_frame_ms,
        row.warm_frame_ms,
        row.rate_traced,
        row.rate_with_light,
        row.rate_with_light / row.rate_traced,
        grouped(row.cells),
        grouped(row.samples),
        row.energy,
        row.warmed_energy,
        row.flip,
        row.warmed_flip
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_as_many_columns_as_its_head() {
        let row = CachedRow {
            tracer: "bvh",
            hit_light: HitLight::Cached.name(),
            bounces: Bounces::All.to_string(),
            first_frame_ms: 2.0,
            warm_frame_ms: 1.0,
            rate_traced: 4.0,
            rate_with_light: 3.0,
            cells: 1000,
            samples: 10,
            energy: 1.0,
            warmed_energy: 1.0,
            flip: 0.1,
            warmed_flip: 0.1,
        };
        let columns = |text: &str| text.matches('|').count();
        assert_eq!([columns(RULE), columns(&table_row(&row))], [columns(HEAD); 2]);
        assert!(table_row(&row).contains("| 4.00 | 3.00 | 0.75 | 1,000 |"));
    }

    #[test]
    fn what_light_takes_is_all_between_tracing_and_smoothing() {
        let of = |name: &str| PassTime { name: name.to_owned(), ms: 1.0 };
        for name in ["indirect/shade", "indirect/shadow", "indirect/cells/find", "radiance_cache/light"] {
            assert!(is_light(&of(name)) && !is_trace(&of(name)), "{name}");
        }
        for name in ["indirect/trace", "indirect/filter", "indirect/resolve", "shadows/trace"] {
            assert!(!is_light(&of(name)), "{name}");
        }
    }
}
