//! `lanternfish-bench deep-images`: times and errors of building and tracing deep images, compared with other builders
//! and exact rays [Archer2019, table 2; Niessner2010, table 1].

pub mod build;
pub mod cases;
mod crossings;
mod layers;
mod rays;
mod trace;

use std::rc::Rc;

use clap::Args;
use lanternfish::{
    GpuScene,
    rays::RayTracer,
    settings::{Settings, Shadows},
};
use lanternfish_cli::{args::PartArgs, error::CliError, report::grouped, scene::SceneName};
use lanternfish_gpu::Profiler;
use lanternfish_papers::{
    DeepBuilder, DeepImageSettings,
    deep_images::{DeepImages, Holes},
};
use lanternfish_reference::Tracer as Exact;
use lanternfish_scene::Scene;

use self::{
    build::build,
    cases::{Group, TABLES, fitted, groups, in_words},
};
use crate::{
    bench::{Bench, RunArgs},
    papers::{self, Paper},
    table::{Row, percent},
    view,
};

/// Flags of `deep-images`.
#[derive(Debug, Args)]
pub struct DeepImagesArgs {
    /// A shot (.toml), of which only the scene is used; a glTF or OBJ file, or demo:NAME.
    #[arg(default_value = "demo:atrium")]
    scene: SceneName,
    #[command(flatten)]
    run: RunArgs,
    /// Number of rays per measurement.
    #[arg(long, value_name = "N", default_value_t = 1 << 19, value_parser = clap::value_parser!(u32).range(1024..=1 << 22))]
    rays: u32,
    /// Measure few directions and coarse images only.
    #[arg(long)]
    quick: bool,
    /// Tables to measure. Builders that draw the scene for each image or each layer take minutes in a large scene.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = TABLES, default_values = TABLES)]
    tables: Vec<String>,
    #[command(flatten)]
    part: PartArgs,
}

/// Inputs and results of all configurations.
struct DeepBench {
    bench: Rc<Bench>,
    profiler: Profiler,
    tracer: RayTracer,
    /// For the builders, which draw the BVH's triangles, and for the BVH.
    uploaded: Rc<GpuScene>,
    /// Scene with the adapter's acceleration structure, for ray queries. `None` if the adapter has no ray query.
    with_ray_query: Option<Rc<GpuScene>>,
    built: Vec<Row>,
    traced: Vec<Row>,
    holes: Vec<Row>,
    /// Images that were drawn for each direction, with which the last ones were compared.
    baseline: Option<(DeepImageSettings, DeepImages)>,
}

/// Exact rays through a scene.
fn exact(scene: &Scene) -> Result<Exact<'_>, CliError> {
    Exact::new(scene, lanternfish_reference::Settings::default())
        .map_err(|error| CliError::new(error, "choose another scene"))
}

/// Measures and writes the report.
pub fn run(args: &DeepImagesArgs) -> Result<(), CliError> {
    let bench = Bench::start(&args.run, "deep-images", "Deep images", Some(&args.scene))?.with_timestamps()?;
    let shot = view::shot_of(&args.scene)?;
    let scene = view::load(&args.scene, &args.part, shot.as_ref(), false, &bench)?;
    let exact = exact(&scene)?;
    let mut of = DeepBench::new(bench, &scene)?;
    let is_wanted = |name: &str| args.tables.iter().any(|table| table == name);
    for group in groups(args.quick).into_iter().filter(|group| is_wanted(&group.title.to_lowercase())) {
        for settings in &group.rows {
            if !of.built.is_empty() && !of.bench.has_time(group.title) {
                continue;
            }
            of.case(&group, *settings, (&scene, &exact, args.rays))?;
        }
    }
    let crossings = match is_wanted(crossings::TABLE) && (of.built.is_empty() || of.bench.has_time(crossings::TABLE)) {
        true => of.crossings(&scene, args.quick, args.rays)?,
        false => Vec::new(),
    };
    let DeepBench { bench, built, traced, holes, with_ray_query, .. } = of;
    if with_ray_query.is_none() {
        bench.leave_out("ray query", "not supported by this adapter");
    }
    let triangles = exact.triangle_count();
    bench.facts(Row::default().data("triangles", triangles));
    let mut report = bench.report();
    let times = format!("least of {} runs (of the first one if it takes more than 4 s)", args.run.runs);
    report.introduction(&format!("{} triangles", grouped(triangles as u64)), &times);
    report.paragraph(
        "*As in Archer 2019*: one draw, stacks and slices, 64² texels, arrays sorted in blocks, nothing merged, linear steps; his milliseconds \
         are of a GeForce GTX 1060 [Archer 2019, table 2 and §4].",
    );
    report.paragraph(layers::TEXT);
    for group in built.chunk_by(|a, b| a.get("group") == b.get("group")) {
        report.heading(&format!("Building: {}", group[0].words_of("group").to_lowercase()));
        report.show(group.iter().cloned());
    }
    let text = "Missing and spurious surfaces, compared with the `per_direction` builder: fragments without a counterpart within one texel of \
                depth in the list of the same texel. Missing ones are grouped by the cosine between the surface normal and the image's axis.";
    report.section_shown("Holes", text, holes);
    report.section("Crossings of texels' borders", crossings::TEXT, crossings::TABLE, crossings);
    if !traced.is_empty() {
        report.heading("Tracing");
        report.paragraph(
            "Rays from surfaces in all directions, with the texels and fragments that each reads to its first hit (crossings; an exact tracer has \
             none); the error is that of the distance to the first hit, relative to an exact ray along the ray's \
             own direction (images have their own).",
        );
    }
    for group in traced.chunk_by(|a, b| a.get("group") == b.get("group")) {
        report.subheading(group[0].words_of("group"));
        report.show(group.iter().cloned());
    }
    report.keep("built", built);
    report.keep("traced", traced);
    papers::beside(Paper::Archer, "deep-images", &mut report);
    drop(report);
    bench.list_left_out();
    Rc::into_inner(bench).map_or(Ok(()), Bench::finish)
}

impl DeepBench {
    fn new(bench: Bench, scene: &Scene) -> Result<Self, CliError> {
        let upload = |shadows| {
            let settings = Settings::direct_light().with_shadows(shadows);
            Ok::<_, CliError>(Rc::new(bench.upload(scene, &settings)?))
        };
        let uploaded = bench.step("upload", "Uploading", || upload(Shadows::BVH))?;
        let has_ray_query = bench.gpu.description.ray_query;
        let with_ray_query = has_ray_query.then(|| upload(Shadows::RAY_QUERY)).transpose()?;
        let profiler = Profiler::new(&bench.gpu.device, &bench.gpu.queue);
        let tracer = RayTracer::new(&bench.gpu.device)?;
        let (built, traced, holes, baseline) = Default::default();
        Ok(Self { bench: Rc::new(bench), profiler, tracer, uploaded, with_ray_query, built, traced, holes, baseline })
    }

    /// Builds images with as many directions as fit, counts holes, and traces rays. Records what the adapter cannot
    /// build as left out.
    fn case(
        &mut self,
        group: &Group,
        wanted: DeepImageSettings,
        (scene, exact, rays): (&Scene, &Exact<'_>, u32),
    ) -> Result<(), CliError> {
        let bench = Rc::clone(&self.bench);
        let settings = fitted(wanted, &self.built);
        let doing = format!("{}, {} x {}²", in_words(&settings), settings.directions.count(), settings.resolution);
        if settings.directions.count() < wanted.directions.count() {
            bench
                .leave_out(&doing, format_args!("{} directions would take too much memory", wanted.directions.count()));
        }
        // For example, lists that exceed the device's limits: continue with the next configuration.
        let (mut row, images) = match bench.step("build", &doing, || self.build(bench.runs, group.title, settings)) {
            Ok(made) => made,
            Err(error) => {
                bench.leave_out(&doing, error);
                return Ok(());
            }
        };
        if self.built.is_empty() {
            let (size, rgb) = layers::sheet(&bench.gpu, &images)?;
            bench.write_rgb("layers", size, &rgb)?;
        }
        let mut counted = None;
        if group.with_holes && settings.builder != DeepBuilder::PerDirection {
            let doing = format!("Holes, {doing}");
            match bench.step("holes", &doing, || self.holes(settings, &images)) {
                Ok(holes) => counted = Some(holes),
                Err(error) => bench.leave_out(&doing, error),
            }
        }
        let holes = counted.map(|holes| holes_row(&row, &holes));
        row = row.data("holes", &holes);
        self.holes.extend(holes);
        self.built.push(row);
        let surfaces = || Ok::<_, CliError>(rays::from_surfaces(scene, exact, &images, rays));
        let rays = bench.step("rays", "Exact rays", surfaces)?;
        let tracing = format!("Tracing, {doing}");
        let traced = bench.step("trace", &tracing, || self.trace(group, settings, &images, rays))?;
        self.traced.extend(traced);
        Ok(())
    }

    fn build(
        &mut self,
        runs: u32,
        group: &'static str,
        settings: DeepImageSettings,
    ) -> Result<(Row, DeepImages), CliError> {
        build(&self.bench, &mut self.profiler, &self.uploaded, runs, group, settings)
    }

    /// Compares images with those of the builder that draws each direction.
    fn holes(&mut self, settings: DeepImageSettings, images: &DeepImages) -> Result<Holes, CliError> {
        let settings = DeepImageSettings { builder: DeepBuilder::PerDirection, ..settings };
        let (known, baseline) = match self.baseline.take().filter(|(known, _)| *known == settings) {
            Some(baseline) => baseline,
            None => (settings, self.build(0, "holes", settings)?.1),
        };
        let gpu = &self.bench.gpu;
        let holes = images.holes(&gpu.device, &gpu.queue, &self.uploaded, &baseline);
        self.baseline = Some((known, baseline));
        Ok(holes?)
    }
}

fn holes_row(built: &Row, holes: &Holes) -> Row {
    let row = Row::default()
        .shown("images", built.words("images"))
        .shown("directions", built.words("directions"))
        .shown("texels", built.words("resolution"))
        .fixed("fragments", "fragments, ratio to per_direction", 3, holes.fragments)
        .percent("missing", "missing", 3, holes.missing)
        .data("missing_by_cosine", holes.missing_by_cosine);
    let classes = ["to 1/4", "to 1/2", "to 3/4", "to 1"].into_iter().zip(holes.missing_by_cosine);
    let row = classes.fold(row, |row, (class, missing)| row.shown(class, percent(3, missing)));
    row.percent("spurious", "spurious", 3, holes.spurious)
}
