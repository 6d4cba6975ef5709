//! Renders every configuration, times it, and compares its picture.

use lanternfish::{
    indirect::virtual_lights::{MapSize, Ranges},
    settings::Tracer,
};
use serde::Serialize;

use super::{configurations::ranges_alone, steps::Steps};
use crate::one_bounce::{Bench, Configuration, Errors, Run};
use lanternfish_cli::{error::CliError, parse::Size};

/// One way to find indirect light.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub name: String,
    pub has_steps: bool,
    #[serde(flatten)]
    pub steps: Steps,
    /// Texels of the map that became lights, and those that were listed.
    pub unique: u64,
    pub listed: u64,
    pub too_small: u64,
    pub too_large: u64,
    /// Flux that arrives within ranges, over all that arrives anywhere; none where it is not counted.
    pub in_range: Option<f64>,
    #[serde(flatten)]
    pub errors: Errors,
}

/// Rays that find ranges, of one size of the map.
#[derive(Clone, Debug, Serialize)]
pub struct RangeRow {
    pub map: u32,
    /// Lights that rays were cast from.
    pub lights: u64,
    pub deep_images_ms: f64,
    pub bvh_ms: f64,
    pub random_ms: f64,
}

impl RangeRow {
    /// Million rays a second through deep images, and through the BVH.
    pub fn rates(&self) -> [f64; 2] {
        [self.deep_images_ms, self.bvh_ms].map(|ms| 6.0 * self.lights as f64 / ms / 1e3)
    }
}

/// A row of the table.
pub fn row(bench: &Bench, configuration: &Configuration) -> Result<Row, CliError> {
    let (run, errors) = bench.row(configuration)?;
    let count = |name: &str| run.counter(&format!("virtual_lights/{name}"));
    let arriving = count("flux_arriving");
    Ok(Row {
        name: configuration.name.clone(),
        has_steps: configuration.has_steps,
        steps: steps(&run),
        unique: count("unique"),
        listed: count("listed"),
        too_small: count("too_small"),
        too_large: count("too_large"),
        in_range: (arriving > 0).then(|| count("flux_in_range") as f64 / arriving as f64),
        errors,
    })
}

fn steps(run: &Run) -> Steps {
    let mut steps = Steps::of(&run.picture.report.passes);
    steps.steps[..2].copy_from_slice(&Steps::of(&run.first).steps[..2]);
    steps
}

/// Rays that find ranges in a map of this size: through deep images, through the BVH, and random ranges.
pub fn ranges(bench: &Bench, map: MapSize) -> Result<RangeRow, CliError> {
    let of = |ranges, tracer| {
        // The picture matters not.
        bench.render(&ranges_alone(&bench.look, map, ranges, tracer), Size { width: 64, height: 36 })
    };
    let deep = of(Ranges::Average, Tracer::WithinTexel)?;
    let bvh = steps(&of(Ranges::Average, Tracer::Bvh)?);
    let random = steps(&of(Ranges::Random, Tracer::WithinTexel)?);
    let lights = deep.counter("virtual_lights/unique");
    let deep = steps(&deep);
    Ok(RangeRow {
        map: map.texels(),
        lights,
        deep_images_ms: deep.range_rays + deep.ranges,
        bvh_ms: bvh.range_rays + bvh.ranges,
        random_ms: random.ranges,
    })
}
