//! `lanternfish-bench photons`: photon differentials, compared with rays from every pixel, virtual lights and the path
//! tracer [Aalund2015, §5.2].

mod cases;
mod occlusion;

use std::collections::BTreeMap;

use lanternfish_cli::{
    error::CliError,
    times::{counter, frame_ms, ms_of, sorted},
};
use lanternfish_gpu::PassTime;

use self::cases::{PAPER, cases};
use crate::{
    bench::TimedFrames,
    case::Case,
    one_bounce::{self, OneBounce, OneBounceArgs},
    papers::{self, Paper},
    table::{DASH, Row},
};

const TEXT: &str = "*Reflected*: photons from the lights that surfaces reflect; each is split. *Escaped*, *landed*: split photons that leave the \
                    scene, and those that reach a surface, some of which are off screen or hidden. Times are in ms. Deep images are built once, \
                    in the first run, and are not part of the frame time.";

/// Keys and column headings of the steps: paths from the lights to the first surface; rays of split photons, including
/// those that detect edges; sorting of visible photons; lists of photons; splatting.
const STEPS: [(&str, &str); 5] =
    [("emit", "emit"), ("trace", "trace"), ("keep", "sort"), ("lists", "lists"), ("splat", "splat")];

/// Device times of [`STEPS`], ms.
fn times(passes: &[PassTime]) -> [f64; 5] {
    // Light culling runs twice: for the scene's lights before tracing photons, and for photons after it.
    let mut has_photons = false;
    sorted(passes, |name| {
        let own = name.strip_prefix("indirect/photon_splatting/");
        has_photons = (has_photons || own.is_some()) && !name.starts_with("shading/");
        match own {
            Some("emit") => Some(0),
            Some("trace" | "land") => Some(1),
            Some("gather" | "splat" | "add") => Some(4),
            Some(_) => Some(2),
            None => (name.starts_with("light_culling/") && has_photons).then_some(3),
        }
    })
}

/// Measures and writes the report.
pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let of = OneBounce::start(args, "photons", "Photons")?;
    let bench = &of.bench;
    let rows = one_bounce::rows(&of, &args.requested(cases(&of.lit.view.look, args.quick)), |case, timed| {
        Ok(row(case, timed))
    })?;
    let has_occlusion = !args.quick && args.requests("occlusion");
    let occlusion = if has_occlusion { occlusion::rows(&of, args.spp)? } else { Vec::new() };
    // His alone say nothing.
    let is_beside = has_occlusion || rows.iter().any(|row| row.words_of("name") == PAPER);
    bench.section("Techniques of indirect light", TEXT, "rows", rows);
    let title = "Ambient occlusion by 512 deep images (Aalund 2015, figs 8 and 9)";
    bench.section(title, occlusion::TEXT, "occlusion", occlusion);
    if is_beside {
        papers::beside(Paper::Aalund, "photons", &mut bench.report());
    }
    of.bench.finish()
}

/// Rate in millions per second; a dash if there is no time.
fn rate(count: u64, ms: f64) -> String {
    if ms > 0.0 { format!("{:.2}", count as f64 / ms / 1e3) } else { DASH.to_owned() }
}

/// A row of the table, without its errors.
fn row(case: &Case, timed: &TimedFrames) -> Row {
    let count = |name: &str| counter(&timed.image.report, &format!("photons/{name}"));
    let passes = &timed.image.report.passes;
    let by_step =
        |times: [f64; 5]| STEPS.iter().zip(times).map(|((key, _), ms)| (*key, ms)).collect::<BTreeMap<_, _>>();
    let runs: Vec<_> = timed.runs.iter().map(|passes| by_step(times(passes))).collect();
    let times = times(passes);
    let (landed, escaped, splatted) = (count("landed"), count("escaped"), count("splatted"));
    let mut row = Row::default()
        .text("name", "", &case.name)
        .fixed("frame_ms", "frame, ms", 0, frame_ms(passes))
        .fixed("deep_images_ms", "deep images", 0, ms_of(&timed.first, "deep_images/"))
        .data("times", by_step(times))
        .data("times_runs", runs);
    for ((key, heading), ms) in STEPS.into_iter().zip(times) {
        row = row.shown(heading, format_args!("{ms:.1}"));
        match key {
            "trace" => row = row.shown("M photons/s", rate(landed + escaped, ms)),
            "splat" => row = row.shown("M photons/s", rate(splatted, ms)),
            _ => {}
        }
    }
    row.count("reflected", "reflected", count("reflected"))
        .count("escaped", "escaped", escaped)
        .count("landed", "landed", landed)
        .count("off_screen", "off screen", count("off_screen"))
        .count("hidden", "hidden", count("hidden"))
        .count("splatted", "splatted", splatted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_go_to_their_columns() {
        let pass = |(name, ms): (&str, f64)| PassTime { name: name.to_owned(), ms };
        let passes = [
            ("light_culling/clustered/mark", 100.0),
            ("indirect/photon_splatting/emit", 1.0),
            ("indirect/photon_splatting/trace", 2.0),
            ("indirect/photon_splatting/keep", 4.0),
            ("light_culling/clustered/mark", 8.0),
            ("indirect/photon_splatting/gather", 16.0),
            ("shading/forward", 1000.0),
            ("light_culling/tiled/count", 1000.0),
        ];
        assert_eq!(times(&passes.map(pass)), [1.0, 2.0, 4.0, 8.0, 16.0]);
    }

    #[test]
    fn no_rate_without_a_time() {
        assert_eq!((rate(5_000_000, 2000.0), rate(5, 0.0)), ("2.50".to_owned(), "–".to_owned()));
    }
}
