//! The measured configurations.

use lanternfish::{
    settings::{Materials, Samples, Settings, Tracer},
    techniques::Sampled,
};
use lanternfish_papers::{ACROSS_TEXELS, DeepImageSettings, DirectionSet};
use lanternfish_scene::Scene;
use serde::Serialize;

use super::gaussian::RADIUS;

/// Number of frames of an accumulated image.
const FRAMES: u32 = 4;

/// Material of all surfaces of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Brdf {
    /// Diffuse, with the base colour as albedo.
    Diffuse,
    /// Metallic 0.5, roughness 0.3.
    Glossy,
    /// Metallic 0.5, roughness 0.
    Mirror,
}

impl Brdf {
    pub const ALL: [Self; 3] = [Self::Diffuse, Self::Glossy, Self::Mirror];

    /// Name; diffuse and glossy rays per pixel [Niessner2010, §7]; and k of the paper's 6 k² directions, 96 for diffuse light and 150 for the
    /// others [Niessner2010, table 1, fig. 7]. The renderer always traces a diffuse ray, which is not counted if glossy rays are measured.
    const fn of_paper(self) -> (&'static str, (u32, u32), u32) {
        match self {
            Self::Diffuse => ("diffuse", (8, 0), 4),
            Self::Glossy => ("glossy", (1, 16), 5),
            Self::Mirror => ("mirror", (1, 1), 5),
        }
    }

    pub const fn name(self) -> &'static str {
        self.of_paper().0
    }

    pub const fn rays(self) -> (u32, u32) {
        self.of_paper().1
    }

    pub const fn k(self) -> u32 {
        self.of_paper().2
    }

    /// Rays per pixel that are counted.
    pub const fn counted_rays(self) -> u32 {
        match self.rays() {
            (diffuse, 0) => diffuse,
            (_, glossy) => glossy,
        }
    }

    /// Rays per pixel before those that are counted.
    pub const fn skipped_rays(self) -> u32 {
        match self.rays() {
            (_, 0) => 0,
            (diffuse, _) => diffuse,
        }
    }

    /// The scene with this material on all surfaces. With one bounce, pure metals would reflect only highlights of lights, so metallic is 0.5
    /// and reflections show diffuse surfaces.
    pub fn scene(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        let roughness = match self {
            Self::Diffuse => return scene,
            Self::Glossy => 0.3,
            Self::Mirror => 0.0,
        };
        for material in &mut scene.materials {
            material.metallic = 0.5;
            material.perceptual_roughness = roughness;
            material.metallic_roughness_texture = None;
        }
        scene
    }

    pub const fn materials(self) -> Materials {
        match self {
            Self::Diffuse => Materials::Lambert,
            Self::Glossy | Self::Mirror => Materials::File,
        }
    }
}

/// A set of deep images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSet {
    /// Parameter of the direction set: 6 k² directions, 3 k² images.
    pub k: u32,
    /// Width and height of each image, texels.
    pub resolution: u32,
}

impl ImageSet {
    pub fn settings(self) -> DeepImageSettings {
        let (directions, resolution) = (DirectionSet::Cube { k: self.k }, self.resolution);
        DeepImageSettings { directions, resolution, ..DeepImageSettings::default() }
    }

    pub const fn directions(self) -> u32 {
        6 * self.k * self.k
    }

    pub fn in_words(self) -> String {
        format!("{} directions of {}²", self.directions(), self.resolution)
    }

    /// The same in a file's name.
    pub fn in_name(self) -> String {
        format!("{}x{}", self.directions(), self.resolution)
    }
}

/// One configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCase {
    pub brdf: Brdf,
    /// Deep images and their tracer; `None` for the BVH.
    pub images: Option<(ImageSet, Tracer)>,
    /// Radius of the filter, pixels.
    pub filter_radius: u32,
    pub samples: Samples,
    pub accumulate: u32,
}

impl RayCase {
    /// The basic configuration: through the BVH, filtered, without antialiasing.
    pub fn plain(brdf: Brdf) -> Self {
        let filter_radius = Sampled::default().filter_radius;
        Self { brdf, images: None, filter_radius, samples: Samples::One, accumulate: 1 }
    }

    /// The same configuration through the BVH.
    pub fn through_bvh(self) -> Self {
        Self { images: None, ..self }
    }

    pub fn tracer(self) -> Tracer {
        self.images.map_or(Tracer::BVH, |(_, tracer)| tracer)
    }

    /// Settings of the configuration. `look` holds those common to all configurations, `fragments_a_texel` is that of
    /// [`DeepImageSettings`].
    pub fn settings(self, look: &Settings, fragments_a_texel: Option<u64>) -> Settings {
        let (diffuse_rays, glossy_rays) = self.brdf.rays();
        let mut deep_images = self.images.map_or_else(DeepImageSettings::default, |(set, _)| set.settings());
        deep_images.fragments_a_texel = fragments_a_texel.unwrap_or(deep_images.fragments_a_texel);
        let sampled = Sampled {
            diffuse_rays,
            glossy_rays,
            tracer: self.tracer().into(),
            filter_radius: self.filter_radius,
            ..Sampled::default().one_bounce()
        };
        look.clone()
            .with_materials(self.brdf.materials())
            .with_indirect(sampled)
            .with_structure(deep_images)
            .with_samples(self.samples)
            .with_accumulate(self.accumulate)
    }

    pub fn in_words(self) -> String {
        let mut words = format!("{}, {}", self.brdf.name(), self.tracer());
        if let Some((set, _)) = self.images {
            words += &format!(", {}", set.in_words());
        }
        words += &format!(", filter {}", self.filter_radius);
        if self.samples != Samples::One {
            words += &format!(", {} samples", self.samples);
        }
        if self.accumulate > 1 {
            words += &format!(", {} frames", self.accumulate);
        }
        words
    }
}

/// An image set with the configurations that trace through it.
pub struct Group {
    pub set: ImageSet,
    pub rows: Vec<RayCase>,
}

/// All configurations: through the BVH first, then image sets from coarse to fine, so that the size of the next set can be estimated from
/// the last.
pub struct Plan {
    pub through_bvh: Vec<RayCase>,
    pub groups: Vec<Group>,
    /// Images for soft shadows [Niessner2010, table 1].
    pub soft: Vec<ImageSet>,
    /// Images for diffuse and glossy light together [Niessner2010, fig. 1].
    pub parts: ImageSet,
    /// Images for diffuse light with his filter [Niessner2010, §7].
    pub filtered: ImageSet,
}

impl Plan {
    /// Returns the plan for image resolutions in texels, ascending; those of the paper if `resolutions` is empty.
    pub fn new(quick: bool, resolutions: &[u32]) -> Self {
        let through_bvh: Vec<RayCase> = Brdf::ALL.iter().flat_map(|brdf| variations(*brdf, quick)).collect();
        // [Niessner2010, table 1].
        let (usual, ks): ([u32; 2], &[u32]) = if quick { ([16, 32], &[4, 5]) } else { ([128, 512], &[4, 5, 8]) };
        let resolutions = if resolutions.is_empty() { &usual } else { resolutions };
        let sets =
            resolutions.iter().flat_map(|resolution| ks.iter().map(|k| ImageSet { k: *k, resolution: *resolution }));
        let group = |set: ImageSet| {
            let is_his = |brdf: Brdf| !quick && set.resolution == resolutions[0] && set.k == brdf.k();
            let rows = through_bvh.iter().filter(|row| **row == RayCase::plain(row.brdf) || is_his(row.brdf));
            // A quick run has each BRDF through his number of directions alone, as he traces.
            let rows = rows.filter(|row| !quick || set.k == row.brdf.k());
            let traced = |row: &RayCase| {
                let row = *row;
                let tracers = Tracer::all().into_iter().filter(|tracer| !tracer.is_exact());
                let tracers = tracers.filter(|tracer| !quick || *tracer == ACROSS_TEXELS);
                tracers.map(move |tracer| RayCase { images: Some((set, tracer)), ..row })
            };
            Group { set, rows: rows.flat_map(traced).collect() }
        };
        let groups: Vec<Group> = sets.map(group).collect();
        let (most, of_parts) = (ks[ks.len() - 1], Brdf::Glossy.k());
        let soft = resolutions.iter().take(if quick { 1 } else { usize::MAX });
        Self {
            soft: soft.map(|resolution| ImageSet { k: most, resolution: *resolution }).collect(),
            parts: ImageSet { k: of_parts, resolution: resolutions[0] },
            filtered: ImageSet { k: ks[0], resolution: resolutions[0] },
            groups,
            through_bvh,
        }
    }
}

/// Plain, with a filter as wide as Nießner's, without filter, and with each kind of antialiasing.
fn variations(brdf: Brdf, quick: bool) -> Vec<RayCase> {
    let plain = RayCase::plain(brdf);
    let mut all = vec![plain];
    if !quick || brdf == Brdf::Diffuse {
        all.push(RayCase { filter_radius: RADIUS, ..plain });
        all.push(RayCase { filter_radius: 0, ..plain });
        all.push(RayCase { accumulate: FRAMES, ..plain });
    }
    // Compiling the passes of several samples takes longer than all else of a small image.
    if !quick {
        all.push(RayCase { samples: Samples::Four, ..plain });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_one_through_the_bvh_before_it() {
        for quick in [false, true] {
            let plan = Plan::new(quick, &[]);
            for row in plan.groups.iter().flat_map(|group| &group.rows) {
                assert_eq!(plan.through_bvh.iter().filter(|bvh| **bvh == row.through_bvh()).count(), 1, "{row:?}");
            }
        }
    }

    #[test]
    fn the_rows_are_the_papers() {
        lanternfish_papers::register();
        let plan = Plan::new(false, &[]);
        let directions: Vec<u32> = plan.groups.iter().map(|group| group.set.directions()).collect();
        assert_eq!(directions, [96, 150, 384, 96, 150, 384]);
        let rows = || plan.groups.iter().flat_map(|group| &group.rows);
        let plain = rows().filter(|row| row.through_bvh() == RayCase::plain(row.brdf));
        assert_eq!(plain.count(), 6 * 2 * Brdf::ALL.len());
        // With a filter as wide as his, without filter, and both kinds of antialiasing: where his figures are, and nowhere else.
        let varied: Vec<_> = rows().filter(|row| row.through_bvh() != RayCase::plain(row.brdf)).collect();
        assert_eq!(varied.len(), 4 * 2 * Brdf::ALL.len());
        for row in varied {
            let (set, _) = row.images.unwrap();
            assert_eq!((set.resolution, set.k), (128, row.brdf.k()), "{row:?}");
        }
        for group in &plan.groups {
            assert_eq!(u64::from(group.set.directions()), 2 * group.set.settings().directions.count());
        }
        let fine = Plan::new(false, &[256]);
        assert!(fine.groups.iter().all(|group| group.set.resolution == 256));
        assert_eq!(fine.groups.iter().map(|group| group.rows.len()).sum::<usize>(), (6 + 2 * 4) * Brdf::ALL.len());
        let sets = |sets: &[ImageSet]| sets.iter().map(|set| set.in_name()).collect::<Vec<_>>();
        assert_eq!(sets(&plan.soft), ["384x128", "384x512"]);
        assert_eq!(sets(&[plan.parts, plan.filtered]), ["150x128", "96x128"]);
    }

    #[test]
    fn rays_that_count_are_the_papers() {
        assert_eq!(Brdf::ALL.map(Brdf::counted_rays), [8, 16, 1]);
        assert_eq!(Brdf::ALL.map(Brdf::skipped_rays), [0, 1, 1]);
        for brdf in Brdf::ALL {
            let (diffuse, glossy) = brdf.rays();
            assert_eq!(brdf.skipped_rays() + brdf.counted_rays(), diffuse + glossy);
        }
    }
}
