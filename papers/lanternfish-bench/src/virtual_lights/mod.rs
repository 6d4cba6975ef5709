//! `lanternfish-bench virtual-lights`: virtual point lights with ranges, compared with rays from every pixel and the path tracer
//! [Archer2019, §4; VanGelderen2020, app. B].

mod cases;
mod measure;
mod steps;

use std::cell::RefCell;

use lanternfish_cli::error::CliError;
use lanternfish_papers::indirect::virtual_lights::MapSize;

use self::{cases::cases, measure::Beside};
use crate::{
    one_bounce::{self, OneBounce, OneBounceArgs},
    papers::{self, Paper},
    table::Row,
};

const TEXT: &str = "*In range*: fraction of the flux of virtual lights that reaches surfaces within their ranges. *Range rays*: fraction of the \
                    frame time. Times are in ms. Deep images are built once, in the first run, and are not part of the frame time; the \
                    paper's total includes them. *Energy* and *FLIP by builder*: indirect light alone, and the complete image, against the \
                    row with a draw per direction [Archer2019, §4]. Rows as in the paper have one light, the sun where there is one.";

/// Measures, and writes the report.
pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let of = OneBounce::start(args, "virtual-lights", "Virtual lights")?;
    let (bench, look) = (&of.bench, &of.lit.view.look);
    let is_papers = args.requested(cases(look, args.quick, 0)).iter().any(|case| case.has_one_light);
    let weight = if is_papers { measure::weight(&of)? } else { 0 };
    bench.facts(Row::default().data("fitted_weight", weight));
    let beside = RefCell::new(Beside::default());
    let rows = one_bounce::rows(&of, &args.requested(cases(look, args.quick, weight)), |case, timed| {
        let beside = beside.borrow_mut().row(&case.name, &timed.image, of.lit(case)?.direct_energy)?;
        Ok(measure::row(case, timed).and(beside))
    })?;
    let maps = if args.quick { &MapSize::ALL[..1] } else { &MapSize::ALL[2..] };
    let maps = maps.iter().filter(|_| args.requests("ranges, table-3"));
    let ranges = bench.rows("ranges", maps, |map| format!("Ranges, {map}²"), |map| measure::ranges(&of, **map))?;
    bench.section("Techniques of indirect light", TEXT, "rows", rows);
    let text = "Six rays from every texel of the map that sees anything, no light is listed; through 169 deep images of 64² as in the paper, and through the BVH.";
    bench.section("Ranges (Archer 2019, table 3)", text, "ranges", ranges);
    papers::beside(Paper::Archer, "virtual-lights", &mut bench.report());
    of.bench.finish()
}
