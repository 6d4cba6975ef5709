//! [Niessner2010]: rays across the texels of layered depth images.

use super::{Claim, Figure, Found, MEGABYTES, MILLION_RAYS, MS, Reports, TIMES, at_least, at_most, claim};
use crate::papers::{
    faults::Fault,
    measure::Measure,
    rows::{Node, least},
    tables::About,
};

pub const ABOUT: About = About {
    title: "Nießner 2010: indirect light through layered depth images",
    theirs: "The paper: Sibenik, Sponza and others, 512 x 512, one sample a pixel, DirectX 10, NVIDIA GTX 285 with 1024 MB. Its rates are \
        ranges over views and have the shading of hits in them.",
    comparable: "Here: <indirect>; crossings and memory in <crossings>; rays alone in <deep-images> and in <deep-images-many-triangles>. \
        Comparable: how rates change with the texels and the number of images, what antialiasing costs, crossings, memory. Not comparable: \
        absolute rates, which are of a card of 2009; frames a second, for our frame has more in it. Sibenik is not to be had: Sponza, or a \
        built-in scene, stands for it. Each of our images serves two directions: his 150 images are 75, his 384 are 192.",
};

const PART: &str = "indirect";
const CROSSINGS: &str = "crossings";
type Light = (&'static str, u32, [f64; 2], [&'static str; 2], f64, &'static str);
/// Of every light that is gathered: its name, his directions, his rates in million rays a second through 512² and 128², least and as he states
/// them, and half of the gain by fewer texels.
const LIGHTS: [Light; 3] = [
    ("diffuse", 96, [11.0, 37.0], ["11–16 M rays/s", "37–50 M rays/s"], 2.11, "3.22 ×"),
    ("glossy", 150, [63.0, 151.0], ["63–71 M rays/s", "151–209 M rays/s"], 1.84, "2.69 ×"),
    ("soft shadows", 384, [79.0, 283.0], ["79–103 M rays/s", "283–377 M rays/s"], 2.31, "3.63 ×"),
];

/// All images have 128² texels.
const ALL_COARSE: Fault = Fault::made("all-coarse", PART, "512²", "deep-resolution 128");
const FINE_IMAGES: Fault = Fault::made("fine-images", CROSSINGS, "the scene", "deep-resolution 256");

/// The row of a light through images, filtered and without antialiasing; through the BVH without `images`, his directions and texels.
pub fn row<'a>(all: &'a Reports, light: &str, images: Option<(u32, u32)>, samples: u32) -> Found<Node<'a>> {
    let is_plain = |row: &Node<'_>| {
        row.is("brdf", light) && row.is("samples", samples) && row.is("accumulate", 1) && row.is("filter_radius", 8)
    };
    let is_through = |row: &Node<'_>| match images {
        Some((directions, texels)) => {
            row.is("tracer", "across-texels") && row.is("directions", directions) && row.is("resolution", texels)
        }
        None => row.is("tracer", "bvh"),
    };
    let table = if light == "soft shadows" { "soft_shadows" } else { "rows" };
    let found = all.row(PART, table, |row| is_through(row) && (table == "soft_shadows" || is_plain(row)));
    found.map_err(|why| match images {
        Some((directions, texels)) => format!("{why} of {light}, {directions} directions of {texels}²"),
        None => format!("{why} of {light} through the BVH"),
    })
}

fn rate(all: &Reports, light: &str, images: Option<(u32, u32)>) -> Found<Measure> {
    row(all, light, images, 1)?.time("rate_shaded")
}

fn crossed(all: &Reports, what: &str, directions: u32) -> Found<Measure> {
    all.row(CROSSINGS, "crossings", |row| row.is("what", what) && row.is("directions", directions))?
        .count("texels_a_ray")
}

/// Rays a second across texels of a scene over those of one with more triangles, through images alike of as many directions.
fn by_triangles(all: &Reports) -> Found<Figure> {
    const PARTS: [&str; 2] = ["deep-images", "deep-images-many-triangles"];
    let rows =
        |part| all.rows(part, "traced", |row| row.is("group", "Directions") && row.is("structure", "across-texels"));
    let [few, many] = [rows(PARTS[0])?, rows(PARTS[1])?];
    let alike = |row: &Node<'_>| {
        many.iter().find(|other| ["directions", "images"].iter().all(|key| other.json[key] == row.json[key]))
    };
    let pairs = few.iter().filter_map(|row| Some((row, alike(row)?)));
    let most =
        pairs.max_by(|a, b| a.0.f64("directions").unwrap_or(0.0).total_cmp(&b.0.f64("directions").unwrap_or(0.0)));
    let (few, many) = most.ok_or("no rays through images alike in both scenes")?;
    let triangles = all.part(PARTS[1])?.f64("triangles")? / all.part(PARTS[0])?.f64("triangles")?;
    Ok((few.time("rate_random")? / many.time("rate_random")?).noted(format!("{triangles:.1} × the triangles")))
}

/// The rate with his number of directions over the largest with another one, the least of the kinds of light.
fn optimum(all: &Reports) -> Found<Figure> {
    let (mut ratios, mut said) = (Vec::new(), Vec::new());
    for (light, his, ..) in LIGHTS {
        let rates = [96, 150, 384].map(|directions| (directions, rate(all, light, Some((directions, 128)))));
        let others = rates
            .iter()
            .filter(|(directions, _)| *directions != his)
            .filter_map(|(of, rate)| Some((of, rate.clone().ok()?)));
        let (of, fastest) =
            others.max_by(|a, b| a.1.value.total_cmp(&b.1.value)).ok_or("indirect: one number of directions")?;
        let ratio = rate(all, light, Some((his, 128)))? / fastest;
        said.push(format!("{light}: {:.2} of {of} directions", ratio.value));
        ratios.push(ratio);
    }
    Ok(least(ratios).ok_or("no light")?.noted(said.join(", ")))
}

pub fn claims() -> Vec<Claim> {
    let mut claims = vec![
        claim("the speed of rays does not depend on the number of triangles")
            .says("[Niessner2010, §7]", "approximately constant")
            .rule("rays a second across texels with few triangles over those with many", TIMES, 0.5..=2.0)
            .lost_by(Fault::made("one-scene-fine", "deep-images-many-triangles", "Directions", "deep-resolution 512"))
            .by(by_triangles),
        claim("fewer images have more crossings")
            .says("[Niessner2010, §3.2]", "fewer crossings with more images")
            .rule("texels a ray, of 24 directions over 384,", TIMES, at_least(1.05))
            .lost_by(Fault::made("equal-sets", CROSSINGS, "the scene", "deep-directions cube:8"))
            .by(|all| Ok((crossed(all, "the scene", 24)? / crossed(all, "the scene", 384)?).into())),
        claim("rays in Sponza cross fewer texels than in a Cornell box")
            .says("[Niessner2010, §7]", "a higher frame rate in its tight corridors")
            .rule("texels a ray, the scene over a Cornell box,", TIMES, at_most(0.95))
            .lost_by(Fault::made("coarse-box", CROSSINGS, "a Cornell box", "deep-resolution 32"))
            .by(|all| Ok((crossed(all, "the scene", 150)? / crossed(all, "a Cornell box", 150)?).into())),
        claim("rays cross as many texels in a larger scene with as much larger images")
            .says("[Niessner2010, §7]", "roughly constant")
            .rule("texels a ray, of four copies with twice the texels over one,", TIMES, 0.8..=1.25)
            .lost_by(Fault::made("coarse-copies", CROSSINGS, "four of the scene", "deep-resolution 64"))
            .by(|all| Ok((crossed(all, "four of the scene", 150)? / crossed(all, "the scene", 150)?).into())),
        claim("a tolerance keeps rays from leaking through surfaces")
            .says("[Niessner2010, §3.2, fig. 3]", "an image")
            .rule("rays that miss or hit nothing real, with half a texel over with none,", TIMES, at_most(0.9))
            .lost_by(Fault::made("no-tolerance", "deep-images", "Tolerances", "deep-tolerance 0"))
            .by(|all| {
                let of = |images: &str| {
                    let is = |row: &Node<'_>| row.is("group", "Tolerances") && row.is("structure", "across-texels");
                    let row = all.row("deep-images", "traced", |row| {
                        is(row)
                            && row.words("images").contains("tolerance") != images.is_empty()
                            && row.words("images").ends_with(images)
                    })?;
                    Ok::<_, String>(row.count("missed")? + row.count("false_hits")?)
                };
                let [none, half, two] = [of("tolerance 0")?, of("")?, of("tolerance 2")?];
                let note = format!(
                    "{:.2} % with 0, {:.2} % with 0.5, {:.2} % with 2 texels",
                    100.0 * none.value,
                    100.0 * half.value,
                    100.0 * two.value
                );
                Ok((half / none).noted(note))
            }),
        claim("150 images of 128² take 15 to 60 MB")
            .says("[Niessner2010, §7]", "15–60 MB")
            .rule("the memory of an image for each direction", MEGABYTES, 15e6..=60e6)
            .lost_by(FINE_IMAGES)
            .by(memory),
        claim("images take less than 100 MB in Sponza, one of 128² for each of 150 directions")
            .says("[Niessner2010, §1]", "below 100 MB in all example scenes, about 100 images")
            .rule("their memory", MEGABYTES, at_most(100e6))
            .lost_by(FINE_IMAGES)
            .by(memory),
        claim("96, 150 and 384 directions are the optimum of diffuse, glossy and soft shadow rays")
            .says("[Niessner2010, §7]", "all three")
            .rule("the rate of his number over the best other, of the worst light,", TIMES, at_least(1.0))
            .lost_by(ALL_COARSE)
            .by(optimum),
        claim("antialiasing by four samples is nearly free")
            .says("[Niessner2010, fig. 4]", "1.06 × the frame")
            .rule("the frame with four samples over that with one", TIMES, at_most(1.12))
            .lost_by(Fault::made("many-rays", PART, "4 samples", "indirect-rays 32"))
            .by(|all| {
                let frame = |samples| row(all, "diffuse", Some((96, 128)), samples)?.time("frame_ms");
                Ok((frame(4)? / frame(1)?).into())
            }),
        claim("a mirror is faster through images of 128² than of 512²")
            .says("[Niessner2010, fig. 7]", "1.79 ×")
            .rule("the ratio of frames, half of the gain,", TIMES, at_least(1.39))
            .lost_by(ALL_COARSE)
            .by(|all| {
                let frame = |texels| row(all, "mirror", Some((150, texels)), 1)?.time("frame_ms");
                Ok((frame(512)? / frame(128)?).into())
            }),
        claim("384 images of 512² are built in 23 s")
            .says("[Niessner2010, §7]", "23,000 ms")
            .rule("building 192 images, each of two directions,", MS, at_most(23_000.0))
            .lost_by(Fault::made("peeled", PART, "indirect", "deep-builder depth_peeling"))
            .of_a_card()
            .by(|all| {
                let is = |row: &Node<'_>| row.is("directions", 192) && row.is("resolution", 512);
                Ok(all.row(PART, "images", is)?.time("total_ms")?.into())
            }),
    ];
    for (light, directions, least, paper, gain, ratio) in LIGHTS {
        for (i, texels) in [512, 128].into_iter().enumerate() {
            claims.push(
                claim(format!("{light} rays through {directions} images of {texels}²"))
                    .says("[Niessner2010, table 1]", paper[i])
                    .rule("the rate, shading included,", MILLION_RAYS, at_least(least[i]))
                    .lost_by(Fault::made("finer-still", PART, "directions of", "deep-resolution 1024"))
                    .of_a_card()
                    .by(move |all| Ok(rate(all, light, Some((directions, texels)))?.into())),
            );
        }
        claims.push(
            claim(format!("{light}: images of 128² are faster than of 512²"))
                .says("[Niessner2010, table 1]", ratio)
                .rule("the ratio of rates, half of the gain,", TIMES, at_least(gain))
                .lost_by(ALL_COARSE)
                .by(move |all| {
                    Ok((rate(all, light, Some((directions, 128)))? / rate(all, light, Some((directions, 512)))?).into())
                }),
        );
    }
    for (texels, paper, what, least) in
        [(512, "comparable", "as fast as", 0.5), (128, "much faster", "much faster than", 2.0)]
    {
        claims.push(
            claim(format!("diffuse rays through images of {texels}² are {what} those of a ray tracer"))
                .says("[Niessner2010, §7]", paper)
                .rule("the rate over that of the BVH", TIMES, at_least(least))
                .lost_by(Fault::made("images-for-bvh", PART, "diffuse, bvh", "indirect-tracer within-texel"))
                .by(move |all| Ok((rate(all, "diffuse", Some((96, texels)))? / rate(all, "diffuse", None)?).into())),
        );
    }
    claims
}

/// The memory of 150 images of one direction, as he has them (§3.1); each of ours serves two.
fn memory(all: &Reports) -> Found<Figure> {
    let row = all.row(CROSSINGS, "crossings", |row| row.is("what", "the scene") && row.is("directions", 150))?;
    let ours = row.count("bytes")?;
    let note = format!("twice {:.1} MB, since each of ours serves two directions", 1e-6 * ours.value);
    Ok((ours.clone() + ours).noted(note))
}
