//! Sums the passes of a frame into the steps of [Archer2019, table 1].

use lanternfish_cli::times::{frame_ms, ms_of, sorted};
use lanternfish_gpu::PassTime;

use crate::bench::TimedFrames;

/// Device milliseconds of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps {
    /// His steps: capture and sort deep images, render g-buffer and RSM, build VPL buffer and light grid, apply lighting.
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

#[cfg(test)]
mod tests {
    use super::*;

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
    }
}
