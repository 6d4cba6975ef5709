//! Renders and times every configuration, and compares its image.

use lanternfish::RenderedImage;
use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of, linear},
    parse::Size,
    report::grouped,
    times::counter,
};
use lanternfish_metrics::RgbImage;
use lanternfish_papers::{VirtualLights, indirect::virtual_lights::MapSize};

use super::{
    cases::{BESIDE_EACH, EACH_DIRECTION, WITH_STEPS, paper, papers_images, ranges_alone},
    steps::Steps,
};
use crate::{bench::TimedFrames, case::Case, one_bounce::OneBounce, reference::flip, table::Row, view::View};

/// A row of the table, without its errors.
pub fn row(case: &Case, timed: &TimedFrames) -> Row {
    let count = |name: &str| counter(&timed.image.report, &format!("virtual_lights/{name}"));
    let arriving = count("flux_arriving");
    // Fraction of the arriving flux that arrives within ranges; `None` if flux is not counted.
    let in_range = (arriving > 0).then(|| count("flux_in_range") as f64 / arriving as f64);
    let steps = Steps::of_timed(timed);
    let (times, runs) = (steps.steps, Steps::of_runs(timed));
    let each = |of: fn(&Steps) -> f64| runs.iter().map(of).collect::<Vec<_>>();
    Row::default()
        .text("name", "", &case.name)
        .data("has_steps", WITH_STEPS.contains(&&*case.name))
        .data("steps", times)
        .data("steps_runs", runs.iter().map(|run| run.steps).collect::<Vec<_>>())
        .data("frame_runs", each(|run| run.frame))
        .data("range_rays_runs", each(|run| run.range_rays))
        .data("ranges_runs", each(|run| run.ranges))
        .fixed("frame", "frame, ms", 0, steps.frame)
        .shown("map", format_args!("{:.1}", times[3]))
        .shown("lights built", format_args!("{:.1}", times[4]))
        .shown("lists", format_args!("{:.1}", times[5]))
        .shown("gathered", format_args!("{:.0}", times[6]))
        .fixed("shadow_rays", "of these: shadow rays", 0, steps.shadow_rays)
        .fixed("range_rays", "range rays", 1, steps.range_rays)
        .said_as(format_args!("{:.2} %", 100.0 * steps.range_rays / steps.frame))
        .data("ranges", steps.ranges)
        .data("build_ms", steps.build())
        .data("total_ms", steps.total())
        .data("map_texels", case.settings.indirect.get::<VirtualLights>().map(|lights| lights.map.texels().pow(2)))
        .count("unique", "unique", count("unique"))
        .count("listed", "listed", count("listed"))
        .count("too_small", "too small", count("too_small"))
        .count("too_large", "too large", count("too_large"))
        .maybe("in_range", "in range", 2, in_range)
}

/// The weight by the number of lights [Archer2019, §3.2] with which their light is as bright as without it, to which it
/// is proportional.
pub fn weight(of: &OneBounce) -> Result<u32, CliError> {
    const TRIED: u32 = 1024;
    let light = |weight: u32| {
        let case = paper(&of.lit.view.look, "", &format!("vpl-weight {weight}"), papers_images());
        let lit = of.lit(&case)?;
        Ok::<_, CliError>(energy(&of.bench.first_frame(&lit.view, &case.settings)?) - lit.direct_energy)
    };
    let ratio = light(0)? / light(TRIED)?;
    Ok((f64::from(TRIED) * ratio).round().clamp(1.0, 65536.0) as u32)
}

/// Final light by other images beside that by images with a draw for each direction: "no difference in the final
/// indirect lighting result" [Archer2019, §4].
#[derive(Default)]
pub struct Beside(Option<RgbImage>);

impl Beside {
    /// Figures of a row. `direct`: energy without indirect light.
    pub fn row(&mut self, name: &str, image: &RenderedImage, direct: f64) -> Result<Row, CliError> {
        if name == EACH_DIRECTION {
            self.0 = Some(linear(image)?);
        }
        let each = self.0.as_ref().filter(|_| BESIDE_EACH.contains(&name));
        let ratio = each.map(|each| (energy(image) - direct) / (energy_of(each) - direct));
        let flip = each.map(|each| flip(image, each)).transpose()?;
        Ok(Row::default().maybe("builder_energy", "energy by builder", 4, ratio).maybe(
            "builder_flip",
            "FLIP by builder",
            4,
            flip,
        ))
    }
}

/// Times of computing ranges for a map of this size: with rays through deep images and through the BVH, and for random
/// ranges.
pub fn ranges(of: &OneBounce, map: MapSize) -> Result<Row, CliError> {
    // A small image, because only ranges are timed.
    let small = View { size: Size { width: 64, height: 36 }, ..of.lit.view.clone() };
    let timed = |(name, ranges): (&str, &str)| {
        of.bench.timed(&small, &of.bench.made(name, &ranges_alone(&of.lit.view.look, map, ranges)))
    };
    let deep = timed(("ranges by deep images", "vpl-ranges average"))?;
    let bvh = timed(("ranges by the BVH", "vpl-ranges average, vpl-range-tracer bvh"));
    let random = timed(("random ranges", "vpl-ranges random"));
    let (bvh, random) = (Steps::of_timed(&bvh?), Steps::of_timed(&random?));
    let (lights, deep) = (counter(&deep.image.report, "virtual_lights/unique"), Steps::of_timed(&deep));
    let ms = [deep.range_rays + deep.ranges, bvh.range_rays + bvh.ranges, random.ranges];
    Ok(range_row(map.texels(), lights, deep.build(), ms))
}

/// `lights`: that rays were cast from; `build`: milliseconds of building deep images.
fn range_row(map: u32, lights: u64, build: f64, [deep, bvh, random]: [f64; 3]) -> Row {
    let rate = |ms: f64| 6.0 * lights as f64 / ms / 1e3;
    Row::default()
        .number("map", "map", map)
        .said_as(format_args!("{map}²"))
        .data("lights", lights)
        .shown("rays", grouped(6 * lights))
        .fixed("deep_images_ms", "deep images, ms", 1, deep)
        .fixed("deep_images_rate", "M rays/s", 2, rate(deep))
        .fixed("build_ms", "with their build, ms", 1, build)
        .said_as(format_args!("{:.1}", build + deep))
        .fixed("bvh_ms", "BVH, ms", 1, bvh)
        .fixed("bvh_rate", "M rays/s", 2, rate(bvh))
        .fixed("random_ms", "random, ms", 2, random)
}
