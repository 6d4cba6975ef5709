//! Sums the passes of a frame into the steps of [Archer2019, table 1].

use lanternfish_gpu::PassTime;

/// Steps of the paper with its times, ms: Atrium and Rungholt, 1920 x 1080 pixels, GeForce GTX 1060.
pub const PAPER: [(&str, f64, f64); 7] = [
    ("Capture deep images", 3.5, 18.8),
    ("Sort deep images", 2.0, 3.3),
    ("Render g-buffer", 1.3, 8.0),
    ("Render RSM", 0.5, 5.9),
    ("Build VPL buffer", 0.15, 0.4),
    ("Build light grid", 0.7, 0.5),
    ("Apply lighting", 12.0, 6.1),
];

/// Device times of one frame, ms.
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
    pub fn of(passes: &[PassTime]) -> Self {
        let mut sums = Self::default();
        // Light culling runs twice: for the scene's lights before building virtual lights, and for virtual lights after it.
        let mut has_virtual_lights = false;
        for pass in passes {
            let name = pass.name.as_str();
            let own = name.strip_prefix("indirect/virtual_lights/");
            has_virtual_lights |= own.is_some();
            let step = match own {
                Some("map" | "draw" | "reconstruct") => Some(3),
                Some("gather" | "shadow") => Some(6),
                Some(_) => Some(4),
                None if name == "deep_images/sort" || name == "deep_images/merge" => Some(1),
                None if name.starts_with("deep_images/") => Some(0),
                None if name == "prepass" => Some(2),
                None if name.starts_with("light_culling/") && has_virtual_lights => Some(5),
                None if SMOOTHING.contains(&name) => Some(6),
                None => None,
            };
            if let Some(step) = step {
                sums.steps[step] += pass.ms;
            }
            sums.frame += if name.starts_with("deep_images/") { 0.0 } else { pass.ms };
            sums.range_rays += if own == Some("range_rays") { pass.ms } else { 0.0 };
            sums.ranges += if own == Some("ranges") { pass.ms } else { 0.0 };
            sums.shadow_rays += if own == Some("shadow") { pass.ms } else { 0.0 };
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_are_summed_into_the_papers_steps() {
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
