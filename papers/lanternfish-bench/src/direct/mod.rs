//! `lanternfish-bench direct`: direct light from a fixed number of shadow rays, compared with a ray to every light.

mod frames;
mod price;

use clap::Args;
use glam::Vec3;
use lanternfish::settings::{Attenuation, Settings};
use lanternfish_cli::error::CliError;
use lanternfish_scene::generate::light_rain;

use crate::{
    bench::{Bench, RunArgs, is_requested},
    case::Case,
    view::{SubjectArgs, View},
};

/// Flags of `direct`.
#[derive(Debug, Args)]
pub struct DirectArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Numbers of lights in the table of prices, with ranges that do not end.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "10,100,1000,10000,100000,1000000")]
    counts: Vec<u32>,
    /// Greatest of these numbers at which every light gets a ray, too. More: slower.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    all_up_to: u32,
    /// Frames of the mean.
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(4..=4096))]
    frames: u32,
    /// Measure only the table of this name: price or frame. Repeatable.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// For the table of frames: so many lights whose ranges do not end in place of the scene's own.
    #[arg(long, value_name = "N")]
    unlimited: Option<u32>,
    #[command(flatten)]
    subject: SubjectArgs,
}

/// Inputs of all tables.
struct DirectLight {
    bench: Bench,
    /// The scene without emission, which a ray to every light does not sample.
    view: View,
    frames: u32,
}

/// Measures and writes the report.
pub fn run(args: &DirectArgs) -> Result<(), CliError> {
    if let Some(other) =
        args.only.iter().find(|only| !["price", "frame"].iter().any(|name| name.contains(only.as_str())))
    {
        let hint = "there are price and frame; `lanternfish-bench probes` measures a walk";
        return Err(CliError::new(format_args!("{other}: there is no such table"), hint));
    }
    let bench = Bench::start(&args.run, "direct", "Direct light", Some(&args.subject.scene))?;
    let (mut view, _) = View::load(&args.subject, true, &bench)?;
    view.scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    if let Some(count) = args.unlimited {
        view = unlimited(&view, count);
    }
    bench.facts(view.facts());
    bench.report().introduction(&view.text(), &format!("least of {} runs", args.run.runs));
    let of = DirectLight { bench, view, frames: args.frames };
    if is_requested(&args.only, "price") {
        let rows = of.prices(&args.counts, args.all_up_to)?;
        of.bench.section("Price by number of lights", price::TEXT, "prices", rows);
    }
    if is_requested(&args.only, "frame") {
        let rows = of.one_frame()?;
        of.bench.section("One frame, and the mean of many", frames::TEXT, "frames", rows);
    }
    of.bench.finish()
}

/// Names and changes of one frame: a ray to every light first.
const FRAMES: [(&str, &str); 7] = [
    ("all", "direct all"),
    ("sampled, 1 rays, denoise on", "direct sampled, light-samples 1, denoise on"),
    ("sampled, 2 rays, denoise on", "direct sampled, light-samples 2, denoise on"),
    ("sampled, 4 rays, denoise on", "direct sampled, light-samples 4, denoise on"),
    ("sampled, 8 rays, denoise on", "direct sampled, light-samples 8, denoise on"),
    ("sampled, 4 rays, denoise off", "direct sampled, light-samples 4, denoise off"),
    ("uniform, 4 rays, denoise on", "direct sampled, light-choice uniform"),
];

/// The configurations whose names are wanted.
fn cases(look: &Settings, is_wanted: impl Fn(&str) -> bool) -> Vec<Case> {
    let wanted = FRAMES.into_iter().filter(|(name, _)| is_wanted(name));
    wanted.map(|(name, changes)| Case::of(look, name, changes)).collect()
}

/// The view of the scene with `count` lights in place of its own, whose ranges do not end. All together are as bright
/// at any number.
fn unlimited(view: &View, count: u32) -> View {
    let bounds = view.scene.bounds();
    let mut lights = light_rain(&bounds, count, Some(1.0), 0, 0.0);
    let intensity = 0.25 * bounds.size().length_squared() / count.max(1) as f32;
    for light in &mut lights {
        light.range = None;
        light.intensity *= intensity / light.intensity.max_element().max(1e-6);
    }
    let mut view = view.clone();
    (view.scene.lights, view.look.lights.attenuation) = (lights, Attenuation::Physical);
    view
}

#[test]
fn every_number_of_rays_has_a_frame() {
    use lanternfish::techniques::{LightSamples, SampledLights};
    let cases = cases(&Settings::direct_light(), |_| true);
    let rays = |case: &Case| case.settings.direct.get::<SampledLights>().map(|lights| lights.light_samples);
    assert!(LightSamples::ALL.iter().all(|wanted| cases.iter().any(|case| rays(case) == Some(*wanted))), "{cases:?}");
    assert!(cases[0].settings.direct.is_none());
}
