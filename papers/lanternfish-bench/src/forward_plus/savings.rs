//! What each optimisation saves, by runs in pairs [Elagabani2025, tables 5.1 and 5.2]: the order of its savings.

use lanternfish_cli::{
    error::CliError,
    timed::{Timed, median_ranks},
    times::{counter, frame_time, ms_of},
};

use super::{ForwardPlus, declared};
use crate::{case::changed, table::Row};

/// What the table means.
pub const TEXT: &str = "A frame without and one with the optimisation in turn, so that both meet the same disturbances. *Saved*: the median part of \
                        a frame's time, and the ranks between which the median of all possible pairs lies, with that *probability*.";

/// The fewest pairs with an interval of 19 in 20.
const PAIRS: u32 = 6;

/// Name, settings without and with the optimisation, and the part of the frame that it saves in the thesis.
const OPTIMISATIONS: [(&str, [&str; 2], Option<f64>); 9] = [
    ("light culling", [NONE, "TILED, ray-culling none"], Some(0.28)),
    ("facing", [NONE, "culling all, ray-culling improved"], Some(0.1531)),
    ("light culling, AABB test and facing", [NONE, "AABB, ray-culling improved"], Some(0.3956)),
    ("light culling and AABB test", [NONE, "AABB, ray-culling none"], Some(0.3169)),
    (
        "improved normals instead of naive ones",
        ["AABB, ray-culling naive", "AABB, ray-culling improved"],
        Some(-0.0083),
    ),
    ("AABB test", ["TILED, ray-culling none", "AABB, ray-culling none"], Some(0.0512)),
    ("tiles of 16 instead of 32", [PX_32, PX_16], Some(0.0430)),
    ("tiles of 8 instead of 16", [PX_16, "AABB, ray-culling improved"], Some(0.0125)),
    ("depth alone", ["AABB, ray-culling improved", "AABB, ray-culling depth"], None),
];

const NONE: &str = "culling all, ray-culling none";
const PX_16: &str = "culling tiled, tile-size 16, ray-culling improved";
const PX_32: &str = "culling tiled, tile-size 32, ray-culling improved";

impl ForwardPlus {
    /// A row for each optimisation.
    pub fn savings(&self) -> Result<Vec<Row>, CliError> {
        let name = |(name, ..): &(&str, _, _)| format!("pairs: {name}");
        self.bench.rows("rows", OPTIMISATIONS, name, |(name, settings, paper)| self.saving(name, *settings, *paper))
    }

    fn saving(&self, name: &str, [without, with]: [&str; 2], paper: Option<f64>) -> Result<Row, CliError> {
        let stage = |changes| {
            let mut settings = changed(&self.view.look, &declared(changes, "off"));
            if changes == with {
                settings = self.bench.made(&format!("pairs: {name}"), &settings);
            }
            let mut stage = self.stage(&settings, changes)?;
            let rays = counter(&stage.frame(&self.view)?.report, "shadows/rays") as f64;
            Ok::<_, CliError>((stage, rays))
        };
        let [(mut without, rays), (mut with, fewer_rays)] = [stage(without)?, stage(with)?];
        let (mut frame, mut shadow) = (Timed::default(), Timed::default());
        for pair in 0..self.bench.runs.max(PAIRS) {
            let mut times = [[0.0; 2]; 2];
            // Each is first in every other pair.
            for i in [pair % 2, 1 - pair % 2].map(|i| i as usize) {
                let stage = if i == 0 { &mut without } else { &mut with };
                let (ms, image) = frame_time(|| stage.frame(&self.view))?;
                times[i] = [ms, ms_of(&image.report.passes, "shadows/trace")];
            }
            let [[frame_before, shadow_before], [frame_after, shadow_after]] = times;
            frame.runs.push(1.0 - frame_after / frame_before);
            shadow.runs.push(1.0 - shadow_after / shadow_before.max(1e-9));
        }
        let ([low, high], (.., probability)) = (frame.interval(), median_ranks(frame.runs.len()));
        Ok(Row::default()
            .text("name", "", name)
            .percent("rays_saved", "rays saved", 1, 1.0 - fewer_rays / rays.max(1.0))
            .percent("saved", "saved", 1, frame.median())
            .data("saved_runs", &frame)
            .percent("saved_low", "at least", 1, low)
            .percent("saved_high", "at most", 1, high)
            .percent("probability", "probability", 1, probability)
            .percent("shadow_saved", "of shadow rays' time", 1, shadow.median())
            .optional("paper_saved", "thesis: saved", paper)
            .said_as(paper.map_or_else(|| crate::table::DASH.to_owned(), |paper| crate::table::percent(2, paper))))
    }
}

#[test]
fn six_pairs_have_an_interval_of_19_in_20() {
    assert!(median_ranks(PAIRS as usize).2 >= 0.95 && median_ranks(PAIRS as usize - 1).2 < 0.95);
}
