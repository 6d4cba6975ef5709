//! Every technique of the renderer, one per row.
//!
//! Each row changes one setting from the renderer's recommended settings of direct light. Rows come from the settings'
//! own lists of values where these are short. Tests fail for a setting of [`Settings`] that has neither rows nor a
//! stated reason, and for a named value without a row.

use lanternfish::{
    settings::{Caustics, Culling, Direct, Indirect, Materials, Occlusion, Quality, Settings, TextureBinding, Tracer},
    technique::{AnyTechnique, ParameterInfo},
    techniques::{LightSamples, Sampled},
};
use lanternfish_papers::Deep;
use lanternfish_scene::{Named, Value};

use crate::{
    case::{Case, ONE_BOUNCE, changed},
    ground_truths::{GroundTruth, SOFT_RADIUS},
};

/// One configuration of the renderer.
#[derive(Clone, Debug)]
pub struct Technique {
    /// The changed settings, by their names on the command line.
    pub case: Case,
    /// The ground truth of its image.
    pub ground_truth: GroundTruth,
}

/// Settings with named values, each of which has a row.
const NAMED: [&str; 5] = ["shadows", "ray-culling", "ray-range-culling", "samples", "anisotropy"];

/// Names and values of light culling. Grouping and depth have no row: a single view has a single grid, and clusters
/// beyond the scene are not visible.
const CULLINGS: [(&str, &str); 14] = [
    ("all", "all"),
    ("tiled 8", "tiled, tile-size 8"),
    ("tiled 8, aabb off", "tiled, tile-size 8, aabb off"),
    ("tiled 16", "tiled"),
    ("tiled 16, aabb off", "tiled, aabb off"),
    ("tiled 32", "tiled, tile-size 32"),
    ("tiled 32, aabb off", "tiled, tile-size 32, aabb off"),
    ("clustered ortho:1", "clustered, clusters ortho:1"),
    ("clustered displ:64:8", "clustered, clusters displ:64:8"),
    ("clustered persp:32, brute_force", "clustered, light-assignment brute_force"),
    ("raster-grid 8, 32 layers", "raster-grid, tile-size 8"),
    ("raster-grid 16, 32 layers", "raster-grid"),
    ("raster-grid 32, 32 layers", "raster-grid, tile-size 32"),
    ("raster-grid 16, 8 layers", "raster-grid, grid-layers 8"),
];

/// Number of frames of the mean with all bounces.
const MEAN_FRAMES: u32 = 64;

/// Rays with one bounce of diffuse light, beside those of every tracer.
const BOUNCES: [(&str, &str); 11] = [
    ("within-texel 64, every fourth pixel", "indirect-tracer within-texel, images 64, indirect-resolution half"),
    ("within-texel 128, every fourth pixel", "indirect-tracer within-texel, images 128, indirect-resolution half"),
    ("within-texel 256, every fourth pixel", "indirect-tracer within-texel, images 256, indirect-resolution half"),
    ("bvh, every fourth pixel", "indirect-tracer bvh, indirect-resolution half"),
    ("within-texel 128, half the rays", "indirect-tracer within-texel, images 128, indirect-rays 4, glossy-rays 2"),
    ("bvh, half the rays", "indirect-tracer bvh, indirect-rays 4, glossy-rays 2"),
    ("bvh, not clamped", "indirect-tracer bvh, indirect-clamp off"),
    ("bvh, cached", "indirect-tracer bvh, hit-light cached"),
    ("bvh, every fourth pixel, cached", "indirect-tracer bvh, hit-light cached, indirect-resolution half"),
    ("within-texel 128, cached", "indirect-tracer within-texel, images 128, hit-light cached"),
    (
        "within-texel 128, every fourth pixel, cached",
        "indirect-tracer within-texel, images 128, hit-light cached, indirect-resolution half",
    ),
];

/// All rows for a shot with the direct-light settings `default`, and a scene with this diagonal, m. The first row is
/// `default`.
pub fn techniques(default: &Settings, diagonal: f32) -> Vec<Technique> {
    let mut rows = Rows { default, all: Vec::new() };
    rows.add(GroundTruth::Direct, "default", "");
    rows.direct_light();
    rows.all_light();
    rows.one_bounce();
    rows.occlusion(diagonal);
    rows.environment(diagonal);
    rows.all
}

/// Rows so far.
struct Rows<'s> {
    default: &'s Settings,
    all: Vec<Technique>,
}

impl Rows<'_> {
    fn add(&mut self, ground_truth: GroundTruth, name: &str, changes: &str) {
        self.push(ground_truth, name, changed(self.default, changes));
    }

    fn push(&mut self, ground_truth: GroundTruth, name: &str, settings: Settings) {
        self.all.push(Technique { case: Case::new(name, settings), ground_truth });
    }

    /// Adds a row whose name is its change, unless that is the default or has a row.
    fn direct(&mut self, name: &str, changes: &str) {
        let settings = changed(self.default, changes);
        if self.all.iter().all(|row| row.case.settings != settings) {
            self.push(GroundTruth::Direct, name, settings);
        }
    }

    /// Direct light: techniques of direct light and of light culling, and settings.
    fn direct_light(&mut self) {
        for (name, values) in CULLINGS {
            self.direct(&format!("culling {name}"), &format!("culling {values}"));
        }
        // All other techniques, with their defaults.
        for name in Culling::all().iter().map(Culling::name) {
            self.direct(&format!("culling {name}"), &format!("culling {name}"));
        }
        let rays = LightSamples::ALL.iter().map(|rays| format!("sampled, light-samples {rays}"));
        for name in Direct::all().iter().map(|direct| direct.name().to_owned()).chain(rays) {
            self.direct(&format!("direct {name}"), &format!("direct {name}"));
        }
        for name in NAMED {
            let Some(parameter) = Settings::PARAMETERS.iter().find(|parameter| parameter.info.name == name) else {
                continue;
            };
            for (value, _) in (parameter.of)(&mut self.default.clone()).names() {
                let change = format!("{name} {value}");
                self.direct(&change, &change);
            }
        }
        // Four frames: more take longer and show nothing new.
        self.direct("accumulate 4", "accumulate 4");
        for value in TextureBinding::all() {
            let change = format!("textures {value}");
            self.direct(&change, &change);
        }
        for other in Materials::ALL.iter().filter(|other| **other != self.default.materials.model) {
            let ground_truth = if *other == Materials::File { GroundTruth::Direct } else { GroundTruth::DirectLambert };
            let change = format!("materials {other}");
            self.add(ground_truth, &change, &change);
        }
        // Area lights, rendered as points, and as disks with few or many shadow rays.
        self.add(GroundTruth::DirectSoft, "light-radius 0", "");
        for rays in [self.default.shadows.rays, 4, 64] {
            let change = format!("light-radius {SOFT_RADIUS}, shadow-rays {rays}");
            self.add(GroundTruth::DirectSoft, &change, &change);
        }
    }

    /// All light, rendered without indirect light, and with it.
    fn all_light(&mut self) {
        let mut full = |name: &str, changes: &str| self.add(GroundTruth::Full, &format!("indirect {name}"), changes);
        full("none", "indirect none");
        full(&format!("none, {MEAN_FRAMES} frames"), &format!("indirect none, accumulate {MEAN_FRAMES}"));
        for name in Indirect::all().iter().map(Indirect::name) {
            full(name, &format!("indirect {name}"));
        }
        for name in Caustics::all().iter().map(Caustics::name) {
            full(&format!("virtual-lights, caustics {name}"), &format!("indirect virtual-lights, caustics {name}"));
        }
        full("sampled, one bounce", ONE_BOUNCE);
        full(&format!("sampled, {MEAN_FRAMES} frames"), &format!("indirect sampled, accumulate {MEAN_FRAMES}"));
        let best = self.default.clone().with_indirect(Quality::Best.sampled());
        self.push(GroundTruth::Full, "indirect sampled, best", best);
    }

    /// One bounce: of diffuse light with every tracer, with images of several resolutions; with every other technique,
    /// with its defaults and with every other value of each parameter that has named values; and on the file's
    /// materials, with 16 glossy rays.
    fn one_bounce(&mut self) {
        let mut lambert = |name: &str, changes: &str| {
            let changes = format!("materials lambert, {changes}");
            self.add(GroundTruth::OneBounce, &format!("one-bounce {name}"), &changes);
        };
        lambert("none", "indirect none");
        for tracer in Tracer::in_one_level() {
            let changes = format!("{ONE_BOUNCE}, indirect-tracer {tracer}");
            if tracer.is_exact() {
                lambert(tracer.name(), &changes);
                continue;
            }
            for texels in [64, 128] {
                lambert(&format!("{tracer} {texels}"), &format!("{changes}, images {texels}"));
            }
        }
        BOUNCES.iter().for_each(|(name, changes)| lambert(name, &format!("{ONE_BOUNCE}, {changes}")));
        for technique in Indirect::all().into_iter().filter(|technique| !technique.is::<Sampled>()) {
            let name = technique.name();
            self.add(
                GroundTruth::OneBounce,
                &format!("one-bounce {name}"),
                &format!("materials lambert, images 64, indirect {name}"),
            );
            self.add(
                GroundTruth::OneBounceFile,
                &format!("one-bounce-file {name}"),
                &format!("images 64, indirect {name}"),
            );
            let parameters = technique.technique().map(AnyTechnique::parameters).unwrap_or_default();
            let named =
                |(info, now): (ParameterInfo, Value)| now.names().into_iter().map(move |(name, _)| (info.name, name));
            for (parameter, value) in parameters.into_iter().flat_map(named) {
                let change = format!("{name}, {parameter} {value}");
                let settings = changed(self.default, &format!("materials lambert, images 64, indirect {change}"));
                if settings.indirect != technique {
                    self.push(GroundTruth::OneBounce, &format!("one-bounce {change}"), settings);
                }
            }
        }
        self.add(GroundTruth::OneBounceFile, "one-bounce-file none", "images 128, indirect none");
        for tracer in Tracer::in_one_level() {
            let changes = format!("images 128, {ONE_BOUNCE}, glossy-rays 16, indirect-tracer {tracer}");
            self.add(GroundTruth::OneBounceFile, &format!("one-bounce-file {tracer}"), &changes);
        }
    }

    /// Every technique of ambient occlusion, with near, far and unlimited distance.
    fn occlusion(&mut self, diagonal: f32) {
        for ground_truth in [GroundTruth::Occlusion, GroundTruth::ObscuranceFar, GroundTruth::ObscuranceNear] {
            let max_distance = ground_truth.max_distance(diagonal);
            let mut ways = vec![("none".to_owned(), "occlusion none".to_owned())];
            ways.extend(occlusions(max_distance, diagonal));
            if max_distance.is_none() {
                // Four times the default's directions: at this resolution their number limits the quality.
                let changes = "occlusion deep, images 128, zonal 676";
                ways.push(("deep 128, 676 directions".to_owned(), changes.to_owned()));
            }
            for (name, changes) in ways {
                let settings = changed(&ground_truth.seen(self.default), &changes);
                self.push(ground_truth, &format!("{ground_truth} {name}"), settings);
            }
        }
    }

    /// Light of the environment: without occlusion, with every technique of ambient occlusion, and with rays.
    fn environment(&mut self, diagonal: f32) {
        self.add(GroundTruth::Environment, "environment none", "occlusion none");
        for (name, changes) in occlusions(None, diagonal) {
            self.add(GroundTruth::Environment, &format!("environment {name}"), &changes);
        }
        for tracer in Tracer::in_one_level() {
            let changes = format!("{ONE_BOUNCE}, indirect-tracer {tracer}");
            self.add(GroundTruth::EnvironmentBounce, &format!("environment sampled {tracer}"), &changes);
        }
    }
}

/// Names and changes of every technique of ambient occlusion with this maximum distance, m; `None`: unlimited, or the
/// scene's `diagonal`, m, for techniques that need a limit. A technique that uses deep images has three resolutions.
fn occlusions(max_distance: Option<f32>, diagonal: f32) -> Vec<(String, String)> {
    let distance = "occlusion-distance";
    let of = |technique: Occlusion| {
        let name = technique.name();
        let needs_limit = technique.technique().is_some_and(|technique| technique.get(distance).is_some());
        let limit = max_distance.or(needs_limit.then_some(diagonal));
        let limit = limit.map(|limit| format!(", {distance} {limit}")).unwrap_or_default();
        let changes = format!("occlusion {name}{limit}");
        match technique.is::<Deep>() {
            true => [64, 128, 256].map(|n| (format!("{name} {n}"), format!("{changes}, images {n}"))).to_vec(),
            false => vec![(name.to_owned(), changes)],
        }
    };
    Occlusion::all().into_iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests;
