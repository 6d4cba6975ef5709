//! The flags of `lanternfish reference`.

use std::path::PathBuf;

use clap::{Arg, Args, Command, ValueEnum};
use lanternfish_reference::{
    Settings,
    settings::{Integrator, LightChoice, LightPaths, UNLIMITED},
};

use crate::{
    args::{RenderArgs, Selection, SharedFlags, demos},
    choices::choice,
    error::CliError,
    parse::{self, Span},
    scene::SceneName,
};

pub const HELP: &str = "\
Examples:
  Ground truth of a shot, 1024 samples per pixel:
    lanternfish reference shot.toml --spp 1024 -o reference.exr
  Resume later, up to four times as many samples:
    lanternfish reference shot.toml --spp 4096 --resume -o reference.exr
  Trace until the expected error is 1 %, and compare a fast image:
    lanternfish reference demo:cornell --until-error 0.01 -o reference.exr
    lanternfish compare fast.exr reference.exr
  Trace on two machines, and merge:
    lanternfish reference shot.toml --samples 1-512 -o a.exr
    lanternfish reference shot.toml --samples 513-1024 -o b.exr
    lanternfish merge a.exr b.exr -o reference.exr
  Direct light only; one bounce:
    lanternfish reference demo:cornell --max-depth 2 -o direct.exr
    lanternfish reference demo:cornell --max-depth 3 -o one-bounce.exr
  Ambient obscurance of every point:
    lanternfish reference demo:atrium --integrator obscurance --max-distance 1.5 -o obscurance.exr

The EXR holds R, G, B (the mean), the layer `variance` (of that mean, by its own samples), and
the settings, as text attributes `lanternfish.…`. It is written once a minute while it grows, or
less often if that takes long.

Ctrl-C stops, writes what there is, and exits with 130; again, and it stops at once.
The last line of standard output is the image's path.";

/// Default samples per pixel.
pub const SPP: u64 = 256;

#[derive(Debug, Args)]
pub struct ReferenceArgs {
    #[arg(help = format!("A glTF 2.0 file (.gltf, .glb), an OBJ file, a shot (.toml), or a built-in scene: {}", demos()))]
    pub scene: SceneName,

    #[command(flatten, next_help_heading = "Output")]
    pub output: OutputArgs,
    #[command(flatten, next_help_heading = "Samples")]
    pub samples: SampleArgs,
    #[command(flatten, next_help_heading = "Light transport")]
    pub transport: TransportArgs,
    #[command(flatten)]
    pub shared: SharedFlags<SharedArgs>,
    #[command(flatten, next_help_heading = "Run")]
    pub run: RunArgs,
}

#[derive(Debug, Args)]
pub struct OutputArgs {
    /// The image. Its ending chooses the format: .exr (linear, 32 bits, with the variance, resumable) or .png (tone-mapped).
    /// Without it: the name of the scene or shot with .reference.exr, in the current folder; with .reference.A-B.exr for
    /// --samples A-B.
    #[arg(id = "reference_output", short = 'o', long = "output", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Also writes the variance of every value as a separate image.
    #[arg(long, value_name = "FILE.exr")]
    pub variance: Option<PathBuf>,
    /// Continues from the output, if it exists: it must have the same scene, view and settings. The result equals that of an
    /// uninterrupted run except for 32-bit rounding; of a part (--samples), to the bit.
    #[arg(long)]
    pub resume: bool,
}

#[derive(Debug, Args)]
pub struct TransportArgs {
    /// Quantity to render.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = IntegratorName::Path)]
    pub integrator: IntegratorName,
    /// Maximum path length, in segments from the camera: 1 shows emission, 2 direct light, 3 one bounce.
    #[arg(long, value_name = "N", value_parser = max_depth, default_value = "unlimited", allow_hyphen_values = true)]
    pub max_depth: u32,
    /// Largest distance of an occluder, m. Required with --integrator obscurance.
    #[arg(long, value_name = "M", value_parser = parse::positive, allow_hyphen_values = true)]
    pub max_distance: Option<f32>,
    /// Selection of one of many lights at a surface. It affects noise, not the expected image.
    #[arg(long, value_name = "NAME", value_parser = choice::<LightChoice>())]
    #[arg(default_value_t = Settings::default().light_choice)]
    pub light_choice: LightChoice,
    /// Also starts paths at point and spot lights without a radius. It affects noise, not the expected image.
    #[arg(long, value_name = "on|off", value_parser = choice::<LightPaths>())]
    #[arg(default_value_t = Settings::default().light_paths)]
    pub light_paths: LightPaths,
}

#[derive(Debug, Args)]
pub struct SampleArgs {
    /// Samples per pixel. Four times as many: half the noise. Without it: 256, or no limit with --until-error or --time-limit.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 32))]
    #[arg(allow_hyphen_values = true)]
    pub spp: Option<u64>,
    /// Traces only samples A to B of a ground truth. `lanternfish merge` adds the parts: the result equals that of a single run
    /// to the bit, for any division.
    #[arg(id = "sample_range", long = "samples", value_name = "A-B", value_parser = parse::samples)]
    #[arg(allow_hyphen_values = true, conflicts_with_all = ["spp", "until_error", "time_limit"])]
    pub range: Option<Span<u64>>,
    /// Stops when the expected relative error of the image, estimated from its variance, is at most X: 0.01 is 1 %. Checked
    /// from 16 samples on, each time the count has grown by an eighth.
    #[arg(long, value_name = "X", value_parser = parse::positive, allow_hyphen_values = true)]
    pub until_error: Option<f32>,
    /// Stops after this many seconds of tracing, even within an image: some rows may have more samples than others, or none.
    #[arg(long, value_name = "SECONDS", value_parser = parse::positive, allow_hyphen_values = true)]
    pub time_limit: Option<f32>,
    /// Seed of the noise. The same seed gives the same image to the bit. --rain-seed is the seed of --lights rain.
    #[arg(id = "noise_seed", long = "seed", value_name = "N", allow_hyphen_values = true)]
    pub seed: Option<u64>,
}

#[derive(Debug, Args)]
pub struct RunArgs {
    /// CPU threads for tracing. Without it: all. The image is the same.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), allow_hyphen_values = true)]
    pub threads: Option<u16>,
}

/// The quantity in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IntegratorName {
    /// Radiance, by path tracing
    Path,
    /// Cosine-weighted fraction of the hemisphere around the normal that is visible; 1 where there is no surface
    Occlusion,
    /// The same, with occluders weighted down by distance: 1 − (d / max-distance)²
    Obscurance,
    /// The shading normal, world space, as (n + 1) / 2; 0 where there is no surface
    Normal,
}

/// The flags that `reference` shares with `render`: all flags of scene, lights and view, and some more. The shot parses their
/// values again.
#[derive(Debug)]
pub struct SharedArgs;

/// Headings whose flags are all shared.
const HEADINGS: [&str; 2] = ["View", "Lights (beside those of the file)"];
/// Ids of further shared flags.
const MORE: [&str; 9] = ["size", "time", "animation", "materials", "exposure", "tone-map", "seed", "timings", "quiet"];

/// The names of the flags that `reference` shares with `render`.
pub fn shared_flags() -> Vec<String> {
    let render = RenderArgs::augment_args(Command::new("render"));
    let shared = render.get_arguments().filter(|flag| is_shared(flag));
    shared.filter_map(|flag| Some(flag.get_long()?.to_owned())).collect()
}

/// True if a flag of `render` is also one of `reference`.
fn is_shared(flag: &Arg) -> bool {
    flag.get_long().is_some()
        && (flag.get_help_heading().is_some_and(|heading| HEADINGS.contains(&heading))
            || MORE.contains(&flag.get_id().as_str()))
}

impl Selection for SharedArgs {
    fn flag(flag: &Arg) -> Option<Arg> {
        let shared = is_shared(flag).then(|| flag.clone())?;
        Some(match flag.get_id().as_str() {
            "seed" => shared
                .long("rain-seed")
                .help("Seed of --lights rain: --seed of `render`")
                .long_help(None)
                .help_heading(HEADINGS[1]),
            // Path tracing includes all light.
            "sky" | "environment" => {
                let help = shared.get_long_help().map(ToString::to_string).unwrap_or_default();
                shared.long_help(
                    help.replace("lights the scene with --indirect sampled or --occlusion", "lights the scene"),
                )
            }
            _ => shared,
        })
    }
}

fn max_depth(text: &str) -> Result<u32, String> {
    match text {
        "unlimited" => Ok(UNLIMITED),
        _ => text
            .parse()
            .ok()
            .filter(|depth| *depth > 0)
            .ok_or_else(|| "expected an integer from 1, or unlimited".to_owned()),
    }
}

impl ReferenceArgs {
    /// The tracer's settings: light transport from these flags, materials and lights from the shot's.
    pub fn settings(&self, shot: &RenderArgs, seed: u64) -> Result<Settings, CliError> {
        let transport = &self.transport;
        let integrator = match (transport.integrator, transport.max_distance) {
            (IntegratorName::Obscurance, Some(max_distance)) => Integrator::Obscurance { max_distance },
            (IntegratorName::Obscurance, None) => {
                return Err(CliError::new(
                    "--integrator obscurance needs the largest distance of an occluder",
                    "give one in metres: --max-distance 1.5",
                ));
            }
            (_, Some(_)) => {
                return Err(CliError::new(
                    "--max-distance is for --integrator obscurance",
                    "choose that, or leave --max-distance out",
                ));
            }
            (IntegratorName::Path, None) => Integrator::Path,
            (IntegratorName::Occlusion, None) => Integrator::Occlusion,
            (IntegratorName::Normal, None) => Integrator::Normal,
        };
        let rendered = shot.settings();
        Ok(Settings {
            integrator,
            max_depth: transport.max_depth,
            materials: rendered.materials.model,
            attenuation: rendered.lights.attenuation,
            attenuation_near_radius: rendered.lights.near_radius,
            attenuation_coefficients: rendered.lights.coefficients,
            range_threshold: rendered.lights.range_threshold,
            light_radius: rendered.lights.radius,
            sun_diameter: rendered.lights.sun_diameter,
            light_choice: transport.light_choice,
            light_paths: transport.light_paths,
            seed,
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::{
        cli::{Cli, Command as Subcommand},
        testing,
    };

    fn parsed(words: &str) -> Result<ReferenceArgs, clap::Error> {
        let Subcommand::Reference(args) = testing::parsed(&format!("reference a.glb {words}"))? else {
            panic!("{words}")
        };
        Ok(*args)
    }

    #[test]
    fn flags_of_lights_and_view_are_those_of_render() {
        let mut command = Cli::command();
        let flags = |name: &str| -> Vec<_> {
            let command = command.find_subcommand(name).unwrap();
            command.get_arguments().filter_map(|flag| flag.get_long().map(str::to_owned)).collect()
        };
        let (render, reference) = (flags("render"), flags("reference"));
        let has = |flags: &[String], flag: &str| flags.iter().any(|other| other == flag);
        let shared = "eye camera scene variant point environment lights attenuation size time animation quiet";
        assert!(shared.split(' ').all(|flag| has(&render, flag) && has(&reference, flag)));
        let others = "shadows culling frames debug-view adapter report";
        assert!(others.split(' ').all(|flag| has(&render, flag) && !has(&reference, flag)));
        let help = command.find_subcommand_mut("reference").unwrap().render_long_help().to_string();
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(help.matches("It is visible, and it lights the scene").count(), 2, "{help}");
        assert!(!help.contains("--occlusion") && !help.contains("--indirect"), "{help}");
        assert!(help.contains("--rain-seed") && help.contains("--seed"), "{help}");
    }

    #[test]
    fn depths_are_numbers_from_one_or_unlimited() {
        let depth = |words: &str| parsed(words).map(|args| args.transport.max_depth);
        assert_eq!((depth("").unwrap(), depth("--max-depth 3").unwrap()), (UNLIMITED, 3));
        assert_eq!(depth("--max-depth unlimited").unwrap(), UNLIMITED);
        for bad in ["0", "-1", "1.5", "many", "99999999999"] {
            let error = depth(&format!("--max-depth {bad}")).unwrap_err().to_string();
            assert!(error.contains("or unlimited"), "{error}");
        }
    }

    #[test]
    fn a_distance_requires_obscurance() {
        let Ok(Subcommand::Render(shot)) = testing::parsed("render a.glb") else { panic!() };
        let shot = shot.render;
        let settings = |words: &str| parsed(words).unwrap().settings(&shot, 7).map_err(|error| error.to_string());
        assert_eq!(settings(""), Ok(Settings { seed: 7, ..Settings::default() }));
        let obscurance = settings("--integrator obscurance --max-distance 2.5").unwrap();
        assert_eq!(obscurance.integrator, Integrator::Obscurance { max_distance: 2.5 });
        assert!(settings("--integrator obscurance").unwrap_err().contains("hint: give one in metres"));
        assert!(settings("--max-distance 2").unwrap_err().contains("--integrator obscurance"));
        assert!(
            parsed("--max-distance 0").is_err() && parsed("--spp 0").is_err() && parsed("--until-error 0").is_err()
        );
    }
}
