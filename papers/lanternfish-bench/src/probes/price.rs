//! The price of a frame with a warm radiance cache: rays by count, and times by pass.

use lanternfish::RenderedImage;
use lanternfish_cli::{
    error::CliError,
    times::{counter, sums},
};
use lanternfish_gpu::PassTime;

use super::{Cost, InMotion, is_indirect, rays, views};
use crate::{
    case::Case,
    table::{Row, percent},
};

const TEXT: &str = "A view at rest, after the frames that warm history and radiance cache. Rays a pixel by count: *rays* from pixels or probes, \
                    *shadow* rays at their hits, *emitter* rays from pixels, *cache*: samples of cache entries, each a ray and at most one shadow \
                    ray that is not counted; *all*: every counter of indirect light that ends in `rays`, and *cache*. *Indirect*: all passes of \
                    indirect light and of the radiance cache, ms.";
const PASSES: &str = "The passes of the same frames, longest first, with their share of *indirect*.";
/// Passes of a frame that are shown.
const MOST_PASSES: usize = 12;

impl InMotion<'_> {
    /// Adds the tables of prices.
    pub fn prices(&self) -> Result<(), CliError> {
        let (mut rows, mut passes) = (Vec::new(), Vec::new());
        for view in self.views(views::PRICE, 432)? {
            for Case { name, settings, .. } in self.cases(&view) {
                let step = || self.at_rest(&view, &settings, self.bench.runs);
                let frames = self.bench.step("price", &format!("{}, {name}", view.name), step)?;
                let ms = |image: &RenderedImage| Cost::of(image).indirect_ms;
                let Some(best) = frames.iter().min_by(|a, b| ms(a).total_cmp(&ms(b))) else { continue };
                let of = Row::default().text("scene", "", &view.name).text("technique", "", name);
                rows.push(of.clone().and(row(best, view.pixels())));
                passes.extend(breakdown(&best.report.passes).into_iter().map(|pass| of.clone().and(pass)));
            }
        }
        self.bench.section("Price", TEXT, "price", rows);
        self.bench.section("Price by pass", PASSES, "passes", passes);
        Ok(())
    }
}

fn row(image: &RenderedImage, pixels: f64) -> Row {
    let per_pixel = |count: u64| count as f64 / pixels;
    let of = |name| per_pixel(counter(&image.report, name));
    let cost = Cost::of(image);
    let counters: std::collections::BTreeMap<_, _> =
        image.report.counters.iter().filter(|(name, _)| is_indirect(name)).map(|(name, n)| (name, n)).collect();
    Row::default()
        .fixed("rays", "rays", 2, of("indirect/rays"))
        .fixed("shadow_rays", "shadow", 2, of("indirect/shadow_rays"))
        .fixed("emitter_rays", "emitter", 2, of("indirect/emitter_rays"))
        .fixed("cache_samples", "cache", 2, of("radiance_cache/samples"))
        .fixed("all_rays", "all", 2, per_pixel(rays(image)))
        .fixed("indirect_ms", "indirect, ms", 1, cost.indirect_ms)
        .fixed("frame_ms", "frame, ms", 1, cost.frame_ms)
        .data("counters", counters)
}

/// Rows of the passes of indirect light; passes of one label are added up.
fn breakdown(passes: &[PassTime]) -> Vec<Row> {
    let mut sums = sums(passes.iter().filter(|pass| is_indirect(&pass.name)));
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let all: f64 = sums.iter().map(|(_, ms)| ms).sum();
    let row = |(name, ms): &(&str, f64)| {
        let row = Row::default().text("pass", "", name).fixed("ms", "ms", 2, *ms);
        row.shown("share", percent(1, ms / all.max(f64::MIN_POSITIVE)))
    };
    sums.iter().take(MOST_PASSES).map(row).collect()
}

#[test]
fn passes_of_one_label_add_up() {
    let passes =
        [("indirect/filter", 1.0), ("indirect/trace", 2.5), ("shading/forward", 9.0), ("indirect/filter", 2.0)];
    let rows = breakdown(&passes.map(|(name, ms)| PassTime { name: name.to_owned(), ms }));
    let figures: Vec<(&str, f64)> = rows.iter().map(|row| (row.words_of("pass"), row.f64("ms"))).collect();
    assert_eq!(figures, [("indirect/filter", 3.0), ("indirect/trace", 2.5)]);
}
