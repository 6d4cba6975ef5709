//! Figures of claims that no expression gives.

use lanternfish_cli::times::distinct;
use serde::Deserialize;

use super::{
    claims::Figure,
    query::{Found, Node, Reports},
};
use crate::{
    clustered::{
        cases::{Views, shapes},
        figures::{Figures, Played, mean},
    },
    document::Document,
    table::{Row, fixed},
};

/// A figure by its name, with its arguments.
pub fn figure(name: &str, reports: &Reports) -> Found<Figure> {
    let words: Vec<&str> = name.split(' ').collect();
    match words[..] {
        ["by_triangles", tracer, least] => by_triangles(reports, tracer, least.parse().unwrap_or_default()),
        ["crossed_by_triangles"] => crossed_by_triangles(reports),
        ["optimum"] => optimum(reports),
        ["enclosed", kind, keys] => enclosed(reports, kind, keys),
        ["linear"] => linear(reports),
        ["steadiest"] => steadiest(&figures(reports)?),
        ["fullest"] => fullest(&figures(reports)?),
        ["best_size", best] => best_size(&figures(reports)?, best),
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
        rows.map(|row| Ok((row.f64("directions")?, row.json["images"].clone(), row.f64("rate_random")?))).collect()
    };
    let of_many = rows(&many)?;
    // Of as many directions, images of one kind are compared, the first kind there is.
    let mut both = None;
    for (directions, images, rate) in rows(&few)? {
        let alike = of_many.iter().find(|(known, others, _)| *known == directions && *others == images);
        if let Some((.., other)) = alike.filter(|_| both.is_none_or(|(most, _)| directions > most)) {
            both = Some((directions, rate / other));
        }
    }
    let (_, slower) = both.ok_or_else(|| format!("no rays by {tracer} in both scenes"))?;
    let triangles = many.f64("triangles")? / few.f64("triangles")?;
    let caveat = (triangles < least).then(|| format!("the second scene has only {triangles:.1} times the triangles"));
    Ok(Figure { caveat, ..Figure::of(slower, format!("{triangles:.1} × the triangles")) })
}

/// Texels that a ray looks into with four times the triangles over those with one, of as many directions.
fn crossed_by_triangles(reports: &Reports) -> Found<Figure> {
    let of = |part: &str| {
        let (query, cut) = (format!("{part} | crossings"), "what=four times the triangles");
        let directions = reports.value(&format!("{{{query} | {cut} | directions}}"))?;
        let uncut = format!("what=the scene & directions={directions}");
        reports.value(&format!("{{{query} | {cut} | texels_a_ray}} / {{{query} | {uncut} | texels_a_ray}}"))
    };
    of("deep-images").or_else(|_| of("crossings")).map(|ratio| Figure::of(ratio, ""))
}

/// The share of the kinds of light that are fastest with Nießner's number of directions, of those with several numbers.
fn optimum(reports: &Reports) -> Found<Figure> {
    let indirect = reports.part("indirect")?;
    let (mut held, mut said) = (0.0, Vec::new());
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
        let rates = rows.iter().filter_map(|row| Some((row.f64("rate_shaded").ok()?, row.f64("directions").ok()?)));
        let fastest = rates.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|_| rows.len() > 1);
        if let Some((_, fastest)) = fastest {
            held += f64::from(u8::from(fastest == directions));
            said.push(format!("{brdf}: {fastest}"));
        }
    }
    if said.is_empty() {
        return Err("indirect: one number of directions".to_owned());
    }
    Ok(Figure::of(held / said.len() as f64, said.join(", ")))
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
fn less(row: &Node<'_>, keys: &str) -> Found<f64> {
    let mut figures = keys.split('-').map(|key| row.f64(key));
    let first = figures.next().unwrap_or(Ok(0.0))?;
    Ok(first - figures.sum::<Found<f64>>()?)
}

/// The mean of enclosed over individual, of clusters whose names begin so, or of any.
fn enclosed(reports: &Reports, kind: &str, keys: &str) -> Found<Figure> {
    let kind = if kind == "any" { "" } else { kind };
    let pairs = pairs(reports)?.into_iter().filter(|(enclosed, _)| enclosed.words("clusters").starts_with(kind));
    let ratios = pairs.map(|(enclosed, own)| Ok(less(&enclosed, keys)? / less(&own, keys)?));
    let mut ratios = ratios.collect::<Found<Vec<f64>>>()?;
    ratios.retain(|ratio| ratio.is_finite());
    if ratios.is_empty() {
        return Err("clustered: there is nothing to divide by".to_owned());
    }
    let [least, most] = [f64::min, f64::max].map(|of| ratios.iter().copied().reduce(of).unwrap_or_default());
    Ok(Figure::of(mean(&ratios), format!("mean of {}, from {least:.2} to {most:.2}", ratios.len())))
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
            let ratio = less(&enclosed, keys).and_then(|of| Ok(of / less(&own, keys)?)).ok();
            row.maybe(*key, heading, 2, ratio)
        })
    };
    pairs(reports).unwrap_or_default().into_iter().map(row).collect()
}

/// How many times as many tests of lights brute force makes with the most lights as with the fewest, for each time as many lights.
fn linear(reports: &Reports) -> Found<Figure> {
    let rows = reports.part("clustered")?.rows("rows")?;
    let brute: Vec<_> = rows.iter().filter(|row| row.words("assignment") == "brute_force").collect();
    let lights = |row: &Node<'_>| row.f64("lights").unwrap_or_default();
    for few in &brute {
        let alike = brute.iter().filter(|row| row.words("clusters") == few.words("clusters"));
        let Some(many) = alike.max_by(|a, b| lights(a).total_cmp(&lights(b))) else { continue };
        if lights(many) > lights(few) {
            let grown = lights(many) / lights(few);
            let ratio = |key: &str| Ok::<_, String>(many.f64(key)? / few.f64(key)?);
            let [tests, count] = [ratio("counts/light_tests")?, ratio("ms/count")?];
            let note = format!("{grown:.0} × the lights: {tests:.1} × the tests, {count:.1} × the time of counting");
            return Ok(Figure::of(tests / grown, note));
        }
    }
    Err("clustered: no two numbers of lights by brute force".to_owned())
}

/// The figures of the track.
fn figures(reports: &Reports) -> Found<Figures> {
    let report = reports.part("clustered-track")?;
    Figures::deserialize(report.json).map_err(|error| format!("clustered-track: {error}"))
}

/// Adds the figures of the thesis that are plots.
pub fn plots(page: &mut Document, reports: &Reports) {
    page.subheading("Fig. A.1: attenuation functions");
    match reports.part("attenuation") {
        Ok(plot) => page.html(plot.json.as_str().unwrap_or_default().to_owned()),
        Err(reason) => page.paragraph(format!("Not measured, because {reason}.")),
    }
    match figures(reports) {
        Ok(figures) => crate::clustered::figures::page::plotted(page, &figures, Document::subheading),
        Err(reason) => page.paragraph(format!("Figures 6.2 to 6.10: not measured, because {reason}.")),
    }
}

/// Frames of one view by number of lights.
fn by_lights(figures: &Figures) -> Vec<(u32, Vec<&Played>)> {
    let mono = || figures.played.iter().filter(|played| played.views == Views::Mono);
    let of = |lights| (lights, mono().filter(|played| played.lights == lights).collect());
    distinct(mono().map(|played| played.lights)).into_iter().map(of).collect()
}

/// In which part of the numbers of lights the displaced clusters are the steadiest of the tuned three.
fn steadiest(figures: &Figures) -> Found<Figure> {
    let best: Vec<String> = shapes(figures.size[1], true).iter().map(ToString::to_string).collect();
    let (mut held, mut said) = (0, Vec::new());
    for (lights, sizes) in by_lights(figures) {
        let unsteadiness =
            |name: &String| sizes.iter().find(|played| played.clusters == *name).map(|p| p.unsteadiness());
        let Some([persp, ortho, displ]) =
            best.iter().map(unsteadiness).collect::<Option<Vec<_>>>().and_then(|all| <[f64; 3]>::try_from(all).ok())
        else {
            continue;
        };
        if ![persp, ortho, displ].iter().all(|deviation| deviation.is_finite()) {
            return Err("clustered-track: no times of the tuned three".to_owned());
        }
        held += usize::from(displ < persp && displ < ortho);
        let [persp, ortho, displ] = [persp, ortho, displ].map(|deviation| fixed(0, 100.0 * deviation));
        said.push(format!("{lights} lights: {persp}, {ortho}, {displ} %"));
    }
    if said.is_empty() {
        return Err("clustered-track: no times of the tuned three".to_owned());
    }
    Ok(Figure::of(held as f64 / said.len() as f64, format!("persp, ortho, displ: {}", said.join("; "))))
}

/// The most fragments of a perspective cluster, over the pixels of its tile.
fn fullest(figures: &Figures) -> Found<Figure> {
    let most = |played: &Played| {
        let pixels = f64::from(played.clusters.strip_prefix("persp:")?.parse::<u32>().ok()?);
        let most = played.most_fragments()?;
        Some((f64::from(most) / (pixels * pixels), most, pixels))
    };
    let fullest = figures.played.iter().filter(|played| played.views == Views::Mono).filter_map(most);
    let fullest = fullest.max_by(|a, b| a.0.total_cmp(&b.0)).ok_or("clustered-track: no perspective clusters")?;
    let (ratio, most, pixels) = fullest;
    Ok(Figure::of(ratio, format!("{most} fragments in tiles of {pixels} x {pixels}")))
}

/// In which part of the numbers of lights the size with the least frame time is the thesis'.
fn best_size(figures: &Figures, best: &str) -> Found<Figure> {
    let kind = best.split(':').next().unwrap_or_default();
    let mut fastest = Vec::new();
    for (_, mut sizes) in by_lights(figures) {
        sizes.retain(|played| played.clusters.starts_with(kind) && !played.frame_ms().is_empty());
        let ms = |played: &&&Played| mean(&played.frame_ms());
        let least = sizes.iter().min_by(|a, b| ms(a).total_cmp(&ms(b))).filter(|_| sizes.len() > 1);
        fastest.extend(least.map(|played| played.clusters.clone()));
    }
    if fastest.is_empty() {
        return Err("clustered-track: one size of each kind".to_owned());
    }
    let held = fastest.iter().filter(|name| *name == best).count();
    Ok(Figure::of(held as f64 / fastest.len() as f64, fastest.join(", ")))
}
