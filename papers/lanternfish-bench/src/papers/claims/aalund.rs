//! [Aalund2015]: occlusion and photons through layered depth maps of many directions.

use super::{Claim, MEGABYTES, MS, PERCENT, TIMES, at_least, at_most, claim};
use crate::papers::{faults::Fault, rows::Node, tables::About};

pub const ABOUT: About = About {
    title: "Aalund 2015: occlusion and photons through layered depth maps",
    theirs: "The paper: Crytek Sponza and a hairball, 800 x 800, 512 maps of 200² or 50², NVIDIA GTX 780 Ti.",
    comparable: "Here: <photons>; photons as `--as aalund` has them, but drawn with blending, as he does, and through maps of fig. 10's 200². \
        Comparable: parts of the time, errors against a path tracer, and memory. Not comparable: milliseconds, and the number of photons, which \
        the paper does not state. The hairball is not to be had.",
};

const PART: &str = "photons";
const PHOTONS: &str = "as in the paper";

pub fn claims() -> Vec<Claim> {
    vec![
        claim("splatting takes the majority of the time of photons")
            .says("[Aalund2015, §5.2]", "a majority; tracing is relatively cheap")
            .rule("its part of all steps", PERCENT, at_least(0.5))
            .lost_by(Fault::made(
                "small-splats",
                PART,
                "light: as in the paper",
                "photon-radius 0.01, photon-tracer across-texels",
            ))
            .by(|all| {
                let photons = all.named(PART, "rows", PHOTONS)?;
                let traced = photons.f64("times/emit")? + photons.f64("times/trace")?;
                let note = format!(
                    "emitting and tracing {:.0} %; the caption of his fig. 10 says 85 %",
                    100.0 * traced / photons.f64("times/*")?
                );
                Ok((photons.time("times/splat")? / photons.time("times/*")?).noted(note))
            }),
        claim("maps are nearer to the reference than HBAO for a large distance")
            .says("[Aalund2015, fig. 8]", "an image")
            .rule("the FLIP of maps over that of HBAO", TIMES, at_most(0.95))
            .lost_by(Fault::made("near-maps", PART, "as in the paper, within 28 %", "occlusion-distance 0.05"))
            .by(|all| {
                let of = |name| all.named(PART, "occlusion", name)?.error("flip");
                let ratio = of("as in the paper, within 28 %, 512 x 200²")? / of("hbao, within 28 %")?;
                Ok(ratio.noted("both up to 28 % of the scene's diagonal"))
            }),
        claim("maps are faster than HBAO for a large distance")
            .says("[Aalund2015, §5.1]", "faster")
            .rule("building and tracing maps over HBAO with a sample every 4 pixels", TIMES, at_most(1.0))
            .lost_by(Fault::made("near-hbao", PART, "hbao, far, by radius", "occlusion-distance 0.05"))
            .of_a_card()
            .by(|all| {
                let maps = all.named(PART, "occlusion", "as in the paper, within 28 %, 512 x 200²")?;
                let hbao = all.named(PART, "occlusion", "hbao, far, by radius")?.time("occlusion_ms")?;
                Ok((maps.times(["deep_images_ms", "occlusion_ms"])? / hbao).into())
            }),
        claim("512 maps of 200² take 805.5 MB")
            .says("[Aalund2015, fig. 10]", "805.5 MB")
            .rule("their memory, 0.8 to 1.25 of his,", MEGABYTES, 644.4e6..=1006.9e6)
            .lost_by(Fault::made("coarse-maps", PART, "as in the paper, 512 x 200²", "deep-resolution 100"))
            .by(|all| Ok(all.named(PART, "occlusion", "as in the paper, 512 x 200²")?.count("bytes")?.into())),
        claim("indirect light by photons")
            .says("[Aalund2015, fig. 10]", "2413 and 1716 ms, two views")
            .rule("the time of all steps", MS, at_most(2413.0))
            .lost_by(Fault::made("many-photons", PART, "light: as in the paper", "photon-count 65536"))
            .of_a_card()
            .by(|all| Ok(all.named(PART, "rows", PHOTONS)?.time("times/*")?.into())),
        claim("occlusion of Sponza by 512 maps of 50², building among it")
            .says("[Archer2019, §4]", "373 ms")
            .rule("the time", MS, at_most(373.0))
            .lost_by(Fault::made("fine-maps", PART, "as in the paper, 512 x 50²", "deep-resolution 200"))
            .of_a_card()
            .by(|all| {
                Ok(all
                    .named(PART, "occlusion", "as in the paper, 512 x 50²")?
                    .times(["deep_images_ms", "occlusion_ms"])?
                    .into())
            }),
        claim("a search through sorted lists ends early")
            .says("[Aalund2015, §4.1]", "an optimisation")
            .rule("fragments that a ray looks at in sorted lists, over those in unsorted ones,", TIMES, at_most(0.95))
            .lost_by(Fault::made(
                "unsorted",
                "deep-images",
                "Stores: per_triangle, sorted_linked_list",
                "deep-store linked_list",
            ))
            .by(|all| {
                let of = |store: &str| {
                    let is = |row: &Node<'_>| row.is("group", "Stores") && row.is("structure", "within-texel");
                    let row = all.row("deep-images", "traced", |row| {
                        is(row) && row.words("images") == format!("per_triangle, {store}")
                    })?;
                    row.count("fragments_a_ray")
                };
                Ok((of("sorted_linked_list")? / of("linked_list")?).into())
            }),
    ]
}
