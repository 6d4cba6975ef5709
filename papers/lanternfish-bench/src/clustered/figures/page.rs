//! The figures as one self-contained HTML page.

use lanternfish_cli::{
    plot::{Area, heat_map, stacked},
    replay::{
        category::Category,
        counted::Clusters,
        page::{areas, least_of, over_frames},
    },
    report::grouped,
    times::distinct,
};
use lanternfish_gpu::Gpu;

use super::{Figures, Played, mean};
use crate::{
    clustered::cases::{Views, shapes},
    document::Document,
};

const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#444444"];

/// A name, a unit, and the values for each frame.
type Quantity = (&'static str, &'static str, fn(&Played) -> Vec<f64>);

/// Quantities that figures 6.2 to 6.6 plot for every configuration.
const QUANTITIES: [Quantity; 5] = [
    ("Frame", "ms", Played::frame_ms),
    ("Clustering", "ms", Played::clustering_ms),
    ("Shading", "ms", Played::shading_ms),
    ("Visible clusters", "clusters", Played::visible),
    ("Lighting operations", "operations", Played::operations),
];

/// The page of all figures.
pub fn page(figures: &Figures, gpu: &Gpu) -> Document {
    let Figures { source, frames, size: [width, height], eye_width, depth, runs, seed, light_assignment, .. } = figures;
    let mut page = Document::new(&format!("Clusters along {source}"), gpu, *runs);
    let what = format!(
        "{frames} frames of {width} x {height}, each eye {eye_width} x {height} (HTC Vive); clusters reach at least {depth} m from the eye; lights \
         assigned by {light_assignment}; \
         falling lights, seed {seed}, as many at a point whatever their number; no shadows"
    );
    page.introduction(&what, &format!("least of {runs} runs, for each pass and frame"));
    page.paragraph("Figures are numbered as in Van Gelderen 2020, chapter 6.");
    plotted(&mut page, figures, Document::heading);
    page.left_out(&figures.left_out);
    page
}

/// Adds the figures 6.2 to 6.10, each under a heading of this kind.
pub fn plotted(page: &mut Document, figures: &Figures, heading: fn(&mut Document, &str)) {
    let lights = distinct(figures.played.iter().map(|played| played.lights));
    let rows = |plots: &dyn Fn(u32) -> Vec<String>| -> String {
        lights.iter().map(|count| format!("<div class=\"row\">{}</div>\n", plots(*count).concat())).collect()
    };
    for (title, wanted) in [
        ("6.2: sizes of perspective clusters", &(|p: &Played| mono_of(p, "persp")) as &dyn Fn(&Played) -> bool),
        ("6.3: sizes of orthographic clusters", &|p| mono_of(p, "ortho")),
        ("6.4: displacements", &|p| mono_of(p, "displ")),
        ("6.5: stereo, one grid per eye or one grid around both", &|p| p.views != Views::Mono),
        ("6.6: the tuned three", &|p| tuned(figures, p.lights).iter().any(|t| std::ptr::eq(*t, p))),
    ] {
        heading(page, &format!("Figure {title}"));
        page.html(rows(&|count| {
            let of: Vec<&Played> = figures.played.iter().filter(|p| p.lights == count && wanted(p)).collect();
            plots(&of, count)
        }));
    }
    let clustering = |played: &Played| areas(&played.report, Category::is_clustering);
    let times = |count| stacks(figures, count, &breakdown, Played::frame_ms);
    let parts = |count| stacks(figures, count, &clustering, Played::clustering_ms);
    let by_lights = |count| maps(figures, count, "lights, from", |c| &c.by_lights);
    let by_fragments = |count| maps(figures, count, "fragments, from", |c| &c.by_fragments);
    for (title, plots) in [
        ("6.7: frame time", &times as &dyn Fn(u32) -> Vec<String>),
        ("6.8: clustering time", &parts),
        ("6.9: clusters by their lights", &by_lights),
        ("6.10: clusters by their fragments", &by_fragments),
    ] {
        heading(page, &format!("Figure {title}"));
        page.html(rows(plots));
    }
}

fn mono_of(played: &Played, kind: &str) -> bool {
    played.views == Views::Mono && played.clusters.starts_with(kind)
}

/// Name of a configuration among those with the same number of lights.
fn name(played: &Played) -> String {
    match played.views {
        Views::Mono => played.clusters.clone(),
        Views::StereoIndividual | Views::UnalignedIndividual => format!("{}, indi", played.clusters),
        Views::StereoEnclosed | Views::UnalignedEnclosed => format!("{}, encl", played.clusters),
    }
}

/// One plot per quantity, with a curve for each of these configurations.
fn plots(of: &[&Played], lights: u32) -> Vec<String> {
    let plot = |(quantity, unit, values): Quantity| {
        let curves = of.iter().zip(COLORS.iter().cycle());
        let curves: Vec<_> = curves.map(|(played, color)| (name(played), *color, values(played))).collect();
        // A run of counts alone has no times.
        let is_measured = curves.iter().all(|(.., values)| !values.is_empty());
        is_measured.then(|| over_frames(&format!("{quantity}, {} lights", grouped(lights.into())), unit, curves))
    };
    QUANTITIES.into_iter().filter_map(plot).collect()
}

/// Frame time divided into clustering, shading and miscellaneous, as in fig. 6.7.
fn breakdown(played: &Played) -> Vec<Area> {
    let area = |name: &str, color, wanted: &dyn Fn(Category) -> bool| {
        Some(Area { name: name.to_owned(), color, heights: least_of(&played.report, wanted)? })
    };
    let is_shading = |category: Category| category == Category::Shading;
    let areas = [
        area("clustering", "#56b4e9", &Category::is_clustering),
        area("shading", "#009e73", &is_shading),
        area("miscellaneous", "#bbbbbb", &|category| !category.is_clustering() && !is_shading(category)),
    ];
    areas.into_iter().flatten().collect()
}

/// Stacked times of the three tuned configurations, on one scale.
fn stacks(
    figures: &Figures,
    lights: u32,
    parts: &dyn Fn(&Played) -> Vec<Area>,
    total: fn(&Played) -> Vec<f64>,
) -> Vec<String> {
    let mut of = tuned(figures, lights);
    of.retain(|played| !total(played).is_empty());
    let high = of.iter().flat_map(|played| total(played)).fold(0.0, f64::max);
    let plot = |played: &&Played| {
        let title = format!("{}, {} lights: {:.1} ms", played.clusters, grouped(lights.into()), mean(&total(played)));
        stacked(&title, "frame", "ms", high, &parts(played))
    };
    of.iter().map(plot).collect()
}

/// Heat maps of the three tuned configurations, on one scale.
fn maps(figures: &Figures, lights: u32, label: &str, of_clusters: fn(&Clusters) -> &Vec<u64>) -> Vec<String> {
    let of = tuned(figures, lights);
    let bins = |played: &'_ Played| -> Vec<Vec<u64>> {
        played.report.frames.iter().filter_map(|frame| frame.clusters.as_ref().map(of_clusters).cloned()).collect()
    };
    let high = of.iter().flat_map(|played| bins(played)).flatten().max().unwrap_or(0) as f64;
    let plot = |played: &&Played| {
        let bins = bins(played);
        let frames: Vec<&[u64]> = bins.iter().map(Vec::as_slice).collect();
        let title = format!("{}, {} lights", played.clusters, grouped(lights.into()));
        heat_map(&title, "frame", label, high, &frames)
    };
    of.iter().map(plot).collect()
}

/// The three tuned configurations of the thesis, Persp 64, Ortho 4 and Displ 64 32, scaled to the image size.
fn tuned(figures: &Figures, lights: u32) -> Vec<&Played> {
    let best = shapes(figures.size[1], true);
    let find = |name: String| {
        let is = |played: &&Played| played.lights == lights && played.views == Views::Mono && played.clusters == name;
        figures.played.iter().find(is)
    };
    best.iter().filter_map(|shape| find(shape.to_string())).collect()
}
