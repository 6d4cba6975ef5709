//! Figures of claims that no expression gives.

use lanternfish_cli::times::distinct;
use serde::Deserialize;

use super::{
    claims::Figure,
    measure::{Measure, margin},
    query::{Found, Node, Reports},
};
use crate::{
    clustered::{
        cases::{Views, shapes},
        figures::{Figures, Played, claims::claims as stated, mean},
    },
    document::Document,
    table::Row,
};

/// A figure by its name, with its arguments.
pub fn figure(name: &str, reports: &Reports) -> Found<Figure> {
    let words: Vec<&str> = name.split(' ').collect();
    match words[..] {
        ["by_triangles", tracer, least] => by_triangles(reports, tracer, least.parse().unwrap_or_default()),
        ["ranges_by_triangles", least] => ranges_by_triangles(reports, least.parse().unwrap_or_default()),
        ["least_of_shapes", kind] => least_of_shapes(reports, kind),
        ["optimum"] => optimum(reports),
        ["enclosed", kind, keys] => enclosed(reports, kind, keys),
        ["linear"] => linear(reports),
        ["steadiest"] => steadiest(reports, &figures(reports)?),
        ["best_size", best] => best_size(reports, &figures(reports)?, best),
        _ => Err(format!("{name}: no such figure")),
    }
}

/// Rows of a table by its name.
pub fn rows(name: &str, reports: &Reports) -> Vec<Row> {
    if name == "stereo" { stereo(reports) } else { Vec::new() }
}

/// Rays a second by one tracer through images of a scene, over those of another with many more triangles, of as many directions as both have.
/// A caveat where the second has less than `least` times as many triangles.
fn by_triangles(reports: &Reports, tracer: &str, least: f64) -> Found<Figure> {
    let [few, many] = ["deep-images", "deep-images-many-triangles"].map(|part| reports.part(part));
    let (few, many) = (few?, many?);
    let rows = |part: &Node<'_>| -> Found<Vec<_>> {
        let rows = part.rows("traced")?.into_iter();
        let rows = rows.filter(|row| row.words("group") == "Directions" && row.words("structure") == tracer);
        rows.map(|row| Ok((row.f64("directions")?, row.json["images"].clone(), reports.mean([&row], "rate_random")?)))
            .collect()
    };
    let of_many = rows(&many)?;
    // Of as many directions, images of one kind are compared, the first kind there is.
    let mut both = None;
    for (directions, images, rate) in rows(&few)? {
        let alike = of_many.iter().find(|(known, others, _)| *known == directions && *others == images);
        if let Some((.., other)) = alike.filter(|_| both.as_ref().is_none_or(|(most, _)| directions > *most)) {
            both = Some((directions, rate.with(other.clone(), divided)));
        }
    }
    let (_, slower) = both.ok_or_else(|| format!("no rays by {tracer} in both scenes"))?;
    Ok(of_triangles(slower, many.f64("triangles")? / few.f64("triangles")?, least))
}

/// A figure with so many times the triangles, with a caveat below `least` times.
fn of_triangles(slower: Measure, triangles: f64, least: f64) -> Figure {
    let caveat = (triangles < least).then(|| format!("the second scene has only {triangles:.1} times the triangles"));
    Figure { caveat, ..Figure::of(slower, format!("{triangles:.1} × the triangles")) }
}

/// Rays for ranges a second with few triangles over those with many, of the largest map.
fn ranges_by_triangles(reports: &Reports, least: f64) -> Found<Figure> {
    let of = |key: &str| format!("{{virtual-lights | {key}}} / {{virtual-lights-many-triangles | {key}}}");
    let slower = reports.measure(&of("ranges | last | deep_images_rate"))?;
    Ok(of_triangles(slower, 1.0 / reports.value(&of("triangles"))?, least))
}

/// The rate with Nießner's number of directions over the largest with another one, the least of the kinds of light with several numbers.
fn optimum(reports: &Reports) -> Found<Figure> {
    let indirect = reports.part("indirect")?;
    let (mut all, mut said) = (Vec::new(), Vec::new());
    for (brdf, directions, table) in
        [("diffuse", 96.0, "rows"), ("glossy", 150.0, "rows"), ("soft shadows", 384.0, "soft_shadows")]
    {
        let is_number = |row: &Node<'_>, key: &str, number: f64| row.f64(key) == Ok(number);
        let is_plain = |row: &Node<'_>| {
            let numbers = [("samples", 1.0), ("accumulate", 1.0), ("filter_radius", 8.0)];
            row.words("brdf") == brdf && numbers.iter().all(|(key, number)| is_number(row, key, *number))
        };
        let mut rows = indirect.rows(table).unwrap_or_default();
        rows.retain(|row| row.words("tracer") == "across-texels" && is_number(row, "resolution", 128.0));
        rows.retain(|row| table == "soft_shadows" || is_plain(row));
        let (his, others): (Vec<_>, Vec<_>) = rows.iter().partition(|row| is_number(row, "directions", directions));
        let rate = |row: &&Node<'_>| row.f64("rate_shaded").unwrap_or_default();
        let fastest = others.into_iter().max_by(|a, b| rate(a).total_cmp(&rate(b)));
        if let (Some(his), Some(other)) = (his.first(), fastest) {
            let ratio = reports.mean([*his], "rate_shaded")?.with(reports.mean([other], "rate_shaded")?, divided);
            said.push(format!("{brdf}: {:.2} of {} directions", ratio.value, other.f64("directions")?));
            all.push(ratio);
        }
    }
    let least = least(all).ok_or("indirect: one number of directions")?;
    Ok(Figure::of(least, said.join(", ")))
}

fn divided(a: f64, b: f64) -> f64 {
    a / b
}

/// The least of figures.
fn least(all: Vec<Measure>) -> Option<Measure> {
    all.into_iter().min_by(|a, b| a.value.total_cmp(&b.value))
}

/// Each row with one grid around two eyes, and the one with a grid each.
fn pairs(reports: &Reports) -> Found<Vec<(Node<'_>, Node<'_>)>> {
    let rows = reports.part("clustered")?.rows("rows")?;
    let pair = |enclosed: &Node<'_>| {
        let is = |row: &&Node<'_>| {
            row.words("views") == "stereo-individual"
                && row.words("clusters") == enclosed.words("clusters")
                && row.f64("lights") == enclosed.f64("lights")
        };
        rows.iter().find(is).cloned()
    };
    let enclosed = rows.iter().filter(|row| row.words("views") == "stereo-enclosed");
    let pairs: Vec<_> = enclosed.filter_map(|row| Some((row.clone(), pair(row)?))).collect();
    if pairs.is_empty() { Err("clustered, table `rows`: no rows of two eyes".to_owned()) } else { Ok(pairs) }
}

/// A figure, or several between `-`: the first less the others.
fn less(reports: &Reports, row: &Node<'_>, keys: &str) -> Found<Measure> {
    let mut figures = keys.split('-').map(|key| reports.mean([row], key));
    let first = figures.next().unwrap_or_else(|| Err("no key".to_owned()));
    figures.try_fold(first?, |first, next| Ok(first.with(next?, |a, b| a - b)))
}

/// The mean of enclosed over individual, of clusters whose names begin so, or of any.
fn enclosed(reports: &Reports, kind: &str, keys: &str) -> Found<Figure> {
    let kind = if kind == "any" { "" } else { kind };
    let pairs = pairs(reports)?.into_iter().filter(|(enclosed, _)| enclosed.words("clusters").starts_with(kind));
    let ratios =
        pairs.map(|(enclosed, own)| Ok(less(reports, &enclosed, keys)?.with(less(reports, &own, keys)?, divided)));
    let mut ratios = ratios.collect::<Found<Vec<Measure>>>()?;
    ratios.retain(|ratio| ratio.value.is_finite());
    let [low, high] =
        [f64::min, f64::max].map(|of| ratios.iter().map(|ratio| ratio.value).reduce(of).unwrap_or_default());
    let count = ratios.len();
    let sum = ratios.into_iter().reduce(|sum, next| sum.with(next, |a, b| a + b));
    let mean = sum.ok_or("clustered: there is nothing to divide by")?.with(Measure::exact(count as f64), divided);
    Ok(Figure::of(mean, format!("mean of {count}, from {low:.2} to {high:.2}")))
}

fn stereo(reports: &Reports) -> Vec<Row> {
    let columns = [
        ("visible", "visible clusters", "counts/visible_clusters"),
        ("listed", "lights listed", "counts/lights_listed"),
        ("clustering", "clustering time", "ms/*-ms/shading-ms/other"),
        ("operations", "lighting operations", "counts/lighting_operations"),
        ("frame", "frame time", "ms/*"),
    ];
    let row = |(enclosed, own): (Node<'_>, Node<'_>)| {
        let row = Row::default().text("clusters", "clusters", enclosed.words("clusters"));
        let row = row.count("lights", "lights", enclosed.f64("lights").unwrap_or_default() as u64);
        columns.iter().fold(row, |row, (key, heading, keys)| {
            let ratio =
                less(reports, &enclosed, keys).and_then(|of| Ok(of.value / less(reports, &own, keys)?.value)).ok();
            row.maybe(*key, heading, 2, ratio)
        })
    };
    pairs(reports).unwrap_or_default().into_iter().map(row).collect()
}

/// The least frame of a kind of clusters over that of perspective ones.
fn least_of_shapes(reports: &Reports, kind: &str) -> Found<Figure> {
    let mut rows = reports.part("clustered")?.rows("shapes")?;
    rows.retain(|row| row.words("clusters").starts_with(kind));
    let frames = rows.iter().map(|row| reports.mean([row], "frame")).collect::<Found<Vec<_>>>()?;
    let best = rows.iter().zip(frames).min_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
    let (row, frame) = best.ok_or("clustered, table `shapes`: no such clusters")?;
    let note = format!("{}, {} lights, {}", row.words("clusters"), row.f64("lights")?, row.words("assignment"));
    Ok(Figure::of(frame, note))
}

/// How many times as long brute force counts lights with the most lights as with the fewest, for each time as many lights.
fn linear(reports: &Reports) -> Found<Figure> {
    let rows = reports.part("clustered")?.rows("rows")?;
    let brute: Vec<_> = rows.iter().filter(|row| row.words("assignment") == "brute_force").collect();
    let lights = |row: &Node<'_>| row.f64("lights").unwrap_or_default();
    for few in &brute {
        let alike = brute.iter().filter(|row| row.words("clusters") == few.words("clusters"));
        let Some(many) = alike.max_by(|a, b| lights(a).total_cmp(&lights(b))) else { continue };
        if lights(many) > lights(few) {
            let grown = lights(many) / lights(few);
            let time = |row: &Node<'_>| reports.mean([row], "ms/count");
            let ratio = time(many)?.with(time(few)?, divided);
            let note = format!("{grown:.0} × the lights: {:.1} × the time", ratio.value);
            return Ok(Figure::of(ratio.with(Measure::exact(grown), divided), note));
        }
    }
    Err("clustered: no two numbers of lights by brute force".to_owned())
}

/// The figures of the track.
fn figures(reports: &Reports) -> Found<Figures> {
    let report = reports.part("clustered-track")?;
    Figures::deserialize(report.json).map_err(|error| format!("clustered-track: {error}"))
}

/// Adds the figures of the thesis that are plots, as far as there are any.
pub fn plots(page: &mut Document, reports: &Reports) {
    if let Ok(plot) = reports.part("attenuation") {
        page.subheading("Fig. A.1: attenuation functions");
        page.html(plot.json.as_str().unwrap_or_default().to_owned());
    }
    match figures(reports) {
        Ok(figures) => {
            let rows = stated(&figures);
            page.subheading("Numbers that the thesis states of figures 6.2 to 6.10");
            page.show(rows.iter().cloned());
            page.keep("van_gelderen_figures", rows);
            crate::clustered::figures::page::plotted(page, &figures, Document::subheading);
        }
        Err(reason) => page.paragraph(format!("Figures 6.2 to 6.10: not measured, because {reason}.")),
    }
}

/// Frames of one view by number of lights.
fn by_lights(figures: &Figures) -> Vec<(u32, Vec<&Played>)> {
    let mono = || figures.played.iter().filter(|played| played.views == Views::Mono);
    let of = |lights| (lights, mono().filter(|played| played.lights == lights).collect());
    distinct(mono().map(|played| played.lights)).into_iter().map(of).collect()
}

/// The least over the numbers of lights of the figure that `of` gives; `names`: what stands in its note.
fn least_by_lights(
    reports: &Reports,
    figures: &Figures,
    names: &str,
    of: impl Fn(&[&Played]) -> Option<(f64, f64)>,
) -> Found<Figure> {
    let (mut all, mut said) = (Vec::new(), Vec::new());
    for (lights, sizes) in by_lights(figures) {
        let Some((others, his)) = of(&sizes).filter(|(others, his)| (others / his).is_finite()) else { continue };
        said.push(format!("{lights} lights: {:.2}", others / his));
        let time = |value| Measure::time(value, Vec::new(), margin(reports.is_software), None);
        all.push(time(others).with(time(his), divided));
    }
    let least = least(all).ok_or_else(|| format!("clustered-track: no times of {names}"))?;
    Ok(Figure::of(least, said.join(", ")))
}

/// The least deviation of the other two of the tuned three over that of displaced clusters.
fn steadiest(reports: &Reports, figures: &Figures) -> Found<Figure> {
    let best: Vec<String> = shapes(figures.size[1], true).iter().map(ToString::to_string).collect();
    least_by_lights(reports, figures, "the tuned three", |sizes| {
        let of = |name: &String| sizes.iter().find(|played| played.clusters == *name).map(|p| p.unsteadiness());
        let all: Vec<f64> = best.iter().map(of).collect::<Option<_>>()?;
        Some((all[0].min(all[1]), all[2]))
    })
}

/// The least frame time of the other sizes over that of the thesis'.
fn best_size(reports: &Reports, figures: &Figures, best: &str) -> Found<Figure> {
    let kind = best.split(':').next().unwrap_or_default();
    least_by_lights(reports, figures, "several sizes", |sizes| {
        let of_kind = sizes.iter().filter(|played| played.clusters.starts_with(kind) && !played.frame_ms().is_empty());
        let (his, others): (Vec<&Played>, Vec<_>) = of_kind.partition(|played| played.clusters == best);
        let ms = |played: &&Played| mean(&played.frame_ms());
        Some((others.iter().map(ms).reduce(f64::min)?, his.first().map(ms)?))
    })
}
