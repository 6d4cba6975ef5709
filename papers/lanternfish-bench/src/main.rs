//! `lanternfish-bench`: the measurements of the papers that Lanternfish implements, and the quality of every technique.
//!
//! One harness serves every benchmark: [`mod@bench`] opens the adapter, renders and times frames, and writes the
//! report; [`view`] loads what is rendered; [`case`] names configurations by flags; [`mod@reference`] has errors
//! against the path tracer; [`table`] and [`document`] make tables and pages. What the papers claim is declared in
//! `papers/claims`.

mod attenuation;
mod bench;
mod case;
mod clustered;
mod deep_images;
mod forward_plus;
mod ground_truths;
mod indirect;
mod one_bounce;
mod papers;
mod photons;
mod quality;
mod reference;
mod stage;
mod stored;
#[cfg(test)]
mod testing;
mod view;
mod virtual_lights;
mod walks;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use lanternfish_cli::{
    args::TrustArgs,
    document,
    error::CliError,
    help::{self, HelpArgs},
    program, table,
};

use self::one_bounce::OneBounceArgs;

const AFTER_HELP: &str = "\
Examples:
  lanternfish-bench forward-plus demo:atrium --lights rain:10
  lanternfish-bench clustered docs/tracks/bistro.toml --runs 5 -o figures
  lanternfish-bench quality --only cornell
  lanternfish-bench papers --quick -o papers

Each benchmark writes report.md, report.html and report.json into a folder, and prints report.md. Counts and errors are exact; compare
times of the same machine only. `lanternfish-bench help BENCH` describes a benchmark; with --all it lists every flag.";

/// Repeats the measurements of the papers that Lanternfish implements, and measures the quality of every technique.
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
    /// Renders one view with every configuration of the thesis and additional ones. Exits with an error if images that
    /// must be identical differ.
    #[command(mut_arg("runs", |runs| runs.default_value("5")))]
    #[command(mut_arg("size", |size| size.default_value("1280x720")))]
    ForwardPlus(Box<forward_plus::ForwardPlusArgs>),
    /// Building and tracing deep images, compared with the BVH: Archer 2019, table 2, and Niessner 2010, table 1.
    ///
    /// Directions are those of the default set, of equal areas; Archer's are stacks and slices. Every speed stands
    /// beside its error, and beside the texels that a ray crosses and the fragments that it is compared with. The table
    /// "crossings" has Niessner's explanation of speed: numbers of images, of triangles, and a corridor beside an empty
    /// box.
    DeepImages(Box<deep_images::DeepImagesArgs>),
    /// Indirect light with rays through deep images, compared with the BVH: Niessner 2010, §7.
    ///
    /// One view, its surfaces diffuse (8 rays a pixel), glossy (16) and mirrors (1), with rays through images of 96,
    /// 150 and 384 directions, of 128² and 512² texels, within a texel and across texels, and through the BVH; then
    /// with a filter as wide as his (11 x 11) and with none, with four samples at edges, and as the mean of four
    /// frames. Soft shadows by 16 rays to each light through 384 directions, as they are and through his Gaussian. The
    /// images of his figs 5, 7 and 8, and the frames a second of his figs 1, 4, 7 and 9 beside those of this scene,
    /// which stands in for his.
    ///
    /// Each row has the device times of tracing, shading, resolving, filtering and the complete frame, ms; rays per
    /// second, for tracing alone and with shading of hits; and errors: energy and mean FLIP against the same rays
    /// through the BVH, and FLIP against the mean of many frames. Each set of images has its build time and its memory.
    Indirect(Box<indirect::IndirectArgs>),
    /// Virtual point lights with ranges: Archer 2019, tables 1 and 3 and fig. 7; Van Gelderen 2020, app. B.
    ///
    /// Renders one view with every kind of virtual lights, and with rays from every pixel. Each row has device times by
    /// the paper's steps, ms, the number of lights, and errors against the path tracer: energy of indirect light alone,
    /// and FLIP. Rays that compute ranges are timed by structure and number, and compared with random ranges.
    ///
    /// The path tracer's images are stored in the folder and reused.
    #[command(mut_arg("scene", |scene| scene.default_value("demo:cornell")))]
    #[command(mut_arg("size", |size| size.default_value("480x270")))]
    VirtualLights(Box<OneBounceArgs>),
    /// Photon differentials, split and splatted: Aalund 2015, figs 8 to 10.
    ///
    /// Renders one view with photons of every kind, with rays from every pixel and with virtual lights. Each row has
    /// device times of tracing and splatting, ms, photons per second, the number of splatted photons, and errors
    /// against the path tracer: energy of indirect light alone, and FLIP; also for means of 1, 16 and 64 frames.
    ///
    /// Figs 8 and 9 alone: `--only occlusion`; fig. 10: `--only "as in the paper"`. For his hairball stands the foliage
    /// of `docs/shots/deep-images-bistro.toml --lights rain:10`.
    ///
    /// The path tracer's images are kept in the folder.
    #[command(mut_arg("scene", |scene| scene.default_value("demo:cornell")))]
    #[command(mut_arg("size", |size| size.default_value("480x270")))]
    Photons(Box<OneBounceArgs>),
    /// The measurements of Van Gelderen 2020, ch. 6: shapes and sizes of clusters, numbers of lights, mono and stereo.
    ///
    /// Writes counts and times of every step, histograms of lights and fragments per cluster, and the ratios expected
    /// of clustered shading, as Markdown, JSON and plots. Exits with an error if images that must be identical differ.
    #[command(mut_arg("runs", |runs| runs.default_value("1")))]
    Clustered(Box<clustered::ClusteredArgs>),
    /// The attenuation functions as curves: Van Gelderen 2020, fig. A.1.
    Attenuation(attenuation::AttenuationArgs),
    /// Every technique on a fixed list of shots, compared with a path tracer.
    ///
    /// Writes FLIP, relMSE, energy, time in ms and number of rays of each technique, with images, as Markdown, JSON and
    /// HTML. The path tracer's images are stored in the folder and reused: the first run takes minutes.
    Quality(Box<quality::QualityArgs>),
    /// One page of all five papers: every table and every figure with numbers beside ours, and a verdict on each claim.
    ///
    /// Runs the other benches, each as a process of its own, and writes papers.html, papers.json and papers.md. A bench
    /// that fails is listed with its reason, and the rest goes on.
    Papers(papers::PapersArgs),
    /// A walk in real time with every technique that a window may use: what a frame costs, pass by pass, and how it
    /// follows a lamp.
    ///
    /// Frames are recorded as a program with a window records them, one after the other. Each walk has the time of its
    /// passes and of the host, the idle time between them, dispatches, rays and memory. The first walk is repeated at
    /// the end: the page says if the machine was not steady. Then a lamp behind a wall goes out and on again, in a room
    /// of its own: frames until the image has followed. Files are written after each walk.
    Walks(walks::WalksArgs),
    /// Prints the page of a stored report: a report.json, or a file of docs/measured.
    Page(stored::PageArgs),
    /// Prints this, or the help of a bench.
    Help(HelpArgs),
}

fn main() -> ExitCode {
    lanternfish_papers::register();
    ExitCode::from(program::run(|cli: Cli, _| {
        cli.trust.obey();
        program::told(run(&cli.bench).map(|()| 0))
    }))
}

fn run(bench: &Bench) -> Result<(), CliError> {
    match bench {
        Bench::ForwardPlus(args) => forward_plus::run(args),
        Bench::DeepImages(args) => deep_images::run(args),
        Bench::Indirect(args) => indirect::run(args),
        Bench::VirtualLights(args) => virtual_lights::run(args),
        Bench::Photons(args) => photons::run(args),
        Bench::Clustered(args) => clustered::run(args),
        Bench::Attenuation(args) => attenuation::run(args),
        Bench::Quality(args) => quality::run(args),
        Bench::Papers(args) => papers::run(args),
        Bench::Walks(args) => walks::run(args),
        Bench::Page(args) => stored::run(args),
        Bench::Help(args) => help::run::<Cli>(args),
    }
}
