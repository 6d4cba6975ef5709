//! Numbers that the thesis states about its figures, beside the values measured here.
//!
//! The figures are plots without tables. Only numbers in the text are used; none is read off a plot.

use lanternfish_cli::{report::grouped, times::distinct};

use super::{Figures, Played, mean};
use crate::{
    clustered::cases::{Views, shapes},
    table::Row,
};

/// One row per stated number and number of lights.
pub fn claims(figures: &Figures) -> Vec<Row> {
    let mut claims = Vec::new();
    for lights in distinct(figures.played.iter().map(|played| played.lights)) {
        let of =
            |views: Views| figures.played.iter().filter(move |played| played.lights == lights && played.views == views);
        let mut add = |figure: &str, what: &str, thesis: &str, ours: String| {
            let what = format!("{what}, {} lights", grouped(lights.into()));
            let row = Row::default().text("figure", "fig.", figure).text("what", "what", what);
            claims.push(row.text("thesis", "thesis", thesis).text("ours", "here", ours));
        };
        for (figure, kind, thesis) in [("6.2", "persp", "64 px"), ("6.3", "ortho", "4"), ("6.4", "displ", "64 px, 32")]
        {
            let sizes: Vec<&Played> = of(Views::Mono).filter(|played| played.clusters.starts_with(kind)).collect();
            let fastest = sizes.iter().min_by(|a, b| mean(&a.frame_ms()).total_cmp(&mean(&b.frame_ms())));
            if let Some(fastest) = fastest.filter(|_| sizes.len() > 1) {
                add(figure, "size with the least frame time", thesis, fastest.clusters.clone());
            }
        }
        for enclosed in of(Views::StereoEnclosed) {
            let Some(own) = of(Views::StereoIndividual).find(|own| own.clusters == enclosed.clusters) else { continue };
            let name = &enclosed.clusters;
            let ratio = |value: fn(&Played) -> Vec<f64>| format!("{:.2}", mean(&value(enclosed)) / mean(&value(own)));
            add(
                "6.5",
                &format!("{name}: visible clusters, enclosed / individual"),
                "halved: 0.5",
                ratio(Played::visible),
            );
            let (clustering, operations) = (ratio(Played::clustering_ms), ratio(Played::operations));
            add("6.5", &format!("{name}: clustering time, enclosed / individual"), "lower: below 1", clustering);
            if name.starts_with("persp") {
                add(
                    "6.5",
                    &format!("{name}: lighting operations, enclosed / individual"),
                    "seem to decrease: below 1",
                    operations,
                );
            }
        }
        for played in tuned(figures, lights) {
            let thesis = if played.clusters.starts_with("displ") { "most stable: the least" } else { "" };
            let ours = format!("{:.0} %", 100.0 * played.unsteadiness());
            add("6.6", &format!("{}: deviation of the frame time along the track", played.clusters), thesis, ours);
            if let Some(pixels) = played.clusters.strip_prefix("persp:") {
                let limit = pixels.parse::<u64>().map_or(0, |pixels| pixels * pixels);
                let ours = format!("{} of {}", grouped(played.most_fragments().unwrap_or(0).into()), grouped(limit));
                add(
                    "6.10",
                    &format!("{}: most fragments of a cluster, transparent surfaces included", played.clusters),
                    "at most 64² = 4,096",
                    ours,
                );
            }
        }
    }
    claims
}

/// The three tuned configurations of the thesis, Persp 64, Ortho 4 and Displ 64 32, scaled to the image size.
pub fn tuned(figures: &Figures, lights: u32) -> Vec<&Played> {
    let best = shapes(figures.size[1], true);
    let find = |name: String| {
        let is = |played: &&Played| played.lights == lights && played.views == Views::Mono && played.clusters == name;
        figures.played.iter().find(is)
    };
    best.iter().filter_map(|shape| find(shape.to_string())).collect()
}
