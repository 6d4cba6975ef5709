//! The measured configurations.

use lanternfish::settings::Settings;
use lanternfish_papers::{DeepImageSettings, DeepStore, DirectionSet, Paper};

use crate::case::{Case, changed};

/// The case of [`papers`].
pub const PAPER: &str = "as in the paper";
/// Texels along an edge of its images.
pub const PAPERS_RESOLUTION: u32 = 200;
/// Photons as `--as aalund` has them, but drawn with additive blending, as he does (§4.2). His maps: [`plain`].
fn papers(look: &Settings) -> Settings {
    let rows = Paper::Aalund.rows().into_iter();
    let photons = rows.filter(|row| row.name.starts_with("photon-") || row.name.starts_with("indirect"));
    let changes: Vec<String> = photons.map(|row| format!("{} {}", row.name, row.value)).collect();
    changed(look, &format!("{}, photon-splat raster", changes.join(", ")))
}

/// Techniques with their parameters.
const QUICK: [&str; 7] = [
    "none",
    "sampled",
    "sampled, indirect-resolution half",
    "virtual-lights",
    "virtual-lights, indirect-resolution half",
    "photon-splatting",
    "photon-splatting, indirect-resolution half",
];
const PHOTONS: [&str; 15] = [
    "photon-count 1024, photon-radius 0.5",
    "photon-count 1024, photon-radius 2",
    "photon-count 256, photon-radius 0.5",
    "photon-count 256, photon-radius 0.5, photon-splat raster",
    "photon-count 16384",
    "photon-radius 0.25",
    "photon-radius 0.5",
    "photon-tracer ray-query",
    "photon-tracer within-texel",
    "photon-tracer across-texels",
    "photon-widened off",
    "photon-conserve on",
    "indirect-filter 0",
    "culling tiled",
    "culling raster-grid",
];

/// All of them. `look`: what they share; `quick`: few.
pub fn cases(look: &Settings, quick: bool) -> Vec<Case> {
    let mut all: Vec<Case> = QUICK.iter().map(|name| Case::one_bounce(look, name)).collect();
    if !quick {
        all.extend(PHOTONS.map(|changes| Case::one_bounce(look, &format!("photon-splatting, {changes}"))));
        let ours = papers_images(PAPERS_RESOLUTION);
        all.push(Case::new(PAPER, papers(look).with_structure(plain(ours))));
        all.push(Case::new("our deep images, else the same", papers(look).with_structure(ours)));
    }
    all
}

/// 512 deep images of this resolution, texels: 200 in [Aalund2015, §5.2], 50 in fig. 9.
pub fn papers_images(resolution: u32) -> DeepImageSettings {
    let directions = DirectionSet::ZonalEqualArea { count: 512 };
    DeepImageSettings { directions, resolution, ..DeepImageSettings::default() }
}

/// The same in sorted linked lists whose first fragment is hit [Aalund2015, §3, §3.1].
pub fn plain(images: DeepImageSettings) -> DeepImageSettings {
    DeepImageSettings { store: DeepStore::SortedLinkedList, merge_texels: 0.0, tests_triangles: false, ..images }
}

#[test]
fn all_names_are_settings() {
    lanternfish_papers::register();
    let look = Settings::direct_light();
    assert_eq!((cases(&look, true).len(), cases(&look, false).len()), (7, 24));
}
