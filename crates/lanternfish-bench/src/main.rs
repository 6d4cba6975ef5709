//! `lanternfish-bench`: the measurements of the papers that Lanternfish is built from, and how good every technique is.

mod attenuation;
mod clustered;
mod deep_images;
mod document;
mod forward_plus;
mod ground_truths;
mod history;
mod image;
mod indirect;
mod moving;
mod one_bounce;
mod photons;
mod quality;
mod run;
mod subject;
mod table;
mod technique;
mod virtual_lights;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use lanternfish_cli::{
    args::TrustArgs,
    error::CliError,
    help::{self, HelpArgs},
    program,
};

use self::one_bounce::OneBounceArgs;

const AFTER_HELP: &str = "\
Examples:
  lanternfish-bench forward-plus demo:atrium --lights rain:10
  lanternfish-bench clustered docs/tracks/bistro.toml --runs 5 -o figures
  lanternfish-bench quality --only cornell

Each writes report.md and report.json into a folder, and prints the first. Counts and errors are exact; times are of this machine, to be
compared with each other only. `lanternfish-bench help BENCH` says what a bench measures, with --all every flag.";

/// Repeats the measurements of the papers that Lanternfish is built from, and judges every technique.
#[derive(Debug, Parser)]
#[command(name = "lanternfish-bench", version, after_help = AFTER_HELP, max_term_width = 100, arg_required_else_help = true)]
#[command(disable_help_flag = true, disable_help_subcommand = true, arg = help::flag("lanternfish-bench"))]
struct Cli {
    #[command(subcommand)]
    bench: Bench,
    #[command(flatten)]
    trust: TrustArgs,
}

#[derive(Debug, Subcommand)]
enum Bench {
    /// Tables 5.1 and 5.2, heat maps (fig. 5.2) and normals from depth (fig. 5.3) of Elagabani 2025.
    ///
    /// Renders one view under every configuration of the thesis and ours. Exits with an error when configurations that must show the
    /// same image do not.
    #[command(mut_arg("runs", |runs| runs.default_value("5")))]
    #[command(mut_arg("size", |size| size.default_value("1280x720")))]
    ForwardPlus(Box<forward_plus::ForwardPlusArgs>),
    /// Building and tracing deep images, beside the BVH: Archer 2019, table 2, and Niessner 2010, table 1.
    ///
    /// Directions are those of the default set, of equal areas; Archer's are stacks and slices. Every speed stands beside its
    /// error, and beside the texels that a ray crosses and the fragments that it is compared with. The table "crossings" has
    /// Niessner's explanation of speed: numbers of images, of triangles, and a corridor beside an empty box.
    DeepImages(Box<deep_images::DeepImagesArgs>),
    /// Indirect light by rays through deep images, beside the BVH: Niessner 2010, §7.
    ///
    /// One view, its surfaces diffuse (8 rays a pixel), glossy (16) and mirrors (1), with rays through images of 96, 150 and 384
    /// directions, of 128² and 512² texels, within a texel and across texels, and through the BVH; then with a filter as wide as
    /// his (11 x 11) and with none, with four samples at edges, and as the mean of four frames. Soft shadows by 16 rays to each
    /// light through 384 directions, as they are and through his Gaussian. The images of his figs 5, 7 and 8, and the frames a
    /// second of his figs 1, 4, 7 and 9 beside those of this scene, which stands in for his.
    ///
    /// Each row has the device's milliseconds of tracing, shading, resolving, filtering and the whole frame; rays a second of
    /// tracing alone and with shading what they meet; and what they cost in quality: energy and mean FLIP against the same rays
    /// through the BVH, and FLIP against the mean of many frames. Each set of images has its building time and its memory.
    /// What an adapter, or the renderer, refuses is listed with its reason, and the rest goes on.
    Indirect(Box<indirect::IndirectArgs>),
    /// Virtual point lights with ranges: Archer 2019, tables 1 and 3 and fig. 7; Van Gelderen 2020, app. B.
    ///
    /// One view by every kind of virtual lights, and by rays from every pixel: the device's milliseconds by his steps, how many lights
    /// there are, and how far the image is from the path tracer's: the energy of indirect light alone, and FLIP. Rays that find ranges,
    /// by structure and number, beside random ranges. Along a shot's track: how much the light of what does not move flickers.
    ///
    /// The path tracer's images are kept in the folder.
    #[command(mut_arg("scene", |scene| scene.default_value("demo:cornell")))]
    #[command(mut_arg("size", |size| size.default_value("480x270")))]
    VirtualLights(Box<OneBounceArgs>),
    /// Photon differentials, split and splatted: Aalund 2015, figs 8 to 11.
    ///
    /// One view by photons of every kind, by rays from every pixel and by virtual lights: the device's milliseconds of tracing and of
    /// splatting, photons a second, how many are kept, and how far the image is from the path tracer's: the energy of indirect light
    /// alone, and FLIP; means of 1, 16 and 64 frames. Along a shot's track: how much the light of what does not move flickers.
    ///
    /// The path tracer's images are kept in the folder.
    #[command(mut_arg("scene", |scene| scene.default_value("demo:cornell")))]
    #[command(mut_arg("size", |size| size.default_value("480x270")))]
    Photons(Box<OneBounceArgs>),
    /// Indirect light while the camera walks and after a light changes, with `--history on` and off.
    ///
    /// Along a shot's track: how far the last frame is from the path tracer's image, and how much the light of what does not move
    /// flickers. Then a light goes out: how far the frames after that are from the image without it.
    ///
    /// The path tracer's images are kept in the folder.
    #[command(mut_arg("scene", |scene| scene.default_value("demo:cornell")))]
    #[command(mut_arg("size", |size| size.default_value("480x270")))]
    History(Box<OneBounceArgs>),
    /// The measurements of Van Gelderen 2020, ch. 6: shapes and sizes of clusters, numbers of lights, one view and two eyes.
    ///
    /// Counts and times of every step, histograms of lights and fragments per cluster, and the ratios that clustered shading
    /// stands for, as Markdown, JSON and plots. Exits with an
    /// error when configurations that must show the same image do not.
    #[command(mut_arg("runs", |runs| runs.default_value("1")))]
    Clustered(Box<clustered::ClusteredArgs>),
    /// Bringing what has moved to the device, beside uploading it afresh, and rays through the tree that was refit.
    Moving(moving::MovingArgs),
    /// The attenuation functions as curves: Van Gelderen 2020, fig. A.1.
    Attenuation(attenuation::AttenuationArgs),
    /// Every technique on a fixed list of shots, against a path tracer.
    ///
    /// Writes FLIP, relMSE, energy, milliseconds and rays of each technique, with images, as Markdown, JSON and HTML. The path
    /// tracer's images are kept in the folder: the first run takes minutes.
    Quality(Box<quality::QualityArgs>),
    /// Prints this, or the help of a bench.
    Help(HelpArgs),
}

fn main() -> ExitCode {
    program::run(|cli: Cli, _| {
        cli.trust.obey();
        program::told(run(&cli.bench).map(|()| 0))
    })
}

fn run(bench: &Bench) -> Result<(), CliError> {
    match bench {
        Bench::ForwardPlus(args) => forward_plus::run(args),
        Bench::DeepImages(args) => deep_images::run(args),
        Bench::Indirect(args) => indirect::run(args),
        Bench::VirtualLights(args) => virtual_lights::run(args),
        Bench::Photons(args) => photons::run(args),
        Bench::History(args) => history::run(args),
        Bench::Clustered(args) => clustered::run(args),
        Bench::Moving(args) => moving::run(args),
        Bench::Attenuation(args) => attenuation::run(args),
        Bench::Quality(args) => quality::run(args),
        Bench::Help(args) => help::run::<Cli>(args),
    }
}
