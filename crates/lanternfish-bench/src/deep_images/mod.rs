//! `lanternfish-bench deep-images`: building and tracing deep images, beside other builders and exact rays, with the error of
//! every figure [Archer2019, table 2; Niessner2010, table 1].

pub(super) mod build;
pub(super) mod configurations;
mod markdown;
mod rays;
mod trace;

use std::path::PathBuf;

use clap::Args;
use lanternfish::{
    GpuScene, Renderer,
    deep_images::{DeepImages, Holes},
    settings::{DeepBuilder, DeepImageSettings, Settings, Shadows},
};
use lanternfish_gpu::{AdapterChoice, Gpu, Profiler};
use lanternfish_reference::Tracer;
use lanternfish_scene::Scene;
use serde::Serialize;

use self::{
    build::{Built, build},
    configurations::{Group, TABLES, fitted, groups, in_words},
    trace::Traced,
};
use super::{make_folder, open};
use lanternfish_cli::{
    args::{PartArgs, adapter},
    error::CliError,
    output::{print, write_text},
    progress::Progress,
    scene::{self, SceneName},
    shot,
};

#[derive(Debug, Args)]
pub struct DeepImagesArgs {
    /// A shot (.toml), of which only the scene counts; a glTF or OBJ file, or demo:NAME.
    #[arg(default_value = "demo:atrium")]
    pub scene: SceneName,
    /// The folder for report.md and report.json. It is made if it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "bench-deep-images")]
    pub output: PathBuf,
    /// How often everything is timed, after one run that is not; the least counts. What takes ten seconds is run once.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Rays of each kind.
    #[arg(long, value_name = "N", default_value_t = 1 << 19, value_parser = clap::value_parser!(u32).range(1024..=1 << 22))]
    pub rays: u32,
    /// Few directions and coarse images only.
    #[arg(long)]
    pub quick: bool,
    /// The tables that are made. Builders that draw the scene for each image or each layer take minutes in a large scene.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = TABLES, default_values = TABLES)]
    pub tables: Vec<String>,
    /// Where to run: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    #[command(flatten)]
    pub part: PartArgs,
}

/// A configuration without figures.
#[derive(Debug, Serialize)]
pub struct LeftOut {
    pub what: String,
    pub reason: String,
}

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Report {
    version: &'static str,
    scene: SceneName,
    adapter: String,
    driver: String,
    triangles: usize,
    runs: u32,
    built: Vec<Built>,
    traced: Vec<Traced>,
    left_out: Vec<LeftOut>,
}

/// What every configuration shares.
struct Bench {
    gpu: Gpu,
    profiler: Profiler,
    /// For the builders, which draw the BVH's triangles, and for the BVH.
    uploaded: GpuScene,
    /// For rays through the adapter's own structure, where it has one.
    with_ray_query: Option<GpuScene>,
    runs: u32,
}

pub fn run(args: &DeepImagesArgs) -> Result<(), CliError> {
    make_folder(&args.output)?;
    let shot = shot::is_shot(&args.scene).then(|| shot::read(args.scene.path(), Vec::new())).transpose()?;
    let (source, part) = match &shot {
        Some(shot) => (&shot.args.scene, &shot.args.part),
        None => (&args.scene, &args.part),
    };
    let mut progress = Progress::start(false);
    let doing = format!("Loading {source}");
    let mut scene = progress.step("load", &doing, || scene::load_part(source, part.scene_of_file.as_deref()))?;
    leave_out_blended(&mut scene);
    if scene.bounds().is_empty() {
        return Err(CliError::new(format_args!("{source}: no opaque surface"), "name a scene that has some"));
    }
    let gpu = open(args.adapter.as_ref())?;
    if !gpu.description.timestamps {
        let name = &gpu.description.name;
        return Err(CliError::new(
            format_args!("{name} cannot time its passes"),
            "choose another adapter with --adapter",
        ));
    }
    let exact = Tracer::new(&scene, lanternfish_reference::Settings::default())
        .map_err(|error| CliError::new(error, "choose another scene"))?;
    let mut bench = progress.step("upload", "Uploading", || Bench::new(gpu, &scene, args.runs))?;
    let report = bench.measure(args, &scene, &exact, &mut progress)?;
    progress.finish();

    let json = serde_json::to_string_pretty(&report).expect("plain numbers and strings");
    write_text(&args.output.join("report.json"), &(json + "\n"))?;
    let page = markdown::to_markdown(&report);
    let file = args.output.join("report.md");
    write_text(&file, &page)?;
    let text = format!("{page}\n{}\n", file.display());
    print(&text)
}

impl Bench {
    fn new(gpu: Gpu, scene: &Scene, runs: u32) -> Result<Self, CliError> {
        let upload = |shadows| {
            let settings = Settings { shadows, ..Settings::direct_light() };
            Renderer::new(&gpu.device, &gpu.queue, settings)?.upload(scene)
        };
        let uploaded = upload(Shadows::BVH)?;
        let with_ray_query = gpu.description.ray_query.then(|| upload(Shadows::RAY_QUERY)).transpose()?;
        let profiler = Profiler::new(&gpu.device, &gpu.queue);
        Ok(Self { gpu, profiler, uploaded, with_ray_query, runs })
    }

    fn build(&mut self, group: &'static str, settings: DeepImageSettings) -> Result<(Built, DeepImages), CliError> {
        build(&self.gpu, &mut self.profiler, &self.uploaded, self.runs, group, settings)
    }

    /// What images of these settings miss of those of a draw for each direction.
    fn holes(&mut self, settings: DeepImageSettings, images: &DeepImages) -> Result<Holes, CliError> {
        let settings = DeepImageSettings { builder: DeepBuilder::PerDirection, ..settings };
        let (_, yardstick) = build(&self.gpu, &mut self.profiler, &self.uploaded, 0, "holes", settings)?;
        Ok(images.holes(&self.gpu.device, &self.gpu.queue, &self.uploaded, &yardstick)?)
    }

    fn measure(
        &mut self,
        args: &DeepImagesArgs,
        scene: &Scene,
        exact: &Tracer<'_>,
        progress: &mut Progress,
    ) -> Result<Report, CliError> {
        let (mut built, mut traced, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        let is_wanted = |group: &Group| args.tables.iter().any(|table| *table == group.title.to_lowercase());
        for group in groups(args.quick).into_iter().filter(is_wanted) {
            for wanted in &group.rows {
                let settings = fitted(*wanted, &built);
                let doing = doing(&settings);
                if settings.directions.count() < wanted.directions.count() {
                    let reason = format!("{} directions would take too much memory", wanted.directions.count());
                    left_out.push(LeftOut { what: doing.clone(), reason });
                }
                // Lists that do not fit the device, say: the others go on.
                let images = match progress.step("build", &doing, || self.build(group.title, settings)) {
                    Ok((mut figures, images)) => {
                        if group.with_holes && settings.builder != DeepBuilder::PerDirection {
                            let doing = format!("Holes, {doing}");
                            let holes = progress.step("holes", &doing, || self.holes(settings, &images));
                            match holes {
                                Ok(holes) => figures.holes = Some(holes.into()),
                                Err(error) => left_out.push(LeftOut { what: doing, reason: error.to_string() }),
                            }
                        }
                        built.push(figures);
                        images
                    }
                    Err(error) => {
                        left_out.push(LeftOut { what: doing, reason: error.to_string() });
                        continue;
                    }
                };
                let rays = progress.step("rays", "Exact rays", || {
                    Ok::<_, CliError>(rays::from_surfaces(scene, exact, &images, args.rays))
                })?;
                let tracing = format!("Tracing, {doing}");
                traced.extend(progress.step("trace", &tracing, || self.trace(&group, settings, &images, rays))?);
            }
        }
        if self.with_ray_query.is_none() {
            let reason = "this adapter has none".to_owned();
            left_out.push(LeftOut { what: "ray query".to_owned(), reason });
        }
        let description = &self.gpu.description;
        Ok(Report {
            version: env!("CARGO_PKG_VERSION"),
            scene: args.scene.clone(),
            adapter: description.name.clone(),
            driver: description.driver.clone(),
            triangles: exact.triangle_count(),
            runs: args.runs,
            built,
            traced,
            left_out,
        })
    }
}

/// Neither deep images nor the BVH have them, but exact rays would meet them.
pub(super) fn leave_out_blended(scene: &mut Scene) {
    for mesh in &mut scene.meshes {
        mesh.primitives.retain(|primitive| !scene.materials[primitive.material].is_blended());
    }
}

/// What is being measured.
fn doing(settings: &DeepImageSettings) -> String {
    format!("{}, {} x {}²", in_words(settings), settings.directions.count(), settings.resolution)
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::{AlphaMode, Material, Mesh, Primitive};

    use super::*;

    #[test]
    fn blended_surfaces_are_left_out() {
        let modes = [AlphaMode::Blend, AlphaMode::Opaque, AlphaMode::Mask { cutoff: 0.5 }];
        let materials = modes.map(|alpha_mode| Material { alpha_mode, ..Material::default() }).to_vec();
        let primitives = (0..3).map(|material| Primitive { material, ..Primitive::default() }).collect();
        let mut scene = Scene { materials, meshes: vec![Mesh { primitives, ..Mesh::default() }], ..Scene::default() };
        leave_out_blended(&mut scene);
        let left: Vec<usize> = scene.meshes[0].primitives.iter().map(|primitive| primitive.material).collect();
        assert_eq!(left, [1, 2]);
    }
}
