//! `lanternfish-bench indirect`: rays of indirect light through deep images, beside the BVH, with what they cost in quality
//! [Niessner2010, §7].

mod cached;
mod configurations;
mod errors;
mod markdown;
mod measure;
mod paper;
mod times;

use std::path::PathBuf;

use clap::Args;
use lanternfish::Renderer;
use lanternfish_gpu::AdapterChoice;
use serde::Serialize;

use self::{
    cached::CachedRow,
    configurations::{Brdf, Configuration, Plan},
    measure::{Bench, Measured, Row},
};
use super::{
    deep_images::{LeftOut, build::Built},
    make_folder, open_timed,
    subject::{Source, Subject},
};
use lanternfish_cli::{
    args::{LightArgs, PartArgs, ViewArgs, adapter},
    error::CliError,
    output::{print, write_text},
    parse::{self, Size},
    progress::Progress,
    scene::SceneName,
};

#[derive(Debug, Args)]
pub struct IndirectArgs {
    /// A shot (.toml), which then says the view, the lights and the look; a glTF or OBJ file, or demo:NAME.
    #[arg(default_value = "demo:atrium")]
    pub scene: SceneName,
    /// The folder for report.md, report.json and a picture of each BRDF. It is made if it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "bench-indirect")]
    pub output: PathBuf,
    /// Width and height of every picture, pixels.
    #[arg(long, value_name = "WxH", default_value = "640x360", value_parser = parse::size)]
    pub size: Size,
    /// How often everything is timed, after one run that is not; the least counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Texels across and down an image; several between commas, ascending. Filter and antialiasing are measured with the first.
    /// Without: 128,512, or 16,32 with --quick.
    #[arg(long = "resolution", value_name = "TEXELS", value_delimiter = ',')]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub resolutions: Vec<u32>,
    /// Few directions, coarse images, and filter and antialiasing of diffuse light only.
    #[arg(long)]
    pub quick: bool,
    /// Where to run: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Where the rain of --lights falls.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
    #[command(flatten, next_help_heading = "Lights (beside those of the file)")]
    pub lights: LightArgs,
}

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Report {
    version: &'static str,
    scene: SceneName,
    adapter: String,
    driver: String,
    triangles: usize,
    width: u32,
    height: u32,
    runs: u32,
    /// Frames of the pictures that errors of many frames are against.
    converged_frames: u32,
    images: Vec<Built>,
    rows: Vec<Row>,
    cached: Vec<CachedRow>,
    left_out: Vec<LeftOut>,
}

pub fn run(args: &IndirectArgs) -> Result<(), CliError> {
    make_folder(&args.output)?;
    let mut progress = Progress::start(false);
    let (view, lights) = (&args.view, &args.lights);
    let source = Source { scene: &args.scene, part: &args.part, view, lights, seed: args.seed, size: args.size };
    let Subject { scene, mut cameras, look } = Subject::load(&source, &mut progress)?;
    let camera = cameras.swap_remove(0);
    let gpu = open_timed(args.adapter.as_ref())?;
    let upload = |brdf: &Brdf| {
        let settings = Configuration::plain(*brdf).settings(&look, None);
        Renderer::new(&gpu.device, &gpu.queue, settings)?.upload(&brdf.scene(&scene))
    };
    let scenes =
        progress.step("upload", "Uploading", || Brdf::ALL.iter().map(upload).collect::<Result<Vec<_>, _>>())?;
    let converged_frames = if args.quick { 8 } else { 32 };
    let bench = Bench {
        gpu: &gpu,
        folder: &args.output,
        camera: &camera,
        size: args.size,
        runs: args.runs,
        look: &look,
        converged_frames,
        scenes,
    };
    let Measured { images, rows, cached, left_out } =
        bench.measure(&Plan::new(args.quick, &args.resolutions), &mut progress)?;
    progress.finish();

    let Size { width, height } = args.size;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.clone(),
        adapter: gpu.description.name.clone(),
        driver: gpu.description.driver.clone(),
        triangles: scene.triangle_counts().1,
        width,
        height,
        runs: args.runs,
        converged_frames,
        images,
        rows,
        cached,
        left_out,
    };
    let json = serde_json::to_string_pretty(&report).expect("plain numbers and strings");
    write_text(&args.output.join("report.json"), &(json + "\n"))?;
    let page = markdown::to_markdown(&report);
    let file = args.output.join("report.md");
    write_text(&file, &page)?;
    let text = format!("{page}\n{}\n", file.display());
    print(&text)
}
