//! Crossings of texels' borders, by which Nießner explains the speed of every ray [Niessner2010, §3.2, §7]: counts, which are the same on
//! any machine.

mod scenes;

use std::rc::Rc;

use lanternfish::{
    rays::{RayTracer, TracedRay},
    settings::{Settings, Shadows, Tracer},
};
use lanternfish_cli::error::CliError;
use lanternfish_gpu::Frame;
use lanternfish_papers::{ACROSS_TEXELS, DeepImageSettings, DirectionSet, deep_images::DeepImages, rays::RayCounter};
use lanternfish_scene::Scene;

use self::scenes::{bisected, corridors, four_of};
use super::{
    DeepBench,
    build::build,
    rays::{self, ReferenceRay},
};
use crate::table::Row;

/// Name of the table.
pub const TABLE: &str = "crossings";
/// Corridors across and up the box.
const CORRIDORS: u32 = 10;

/// What the table says.
pub const TEXT: &str = "Texels that a ray looks into until its first hit (one, and one more for each border that it crosses), and fragments that it is \
                        compared with, across texels. Rays start halfway between two surfaces, so that none ends at its own; those that images \
                        let through (*missed*) go on to the border and are not counted. Nießner explains speed by these crossings: fewer images \
                        have more of them, because the axis is farther from the ray's direction; the number of triangles does not matter; and \
                        a ray in a tight corridor has fewer than one in an empty box. *Twice* and *four times*: the same surfaces with every \
                        triangle cut in two, once and twice, and the same rays. The box has edges of 10 m; the corridors, 10 by 10, fill the same \
                        box. *Four of the scene*: copies side by side through images with twice the texels. With an odd k of 6 k² directions some axes lie in walls, which then have no fragments.";

/// Texels and fragments of a ray on average, to the first hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    pub texels: f64,
    pub fragments: f64,
}

impl Counts {
    fn of(counts: &[[u32; 2]]) -> Self {
        let mean = |of: usize| counts.iter().map(|ray| f64::from(ray[of])).sum::<f64>() / counts.len().max(1) as f64;
        Self { texels: mean(0), fragments: mean(1) }
    }

    /// Two columns; dashes where nothing was counted.
    pub fn row(counts: Option<Self>) -> Row {
        let row = Row::default().maybe("texels_a_ray", "texels a ray", 2, counts.map(|counts| counts.texels));
        row.maybe("fragments_a_ray", "fragments a ray", 2, counts.map(|counts| counts.fragments))
    }
}

/// The second half of a ray that hits something: near its start a ray may end at the surface that it leaves, the sooner the farther it is
/// from the image's axis.
fn halfway(ReferenceRay { ray, distance }: &ReferenceRay) -> Option<TracedRay> {
    Some(TracedRay { origin: ray.origin + 0.5 * (*distance)? * ray.direction, offset: 0.0, ..*ray })
}

/// Images through which rays are counted, from few to many: 6 k² directions.
fn sets(quick: bool) -> Vec<DeepImageSettings> {
    let (resolution, ks): (u32, &[u32]) = if quick { (32, &[2, 4]) } else { (128, &[2, 4, 5, 8]) };
    let set = |k: &u32| DeepImageSettings {
        directions: DirectionSet::Cube { k: *k },
        resolution,
        ..DeepImageSettings::default()
    };
    ks.iter().map(set).collect()
}

impl DeepBench {
    /// What rays read through a tracer of deep images; none for another.
    pub fn counts(
        &mut self,
        through: Tracer,
        images: &DeepImages,
        rays: &[TracedRay],
    ) -> Result<Option<Counts>, CliError> {
        (!through.is_exact()).then(|| Ok(Counts::of(&self.each(through, images, rays)?))).transpose()
    }

    /// Texels and fragments of each ray.
    fn each(&mut self, through: Tracer, images: &DeepImages, rays: &[TracedRay]) -> Result<Vec<[u32; 2]>, CliError> {
        let counter = RayCounter::new(&self.bench.gpu.device, through, &images.settings)?;
        let uploaded = self.tracer.upload(&self.bench.gpu.device, rays)?;
        let record = |frame: &mut Frame<'_>, _: &RayTracer| counter.record(frame, images, &uploaded, rays.len() as u32);
        Ok(self.read(rays.len(), record)?.1)
    }

    /// The rows of the table.
    pub fn crossings(&mut self, scene: &Scene, quick: bool, count: u32) -> Result<Vec<Row>, CliError> {
        let sets = sets(quick);
        // 150 of 128², as in his figure 7.
        let usual = sets[sets.len() / 2];
        let (mut rows, mut rays_of_scene) = (Vec::new(), Vec::new());
        for set in &sets {
            let (row, rays) = self.crossings_of("the scene", scene, *set, None, count)?;
            rows.push(row);
            if *set == usual {
                rays_of_scene = rays;
            }
        }
        let twice = bisected(scene);
        let same = Some(rays_of_scene);
        for (words, scene, rays) in [
            ("twice the triangles", &twice, &same),
            ("four times the triangles", &bisected(&twice), &same),
            ("an empty box", &corridors(1), &None),
            ("tight corridors", &corridors(CORRIDORS), &None),
        ] {
            rows.push(self.crossings_of(words, scene, usual, rays.clone(), count)?.0);
        }
        let finer = DeepImageSettings { resolution: 2 * usual.resolution, ..usual };
        rows.push(self.crossings_of("four of the scene", &four_of(scene), finer, None, count)?.0);
        Ok(rows)
    }

    /// A row, and its rays: `rays`, or those from halfway between the scene's surfaces.
    fn crossings_of(
        &mut self,
        words: &str,
        scene: &Scene,
        set: DeepImageSettings,
        rays: Option<Vec<TracedRay>>,
        count: u32,
    ) -> Result<(Row, Vec<TracedRay>), CliError> {
        let directions = 2 * set.directions.count();
        let bench = Rc::clone(&self.bench);
        bench.step(TABLE, &format!("{words}, {directions} directions of {}²", set.resolution), || {
            let settings = Settings::direct_light().with_shadows(Shadows::BVH);
            let uploaded = self.bench.stage(scene, &settings)?.scene;
            let (_, images) = build(&self.bench.gpu, &mut self.profiler, &uploaded, 0, TABLE, set)?;
            let rays = match rays {
                Some(rays) => rays,
                None => {
                    let known = rays::from_surfaces(scene, &super::exact(scene)?, &images, count);
                    known.iter().filter_map(halfway).collect()
                }
            };
            let counts = self.each(ACROSS_TEXELS, &images, &rays)?;
            let distances = self.distances(ACROSS_TEXELS, &uploaded, &images, &rays)?.1;
            let hits = counts.iter().zip(&distances).filter(|(_, distance)| **distance >= 0.0);
            let hits: Vec<[u32; 2]> = hits.map(|(counts, _)| *counts).collect();
            let row = Row::default()
                .text("what", "what", words)
                .count("triangles", "triangles", scene.triangle_counts().1 as u64)
                .number("directions", "directions", directions)
                .texels("resolution", set.resolution)
                .count("rays", "rays", rays.len() as u64)
                .and(Counts::row(Some(Counts::of(&hits))))
                .percent("missed", "missed", 2, 1.0 - hits.len() as f64 / rays.len().max(1) as f64);
            Ok((row, rays))
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn counts_are_means_of_rays() {
        let counts = Counts::of(&[[1, 4], [2, 0], [6, 2]]);
        assert_eq!(counts, Counts { texels: 3.0, fragments: 2.0 });
        assert_eq!(Counts::of(&[]), Counts { texels: 0.0, fragments: 0.0 });
        let words = |counts| ["texels_a_ray", "fragments_a_ray"].map(|key| Counts::row(counts).words(key).to_owned());
        assert_eq!(words(Some(counts)), ["3.00", "2.00"]);
        assert_eq!(words(None), ["–", "–"]);
    }

    #[test]
    fn rays_start_halfway_to_what_they_hit() {
        let ray = TracedRay { origin: Vec3::X, direction: Vec3::Y, offset: 0.1, image_and_side: 7 };
        let expected = TracedRay { origin: Vec3::new(1.0, 2.0, 0.0), offset: 0.0, ..ray };
        assert_eq!(
            halfway(&ReferenceRay { ray, distance: Some(4.0) }).map(|ray| format!("{ray:?}")),
            Some(format!("{expected:?}"))
        );
        assert!(halfway(&ReferenceRay { ray, distance: None }).is_none());
    }

    #[test]
    fn more_images_follow_fewer_and_the_usual_one_is_the_papers() {
        let counts = |quick| sets(quick).iter().map(|set| 2 * set.directions.count()).collect::<Vec<_>>();
        assert_eq!((counts(false), counts(true)), (vec![24, 96, 150, 384], vec![24, 96]));
        assert_eq!(2 * sets(false)[2].directions.count(), 150);
    }
}
