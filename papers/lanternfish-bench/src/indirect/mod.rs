//! `lanternfish-bench indirect`: speed and errors of indirect light with rays through deep images, compared with the BVH
//! [Niessner2010, §7].

mod cases;
mod errors;
mod figures;
mod gaussian;
mod measure;
mod page;
mod soft_shadows;
mod times;

use clap::Args;
use lanternfish_cli::error::CliError;

use self::{
    cases::{Brdf, Plan, RayCase},
    measure::RayBench,
};
use crate::{
    bench::{Bench, RunArgs},
    view::{SubjectArgs, View},
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
    let title = "Indirect light by rays";
    let bench = Bench::start(&args.run, "indirect", title, Some(&args.subject.scene))?.with_timestamps()?;
    let (view, _) = View::load(&args.subject, false, &bench)?;
    let upload =
        |brdf: &Brdf| Ok(bench.upload(&brdf.scene(&view.scene), &RayCase::plain(*brdf).settings(&view.look, None))?);
    let scenes =
        bench.step("upload", "Uploading", || Brdf::ALL.iter().map(upload).collect::<Result<Vec<_>, CliError>>())?;
    let converged_frames = if args.quick { 8 } else { 32 };
    bench.facts(view.facts().data("converged_frames", converged_frames));
    bench.report().introduction(&view.text(), &format!("least of {} runs", bench.runs));
    let of = RayBench { bench, view, converged_frames, scenes };
    let measured = of.measure(&Plan::new(args.quick, &args.resolutions))?;
    page::report(&mut of.bench.report(), measured, converged_frames);
    of.bench.list_left_out();
    of.bench.finish()
}
