//! Ambient occlusion with 512 deep images [Aalund2015, figs 8 and 9].

use lanternfish::settings::{Occlusion, Settings};
use lanternfish_cli::error::CliError;
use lanternfish_papers::DeepImageSettings;

use super::cases::papers_images;
use crate::{
    ground_truths::{self, GroundTruth},
    one_bounce::Bench,
    run::{counter, ms_of},
    table::Row,
    technique,
};

/// Measures techniques of ambient occlusion, on white surfaces under a white sky.
pub fn rows(bench: &Bench) -> Result<Vec<Row>, CliError> {
    let scene = ground_truths::white(bench.scene.clone());
    let ground_truth = bench.ground_truth_of(GroundTruth::Occlusion, &scene)?;
    let look = GroundTruth::Occlusion.seen(&bench.look);
    let far = 0.28 * scene.bounds().size().length();
    let usual = DeepImageSettings::default();
    let techniques = [
        ("deep, 512 x 200²", technique::deep_occlusion(None), papers_images(200)),
        ("deep, 512 x 50²", technique::deep_occlusion(None), papers_images(50)),
        ("deep, as usual", technique::deep_occlusion(None), usual),
        ("hbao, 28 % of the diagonal", technique::hbao(far), usual),
    ];
    let row = |(name, occlusion, images): (&str, Occlusion, DeepImageSettings)| {
        let deep_images = DeepImageSettings { payload: false, ..images };
        let rendered = bench.render_scene(
            &scene,
            &Settings { occlusion, structure: deep_images.into(), ..look.clone() },
            bench.size,
        )?;
        let (flip, energy) = bench.against(&rendered.rendering, &ground_truth)?;
        let bytes = counter(&rendered.rendering.report, "deep_images/bytes");
        Ok(Row::default()
            .text("name", "", name)
            .fixed("deep_images_ms", "deep images, ms", 0, ms_of(&rendered.first, "deep_images/"))
            .count("bytes", "MB", bytes)
            .said_as(format_args!("{:.1}", bytes as f64 / 1e6))
            .fixed("occlusion_ms", "occlusion, ms", 1, ms_of(&rendered.rendering.report.passes, "occlusion/"))
            .fixed("flip", "FLIP", 4, flip)
            .fixed("energy", "energy", 3, energy))
    };
    techniques.into_iter().map(row).collect()
}
