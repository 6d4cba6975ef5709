//! The measured configurations.

use lanternfish::settings::Settings;
use lanternfish_papers::{DeepBuilder, DeepImageSettings, indirect::virtual_lights::MapSize};

use crate::case::{Case, changed};

/// Deep images as in [Archer2019, §4]; ranges need no triangles.
pub fn papers_images() -> DeepImageSettings {
    DeepImageSettings { payload: false, ..DeepImageSettings::ARCHER }
}

/// Ranges as in the paper: no shadows, no compensation of lost light, most lights with large ranges left out, light weighted by the number of
/// lights that reach a pixel, no filter, one light.
const PAPER: &str = "indirect virtual-lights, vpl-source raster, vpl-count 0, vpl-stride 1, vpl-residual lost, vpl-shadows none, \
                     indirect-filter 0, indirect-clamp off, culling raster-grid";
/// What the paper uses and does not state, fitted to its Atrium: the spacing to 20,000 unique lights, the thresholds to 2,000 listed ones. The
/// weight is fitted to each scene (`measure::weight`).
const FITTED: &str = "vpl-spacing 0.02, vpl-least-range 0.005, vpl-most-range 0.15, vpl-large-kept 10";

/// [VanGelderen2020, app. B]: lights that shine by the root of the cosine, each with the range √(I / I0) of §A.1, no shadows. No light is
/// dropped. His are drawn in pseudo-random directions; ours are an even sample of all by flux.
const APPENDIX_B: &str = "indirect virtual-lights, vpl-unique off, vpl-stride 1, vpl-ranges threshold-each, vpl-least-range 1e-30, \
                          vpl-falloff physical_reduced_2, vpl-emission root, vpl-least-distance 1, vpl-residual lost, vpl-shadows none";

/// Names of those whose steps stand beside the paper's.
pub const WITH_STEPS: [&str; 3] = ["virtual-lights", "as in the paper", "as in the paper, our deep images"];

/// Techniques with their parameters.
const QUICK: [&str; 4] = ["none", "sampled", "sampled, indirect-resolution half", "virtual-lights"];
const VIRTUAL_LIGHTS: [&str; 27] = [
    "indirect-resolution half",
    "vpl-shadow-rays 1",
    "vpl-shadow-rays 16",
    "vpl-shadows none",
    "vpl-shadows within-texel",
    "vpl-shadows across-texels",
    "vpl-residual lost",
    "vpl-residual lost, vpl-shadows none",
    "vpl-residual scaled",
    "vpl-far-lights 64",
    "vpl-ranges maximum",
    "vpl-ranges random",
    "vpl-ranges unlimited = vpl-ranges unlimited, vpl-residual lost",
    "vpl-axis reflection",
    "vpl-range-tracer bvh",
    "vpl-unique off",
    "vpl-count 1024, vpl-stride 1 = vpl-count 1024, vpl-stride 1, vpl-far-lights 64",
    "vpl-count 1024, vpl-stride 4",
    "vpl-stride 4",
    "vpl-count 16384, vpl-stride 32 = vpl-count 16384, vpl-stride 32, vpl-far-lights 2048",
    "vpl-count 16384, vpl-stride 32, half = vpl-count 16384, vpl-stride 32, vpl-far-lights 2048, indirect-resolution half",
    "vpl-source raster",
    "vpl-least-distance 1",
    "vpl-emission root",
    "culling all",
    "culling tiled",
    "culling raster-grid",
];
/// The paper's images by a draw of the scene for each direction, which the others are compared with.
pub const EACH_DIRECTION: &str = "as in the paper, a draw per direction";
/// The paper's with other images, whose light is compared with that of [`EACH_DIRECTION`].
pub const BESIDE_EACH: [&str; 3] = [WITH_STEPS[1], "as in the paper, single_pass", WITH_STEPS[2]];
/// Changes of the paper's.
const OF_PAPER: [&str; 5] = ["vpl-weight 0", "vpl-shadows bvh", "culling all", "culling tiled", "culling clustered"];

/// The paper's configuration with changes.
pub fn paper(look: &Settings, name: &str, changes: &str, images: DeepImageSettings) -> Case {
    let settings = changed(look, &format!("{PAPER}, {FITTED}, {changes}"));
    Case::new(name, settings.with_structure(images)).under_one_light()
}

/// All configurations, with the common settings `look` and the paper's weight; few if `quick`.
pub fn cases(look: &Settings, quick: bool, weight: u32) -> Vec<Case> {
    let paper =
        |name: &str, changes: &str, images| paper(look, name, &format!("vpl-weight {weight}, {changes}"), images);
    let mut all: Vec<Case> = QUICK.iter().map(|name| Case::one_bounce(look, name)).collect();
    let by = |builder| DeepImageSettings { builder, ..papers_images() };
    all.push(paper(EACH_DIRECTION, "", by(DeepBuilder::PerDirection)));
    // His loop, ours, and as many deep images of the same size by our builder, sort and search, in our directions.
    let ours = DeepImageSettings { payload: false, ..DeepImageSettings::default() };
    let images = [papers_images(), by(DeepBuilder::SinglePass), ours];
    all.extend(BESIDE_EACH.iter().zip(images).map(|(name, images)| paper(name, "", images)));
    if quick {
        return all;
    }
    all.push(Case::one_bounce(look, "sampled, half the rays = indirect-rays 4, glossy-rays 2"));
    all.extend(VIRTUAL_LIGHTS.map(|changes| Case::one_bounce(look, &format!("virtual-lights, {changes}"))));
    all.extend(OF_PAPER.map(|changes| paper(&format!("as in the paper, {changes}"), changes, papers_images())));
    for count in [1000, 5000] {
        for changes in ["", ", vpl-ranges threshold"] {
            let (name, count) = (format!("app. B, vpl-count {count}{changes}"), format!("vpl-count {count}"));
            all.push(Case::of(look, &name, &format!("{APPENDIX_B}, {count}{changes}")));
        }
    }
    all
}

/// Settings that compute ranges only: every texel of the map is a light, and no light is listed, so that the map can be large.
pub fn ranges_alone(look: &Settings, map: MapSize, ranges: &str) -> Settings {
    let changes = format!(
        "indirect virtual-lights, vpl-map {map}, vpl-unique off, vpl-count 0, vpl-most-range 1e-30, vpl-large-kept 0, vpl-residual lost, \
         vpl-shadows none, {ranges}"
    );
    changed(look, &changes).with_structure(papers_images())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_list_is_the_beginning_of_the_complete_list() {
        lanternfish_papers::register();
        let look = Settings::direct_light();
        let names = |quick| cases(&look, quick, 32).into_iter().map(|c| c.name).collect::<Vec<_>>();
        let (quick, all) = (names(true), names(false));
        assert!(all.starts_with(&quick) && all.len() > 20, "{all:?}");
        let mut unique = all.clone();
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), all.len());
        assert!(WITH_STEPS.iter().chain(&BESIDE_EACH).all(|name| quick.contains(&(*name).to_owned())), "{quick:?}");
        ranges_alone(&look, MapSize::ALL[0], "vpl-ranges average, vpl-range-tracer bvh");
    }
}
