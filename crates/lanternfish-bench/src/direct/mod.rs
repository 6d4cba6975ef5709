//! `lanternfish-bench direct`: direct light from a fixed number of shadow rays, compared with a ray to every light.

mod frames;
mod motion;
mod price;

use clap::Args;
use glam::Vec3;
use lanternfish::{
    GpuScene, RenderedImage, Renderer,
    settings::{Attenuation, Direct, Settings},
    techniques::{Denoise, LightChoice, LightRays, SampledLights},
};
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress};
use lanternfish_scene::{Camera, Scene, generate::light_rain};

use crate::{
    document::Document,
    run::{Run, RunArgs},
    subject::{Subject, SubjectArgs},
    table::Row,
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
    /// Frames of the mean, and of the walk.
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(4..=4096))]
    frames: u32,
    /// Measure only the table of this name: price, frame or motion. Repeatable.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// For the tables of frames and of motion: so many lights whose ranges do not end in place of the scene's own.
    #[arg(long, value_name = "N")]
    unlimited: Option<u32>,
    #[command(flatten)]
    subject: SubjectArgs,
}

/// Inputs of all tables.
struct Bench {
    run: Run,
    /// The scene without emission, which a ray to every light does not sample.
    scene: Scene,
    cameras: Vec<Camera>,
    look: Settings,
    size: Size,
    frames: u32,
}

/// One configuration of direct light.
struct Case {
    name: String,
    direct: Direct,
}

/// Measures and writes the report.
pub fn run(args: &DirectArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let Subject { mut scene, cameras, look } = Subject::load(&args.subject, true, &mut progress)?;
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    let run = Run::start(&args.run, "direct")?;
    let mut bench = Bench { run, scene, cameras, look, size: args.subject.size, frames: args.frames };
    if let Some(count) = args.unlimited {
        (bench.scene, bench.look) = bench.unlimited(count);
    }
    let mut report = Document::of_scene("Direct light", &args.subject.scene, &bench.run.gpu, args.run.runs);
    let Size { width, height } = bench.size;
    report.facts(Row::default().data("width", width).data("height", height).data("lights", bench.scene.lights.len()));
    let what = format!("{}, {width} × {height}, {} lights", args.subject.scene, bench.scene.lights.len());
    report.introduction(&what, &format!("least of {} runs", args.run.runs));
    let is_wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|only| only == name);
    if is_wanted("price") {
        let rows = bench.prices(&args.counts, args.all_up_to, &mut progress)?;
        report.section("Price by number of lights", price::TEXT, "prices", rows);
    }
    if is_wanted("frame") {
        let rows = bench.one_frame(&mut progress)?;
        report.section("One frame, and the mean of many", frames::TEXT, "frames", rows);
    }
    if is_wanted("motion") {
        let rows = bench.walks(&mut progress)?;
        report.section("In motion", motion::TEXT, "motion", rows);
    }
    report.write(&bench.run.folder)
}

/// `direct sampled` with these parameters.
fn sampled(rays: LightRays, denoise: Denoise) -> Direct {
    Direct::from(SampledLights { rays, denoise, choice: LightChoice::Tree })
}

/// The configurations of one frame and of motion: a ray to every light first.
fn cases() -> Vec<Case> {
    let mut cases = vec![Case { name: "all".to_owned(), direct: Direct::NONE }];
    let sampled_cases = LightRays::ALL.iter().map(|rays| (*rays, Denoise::On)).chain([(LightRays::Four, Denoise::Off)]);
    for (rays, denoise) in sampled_cases {
        let name = format!("sampled, {rays} rays, denoise {denoise}");
        cases.push(Case { name, direct: sampled(rays, denoise) });
    }
    let uniform = SampledLights { choice: LightChoice::Uniform, ..SampledLights::default() };
    cases.push(Case { name: "uniform, 4 rays, denoise on".to_owned(), direct: uniform.into() });
    cases
}

impl Bench {
    fn pixels(&self) -> f64 {
        f64::from(self.size.width) * f64::from(self.size.height)
    }

    fn renderer(&self, settings: Settings) -> Result<Renderer, CliError> {
        Ok(Renderer::with_engine(&self.run.engine, settings)?)
    }

    fn frame(&self, renderer: &mut Renderer, scene: &GpuScene, camera: &Camera) -> Result<RenderedImage, CliError> {
        Ok(renderer.render(scene, camera, self.size.width, self.size.height)?)
    }

    /// The scene with `count` lights in place of its own, whose ranges do not end, and the settings for them. All together are as bright at
    /// any number.
    fn unlimited(&self, count: u32) -> (Scene, Settings) {
        let mut lights = light_rain(&self.scene.bounds(), count, Some(1.0), 0, 0.0);
        let size = self.scene.bounds().size();
        let intensity = 0.25 * size.length_squared() / count.max(1) as f32;
        for light in &mut lights {
            light.range = None;
            light.intensity *= intensity / light.intensity.max_element().max(1e-6);
        }
        let settings = self.look.clone().with_attenuation(Attenuation::Physical);
        (Scene { lights, ..self.scene.clone() }, settings)
    }
}
