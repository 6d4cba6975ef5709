//! Ambient occlusion by 512 deep images [Aalund2015, figs 8 and 9].

use lanternfish::settings::{DeepImageSettings, Hbao, Occlusion, Settings};
use lanternfish_gpu::PassTime;
use serde::Serialize;

use super::configurations::papers_images;
use crate::{
    one_bounce::Bench,
    quality::truths::{self, Truth},
};
use lanternfish_cli::error::CliError;

/// One way to find occlusion, on white surfaces under a white sky.
#[derive(Clone, Debug, Serialize)]
pub struct OcclusionRow {
    pub name: String,
    /// Device milliseconds of building deep images, and of the passes of occlusion.
    pub deep_images_ms: f64,
    pub occlusion_ms: f64,
    /// Bytes of deep images.
    pub bytes: u64,
    /// Against the path tracer: mean HDR-FLIP, and the sum of the picture over the truth's.
    pub flip: f64,
    pub energy: f64,
}

/// All rows.
pub fn rows(bench: &Bench) -> Result<Vec<OcclusionRow>, CliError> {
    let scene = truths::white(bench.scene.clone());
    let truth = bench.truth_of(Truth::Occlusion, &scene)?;
    let look = Truth::Occlusion.seen(&bench.look);
    let far = 0.28 * scene.bounds().size().length();
    let usual = DeepImageSettings::default();
    let ways = [
        ("deep, 512 x 200²", Occlusion::deep(None), papers_images(200)),
        ("deep, 512 x 50²", Occlusion::deep(None), papers_images(50)),
        ("deep, as usual", Occlusion::deep(None), usual),
        ("hbao, 28 % of the diagonal", Occlusion::Hbao(Hbao { radius: far }), usual),
    ];
    let row = |(name, occlusion, images): &(&str, Occlusion, DeepImageSettings)| {
        let deep_images = DeepImageSettings { payload: false, ..*images };
        let settings = Settings { occlusion: *occlusion, deep_images, ..look.clone() };
        let run = bench.render_scene(&scene, &settings, bench.size)?;
        let (flip, energy) = bench.against(&run.picture, &truth)?;
        let ms = |passes: &[PassTime], start: &str| -> f64 {
            passes.iter().filter(|pass| pass.name.starts_with(start)).map(|pass| pass.ms).sum()
        };
        Ok(OcclusionRow {
            name: (*name).to_owned(),
            deep_images_ms: ms(&run.first, "deep_images/"),
            occlusion_ms: ms(&run.picture.report.passes, "occlusion/"),
            bytes: run.counter("deep_images/bytes"),
            flip,
            energy,
        })
    };
    ways.iter().map(row).collect()
}
