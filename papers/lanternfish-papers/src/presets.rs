//! The five papers as settings: every stage of a frame as a paper has it, off where it has none. Lights are the
//! scene's: the default of `range-threshold` is that of [Elagabani2025, eq. 4.1], the default of `attenuation` is
//! [VanGelderen2020, eq. 5.1].

use lanternfish::settings::{GivenSettings, Settings};
use lanternfish_scene::named_enum;

named_enum! {
    /// A paper, or all five in one frame.
    Paper {
        /// [Elagabani2025].
        Elagabani = "elagabani": "Forward+: tiles, shadow rays from surfaces that face the light (2025)",
        /// [VanGelderen2020].
        VanGelderen = "van-gelderen": "Clustered lights, one grid for all views (2020)",
        /// [Niessner2010].
        Niessner = "niessner": "Rays across the texels of layered depth images (2010)",
        /// [Aalund2015].
        Aalund = "aalund": "Occlusion and photons by layered depth maps (2015)",
        /// [Archer2019].
        Archer = "archer": "Virtual lights, their ranges from compound deep images (2019)",
        /// One frame in which all five work.
        Five = "five": "All five in one frame",
    }
}

/// One setting of a paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperSetting {
    /// The name, as in [`Settings::set`].
    pub name: &'static str,
    /// The value.
    pub value: &'static str,
    /// The section that says so, and what it says; or why this stands for it.
    pub source: &'static str,
}

type Row = (&'static str, &'static str, &'static str);

const NONE: &str = "the paper has none";
/// Direct light of Nießner and Aalund, who rasterise it.
const EXACT: &str = "exact rays, for the shadow map or the rasterised light that stand apart from the method";

/// Every stage, with the values of a paper that does not speak of it.
const STAGES: [Row; 14] = [
    ("direct", "all", "every light that is listed"),
    ("culling", "all", "lights are not culled"),
    ("shadows", "none", NONE),
    ("ray-culling", "surface", "not stated; the image is the same with none"),
    ("ray-range-culling", "on", "not stated; the image is the same without"),
    ("light-radius", "0", NONE),
    ("sun-diameter", "0", NONE),
    ("indirect", "none", NONE),
    ("caustics", "none", NONE),
    ("occlusion", "none", NONE),
    ("history", "off", NONE),
    ("antialiasing", "none", NONE),
    ("samples", "1", NONE),
    ("materials", "file", "by metalness and roughness, as the scene's file has them"),
];

const ELAGABANI: &[Row] = &[
    ("culling", "tiled", "§4.2.3: tiles between their nearest and farthest depth"),
    ("tile-size", "8", "tables 5.1 and 5.2"),
    ("aabb", "on", "§4.2.3, in the fastest rows of table 5.1"),
    ("shadows", "auto", "§4.3: ray queries; the BVH where the adapter has none"),
    ("ray-culling", "improved", "§4.3.1: normals from five depths along each axis"),
    ("ray-range-culling", "off", "§4.3.3: a ray to every light of the tile that the surface faces"),
];

const VAN_GELDEREN: &[Row] = &[
    ("culling", "clustered", "§3; the test of the box around a cluster is ours, and shortens lists"),
    ("clusters", "persp:64", "§3.1; the best size of chapter 6"),
    ("cluster-views", "enclosed", "§4.1: one grid around both eyes"),
    ("light-assignment", "brute_force", "§3.3"),
    ("cluster-depth", "100", "§6.1.3"),
    ("ray-culling", "surface", "no shadow rays"),
    ("ray-range-culling", "on", "no shadow rays"),
    ("indirect", "none", "app. B has virtual lights, as an experiment"),
    ("samples", "1", "fig. 6.10; §5.2.3 describes more"),
];

const NIESSNER: &[Row] = &[
    ("shadows", "auto", EXACT),
    ("indirect", "sampled", "§5: rays from every pixel"),
    ("indirect-rays", "8", "§7: diffuse rays"),
    ("glossy-rays", "16", "§7"),
    ("first-rays", "1", "a first frame has no more rays than others"),
    ("hit-light", "shaded", "§5: local lighting at hits, with an exact shadow ray for their shadow map"),
    ("bounces", "1", "§5"),
    ("indirect-tracer", "across-texels", "§3.2"),
    ("indirect-resolution", "full", "§5: 8 to 64 rays a pixel"),
    ("indirect-filter", "5", "§5, §7: 11 x 11 on diffuse light; ours stops at edges, and filters glossy light too"),
    ("indirect-clamp", "off", NONE),
    ("deep-directions", "cube:5", "§3.1, §7: 150 directions; one image for two opposite ones is ours"),
    ("deep-resolution", "128", "§5"),
    ("deep-builder", "per_triangle", "the images of §3.1; depth_peeling, theirs, takes minutes on a processor"),
    ("deep-merge", "0", NONE),
    ("deep-sort", "blocks", "ours: peeled layers need no sort"),
    ("deep-search", "linear_steps", "not stated; the hits are the same"),
    ("deep-tolerance", "0.5", "§3.2, fig. 3: a tolerance, whose size is not stated"),
    ("samples", "4", "§4, §7"),
];

const AALUND: &[Row] = &[
    ("culling", "clustered", "ours: pixels find the photons that they gather; the light is the same"),
    ("shadows", "auto", EXACT),
    ("occlusion", "deep", "§3.3"),
    ("occlusion-plain", "on", "§3.3, eq. 1 to 3"),
    ("indirect", "photon-splatting", "§3.4"),
    ("photon-count", "4096", "not stated; ours"),
    ("photon-tracer", "within-texel", "§3.1"),
    ("photon-bounces", "1", "§3.4: absorbed after the first bounce"),
    ("photon-radius", "1", "§3.4: the ellipse of the differentials"),
    ("photon-widened", "off", NONE),
    ("photon-conserve", "off", NONE),
    ("photon-splat", "gather", "the sum of §4.2; raster, their blending, takes minutes on a processor"),
    ("indirect-resolution", "full", "§4.2"),
    ("indirect-filter", "0", NONE),
    ("indirect-clamp", "off", NONE),
    ("deep-directions", "zonal:512", "§3.2, figs 8 to 10"),
    ("deep-resolution", "50", "fig. 9; figs 8 and 10 have 200"),
    ("deep-builder", "per_direction", "§3: one draw for each map"),
    ("deep-merge", "0", NONE),
    ("deep-store", "sorted_linked_list", "§3: PSPPSLL; windows and replays take arrays"),
    ("deep-test", "off", "§3.1: the first fragment"),
];

const ARCHER: &[Row] = &[
    ("shadows", "auto", "§3.2: shadows of the light are calculated apart; exact rays"),
    ("culling", "raster-grid", "§3.2: outlines of lights at tiles, depths by line and sphere"),
    ("indirect", "virtual-lights", "§3.2"),
    ("vpl-map", "256", "§4"),
    ("vpl-source", "raster", "§3.2: a reflective shadow map"),
    ("vpl-unique", "on", "§3.2: higher mip levels near the light"),
    ("vpl-spacing", "0.02", "not stated; fitted to their 20,000 lights"),
    ("vpl-count", "0", "§3.2: all that are unique"),
    ("vpl-stride", "1", "§3.2: a pixel uses every listed light"),
    ("vpl-ranges", "average", "§3.2: six rays; one of their two"),
    ("vpl-axis", "normal", "§3.2: one of their two"),
    ("vpl-range-tracer", "within-texel", "§3.2"),
    ("vpl-least-range", "0.005", "not stated; ours"),
    ("vpl-most-range", "0.15", "not stated; fitted to their 2,000 lights"),
    ("vpl-large-kept", "10", "§3.2: most of the large ones are discarded; the part is fitted"),
    ("vpl-residual", "lost", NONE),
    ("vpl-weight", "34", "§3.2: by the number of lights; its scale is not stated: fitted to Sponza, 0 is none"),
    ("vpl-shadows", "none", "§4: virtual lights cast none"),
    ("indirect-resolution", "full", "§3.2: light of every pixel"),
    ("indirect-filter", "0", NONE),
    ("indirect-clamp", "off", NONE),
    ("deep-directions", "stacks:13x13", "§3.1, §4"),
    ("deep-resolution", "64", "§4"),
    ("deep-builder", "single_pass_literal", "§3.1, fig. 3"),
    ("deep-merge", "0", NONE),
    ("deep-sort", "blocks", "§3.1"),
    ("deep-search", "linear_steps", "§3.2"),
];

/// What each paper does in a frame of all five. Other parameters keep the renderer's defaults: they light more than a
/// paper alone.
const FIVE: &[Row] = &[
    ("culling", "clustered", "[VanGelderen2020, §3]"),
    ("clusters", "displ:32:8", "[VanGelderen2020, §4.3]: displaced, the thesis's shape for views that differ"),
    ("cluster-views", "enclosed", "[VanGelderen2020, §4.1]: one grid for both eyes"),
    ("shadows", "across-texels", "[Niessner2010, §4, fig. 8]: soft shadows through the images"),
    (
        "ray-culling",
        "surface",
        "[Elagabani2025, §4.3.1]: facing; other stages have the normals that he rebuilds from depth",
    ),
    ("ray-range-culling", "on", "[Elagabani2025, §4.3]: range, for each pixel"),
    ("light-radius", "0.05", "ours: soft shadows"),
    ("shadow-rays", "16", "[Niessner2010, §7]"),
    ("deep-directions", "cube:5", "[Niessner2010, §3.1, §7]: one set for shadows, glossy rays and virtual lights"),
    ("deep-resolution", "128", "[Niessner2010, §5]"),
    ("deep-builder", "per_triangle", "ours: the images of [Niessner2010, §3.1]"),
    ("deep-merge", "0", "[Niessner2010] merges no layers"),
    ("deep-sort", "blocks", "ours: peeled layers need no sort"),
    ("deep-search", "linear_steps", "not stated"),
    ("deep-slopes", "on", "ours: planes for the tolerance of [Niessner2010, fig. 3], so that rays see what is near"),
    ("occlusion", "deep", "[Aalund2015, §3.3]"),
    ("occlusion-plain", "on", "[Aalund2015, eq. 1 to 3]"),
    (
        "occlusion-ambient",
        "0.5",
        "[Aalund2015, §2.2] attenuates ambient light; ours: ρ² / (1 - ρ), light beyond one bounce at ρ = 1/2",
    ),
    ("occlusion-images", "five", "[Aalund2015, §3.2, §5.1]: fewer and small maps; one set with the ranges"),
    ("caustics", "photons", "[Aalund2015, §3.4, §6]: photon differentials, mirrored"),
    ("indirect", "virtual-lights", "[Archer2019, §3.2]"),
    ("vpl-ranges", "average", "[Archer2019, §3.2]"),
    ("vpl-range-tracer", "within-texel", "[Archer2019, §3.2]"),
    ("vpl-images", "five", "[Archer2019, §3.1]: all directions from one draw"),
    ("vpl-grid", "on", "[Archer2019, §3.2]: outlines of lights at tiles, depths by line and sphere"),
    ("vpl-shadows", "across-texels", "[Niessner2010, §3.2]: virtual lights are seen through the images"),
    ("vpl-glossy-rays", "4", "[Niessner2010, §5]: glossy rays, a quarter of his 16"),
    ("samples", "4", "[Niessner2010, §4, §7]"),
];

impl Paper {
    /// Its settings, a value for each stage first.
    pub fn rows(self) -> Vec<PaperSetting> {
        let own = match self {
            Self::Elagabani => ELAGABANI,
            Self::VanGelderen => VAN_GELDEREN,
            Self::Niessner => NIESSNER,
            Self::Aalund => AALUND,
            Self::Archer => ARCHER,
            Self::Five => FIVE,
        };
        let is_new = |(name, ..): &&Row| STAGES.iter().all(|(stage, ..)| stage != name);
        let value = |stage: &Row| *own.iter().find(|(name, ..)| *name == stage.0).unwrap_or(stage);
        let all = STAGES.iter().map(value).chain(own.iter().filter(is_new).copied());
        all.map(|(name, value, source)| PaperSetting { name, value, source }).collect()
    }

    /// Changes that leave the paper out of a frame of all five.
    pub fn without(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Elagabani => &[("ray-culling", "none"), ("ray-range-culling", "off")],
            Self::VanGelderen => &[("cluster-views", "individual")],
            Self::Niessner => &[("shadows", "none"), ("vpl-shadows", "none"), ("vpl-glossy-rays", "0")],
            Self::Aalund => &[("caustics", "none"), ("occlusion", "none")],
            Self::Archer => &[("indirect", "none")],
            Self::Five => &[],
        }
    }

    /// Its settings, as flags give them.
    pub fn given(self) -> GivenSettings {
        let rows = self.rows();
        GivenSettings::read(rows.iter().map(|row| (row.name, row.value))).expect("a test reads every row")
    }

    /// The settings of a renderer.
    pub fn settings(self) -> Settings {
        let mut settings = Settings::direct_light();
        for PaperSetting { name, value, .. } in self.rows() {
            settings.set(name, value).expect("a test reads every row");
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::{Indirect, Occlusion};
    use lanternfish_scene::Named;

    use super::*;
    use crate::{DeepImageSettings, DeepStore, PaperImages, VirtualLights, occlusion::deep::Deep};

    /// Every row is a setting that keeps its value: none belongs to a technique that is not chosen.
    #[test]
    fn every_row_is_set() {
        crate::register();
        for paper in Paper::all() {
            let settings = paper.settings();
            for PaperSetting { name, value, source } in paper.rows() {
                assert_eq!(settings.get(name).as_deref(), Some(value), "{paper}: {name}");
                assert!(!source.is_empty());
            }
            let mut names: Vec<_> = paper.rows().iter().map(|row| row.name).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), paper.rows().len(), "{paper}: a setting twice");
        }
    }

    /// A stage that a paper lacks is off, whatever the renderer's default is.
    #[test]
    fn what_a_paper_lacks_is_off() {
        crate::register();
        let [elagabani, van_gelderen] = [Paper::Elagabani, Paper::VanGelderen].map(Paper::settings);
        for settings in [&elagabani, &van_gelderen] {
            assert_eq!((&settings.indirect, &settings.occlusion), (&Indirect::NONE, &Occlusion::NONE));
        }
        assert_eq!(van_gelderen.get("shadows").as_deref(), Some("none"));
        assert_eq!(Paper::Niessner.settings().occlusion, Occlusion::NONE);
        assert_eq!(Paper::Archer.settings().occlusion, Occlusion::NONE);
    }

    /// The deep images that a preset builds are those of the constants, and all five share two structures.
    #[test]
    fn deep_images_are_the_papers() {
        crate::register();
        let images = |paper: Paper| DeepImageSettings::of(&paper.settings().structure);
        assert_eq!(images(Paper::Niessner), DeepImageSettings::NIESSNER);
        let lists = DeepImageSettings { store: DeepStore::SortedLinkedList, ..DeepImageSettings::AALUND };
        assert_eq!(images(Paper::Aalund), lists);
        assert_eq!(images(Paper::Archer), DeepImageSettings::ARCHER);
        let five = Paper::Five.settings();
        let lights = *five.indirect.get::<VirtualLights>().unwrap();
        assert_eq!(images(Paper::Five), DeepImageSettings { slopes: true, ..DeepImageSettings::NIESSNER });
        assert_eq!([lights.images, lights.shadow_images], [PaperImages::Five, PaperImages::Shared]);
        assert_eq!(five.occlusion.get::<Deep>().unwrap().images, PaperImages::Five);
    }
}
