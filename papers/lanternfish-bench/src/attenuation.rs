//! The attenuation functions as curves [VanGelderen2020, fig. A.1].

use std::path::PathBuf;

use clap::Args;
use lanternfish::settings::Attenuation;
use lanternfish_cli::{
    error::CliError,
    output,
    plot::{Axis, Curve, curves},
};
use lanternfish_scene::shading::Falloff;

#[derive(Debug, Args)]
pub struct AttenuationArgs {
    /// The plot, an SVG file.
    #[arg(short, long, value_name = "FILE", default_value = "attenuation.svg")]
    pub output: PathBuf,
}

pub fn run(args: &AttenuationArgs) -> Result<(), CliError> {
    output::write_text(&args.output, &plot())?;
    let text = format!("{}\n", args.output.display());
    output::print(&text)
}

/// The figure's I₀ and R₀.
const CUT_OFF: f32 = 0.25;
const NEAR_RADIUS: f32 = 0.75;
/// The caption's intensity, cd, at which all functions are drawn; and two around it, for the basic ones.
const INTENSITY: f32 = 1.0;
const OTHERS: [f32; 2] = [0.5, 2.0];
const BASIC: [Attenuation; 3] = [Attenuation::Physical, Attenuation::Reduced, Attenuation::Smooth];
const FARTHEST: f32 = 3.0;

/// Okabe and Ito's, and three greys and browns.
const COLORS: [&str; 11] = [
    "#000000", "#999999", "#e69f00", "#d55e00", "#56b4e9", "#0072b2", "#cc79a7", "#009e73", "#b8860b", "#c0c0c0",
    "#8b4513",
];

/// The curves of a function have one colour.
fn plot() -> String {
    let curve = |intensity: f32, (i, attenuation): (usize, &Attenuation)| {
        let falloff = Falloff { near_radius: NEAR_RADIUS, ..(*attenuation).into() };
        // R1 = √(I / I0) [VanGelderen2020, §A.1].
        let range = (intensity / CUT_OFF).sqrt();
        let at = |d: f32| (f64::from(d), f64::from(intensity * falloff.factor(d, range)));
        let steps = |from: f32, to: f32| (0..=150).map(move |step| from + (to - from) * step as f32 / 150.0);
        // Up to the range, and from it on: some end in an edge.
        let before = range.next_down();
        Curve {
            name: if intensity == INTENSITY { attenuation.to_string() } else { String::new() },
            color: COLORS[i],
            // Equals the glTF function and is drawn over it.
            dashed: *attenuation == Attenuation::PhysicalReduced2,
            marked: false,
            points: [(0.0, at(0.0).1)]
                .into_iter()
                .chain(steps(NEAR_RADIUS, before).chain([range, FARTHEST]).map(at))
                .collect(),
        }
    };
    let ticks = |values: &[f64]| values.iter().map(|v| (*v, v.to_string())).collect();
    let x = ticks(&[0.0, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0]);
    let x = Axis::of("distance d, m", [0.0, FARTHEST.into()], x);
    let y = ticks(&[0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]);
    let y = Axis::of("illuminance, lx", [0.0, 3.75], y);
    let functions = || Attenuation::ALL.iter().enumerate();
    let basic = || functions().filter(|(_, function)| BASIC.contains(function));
    let others = OTHERS.iter().flat_map(|intensity| basic().map(|of| curve(*intensity, of)));
    let all: Vec<_> = functions().map(|of| curve(INTENSITY, of)).chain(others).collect();
    curves("Attenuation of 1 cd; basic functions also of 0.5 and 2 cd (R₀ = 0.75 m, I₀ = 0.25 cd/m²)", &x, &y, &all)
}

#[test]
fn the_image_of_the_documentation_is_this_one() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/attenuation_functions.svg");
    let stored = std::fs::read_to_string(path).unwrap_or_default();
    assert!(stored == plot(), "write it again: lanternfish-bench attenuation -o docs/images/attenuation_functions.svg");
}
