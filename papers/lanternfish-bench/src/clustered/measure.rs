//! Renders every configuration, and collects counts and times.

use std::{collections::BTreeMap, time::Instant};

use lanternfish::{
    GpuScene, RenderError, RenderedImage, Renderer,
    light_culling::clustered::GridContents,
    techniques::{Assignment, ClusterShape},
};
use lanternfish_cli::{error::CliError, images::differing, report::grouped, timed::Timed, times::counter};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

use super::{
    cases::{BRUTE_FORCE_TESTS, Views, settings},
    steps::Steps,
};
use crate::{
    bench::{Bench, LONG},
    table::Row,
};

/// Deterministic counts: equal in every run, and on every adapter that draws the same pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Clusters of all grids.
    pub clusters: u64,
    /// Clusters with visible fragments.
    pub visible_clusters: u64,
    pub fragments: u64,
    /// Entries of all lists.
    pub lights_listed: u64,
    /// Tests of a light or a tree node against a cluster.
    pub light_tests: u64,
    /// Length of the cluster's light list, summed over all fragments.
    pub lighting_operations: u64,
    /// Memory of marks, lists, lights and tree, bytes.
    pub bytes: u64,
}

/// Results of one configuration.
#[derive(Debug, Serialize)]
pub struct Measured {
    pub clusters: String,
    pub lights: usize,
    pub views: Views,
    pub assignment: String,
    pub counts: Counts,
    /// Median time of each step over the runs, ms; of the first frame if it takes more than [`LONG`].
    pub ms: Steps,
    /// Number of pixels that are not bit-identical to those of the first configuration with the same numbers of lights
    /// and views.
    pub differing_pixels: usize,
}

impl Measured {
    pub fn in_words(&self) -> String {
        in_words(&self.clusters, self.lights, self.views, &self.assignment)
    }

    /// The results as a row of the page.
    pub fn row(&self) -> Row {
        let (counts, ms) = (&self.counts, &self.ms);
        let row = Row::default()
            .text("clusters", "clusters", &self.clusters)
            .text("views", "views", self.views)
            .text("assignment", "assignment", &self.assignment)
            .count("visible_clusters", "visible clusters", counts.visible_clusters)
            .count("all", "of", counts.clusters)
            .count("lights_listed", "lights listed", counts.lights_listed)
            .count("light_tests", "light tests", counts.light_tests)
            .count("lighting_operations", "lighting operations", counts.lighting_operations)
            .fixed("a_fragment", "a fragment", 1, counts.lighting_operations as f64 / counts.fragments.max(1) as f64)
            .count("kib", "KiB", counts.bytes / 1024);
        let names = ["visibility", "compact", "sort + tree", "count", "write", "shading", "frame ms"];
        let [_, _, compact, tree, count, write, shading, _] = ms.0;
        let times = [ms.visibility(), compact, tree, count, write, shading, ms.frame()];
        names.into_iter().zip(times).fold(row, |row, (name, ms)| row.shown(name, format_args!("{ms:.2}")))
    }
}

fn in_words(clusters: &str, lights: usize, views: Views, assignment: &str) -> String {
    format!("{clusters}, {} lights, {views}, {assignment}", grouped(lights as u64))
}

/// Inputs of all configurations.
pub struct ClusterBench<'a> {
    pub bench: &'a Bench,
    /// Least depth range of the clusters, m.
    pub depth: u32,
    pub mono: [(&'a Camera, [u32; 2]); 1],
    pub stereo: [(&'a Camera, [u32; 2]); 2],
    pub unaligned: [(&'a Camera, [u32; 2]); 2],
}

/// A scene in device memory, and its number of lights.
struct Lit {
    lights: usize,
    scene: GpuScene,
}

/// First images of each view, by number of lights and first camera's place.
type RenderedImages = BTreeMap<(usize, [u32; 3]), Vec<RenderedImage>>;

impl ClusterBench<'_> {
    /// Measures every combination of shape, configuration and number of lights. `known`: rows of other configurations.
    pub fn measure(
        &self,
        shapes: &[ClusterShape],
        scenes: &[Scene],
        configurations: [(Views, Assignment); 4],
        known: &[Measured],
    ) -> Result<Vec<Measured>, CliError> {
        let (mut rows, mut lit, mut firsts) = (Vec::new(), Vec::new(), RenderedImages::new());
        let all = shapes
            .iter()
            .flat_map(|shape| configurations.into_iter().map(move |(views, assignment)| (*shape, views, assignment)));
        for (shape, views, assignment) in all {
            let settings = settings(shape, views.grouping(), assignment, self.depth);
            let made = self.bench.made(&format!("{shape}, {views}, {assignment}"), &settings);
            let mut renderer = self.bench.renderer(&made)?;
            if lit.is_empty() {
                let upload = |scene: &Scene| Ok(Lit { lights: scene.lights.len(), scene: renderer.upload(scene)? });
                lit = scenes.iter().map(upload).collect::<Result<_, CliError>>()?;
            }
            for lit in &lit {
                let (clusters, lights, assigned) = (shape.to_string(), lit.lights, assignment.to_string());
                let what = in_words(&clusters, lights, views, &assigned);
                if !rows.is_empty() && !self.bench.has_time(&what) {
                    continue;
                }
                let tests = tests_of_all(rows.iter().chain(known), &clusters, lights, views);
                if assignment == Assignment::BruteForce && tests.is_none_or(|tests| tests > BRUTE_FORCE_TESTS) {
                    let reason = tests.map(|tests| format!("{} tests of a light against a cluster", grouped(tests)));
                    self.bench.leave_out(what, reason.unwrap_or("no result of the hierarchy".to_owned()));
                    continue;
                }
                match self.bench.step("clusters", &what, || self.case(&mut renderer, lit, views, &mut firsts)) {
                    Ok(measured) => rows.push(Measured { clusters, assignment: assigned, ..measured }),
                    // Too many clusters, or views that no grid encloses: continue with the next configuration.
                    Err(error) => self.bench.leave_out(what, error),
                }
            }
        }
        Ok(rows)
    }

    fn case(
        &self,
        renderer: &mut Renderer,
        lit: &Lit,
        views: Views,
        firsts: &mut RenderedImages,
    ) -> Result<Measured, RenderError> {
        let cameras: &[_] = match views {
            Views::Mono => &self.mono,
            Views::StereoIndividual | Views::StereoEnclosed => &self.stereo,
            Views::UnalignedIndividual | Views::UnalignedEnclosed => &self.unaligned,
        };
        let started = Instant::now();
        let images = renderer.render_views(&lit.scene, cameras)?;
        let is_long = started.elapsed() > LONG;
        let counts = counts(&images, &renderer.cluster_contents()?);
        let steps = |images: &[RenderedImage]| Ok::<_, RenderError>(Steps::of(&images[0].report.passes).0);
        let ms = match is_long {
            true => Timed::each(1, || steps(&images)),
            false => Timed::each(self.bench.runs, || steps(&renderer.render_views(&lit.scene, cameras)?)),
        }?;
        let place = cameras[0].0.eye().to_array().map(f32::to_bits);
        let firsts = firsts.entry((lit.lights, place)).or_insert_with(|| images.clone());
        let differing_pixels = images.iter().zip(firsts).map(|(image, first)| differing(first, image)).sum();
        let [clusters, assignment] = Default::default();
        Ok(Measured {
            clusters,
            lights: lit.lights,
            views,
            assignment,
            counts,
            ms: Steps(ms.map(|times| times.median())),
            differing_pixels,
        })
    }
}

/// Number of tests of every light against every visible cluster, from the row with these clusters, lights and views.
/// `None` if there is no such row.
fn tests_of_all<'r>(
    mut rows: impl Iterator<Item = &'r Measured>,
    clusters: &str,
    lights: usize,
    views: Views,
) -> Option<u64> {
    let row = rows.find(|row| row.clusters == clusters && row.lights == lights && row.views == views)?;
    Some(row.counts.visible_clusters * lights as u64)
}

fn counts(renderings: &[RenderedImage], grids: &[GridContents]) -> Counts {
    let sum = |name: &str| renderings.iter().map(|rendering| counter(&rendering.report, name)).sum();
    Counts {
        clusters: sum("light_culling/clusters"),
        visible_clusters: sum("light_culling/visible_clusters"),
        fragments: grids.iter().map(GridContents::fragments).sum(),
        lights_listed: sum("light_culling/listed_lights"),
        light_tests: sum("light_culling/light_tests"),
        lighting_operations: grids.iter().map(GridContents::lighting_operations).sum(),
        bytes: sum("light_culling/cluster_bytes"),
    }
}
