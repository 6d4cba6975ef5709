//! `[Niessner2010, §7]`: rays through layered depth images, and indirect light by them.

use super::{
    claims::{Figure, Judged, Rule, Unit, claim},
    page::{Section, Table, measured},
    reports::{Found, Node, Reports},
};
use crate::table::Row;

/// Table 1: what is lit, its number of images, and million rays a second, shading included, with images of 512² and of 128².
const RATES: [Rate; 3] = [
    Rate { brdf: "diffuse", directions: 96, fine: [11.0, 16.0], coarse: [37.0, 50.0] },
    Rate { brdf: "glossy", directions: 150, fine: [63.0, 71.0], coarse: [151.0, 209.0] },
    Rate { brdf: "soft shadows", directions: 384, fine: [79.0, 103.0], coarse: [283.0, 377.0] },
];

struct Rate {
    brdf: &'static str,
    directions: u32,
    fine: [f64; 2],
    coarse: [f64; 2],
}

impl Rate {
    fn of(&self, texels: u32) -> [f64; 2] {
        if texels == COARSE { self.coarse } else { self.fine }
    }

    /// How many times as fast the coarse images are, by the means of his ranges.
    fn gain(&self) -> f64 {
        (self.coarse[0] + self.coarse[1]) / (self.fine[0] + self.fine[1])
    }
}

const COARSE: u32 = 128;
const FINE: u32 = 512;
/// Images of fig. 7 and of his memory, of which each of ours serves two directions.
const MIRROR_DIRECTIONS: u32 = 150;
/// Frames a second: fig. 4 without and with four samples; fig. 7 with images of 512² and of 128².
const SAMPLES_FPS: [f64; 2] = [17.5, 16.5];
const MIRROR_FPS: [f64; 2] = [336.0, 600.0];

pub fn section(reports: &Reports) -> Section {
    Section {
        title: "Nießner 2010: indirect light through layered depth images",
        theirs: "The paper: Sibenik, Sponza and others, 512 x 512, one sample a pixel, DirectX 10, NVIDIA GTX 285 with 1024 MB. Its rates are \
                 ranges over views and have the shading of hits in them.",
        comparable: format!(
            "Here: {}; rays alone in {} and in {}. Comparable: how rates change with the texels and the number of images, what antialiasing \
             costs, memory. Not comparable: absolute rates, which are of a card of 2009; frames a second, for our frame has more in it. Sibenik \
             is not to be had: Sponza, or a built-in scene, stands for it. Each of our images serves two directions: his 150 images are 75.",
            reports.scene_of("indirect"),
            reports.scene_of("deep-images"),
            reports.scene_of("deep-images-many-triangles")
        ),
        claims: claims(reports),
        tables: vec![
            Table {
                key: "niessner_table_1",
                heading: "Table 1: million rays a second, shading included",
                rows: rates(reports),
            },
            Table { key: "niessner_frames", heading: "Figs 4 and 7: frames a second", rows: frames(reports) },
            Table {
                key: "niessner_images",
                heading: "§7: images, their memory and building time",
                rows: images(reports),
            },
        ],
    }
}

/// Filtered and without antialiasing.
fn is_plain(row: &Node<'_>) -> bool {
    row.is("samples", 1) && row.is("accumulate", 1) && !row.is("filter_radius", 0) && !row.is("filter_radius", 5)
}

/// A row of rays across texels: with his number of directions, or the first of any.
fn across<'a>(
    reports: &'a Reports,
    brdf: &str,
    directions: u32,
    texels: u32,
    is: impl Fn(&Node<'_>) -> bool,
) -> Found<Node<'a>> {
    let rows = reports.part("indirect")?.rows("rows")?.into_iter();
    let is_this = |row: &Node<'_>| {
        row.words("brdf") == brdf && row.words("tracer") == "across-texels" && row.is("resolution", texels) && is(row)
    };
    let rows: Vec<Node<'_>> = rows.filter(is_this).collect();
    let his = rows.iter().find(|row| row.is("directions", directions)).or(rows.first());
    his.cloned().ok_or_else(|| format!("indirect: no row of {brdf} across texels of images of {texels}²"))
}

/// A plain row of table 1. Soft shadows are in a table of their own.
fn lit<'a>(reports: &'a Reports, brdf: &str, directions: u32, texels: u32) -> Found<Node<'a>> {
    if brdf != "soft shadows" {
        return across(reports, brdf, directions, texels, is_plain);
    }
    let indirect = reports.part("indirect")?;
    let rows = ["soft_shadows", "shadows"].iter().find_map(|table| indirect.rows(table).ok()).unwrap_or_default();
    let rows = || rows.iter().filter(|row| row.words("tracer") == "across-texels" && row.is("resolution", texels));
    let his = rows().find(|row| row.is("directions", directions)).or_else(|| rows().next());
    his.cloned().ok_or_else(|| format!("indirect: no rows of soft shadows through images of {texels}²"))
}

/// Million rays a second, shading included; of soft shadows there is nothing to shade.
fn rate(row: &Node<'_>) -> Found<f64> {
    row.f64("rate_shaded").or_else(|_| row.f64("rate_traced")).or_else(|_| row.f64("rate"))
}

/// A rate with the number of directions that it is of.
fn rate_of(reports: &Reports, of: &Rate, texels: u32) -> Found<Figure> {
    let row = lit(reports, of.brdf, of.directions, texels)?;
    Ok(Figure::of(rate(&row)?, format!("{} directions", row.f64("directions")?)))
}

/// How many times as many rays a second coarse images take as fine ones.
fn gain(reports: &Reports, of: &Rate) -> Found<Figure> {
    let [coarse, fine] = [COARSE, FINE].map(|texels| lit(reports, of.brdf, of.directions, texels));
    let (coarse, fine) = (coarse?, fine?);
    Ok(Figure::of(rate(&coarse)? / rate(&fine)?, format!("{} directions", coarse.f64("directions")?)))
}

/// The share of the kinds of light that are fastest with his number of directions, of those with several numbers.
fn optimum(reports: &Reports) -> Found<Figure> {
    let indirect = reports.part("indirect")?;
    let (mut held, mut said) = (0.0, Vec::new());
    for Rate { brdf, directions, .. } in &RATES {
        let table = if *brdf == "soft shadows" { "soft_shadows" } else { "rows" };
        let rows = indirect.rows(table).unwrap_or_default().into_iter();
        let is = |row: &Node<'_>| {
            let is_brdf = table == "soft_shadows" || (row.words("brdf") == *brdf && is_plain(row));
            is_brdf && row.words("tracer") == "across-texels" && row.is("resolution", COARSE)
        };
        let rows: Vec<Node<'_>> = rows.filter(is).collect();
        let fastest = rows.iter().filter_map(|row| Some((rate(row).ok()?, row.f64("directions").ok()?)));
        let Some((_, fastest)) = fastest.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|_| rows.len() > 1) else {
            continue;
        };
        held += f64::from(u8::from(fastest == f64::from(*directions)));
        said.push(format!("{brdf}: {fastest}"));
    }
    if said.is_empty() {
        return Err("indirect: one number of directions".to_owned());
    }
    Ok(Figure::of(held / said.len() as f64, said.join(", ")))
}

/// The frame's time with four samples a pixel over that with one.
fn samples(reports: &Reports) -> Found<f64> {
    let row = |count| {
        let is = |row: &Node<'_>| row.is("samples", count) && row.is("accumulate", 1) && row.is("filter_radius", 8);
        across(reports, "diffuse", RATES[0].directions, COARSE, is)?.f64("frame_ms")
    };
    Ok(row(4)? / row(1)?)
}

/// The frame's time of a mirror through fine images over that through coarse ones.
fn mirror(reports: &Reports) -> Found<f64> {
    let ms = |texels| across(reports, "mirror", MIRROR_DIRECTIONS, texels, is_plain)?.f64("frame_ms");
    Ok(ms(FINE)? / ms(COARSE)?)
}

/// A set of images: so many directions, each image with so many texels.
fn set<'a>(reports: &'a Reports, directions: u32, texels: u32) -> Found<Node<'a>> {
    let what = format!("of {directions} directions, {texels}²");
    let is = |row: &Node<'_>| row.is("directions", directions / 2) && row.is("resolution", texels);
    reports.part("indirect")?.find("images", &what, is)
}

/// Rays of one tracer through images of two scenes, the second with many more triangles, at the largest number of directions that both
/// have: rays a second in the first over those in the second, and how many times as many triangles the second has.
pub fn by_triangles(reports: &Reports, tracer: &str, key: &str) -> Found<(f64, f64)> {
    let [few, many] = ["deep-images", "deep-images-many-triangles"].map(|part| reports.part(part));
    let (few, many) = (few?, many?);
    let rows = |part: &Node<'_>| -> Found<Vec<_>> {
        let rows = part.rows("traced")?.into_iter();
        let rows = rows.filter(|row| row.words("group") == "Directions" && row.words("structure") == tracer);
        rows.map(|row| Ok((row.f64("directions")?, row.json["images"].clone(), row.f64(key)?))).collect()
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
    Ok((slower, many.f64("triangles")? / few.f64("triangles")?))
}

/// How many times slower, with the number of triangles; a caveat where these are less than `least` times as many.
pub fn slower(found: Found<(f64, f64)>, least: f64) -> Found<Figure> {
    let (slower, triangles) = found?;
    let caveat = format!("the second scene has only {triangles:.1} times the triangles");
    let figure = Figure::of(slower, format!("{triangles:.1} × the triangles"));
    Ok(figure.with_caveat((triangles < least).then_some(caveat)))
}

/// Texels that a ray looks into, of the first row that is so, from the part with images as in the paper where it counted them.
fn crossings(reports: &Reports, what: &str, is: impl Fn(&Node<'_>) -> bool + Copy) -> Found<f64> {
    let of = |part| reports.part(part)?.find("crossings", what, is)?.f64("texels_a_ray");
    of("deep-images").or_else(|_| of("crossings"))
}

/// Crossings of rays through a scene, or of rays through the same images of another.
fn crossed(reports: &Reports, what: &str) -> Found<f64> {
    crossings(reports, what, |row| row.words("what") == what)
}

/// Crossings with four times the triangles over those with one, of as many directions.
fn crossed_by_triangles(reports: &Reports) -> Found<f64> {
    let many = "four times the triangles";
    let directions = |part| {
        Ok::<_, String>(
            reports.part(part)?.find("crossings", many, |row| row.words("what") == many)?.json["directions"].clone(),
        )
    };
    let directions = directions("deep-images").or_else(|_| directions("crossings"))?;
    let is = |row: &Node<'_>| row.words("what") == "the scene" && row.json["directions"] == directions;
    Ok(crossed(reports, many)? / crossings(reports, "the scene", is)?)
}

/// Crossings with the fewest images over those with the most.
fn crossed_by_images(reports: &Reports) -> Found<f64> {
    let part = |part| reports.part(part)?.rows("crossings");
    let rows = part("deep-images").or_else(|_| part("crossings"))?;
    let of_scene: Vec<_> = rows.iter().filter(|row| row.words("what") == "the scene").collect();
    let (Some(few), Some(many)) = (of_scene.first(), of_scene.last()) else {
        return Err("no crossings of a scene".to_owned());
    };
    Ok(few.f64("texels_a_ray")? / many.f64("texels_a_ray")?)
}

fn claims(reports: &Reports) -> Vec<Judged> {
    let is_software = reports.is_software;
    let corridors = || -> Found<f64> { Ok(crossed(reports, "tight corridors")? / crossed(reports, "an empty box")?) };
    let mut all = vec![
        claim(
            "the speed of rays does not depend on the number of triangles",
            "[Niessner2010, §7]",
            "approximately constant",
        )
        .confirmed_if(
            "rays a second across texels with few triangles over those with many",
            Unit::TIMES,
            Rule::Between(0.5, 2.0),
        )
        .judged(slower(by_triangles(reports, "across-texels", "rate_random"), 2.0)),
        claim(
            "rays cross as many texels with four times the triangles",
            "[Niessner2010, §7]",
            "approximately constant",
        )
        .confirmed_if(
            "texels a ray, with four times the triangles over the same surfaces,",
            Unit::TIMES,
            Rule::Between(0.9, 1.1),
        )
        .judged(crossed_by_triangles(reports)),
        claim("fewer images have more crossings", "[Niessner2010, §3.2]", "fewer crossings with more images")
            .confirmed_if("texels a ray, with the fewest images over the most,", Unit::TIMES, Rule::AtLeast(1.0))
            .judged(crossed_by_images(reports)),
        claim(
            "rays in tight corridors cross fewer texels than in an empty box",
            "[Niessner2010, §7]",
            "a higher frame rate",
        )
        .confirmed_if("texels a ray, corridors over box,", Unit::TIMES, Rule::AtMost(1.0))
        .judged(corridors()),
    ];
    for rate in &RATES {
        for texels in [FINE, COARSE] {
            let [least, most] = rate.of(texels);
            let what = format!("{} rays through images of {texels}², {} directions", rate.brdf, rate.directions);
            let claim =
                claim(what, "[Niessner2010, table 1]", format!("{least}–{most} M rays/s")).of_a_card(is_software);
            let claim = claim.confirmed_if("the rate", Unit::MILLION_RAYS, Rule::AtLeast(least));
            all.push(claim.judged(rate_of(reports, rate, texels)));
        }
        let what = format!("{}: images of 128² are faster than of 512²", rate.brdf);
        let claim = claim(what, "[Niessner2010, table 1]", Unit::TIMES.show(rate.gain()));
        let half = 1.0 + 0.5 * (rate.gain() - 1.0);
        let claim = claim.confirmed_if("the ratio of rates, half of the gain,", Unit::TIMES, Rule::AtLeast(half));
        all.push(claim.judged(gain(reports, rate)));
    }
    let mirror_gain = MIRROR_FPS[1] / MIRROR_FPS[0];
    all.extend([
        claim(
            "96, 150 and 384 directions are the optimum of diffuse, glossy and soft shadow rays",
            "[Niessner2010, §7]",
            "all three",
        )
        .confirmed_if("the part of those measured that are fastest so", Unit::PERCENT, Rule::AtLeast(1.0))
        .judged(optimum(reports)),
        claim("antialiasing by four samples is nearly free", "[Niessner2010, fig. 4]", "1.06 × the frame")
            .confirmed_if("the frame with four samples over that with one", Unit::TIMES, Rule::AtMost(1.12))
            .judged(samples(reports)),
        claim(
            "a mirror is faster through images of 128² than of 512²",
            "[Niessner2010, fig. 7]",
            Unit::TIMES.show(mirror_gain),
        )
        .confirmed_if(
            "the ratio of frames, half of the gain,",
            Unit::TIMES,
            Rule::AtLeast(1.0 + 0.5 * (mirror_gain - 1.0)),
        )
        .judged(mirror(reports)),
        claim("150 images of 128² take 15 to 60 MB", "[Niessner2010, §7]", "15–60 MB")
            .confirmed_if("their memory", Unit::MEGABYTES, Rule::Between(15e6, 60e6))
            .judged(set(reports, 150, COARSE).and_then(|row| row.f64("bytes"))),
        claim("384 images of 512² are built in 23 s, 96 of 128² in 1 s", "[Niessner2010, §7]", "23,000 ms")
            .of_a_card(is_software)
            .confirmed_if("building 384 of 512²", Unit::MS, Rule::AtMost(23_000.0))
            .judged(set(reports, 384, FINE).and_then(|row| row.f64("total_ms"))),
    ]);
    all
}

fn rates(reports: &Reports) -> Vec<Row> {
    let row = |rate_of: &Rate, texels: u32| {
        let found = || lit(reports, rate_of.brdf, rate_of.directions, texels);
        let [least, most] = rate_of.of(texels);
        let row = Row::default().text("light", "", rate_of.brdf).number("texels", "texels", texels);
        let row =
            row.said_as(format_args!("{texels}²")).number("paper_directions", "his directions", rate_of.directions);
        let row = row.data("paper", [least, most]).shown("his", format_args!("{least}–{most}"));
        let row = measured(row, "directions", "directions here", 0, found().and_then(|row| row.f64("directions")));
        let row = measured(row, "rate", "here", 2, found().and_then(|row| rate(&row)));
        measured(row, "rate_traced", "traced alone", 2, found().and_then(|row| row.f64("rate_traced")))
    };
    RATES.iter().flat_map(|rate| [FINE, COARSE].map(|texels| row(rate, texels))).collect()
}

fn frames(reports: &Reports) -> Vec<Row> {
    let fps = |found: Found<Node<'_>>| Ok(1e3 / found?.f64("frame_ms")?);
    let row = |name: &'static str, paper: f64, found: Found<Node<'_>>| {
        let row = Row::default().text("name", "", name).number("paper_fps", "his", paper);
        measured(row, "fps", "here", 1, fps(found))
    };
    let of = |count| {
        let is =
            move |row: &Node<'_>| row.is("samples", count) && row.is("accumulate", 1) && row.is("filter_radius", 8);
        across(reports, "diffuse", RATES[0].directions, COARSE, is)
    };
    let mirror = |texels| across(reports, "mirror", MIRROR_DIRECTIONS, texels, is_plain);
    vec![
        row("fig. 4: diffuse light, 8 rays, one sample", SAMPLES_FPS[0], of(1)),
        row("fig. 4: the same with four samples", SAMPLES_FPS[1], of(4)),
        row("fig. 7: mirror, images of 512²", MIRROR_FPS[0], mirror(FINE)),
        row("fig. 7: mirror, images of 128²", MIRROR_FPS[1], mirror(COARSE)),
    ]
}

fn images(reports: &Reports) -> Vec<Row> {
    let sets = [(96, COARSE, "1 s", "–"), (150, COARSE, "–", "15–60 MB"), (384, FINE, "23 s", "–")];
    let row = |(directions, texels, time, memory): (u32, u32, &str, &str)| {
        let found = |key: &str| set(reports, directions, texels)?.f64(key);
        let row = Row::default().number("directions", "directions", directions).number("texels", "texels", texels);
        let row = row.said_as(format_args!("{texels}²")).shown("his: built in", time).shown("his: memory", memory);
        let row = measured(row, "total_ms", "built, ms", 0, found("total_ms"));
        measured(row, "bytes", "MB", 1, found("bytes").map(|bytes| bytes / 1e6))
    };
    sets.into_iter().map(row).collect()
}
