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
    table::Row,
};

/// What the table means.
pub const TEXT: &str = "White surfaces under a white sky, against the path tracer's visible fraction of the sphere with the same distance. *Within \
                        28 %*: obscurance up to 28 % of the scene's diagonal, which is what his 1,280 units are of Crytek Sponza (fig. 8); *near*: up to 1/64 of it; else \
                        everything occludes (fig. 9). *As in the paper*: the first fragment of one texel, weights of 2 / N, sorted linked lists without triangles; \
                        else images hold them, and those of near fragments are tested.";

/// Names of all ways to find occlusion, and the texels of their images; 0: as usual.
const WAYS: [(&str, u32); 13] = [
    ("as in the paper, within 28 %, 512 x 200²", 200),
    ("as in the paper, arrays, within 28 %, 512 x 200²", 200),
    ("deep, within 28 %, 512 x 200²", 200),
    ("deep, within 28 %, as usual", 0),
    ("hbao, within 28 %", 0),
    ("as in the paper, near, 512 x 200²", 200),
    ("deep, near, 512 x 200²", 200),
    ("hbao, near", 0),
    ("as in the paper, 512 x 50²", 50),
    ("deep, 512 x 50²", 50),
    ("as in the paper, 512 x 200²", 200),
    ("deep, 512 x 200²", 200),
    ("deep, as usual", 0),
];

/// The technique that a name of [`WAYS`] begins with, and its reference. `diagonal`: of the scene, m.
fn technique(name: &str, diagonal: f32) -> (Occlusion, GroundTruth) {
    let ground_truth = match name {
        _ if name.contains("28 %") => GroundTruth::ObscuranceFar,
        _ if name.contains("near") => GroundTruth::ObscuranceNear,
        _ => GroundTruth::Occlusion,
    };
    let max_distance = ground_truth.max_distance(diagonal);
    let occlusion = match name.split(',').next() {
        Some("hbao") => Hbao { radius: max_distance.unwrap_or(diagonal) }.into(),
        Some("deep") => Deep { max_distance, ..Deep::default() }.into(),
        // Without tests of triangles [Aalund2015, §3.3].
        _ => Deep { max_distance, plain: true }.into(),
    };
    (occlusion, ground_truth)
}

/// Ways to find occlusion, on white surfaces under a white sky.
pub fn rows(of: &OneBounce, spp: u64) -> Result<Vec<Row>, CliError> {
    let bench = &of.bench;
    let mut view = of.lit.view.with(ground_truths::white(of.lit.view.scene.clone()));
    let diagonal = view.scene.bounds().size().length();
    let mut references = Vec::new();
    for kind in [GroundTruth::ObscuranceFar, GroundTruth::ObscuranceNear, GroundTruth::Occlusion] {
        let traced = bench.step("ground_truth", "Occlusion", || view.reference(bench, kind, spp))?;
        references.push((kind, traced.mean));
    }
    view.look = GroundTruth::Occlusion.seen(&view.look);
    let rows = bench.rows(
        "occlusion",
        WAYS,
        |(name, _)| (*name).to_owned(),
        |(name, texels)| {
            let (occlusion, ground_truth) = technique(name, diagonal);
            let mut images = if *texels > 0 { papers_images(*texels) } else { DeepImageSettings::default() };
            if name.starts_with(PAPER) && !name.contains("arrays") {
                images = plain(images);
            }
            let timed = bench.timed(&view, &view.look.clone().with_occlusion(occlusion).with_structure(images))?;
            bench.write(&format!("occlusion, {name}"), &timed.image)?;
            let (_, reference) = references.iter().find(|(kind, _)| *kind == ground_truth).expect("all are traced");
            let bytes = counter(&timed.image.report, "deep_images/bytes");
            let build_ms = ms_of(&timed.first, "deep_images/");
            let occlusion_ms = ms_of(&timed.image.report.passes, "occlusion/");
            Ok::<_, CliError>(
                Row::default()
                    .text("name", "", name)
                    .fixed("deep_images_ms", "deep images, ms", 0, build_ms)
                    .megabytes("bytes", "MB", bytes)
                    .fixed("occlusion_ms", "occlusion, ms", 1, occlusion_ms)
                    .fixed("flip", "FLIP", 4, flip(&timed.image, reference)?)
                    .fixed("energy", "energy", 3, energy(&timed.image) / energy_of(reference)),
            )
        },
    )?;
    Ok(rows)
}

/// What is bounded is judged by the ground truth with the same bound.
#[test]
fn every_way_has_the_distance_of_its_ground_truth() {
    for (name, _) in WAYS {
        let (occlusion, ground_truth) = technique(name, 40.0);
        let expected = ground_truth.max_distance(40.0);
        let deep = [false, true].map(|plain| Occlusion::from(Deep { max_distance: expected, plain }));
        let is_hbao = expected.is_some_and(|radius| occlusion == Hbao { radius }.into());
        assert!(deep.contains(&occlusion) || is_hbao, "{name}");
    }
}
