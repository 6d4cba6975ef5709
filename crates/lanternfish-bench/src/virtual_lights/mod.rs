//! `lanternfish-bench virtual-lights`: virtual point lights with ranges, compared with rays from every pixel and the path tracer
//! [Archer2019, §4; VanGelderen2020, app. B].

mod cases;
mod measure;
mod steps;

use lanternfish_cli::{error::CliError, progress::Progress};
use lanternfish_papers::indirect::virtual_lights::MapSize;

use self::{
    cases::{cases, walked},
    steps::PAPER,
};
use crate::{
    one_bounce::{Bench, OneBounceArgs},
    table::Row,
};

const TEXT: &str = "*In range*: fraction of the flux of virtual lights that reaches surfaces within their ranges. *Range rays*: fraction of the \
                    frame time. Times are in ms. Deep images are built once, in the first run, and are not part of the frame time; the \
                    paper's total includes them.";

/// Measures and writes the report.
pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let mut bench = Bench::start(args, "virtual-lights", "Virtual lights", &mut progress)?;
    let (mut rows, mut steps) = (Vec::new(), Vec::new());
    for case in cases(&bench.look, args.quick).iter().filter(|case| args.requests(&case.name)) {
        let (row, own) = progress.step("render", &case.name, || measure::row(&bench, case))?;
        rows.push(row);
        steps.extend(own);
    }
    let maps = if args.quick { &MapSize::ALL[..1] } else { &MapSize::ALL[2..] };
    let mut ranges = Vec::new();
    for map in maps.iter().filter(|_| args.requests("ranges")) {
        ranges.push(progress.step("ranges", &format!("Ranges, {map}²"), || measure::ranges(&bench, *map))?);
    }
    let report = &mut bench.report;
    report.section("Techniques of indirect light", TEXT, "rows", rows);
    report.heading("Steps (Archer 2019, table 1), ms");
    report.paragraph(
        "The paper: 1920 x 1080 pixels, NVIDIA GeForce GTX 1060. Its printed totals are 20.6 and 43.5 ms; its rows sum to 20.15 and 43.0 ms.",
    );
    report.show(PAPER.iter().enumerate().map(|(i, (name, atrium, rungholt))| {
        let row = Row::default().text("step", "", name);
        let ours =
            |row: Row, (name, steps): &(String, steps::Steps)| row.shown(name, format_args!("{:.1}", steps.steps[i]));
        steps.iter().fold(row, ours).shown("Atrium", atrium).shown("Rungholt", rungholt)
    }));
    let text = "Six rays from every texel of the map with a surface, through 169 deep images of 64² texels and through the BVH. No light is \
                listed.";
    report.section("Ranges (Archer 2019, table 3)", text, "ranges", ranges);
    let walked = if args.requests("flicker") { walked(&bench.look) } else { Vec::new() };
    bench.finish(&walked, progress)
}
