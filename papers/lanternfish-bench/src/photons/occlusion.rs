//! Ambient occlusion with 512 deep images [Aalund2015, figs 8 and 9].

use lanternfish::settings::Occlusion;
use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of},
    times::{counter, ms_of},
};
use lanternfish_papers::{Deep, DeepImageSettings, Hbao};

use super::cases::{PAPER, papers_images, plain};
use crate::{
    ground_truths::{self, GroundTruth},
    one_bounce::OneBounce,
    reference::flip,
    table::{Row, decimal},
};

/// What the table means.
pub const TEXT: &str = "White surfaces under a white sky, against the path tracer's visible fraction of the sphere with the same distance. *Within \
                        28 %*: obscurance up to 28 % of the scene's diagonal, which is what his 1,280 units are of Crytek Sponza (fig. 8); else \
                        everything occludes (fig. 9). HBAO *by radius* \
                        takes a sample every 4 pixels of its radius in the image (§5.1). *As in the paper*: the first fragment of one texel, weights of 2 / N, sorted linked lists without triangles; \
                        else images hold them, and those of near fragments are tested.";

/// Names of all ways to find occlusion, and the texels of their images; 0: as usual.
const WAYS: [(&str, u32); 11] = [
    ("as in the paper, within 28 %, 512 x 200²", 200),
    ("as in the paper, arrays, within 28 %, 512 x 200²", 200),
    ("deep, within 28 %, 512 x 200²", 200),
    ("deep, within 28 %, as usual", 0),
    ("hbao, within 28 %", 0),
    ("as in the paper, 512 x 50²", 50),
    ("deep, 512 x 50²", 50),
    ("as in the paper, 512 x 200²", 200),
    ("deep, 512 x 200²", 200),
    ("deep, as usual", 0),
    ("hbao, far, by radius", 0),
];

/// Pixels between the samples of HBAO *by radius*.
const STEP: f32 = 4.0;

/// The technique that a name of [`WAYS`] begins with, and its reference. `distance`: as [`distance_of`] gives it, m.
fn technique(name: &str, distance: Option<f32>) -> (Occlusion, GroundTruth) {
    let occlusion = match name.split(',').next() {
        Some("hbao") => {
            let step = name.contains("by radius").then_some(STEP);
            Hbao { radius: distance.unwrap_or_default(), step }.into()
        }
        Some("deep") => Deep { max_distance: distance, ..Deep::default() }.into(),
        // Without tests of triangles [Aalund2015, §3.3].
        _ => Deep { max_distance: distance, plain: true, ..Deep::default() }.into(),
    };
    (occlusion, if distance.is_none() { GroundTruth::Occlusion } else { GroundTruth::ObscuranceFar })
}

/// Largest distance of occluders of a name of [`WAYS`], m; none: any. `diagonal`: of the scene, m.
fn distance_of(name: &str, diagonal: f32) -> Option<f32> {
    let is_far = name.split(", ").any(|word| word == "far" || word == "within 28 %");
    GroundTruth::ObscuranceFar.max_distance(diagonal).filter(|_| is_far)
}

/// Ways to find occlusion, on white surfaces under a white sky.
pub fn rows(of: &OneBounce, spp: u64) -> Result<Vec<Row>, CliError> {
    let bench = &of.bench;
    let mut view = of.lit.view.with(ground_truths::white(of.lit.view.scene.clone()));
    let diagonal = view.scene.bounds().size().length();
    let mut references = Vec::new();
    for kind in [GroundTruth::ObscuranceFar, GroundTruth::Occlusion] {
        let traced = bench.step("ground_truth", "Occlusion", || view.reference(bench, kind, spp))?;
        references.push((kind, traced.mean));
    }
    view.look = GroundTruth::Occlusion.seen(&view.look);
    let rows = bench.rows(
        "occlusion",
        WAYS,
        |(name, _)| (*name).to_owned(),
        |(name, texels)| {
            let distance = distance_of(name, diagonal);
            let (occlusion, ground_truth) = technique(name, distance);
            let mut images = if *texels > 0 { papers_images(*texels) } else { DeepImageSettings::default() };
            if name.starts_with(PAPER) && !name.contains("arrays") {
                images = plain(images);
            }
            let settings = view.look.clone().with_occlusion(occlusion).with_structure(images);
            let timed = bench.timed(&view, &bench.made(name, &settings))?;
            bench.write(&format!("occlusion, {name}"), &timed.image)?;
            let reference = references.iter().find(|(kind, _)| *kind == ground_truth).map(|(_, mean)| mean);
            let bytes = counter(&timed.image.report, "deep_images/bytes");
            let build_ms = ms_of(&timed.first, "deep_images/");
            let occlusion_ms = ms_of(&timed.image.report.passes, "occlusion/");
            Ok::<_, CliError>(
                Row::default()
                    .text("name", "", name)
                    .maybe("distance", "distance, m", 2, distance.map(decimal))
                    .fixed("deep_images_ms", "deep images, ms", 0, build_ms)
                    .megabytes("bytes", "MB", bytes)
                    .fixed("occlusion_ms", "occlusion, ms", 1, occlusion_ms)
                    .maybe("flip", "FLIP", 4, reference.map(|of| flip(&timed.image, of)).transpose()?)
                    .maybe("energy", "energy", 3, reference.map(|of| energy(&timed.image) / energy_of(of))),
            )
        },
    )?;
    Ok(rows)
}

/// What is bounded is judged by the ground truth with the same bound.
#[test]
fn every_way_has_the_distance_of_its_ground_truth() {
    for (name, _) in WAYS {
        let distance = distance_of(name, 40.0);
        let (occlusion, ground_truth) = technique(name, distance);
        assert_eq!(occlusion.technique().unwrap().max_distance(), ground_truth.max_distance(40.0), "{name}");
    }
}
