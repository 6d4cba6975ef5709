//! The attenuation functions as curves [VanGelderen2020, fig. A.1].

use std::path::PathBuf;

use clap::Args;
use lanternfish::settings::Attenuation;
use lanternfish_cli::{
    error::CliError,
    output,
    plot::{Axis, Curve, curves},
};

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

/// Range of the light, m. I₀ of a light of 1 cd is then 0.25 cd/m², as in the figure.
const RANGE: f32 = 2.0;
/// Nearest plotted distance, m: R₀ of the figure. The renderer's own R₀ is 1 mm.
const NEAREST: f32 = 0.75;
/// Farthest plotted distance, m.
const FARTHEST: f32 = 2.25;

/// Colours of the curves: the palette of Okabe and Ito, and two greys.
const COLORS: [&str; 10] =
    ["#000000", "#999999", "#e69f00", "#d55e00", "#56b4e9", "#0072b2", "#cc79a7", "#009e73", "#b8860b", "#c0c0c0"];

fn plot() -> String {
    let curve = |(i, attenuation): (usize, &Attenuation)| {
        let at = |d: f32| (f64::from(d), f64::from(attenuation.factor(d, RANGE)));
        let steps = |from: f32, to: f32| (0..=150).map(move |step| from + (to - from) * step as f32 / 150.0);
        // Sampled on both sides of the range: some functions are discontinuous there.
        let before = RANGE.next_down();
        Curve {
            name: attenuation.name().to_owned(),
            color: COLORS[i],
            // Equals the glTF function and is drawn over it.
            dashed: *attenuation == Attenuation::PhysicalReduced2,
            marked: false,
            points: steps(NEAREST, before).chain([RANGE, FARTHEST]).map(at).collect(),
        }
    };
    let ticks = |values: &[f64]| values.iter().map(|v| (*v, v.to_string())).collect();
    let x = Axis {
        label: "distance d, m",
        ends: [NEAREST.into(), FARTHEST.into()],
        logarithmic: false,
        ticks: ticks(&[0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25]),
    };
    let y = Axis {
        label: "lux a candela",
        ends: [0.0, 1.8],
        logarithmic: false,
        ticks: ticks(&[0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75]),
    };
    let curves_of: Vec<_> = Attenuation::ALL.iter().enumerate().map(curve).collect();
    curves("Attenuation of a light of range R = 2 m (I₀ = 0.25 I / m²)", &x, &y, &curves_of)
}

#[test]
fn the_image_of_the_documentation_is_this_one() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/attenuation_functions.svg");
    let stored = std::fs::read_to_string(path).unwrap_or_default();
    assert!(stored == plot(), "write it again: lanternfish-bench attenuation -o docs/images/attenuation_functions.svg");
}
