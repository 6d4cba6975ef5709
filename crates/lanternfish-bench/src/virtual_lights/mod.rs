//! `lanternfish-bench virtual-lights`: virtual point lights with ranges, beside rays from every pixel and the path tracer
//! [Archer2019, §4; VanGelderen2020, app. B].

mod configurations;
mod markdown;
mod measure;
mod steps;

use lanternfish::indirect::virtual_lights::MapSize;
use serde::Serialize;

use self::{
    configurations::{configurations, walked},
    measure::{RangeRow, Row},
};
use super::one_bounce::{Bench, Flicker, Heading, OneBounceArgs};
use lanternfish_cli::{error::CliError, progress::Progress};

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Report {
    #[serde(flatten)]
    heading: Heading,
    rows: Vec<Row>,
    ranges: Vec<RangeRow>,
    flicker: Vec<Flicker>,
}

pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let bench = Bench::start(args, "virtual-lights", &mut progress)?;
    let mut rows = Vec::new();
    for configuration in configurations(&bench.look, args.quick).iter().filter(|c| args.asks_for(&c.name)) {
        rows.push(progress.step("render", &configuration.name, || measure::row(&bench, configuration))?);
    }
    let maps = if args.quick { &MapSize::ALL[..1] } else { &MapSize::ALL[2..] };
    let mut ranges = Vec::new();
    for map in maps.iter().filter(|_| args.asks_for("ranges")) {
        ranges.push(progress.step("ranges", &format!("Ranges, {map}²"), || measure::ranges(&bench, *map))?);
    }
    let asked = if args.asks_for("flicker") { walked(&bench.look) } else { Vec::new() };
    let flicker = if asked.is_empty() { Vec::new() } else { bench.flicker(&asked, &mut progress)? };
    progress.finish();

    let report = Report { heading: bench.heading.clone(), rows, ranges, flicker };
    bench.write(&report, &markdown::to_markdown(&report))
}
