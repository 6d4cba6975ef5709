//! The figures as one page of HTML that needs nothing else.

use std::fmt::Write as _;

use super::{
    Figures, Played,
    claims::{claims, tuned},
    mean,
};
use crate::clustered::configurations::Views;
use lanternfish_cli::{
    plot::{Area, escaped, heat_map, stacked},
    replay::{
        category::Category,
        counted::Clusters,
        page::{areas, least_of, over_frames},
    },
    report::grouped,
};

const STYLE: &str = "body{font-family:sans-serif;margin:1rem auto;max-width:110rem;padding:0 1rem;color:#222}\
                     .row{display:grid;grid-template-columns:repeat(auto-fit,minmax(22rem,1fr));gap:.4rem}\
                     svg{width:100%;height:auto}table{border-collapse:collapse}\
                     td,th{padding:.15rem .6rem;text-align:left;border-bottom:1px solid #ddd}";

const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#444444"];

/// A name, its unit, and values by frame.
type Quantity = (&'static str, &'static str, fn(&Played) -> Vec<f64>);

/// What figures 6.2 to 6.6 show of every configuration.
const QUANTITIES: [Quantity; 5] = [
    ("Frame", "ms", Played::frame_ms),
    ("Clustering", "ms", Played::clustering_ms),
    ("Shading", "ms", Played::shading_ms),
    ("Visible clusters", "clusters", Played::visible),
    ("Lighting operations", "operations", Played::operations),
];

/// The page.
pub fn html(figures: &Figures) -> String {
    let Figures { source, frames, size: [width, height], eye_width, depth, runs, seed, .. } = figures;
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Clusters along {0}</title><style>{STYLE}</style></head>\
         <body>\n<h1>Clusters along {0}</h1>\n<p>{frames} frames of {width} x {height}, each eye {eye_width} x {height} (HTC Vive); clusters \
         reach at least {depth} m from the eye; falling lights, seed {seed}, as many at a point whatever their number; no shadows. {runs} \
         runs, of which the least counts, pass by pass and frame by frame. {1} Numbers of figures are those of Van Gelderen 2020, chapter \
         6.</p>\n",
        escaped(source),
        escaped(&adapter(figures)),
    );
    let mut add = |text: &str| writeln!(page, "{text}").expect("String");
    add("<h2>The thesis' numbers beside ours</h2>");
    add("<p>Its figures are plots without tables: these are all numbers that its text has of them.</p>");
    add("<table><tr><th>figure</th><th>what</th><th>thesis</th><th>here</th></tr>");
    for claim in claims(figures) {
        let (what, ours) = (escaped(&claim.what), escaped(&claim.ours));
        add(&format!("<tr><td>{}</td><td>{what}</td><td>{}</td><td>{ours}</td></tr>", claim.figure, claim.thesis));
    }
    add("</table>");
    let lights = distinct(figures.played.iter().map(|played| played.lights));
    for (heading, wanted) in [
        ("6.2: sizes of perspective clusters", &(|p: &Played| mono_of(p, "persp")) as &dyn Fn(&Played) -> bool),
        ("6.3: sizes of orthographic clusters", &|p| mono_of(p, "ortho")),
        ("6.4: displacements", &|p| mono_of(p, "displ")),
        ("6.5: two eyes, a grid each or one around both", &|p| p.views != Views::Mono),
        ("6.6: the tuned three", &|p| tuned(figures, p.lights).iter().any(|t| std::ptr::eq(*t, p))),
    ] {
        add(&format!("<h2>Figure {heading}</h2>"));
        for count in &lights {
            let of: Vec<&Played> = figures.played.iter().filter(|p| p.lights == *count && wanted(p)).collect();
            add(&row(&of, *count));
        }
    }
    let of_lights = |heading: &str, plots: &dyn Fn(u32) -> Vec<String>| {
        let rows = lights.iter().map(|count| format!("<div class=\"row\">{}</div>\n", plots(*count).concat()));
        format!("<h2>Figure {heading}</h2>\n{}", rows.collect::<String>())
    };
    add(&of_lights("6.7: what a frame takes", &|count| stacks(figures, count, &breakdown, Played::frame_ms)));
    let clustering = |played: &Played| areas(&played.report, Category::is_clustering);
    add(&of_lights("6.8: what clustering takes", &|count| stacks(figures, count, &clustering, Played::clustering_ms)));
    add(&of_lights("6.9: clusters by their lights", &|count| maps(figures, count, "lights, from", |c| &c.by_lights)));
    add(&of_lights("6.10: clusters by their fragments", &|count| {
        maps(figures, count, "fragments, from", |c| &c.by_fragments)
    }));
    if !figures.left_out.is_empty() {
        add("<h2>Left out</h2>");
    }
    for row in &figures.left_out {
        let lights = grouped(row.lights.into());
        add(&format!("<p>{}, {}, {lights} lights: {}</p>", row.clusters, row.views, escaped(&row.reason)));
    }
    add("</body></html>");
    page
}

fn adapter(figures: &Figures) -> String {
    let first = figures.played.first();
    first.map(|played| format!("{} on {}.", played.report.adapter, played.report.driver)).unwrap_or_default()
}

/// Each value once, in their order.
pub fn distinct(values: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut values: Vec<u32> = values.collect();
    values.sort_unstable();
    values.dedup();
    values
}

fn mono_of(played: &Played, kind: &str) -> bool {
    played.views == Views::Mono && played.clusters.starts_with(kind)
}

/// A configuration among others of as many lights.
fn name(played: &Played) -> String {
    match played.views {
        Views::Mono => played.clusters.clone(),
        Views::StereoIndividual => format!("{}, indi", played.clusters),
        Views::StereoEnclosed => format!("{}, encl", played.clusters),
    }
}

/// All quantities of these configurations, a plot each.
fn row(of: &[&Played], lights: u32) -> String {
    let mut text = "<div class=\"row\">".to_owned();
    for (quantity, unit, values) in QUANTITIES {
        let curves = of.iter().zip(COLORS.iter().cycle());
        let curves = curves.map(|(played, color)| (name(played), *color, values(played))).collect();
        text += &over_frames(&format!("{quantity}, {} lights", grouped(lights.into())), unit, curves);
    }
    text + "</div>"
}

/// Clustering, shading and miscellaneous, as fig. 6.7 has them.
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

/// Stacked times of the tuned three, on one scale.
fn stacks(
    figures: &Figures,
    lights: u32,
    parts: &dyn Fn(&Played) -> Vec<Area>,
    whole: fn(&Played) -> Vec<f64>,
) -> Vec<String> {
    let of = tuned(figures, lights);
    let high = of.iter().flat_map(|played| whole(played)).fold(0.0, f64::max);
    let plot = |played: &&Played| {
        let title = format!("{}, {} lights: {:.1} ms", played.clusters, grouped(lights.into()), mean(&whole(played)));
        stacked(&title, "frame", "ms", high, &parts(played))
    };
    of.iter().map(plot).collect()
}

/// Heat maps of the tuned three, on one scale.
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
