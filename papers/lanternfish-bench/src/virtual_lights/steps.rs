//! Sums the passes of a frame into the steps of [Archer2019, table 1].

use lanternfish_cli::times::{frame_ms, ms_of, sorted};
use lanternfish_gpu::PassTime;

use crate::{
    bench::TimedFrames,
    table::{DASH, Row, fixed, percent},
};

/// His steps, and what he measured: Atrium and Rungholt, 1920 x 1080, GeForce GTX 1060, ms.
pub const PAPER: [(&str, f64, f64); 7] = [
    ("Capture deep images", 3.5, 18.8),
    ("Sort deep images", 2.0, 3.3),
    ("Render g-buffer", 1.3, 8.0),
    ("Render RSM", 0.5, 5.9),
    ("Build VPL buffer", 0.15, 0.4),
    ("Build light grid", 0.7, 0.5),
    ("Apply lighting", 12.0, 6.1),
];

/// His totals as printed; his rows sum to 20.15 and 43.0.
const PRINTED: [f64; 2] = [20.6, 43.5];

/// Device milliseconds of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps {
    /// Steps in the order of [`PAPER`].
    pub steps: [f64; 7],
    /// Rays that compute ranges, a part of the fifth step.
    pub range_rays: f64,
    /// Assignment of ranges from the traced rays, a part of the fifth step.
    pub ranges: f64,
    /// Shadow rays to virtual lights, a part of the last step.
    pub shadow_rays: f64,
    /// All passes but those that build deep images, which are reused while nothing moves.
    pub frame: f64,
}

/// Passes that filter the demodulated irradiance.
const SMOOTHING: [&str; 6] = [
    "indirect/resolve",
    "indirect/firefly_clamp",
    "indirect/collect",
    "indirect/redistribution",
    "indirect/add",
    "indirect/filter",
];

impl Steps {
    /// Milliseconds that building deep images takes, which are kept as long as nothing moves.
    pub fn build(&self) -> f64 {
        self.steps[..2].iter().sum()
    }

    /// Milliseconds of his steps, with the build.
    pub fn total(&self) -> f64 {
        self.steps.iter().sum()
    }

    /// Steps of the fastest frame, with the build of the first one.
    pub fn of_timed(timed: &TimedFrames) -> Self {
        let mut steps = Self::of(&timed.image.report.passes);
        steps.steps[..2].copy_from_slice(&Self::of(&timed.first).steps[..2]);
        steps
    }

    /// Steps of every timed frame, with the build of the first one.
    pub fn of_runs(timed: &TimedFrames) -> Vec<Self> {
        let build = Self::of(&timed.first);
        let with_build = |passes: &Vec<PassTime>| {
            let mut steps = Self::of(passes);
            steps.steps[..2].copy_from_slice(&build.steps[..2]);
            steps
        };
        timed.runs.iter().map(with_build).collect()
    }

    pub fn of(passes: &[PassTime]) -> Self {
        // Light culling runs twice: for the scene's lights before building virtual lights, and for virtual lights after
        // it.
        let mut has_virtual_lights = false;
        let steps = sorted(passes, |name| {
            let own = name.strip_prefix("indirect/virtual_lights/");
            has_virtual_lights |= own.is_some();
            match own {
                Some("map" | "draw" | "reconstruct") => Some(3),
                Some("gather" | "shadow") => Some(6),
                Some(_) => Some(4),
                None if name == "deep_images/sort" || name == "deep_images/merge" => Some(1),
                None if name.starts_with("deep_images/") => Some(0),
                None if name == "prepass" => Some(2),
                None if name.starts_with("light_culling/") && has_virtual_lights => Some(5),
                None if SMOOTHING.contains(&name) => Some(6),
                None => None,
            }
        });
        let own = |name: &str| ms_of(passes, &format!("indirect/virtual_lights/{name}"));
        let [range_rays, ranges, shadow_rays] = ["range_rays", "ranges", "shadow"].map(own);
        Self { steps, range_rays, ranges, shadow_rays, frame: frame_ms(passes) }
    }
}

/// A row of [Archer2019, table 1]: its name, ours from the steps, his from his.
type Line = (&'static str, fn(&Steps) -> Option<f64>, fn(&Steps, f64) -> Option<f64>, fn(f64) -> String);

/// What follows from the steps. His figures follow from his rows, but the total, which is printed; his rays have no row
/// of their own.
const LINES: [Line; 6] = [
    ("Total", |ours| Some(ours.total()), |_, printed| Some(printed), |ms| fixed(1, ms)),
    (
        "Total without deep images",
        |ours| Some(ours.total() - ours.build()),
        |his, _| Some(his.total() - his.build()),
        |ms| fixed(1, ms),
    ),
    (
        "Build VPL buffer, of the total",
        |ours| over(ours.steps[4], ours.total()),
        |his, all| over(his.steps[4], all),
        share,
    ),
    (
        "Build VPL buffer, without deep images",
        |ours| over(ours.steps[4], ours.total() - ours.build()),
        |his, _| over(his.steps[4], his.total() - his.build()),
        share,
    ),
    ("Range rays, of the total", |ours| over(ours.range_rays, ours.total()), |_, _| None, share),
    ("Range rays, without deep images", |ours| over(ours.range_rays, ours.total() - ours.build()), |_, _| None, share),
];

fn over(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

fn share(ratio: f64) -> String {
    percent(2, ratio)
}

/// [Archer2019, table 1] with its totals, and each range's share of them; a column for each of `ours`.
pub fn table(ours: &[(String, Steps)]) -> Vec<Row> {
    let column = |of: fn(&(&str, f64, f64)) -> f64| Steps { steps: PAPER.each_ref().map(of), ..Steps::default() };
    let his = [("Atrium", column(|row| row.1)), ("Rungholt", column(|row| row.2))];
    let steps = PAPER.iter().enumerate().map(|(i, (name, ..))| {
        let row = Row::default().text("step", "", name);
        let row = ours.iter().fold(row, |row, (name, ours)| row.shown(name, fixed(1, ours.steps[i])));
        his.iter().fold(row, |row, (name, his)| row.shown(name, his.steps[i]))
    });
    let lines = LINES.iter().map(|(name, of_ours, of_his, shown)| {
        let said = |figure: Option<f64>| figure.map_or(DASH.to_owned(), shown);
        let row = Row::default().text("step", "", name);
        let row = ours.iter().fold(row, |row, (name, ours)| row.shown(name, said(of_ours(ours))));
        his.iter().zip(PRINTED).fold(row, |row, ((name, his), printed)| row.shown(name, said(of_his(his, printed))))
    });
    steps.chain(lines).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_and_shares_are_with_the_build_and_without() {
        let steps = Steps { steps: [6.0, 4.0, 1.0, 1.0, 2.0, 3.0, 3.0], range_rays: 0.5, ..Steps::default() };
        assert_eq!([steps.build(), steps.total()], [10.0, 20.0]);
        let table = crate::table::to_markdown(&table(&[("ours".to_owned(), steps)]));
        for line in [
            "| Sort deep images | 4.0 | 2 | 3.3 |",
            "| Total | 20.0 | 20.6 | 43.5 |",
            "| Total without deep images | 10.0 | 14.6 | 20.9 |",
            "| Build VPL buffer, of the total | 10.00 % | 0.73 % | 0.92 % |",
            "| Build VPL buffer, without deep images | 20.00 % | 1.02 % | 1.91 % |",
            "| Range rays, of the total | 2.50 % | – | – |",
            "| Range rays, without deep images | 5.00 % | – | – |",
        ] {
            assert!(table.contains(line), "{line} is not in\n{table}");
        }
    }

    #[test]
    fn passes_go_to_his_steps() {
        let pass = |(name, ms): (&str, f64)| PassTime { name: name.to_owned(), ms };
        let passes = [
            ("prepass", 1.0),
            ("light_culling/clustered/mark", 100.0),
            ("deep_images/gather", 2.0),
            ("deep_images/sort", 3.0),
            ("indirect/virtual_lights/map", 4.0),
            ("indirect/virtual_lights/merge", 5.0),
            ("indirect/virtual_lights/range_rays", 6.0),
            ("indirect/virtual_lights/ranges", 7.0),
            ("light_culling/clustered/mark", 8.0),
            ("indirect/virtual_lights/gather", 9.0),
            ("indirect/virtual_lights/shadow", 10.0),
            ("indirect/redistribution", 5.0),
            ("indirect/filter", 6.0),
            ("shading/forward", 1000.0),
        ];
        let steps = Steps::of(&passes.map(pass));
        assert_eq!(steps.steps, [2.0, 3.0, 1.0, 4.0, 18.0, 8.0, 30.0]);
        assert_eq!((steps.range_rays, steps.ranges, steps.shadow_rays), (6.0, 7.0, 10.0));
        assert_eq!(steps.frame, 1161.0);
        assert_eq!(PAPER.iter().map(|(_, atrium, _)| atrium).sum::<f64>(), 20.15);
    }
}
