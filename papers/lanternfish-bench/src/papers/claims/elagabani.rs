//! [Elagabani2025]: what each optimisation of shadow rays saves, and normals from depth.

use super::{Claim, FLIP, Figure, Found, PERCENT, Reports, TIMES, at_least, at_most, claim};
use crate::papers::{faults::Fault, measure::Measure, tables::About};

pub const ABOUT: About = About {
    title: "Elagabani 2025: hybrid Forward+",
    theirs: "The thesis: Sponza, ten point lights with \"varying intensities, colors, and ranges\", 1920 x 1080, Nvidia RTX 2060 SUPER, Ryzen 7 \
        3700X, rays in hardware. Frame times are means over a second.",
    comparable: "Here: <forward-plus>, normals at 1920 x 1080. Comparable: how a frame's time and its number of rays change from one \
        configuration to the next, the memory of lists, and errors of normals at his size. Not comparable: milliseconds, and the thesis' \
        lights, which it does not list: what light culling saves is a matter of their ranges. Rays go through the BVH in compute shaders, so \
        that the shadow pass costs more than in hardware.",
};

const PART: &str = "forward-plus";
/// Every second frame of a pair is one without optimisations.
const NOTHING_SAVED: Fault =
    Fault::made("nothing-saved", PART, "pairs: ", "culling all, ray-culling none, ray-range-culling off");
const LARGE_TILES: Fault = Fault::made("large-tiles", PART, "8 x 8", "tile-size 16");
const NO_BOXES: Fault = Fault::made("no-boxes", PART, "light culling + AABB", "aabb off");

const LIGHTS: &str = "the thesis lists neither its lights nor their ranges, on which this depends";
const VIEW: &str = "the error is of a view that the thesis does not give";

/// What an optimisation saves of the frame.
fn saved(name: &'static str) -> impl Fn(&Reports) -> Found<Figure> {
    move |all| {
        let row = all.named(PART, "savings", name)?;
        Ok(row.time("saved")?.noted(format!("of the rays {:.1} %", 100.0 * row.f64("rays_saved")?)))
    }
}

fn normals(all: &Reports, name: &str) -> Found<Measure> {
    all.named(PART, "normals", name)?.count("mean_flip")
}

pub fn claims() -> Vec<Claim> {
    let saves = |what, paper, least, name| {
        claim(what)
            .says("[Elagabani2025, table 5.1]", paper)
            .rule("the saving of frame time, at least half of his,", PERCENT, at_least(least))
            .lost_by(NOTHING_SAVED)
            .by(saved(name))
    };
    vec![
        saves("all optimisations shorten the frame", "saves 39.56 %", 0.1978, "light culling, AABB test and facing"),
        saves("light culling alone shortens the frame", "saves 28.00 %", 0.14, "light culling").untestable(LIGHTS),
        saves(
            "light culling with the AABB test shortens the frame",
            "saves 31.69 %",
            0.158,
            "light culling and AABB test",
        )
        .untestable(LIGHTS),
        saves("culling rays by facing alone shortens the frame", "saves 15.31 %", 0.07655, "facing"),
        saves("the AABB test shortens the frame", "saves 5.12 %", 0.0256, "AABB test"),
        saves(
            "tiles of 16 x 16 shorten the frame against 32 x 32",
            "saves 4.30 %",
            0.0215,
            "tiles of 16 instead of 32",
        )
        .says("[Elagabani2025, table 5.2]", "saves 4.30 %"),
        saves("tiles of 8 x 8 shorten the frame against 16 x 16", "saves 1.25 %", 0.00625, "tiles of 8 instead of 16")
            .says("[Elagabani2025, table 5.2]", "saves 1.25 %"),
        claim("the AABB test leaves out false positives")
            .says("[Elagabani2025, §4.2.3]", "fewer")
            .rule("false positives with it over those without", TIMES, at_most(0.9))
            .lost_by(NO_BOXES)
            .by(|all| {
                let of = |name| all.named(PART, "configurations", name)?.count("false_positives");
                let (with, without) = (of("light culling + AABB")?, of("light culling")?);
                let note = format!("{:.1} % and {:.1} %", 100.0 * with.value, 100.0 * without.value);
                Ok((with / without).noted(note))
            }),
        claim("improved normals take little longer than naive ones")
            .says("[Elagabani2025, ch. 5]", "saves −0.8 %")
            .rule("the saving of frame time against naive normals", PERCENT, at_least(-0.05))
            .lost_by(NOTHING_SAVED)
            .by(saved("improved normals instead of naive ones")),
        claim("shadow rays take most of the frame")
            .says("[Elagabani2025, ch. 5]", "92 %")
            .rule("their part of the frame, within ten points,", PERCENT, at_least(0.82))
            .lost_by(Fault::made("few-rays", PART, "no optimisations", "shadows none"))
            .of_a_card()
            .by(|all| Ok(all.named(PART, "configurations", "no optimisations")?.time("shadow_part")?.into())),
        claim("halving the size of tiles quadruples the memory of lists")
            .says("[Elagabani2025, ch. 5]", "4 ×")
            .rule("the memory at 8 x 8 over that at 16 x 16", TIMES, 3.0..=5.0)
            .lost_by(LARGE_TILES)
            .by(|all| {
                let of = |name| all.named(PART, "tile_sizes", name)?.count("list_bytes");
                Ok((of("8 x 8")? / of("16 x 16")?).noted("nearly forced: there are four times the tiles"))
            }),
        claim("error of naive normals from depth")
            .says("[Elagabani2025, fig. 5.3]", "FLIP 0.07975")
            .rule("the mean FLIP, half to twice his,", FLIP, 0.039875..=0.1595)
            .untestable(VIEW)
            .by(|all| Ok(normals(all, "naive")?.into())),
        claim("error of improved normals from depth")
            .says("[Elagabani2025, fig. 5.3]", "FLIP 0.02264")
            .rule("the mean FLIP, half to twice his,", FLIP, 0.01132..=0.04528)
            .untestable(VIEW)
            .by(|all| Ok(normals(all, "improved")?.into())),
        claim("improved normals have less error than naive ones")
            .says("[Elagabani2025, fig. 5.3]", "3.52 ×")
            .rule("the error of naive normals over that of improved ones, at least half,", TIMES, at_least(1.76))
            .lost_by(Fault::swapped("other-normals", PART, "name", ["naive", "improved"]))
            .by(|all| Ok((normals(all, "naive")? / normals(all, "improved")?).into())),
        claim("positions from depth are as accurate as floats can be")
            .says("[Elagabani2025, §4.3.2]", "100 %")
            .rule("the part of bits that are right, in 32-bit floats,", PERCENT, at_least(0.9995))
            .lost_by(Fault::swapped("inverse-matrix", PART, "name", POSITIONS))
            .by(|all| {
                let of = |name| all.named(PART, "positions", name)?.count("accuracy");
                let before = 100.0 * of(POSITIONS[0])?.value;
                Ok(of(POSITIONS[1])?.noted(format!("{before:.2} % before, his 99.6 %; fma rounds its input once")))
            }),
    ]
}

const POSITIONS: [&str; 2] =
    ["((u + 0.5) · (1 / w)) · 2 − 1, inverse matrix", "fma((u + 0.5) / w, 2, −1), inlined (alg. 4.1)"];
