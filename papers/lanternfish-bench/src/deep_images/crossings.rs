//! Crossings of texels' borders, by which Nießner explains the speed of every ray [Niessner2010, §3.2, §7]: counts, which are the same on
//! any machine.

use std::rc::Rc;

use glam::{Affine3A, Vec3};
use lanternfish::{
    rays::{RayTracer, TracedRay},
    settings::{Settings, Shadows, Tracer},
};
use lanternfish_cli::error::CliError;
use lanternfish_gpu::Frame;
use lanternfish_papers::{ACROSS_TEXELS, DeepImageSettings, DirectionSet, deep_images::DeepImages, rays::RayCounter};
use lanternfish_scene::{Instance, Scene};

use super::{
    DeepBench,
    build::build,
    rays::{self, ReferenceRay},
};
use crate::table::Row;

/// Name of the table.
pub const TABLE: &str = "crossings";
/// What the table says.
pub const TEXT: &str = "Texels that a ray looks into until its first hit (one, and one more for each border that it crosses), and fragments that it is \
                        compared with, across texels. Rays start halfway between two surfaces, so that none ends at its own; those that images \
                        let through (*missed*) go on to the border and are not counted. Nießner explains speed by these crossings: fewer images \
                        have more of them, because the axis is farther from the ray's direction; and a ray in Sponza's corridors has fewer than \
                        one in a Cornell box, here demo:cornell. *Four of the scene*: copies side by side through images with twice the texels. \
                        With an odd k of 6 k² directions some axes lie in walls, which then have no fragments.";

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
        let of_scene = sets.iter().map(|set| self.crossings_of("the scene", scene, *set, count));
        let mut rows = of_scene.collect::<Result<Vec<_>, _>>()?;
        let cornell = lanternfish_scene::generate::demo("cornell").expect("every program has it");
        rows.push(self.crossings_of("a Cornell box", &cornell, usual, count)?);
        let finer = DeepImageSettings { resolution: 2 * usual.resolution, ..usual };
        rows.push(self.crossings_of("four of the scene", &four_of(scene), finer, count)?);
        Ok(rows)
    }

    /// A row of rays from halfway between the scene's surfaces.
    fn crossings_of(
        &mut self,
        words: &'static str,
        scene: &Scene,
        set: DeepImageSettings,
        count: u32,
    ) -> Result<Row, CliError> {
        let directions = 2 * set.directions.count();
        let bench = Rc::clone(&self.bench);
        bench.step(TABLE, &format!("{words}, {directions} directions of {}²", set.resolution), || {
            let settings = Settings::direct_light().with_shadows(Shadows::BVH);
            let uploaded = self.bench.upload(scene, &settings)?;
            let (built, images) = build(&self.bench, &mut self.profiler, &uploaded, 0, words, set)?;
            let known = rays::from_surfaces(scene, &super::exact(scene)?, &images, count);
            let rays: Vec<TracedRay> = known.iter().filter_map(halfway).collect();
            let counts = self.each(ACROSS_TEXELS, &images, &rays)?;
            let distances = self.distances(ACROSS_TEXELS, &uploaded, &images, &rays)?.1;
            let hits = counts.iter().zip(&distances).filter(|(_, distance)| **distance >= 0.0);
            let hits: Vec<[u32; 2]> = hits.map(|(counts, _)| *counts).collect();
            let row = Row::default()
                .text("what", "what", words)
                .count("triangles", "triangles", scene.triangle_counts().1 as u64)
                .number("directions", "directions", directions)
                .texels("resolution", set.resolution)
                .megabytes("bytes", "MB", built.f64("bytes") as u64)
                .count("rays", "rays", rays.len() as u64)
                .and(Counts::row(Some(Counts::of(&hits))))
                .percent("missed", "missed", 2, 1.0 - hits.len() as f64 / rays.len().max(1) as f64);
            Ok(row)
        })
    }
}

/// A larger scene: two by two copies side by side, along the two longest edges of its box.
fn four_of(scene: &Scene) -> Scene {
    let (size, mut four) = (scene.bounds().size(), scene.clone());
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let [first, second] = match size.min_position() {
        0 => [y, z],
        1 => [x, z],
        _ => [x, y],
    };
    for offset in [first, second, first + second] {
        let moved = |instance: &Instance| {
            let world_from_object = Affine3A::from_translation(offset) * instance.world_from_object;
            Instance { world_from_object, ..instance.clone() }
        };
        four.instances.extend(scene.instances.iter().map(moved));
    }
    four
}

#[cfg(test)]
mod tests {
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

    #[test]
    fn four_copies_lie_side_by_side() {
        let scene = lanternfish_scene::generate::demo("cornell").unwrap();
        let four = four_of(&scene);
        assert_eq!(four.triangle_counts().1, 4 * scene.triangle_counts().1);
        let sizes = four.bounds().size() / scene.bounds().size();
        assert!((sizes.min_element() - 1.0).abs() < 1e-5 && (sizes.element_product() - 4.0).abs() < 1e-4, "{sizes}");
        four.validate().unwrap();
    }
}
