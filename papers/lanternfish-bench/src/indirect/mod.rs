//! `lanternfish-bench indirect`: speed and errors of indirect light with rays through deep images, compared with the BVH
//! [Niessner2010, §7].

mod cached;
mod cases;
mod errors;
mod figures;
mod gaussian;
mod measure;
mod page;
mod paper;
mod soft_shadows;
mod times;

use clap::Args;
use lanternfish::Renderer;
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress, report::grouped};

use self::{
    cases::{Brdf, Case, Plan},
    measure::Bench,
};
use crate::{
    document::Document,
    run::{Run, RunArgs},
    subject::{Subject, SubjectArgs},
    table::Row,
};

/// Flags of `indirect`.
#[derive(Debug, Args)]
pub struct IndirectArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Width and height of a deep image, texels; several separated by commas, ascending. Filter and antialiasing are measured with the
    /// first. Default: 128,512, or 16,32 with --quick.
    #[arg(long = "resolution", value_name = "TEXELS", value_delimiter = ',')]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096))]
    resolutions: Vec<u32>,
    /// Few directions and coarse images; filter and frames through the BVH and of diffuse light only; no antialiasing.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    subject: SubjectArgs,
}

/// Measures and writes the report.
pub fn run(args: &IndirectArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let Subject { scene, mut cameras, look } = Subject::load(&args.subject, false, &mut progress)?;
    let camera = cameras.swap_remove(0);
    let run = Run::start_timed(&args.run, "indirect")?;
    let upload = |brdf: &Brdf| {
        let settings = Case::plain(*brdf).settings(&look, None);
        Renderer::with_engine(&run.engine, settings)?.upload(&brdf.scene(&scene))
    };
    let scenes =
        progress.step("upload", "Uploading", || Brdf::ALL.iter().map(upload).collect::<Result<Vec<_>, _>>())?;
    let converged_frames = if args.quick { 8 } else { 32 };
    let size = args.subject.size;
    let bench = Bench { run: &run, camera: &camera, size, source: &scene, look: &look, converged_frames, scenes };
    let measured = bench.measure(&Plan::new(args.quick, &args.resolutions), &mut progress)?;
    progress.finish();

    let (Size { width, height }, name, triangles) = (size, &args.subject.scene, scene.triangle_counts().1);
    let mut report = Document::of_scene("Indirect light by rays", name, &run.gpu, run.runs);
    let facts = Row::default().data("triangles", triangles).data("width", width).data("height", height);
    report.facts(facts.data("converged_frames", converged_frames));
    let what = format!("{width} x {height} pixels, {} triangles", grouped(triangles as u64));
    report.introduction(&what, &format!("least of {} runs", run.runs));
    page::report(&mut report, measured, converged_frames);
    report.write(&run.folder)
}
