//! The tables of [Elagabani2025, ch. 5]: what each way to save shadow rays saves.

use std::{path::Path, time::Instant};

use lanternfish::{
    GpuScene, Picture, Renderer,
    settings::{Culling, DebugView, RayCulling, Settings, Shadows, TileSize, Tiled, ToneMap},
};
use lanternfish_gpu::Gpu;
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

use super::{
    ForwardPlusArgs, make_folder,
    markdown::to_markdown,
    normals::{self, NormalErrors},
    open,
};
use lanternfish_cli::{
    apply_lights,
    args::LightArgs,
    camera,
    error::CliError,
    light_rig, output,
    scene::{self, SceneName},
    shot::{self, Shot},
};

/// One way to render the view.
struct Configuration {
    name: &'static str,
    culling: Culling,
    ray_culling: RayCulling,
    /// Whether its picture must be that of the configuration without optimisations. Normals from depth are wrong at
    /// edges, and may lose light there.
    exact: bool,
    /// The heat map's file, if it gets one.
    heat_map: Option<&'static str>,
    /// Frame time in the thesis, ms.
    paper_ms: Option<f64>,
}

/// Figures of one configuration.
#[derive(Debug, Serialize)]
pub struct Row {
    pub name: &'static str,
    /// Sum of all passes, median over the runs, ms; time by the wall clock where the adapter has no timestamps.
    pub frame_ms: f64,
    /// Time of tracing shadow rays, median over the runs, ms.
    pub shadow_ms: f64,
    pub rays: u64,
    pub light_tests: u64,
    pub listed_lights: u64,
    /// Pixels whose radiance differs from the first row's in any bit.
    pub differing_pixels: usize,
    /// Whether `differing_pixels` must be 0.
    pub exact: bool,
    pub paper_ms: Option<f64>,
}

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Results {
    pub version: &'static str,
    pub scene: SceneName,
    pub adapter: String,
    pub driver: String,
    pub width: u32,
    pub height: u32,
    pub light_count: usize,
    pub range_threshold: f32,
    pub runs: u32,
    pub surface_pixels: usize,
    /// Rows of table 5.1.
    pub configurations: Vec<Row>,
    /// Rows of table 5.2: every optimisation on, by size of tiles.
    pub tile_sizes: Vec<Row>,
    /// Errors of normals from depth, as in fig. 5.3.
    pub normals: Vec<NormalErrors>,
}

fn tiled(tile_size: TileSize, aabb_test: bool) -> Culling {
    Culling::Tiled(Tiled { tile_size, aabb_test })
}

/// The rows of table 5.1, at tiles of 8 × 8, and ours.
fn configurations() -> Vec<Configuration> {
    let row = |name, culling, ray_culling, exact, heat_map, paper_ms| Configuration {
        name,
        culling,
        ray_culling,
        exact,
        heat_map,
        paper_ms,
    };
    let px8 = |aabb| tiled(TileSize::Px8, aabb);
    use RayCulling::{Improved, Naive, None as NoCulling, Surface};
    vec![
        row("no optimisations", Culling::All, NoCulling, true, Some("rays-none.png"), Some(16.0)),
        row("light culling", px8(false), NoCulling, true, Some("rays-culling.png"), Some(11.52)),
        row("light culling + AABB", px8(true), NoCulling, true, Some("rays-culling-aabb.png"), Some(10.93)),
        row("light culling + AABB + naive normals", px8(true), Naive, false, Some("rays-naive.png"), Some(9.59)),
        row(
            "light culling + AABB + improved normals",
            px8(true),
            Improved,
            false,
            Some("rays-improved.png"),
            Some(9.67),
        ),
        row("improved normals", Culling::All, Improved, false, None, Some(13.55)),
        row("light culling + AABB + surface normals", px8(true), Surface, true, Some("rays-surface.png"), None),
    ]
}

/// The rows of table 5.2.
fn tile_sizes() -> Vec<Configuration> {
    let paper = [("8 x 8", TileSize::Px8, 9.44), ("16 x 16", TileSize::Px16, 9.56), ("32 x 32", TileSize::Px32, 9.99)];
    let row = |(name, size, paper_ms)| Configuration {
        name,
        culling: tiled(size, true),
        ray_culling: RayCulling::Improved,
        exact: false,
        heat_map: None,
        paper_ms: Some(paper_ms),
    };
    paper.map(row).into()
}

/// What every run shares.
pub struct Bench<'a> {
    gpu: Gpu,
    scene: Scene,
    camera: Camera,
    lights: &'a LightArgs,
    args: &'a ForwardPlusArgs,
}

impl Bench<'_> {
    fn settings(&self, configuration: &Configuration) -> Settings {
        Settings {
            culling: configuration.culling,
            ray_culling: configuration.ray_culling,
            shadows: self.args.shadows,
            attenuation: self.lights.attenuation,
            range_threshold: self.lights.range_threshold,
            ..Settings::direct_light()
        }
    }

    fn renderer(&self, settings: Settings) -> Result<(Renderer, GpuScene), CliError> {
        let renderer = Renderer::new(&self.gpu.device, &self.gpu.queue, settings)?;
        let uploaded = renderer.upload(&self.scene)?;
        Ok((renderer, uploaded))
    }

    fn render(&self, (renderer, uploaded): &mut (Renderer, GpuScene)) -> Result<Picture, CliError> {
        Ok(renderer.render(uploaded, &self.camera, self.args.size.width, self.args.size.height)?)
    }

    /// A debug view of the frame.
    pub fn view(&self, view: DebugView, shadows: Shadows) -> Result<Picture, CliError> {
        let settings =
            Settings { debug_view: Some(view), shadows, tone_map: ToneMap::None, ..Settings::direct_light() };
        self.render(&mut self.renderer(settings)?)
    }

    /// Writes a picture of the report, 8 bits a channel, as PNG.
    pub fn write(&self, name: &str, width: u32, height: u32, rgb: &[u8]) -> Result<(), CliError> {
        Ok(write_png(&self.args.output.join(name), width, height, ColorType::Rgb, rgb)?)
    }

    /// Renders a configuration once to warm up and `runs` times for its figures.
    fn measure(&self, configuration: &Configuration, first: Option<&Picture>) -> Result<(Row, Picture), CliError> {
        eprintln!("  {}", configuration.name);
        let mut ready = self.renderer(self.settings(configuration))?;
        let picture = self.render(&mut ready)?;
        let (mut frames, mut shadows) = (Vec::new(), Vec::new());
        for _ in 0..self.args.runs {
            let started = Instant::now();
            let passes = self.render(&mut ready)?.report.passes;
            let wall_ms = 1e3 * started.elapsed().as_secs_f64();
            let sum: f64 = passes.iter().map(|pass| pass.ms).sum();
            frames.push(if passes.is_empty() { wall_ms } else { sum });
            shadows.push(passes.iter().filter(|pass| pass.name == "shadows/trace").map(|pass| pass.ms).sum());
        }
        if let Some(name) = configuration.heat_map {
            let settings = Settings { debug_view: Some(DebugView::RayCount), ..self.settings(configuration) };
            let heat = self.render(&mut self.renderer(settings)?)?;
            self.write(name, heat.width, heat.height, &rgb(&heat))?;
        }
        let counter =
            |name: &str| picture.report.counters.iter().find(|(n, _)| n == name).map_or(0, |(_, value)| *value);
        let row = Row {
            name: configuration.name,
            frame_ms: median(&mut frames),
            shadow_ms: median(&mut shadows),
            rays: counter("shadows/rays"),
            light_tests: counter("light_culling/light_tests"),
            listed_lights: counter("light_culling/listed_lights"),
            differing_pixels: first.map_or(0, |first| differing(first, &picture)),
            exact: configuration.exact,
            paper_ms: configuration.paper_ms,
        };
        Ok((row, picture))
    }
}

/// A debug view or picture without its alpha.
pub fn rgb(picture: &Picture) -> Vec<u8> {
    picture.display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
}

/// The middle value, or the upper of the two middle ones.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Pixels whose radiance differs in any bit.
pub fn differing(a: &Picture, b: &Picture) -> usize {
    let bits = |texel: &[f32; 4]| texel.map(f32::to_bits);
    a.radiance.iter().zip(&b.radiance).filter(|(a, b)| bits(a) != bits(b)).count()
}

pub fn run(args: &ForwardPlusArgs) -> Result<(), CliError> {
    let shot = shot::is_shot(&args.scene).then(|| shot::read(args.scene.path(), Vec::new())).transpose()?;
    let shot_view = shot.as_ref().map(|shot| shot.views().swap_remove(0));
    let (source, part, lights, view, seed) = match (&shot, &shot_view) {
        (Some(Shot { args: shot, .. }), Some(view)) => {
            (&shot.scene, shot.part.scene_of_file.as_deref(), &shot.lights, view, shot.run.seed)
        }
        _ => (&args.scene, None, &args.lights, &args.view, args.seed),
    };
    let mut scene = scene::load_part(source, part)?;
    apply_lights(&mut scene, lights, seed)?;
    let camera = camera::choose(&scene, view, args.size.width as f32 / args.size.height as f32)?;
    light_rig::add(&mut scene, lights, &camera)?;
    if scene.lights.is_empty() {
        return Err(CliError::new("the scene has no lights to bench", "add some, e.g. --lights rain:10"));
    }
    make_folder(&args.output)?;
    let gpu = open(args.adapter.as_ref())?;
    let bench = Bench { gpu, scene, camera, lights, args };

    let mut rows = Vec::new();
    let mut first: Option<Picture> = None;
    for configuration in configurations() {
        let (row, picture) = bench.measure(&configuration, first.as_ref())?;
        if first.is_none() {
            bench.write("picture.png", picture.width, picture.height, &rgb(&picture))?;
            first = Some(picture);
        }
        rows.push(row);
    }
    let first = first.expect("there are configurations");
    let mut tile_rows = Vec::new();
    for configuration in tile_sizes() {
        tile_rows.push(bench.measure(&configuration, Some(&first))?.0);
    }
    let results = Results {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.clone(),
        adapter: bench.gpu.description.name.clone(),
        driver: bench.gpu.description.driver.clone(),
        width: args.size.width,
        height: args.size.height,
        light_count: bench.scene.lights.len(),
        range_threshold: lights.range_threshold,
        runs: args.runs,
        surface_pixels: first.radiance.iter().filter(|texel| texel[3] > 0.0).count(),
        configurations: rows,
        tile_sizes: tile_rows,
        normals: normals::measure(&bench)?,
    };
    report(&results, &args.output)
}

fn report(results: &Results, folder: &Path) -> Result<(), CliError> {
    let markdown = to_markdown(results);
    output::write_text(&folder.join("report.md"), &markdown)?;
    let json = serde_json::to_string_pretty(results).expect("plain numbers and strings");
    output::write_text(&folder.join("report.json"), &(json + "\n"))?;
    let text = format!("{markdown}\n{}\n", folder.join("report.md").display());
    output::print(&text)?;
    let wrong: Vec<_> = results.configurations.iter().filter(|row| row.exact && row.differing_pixels > 0).collect();
    match wrong.first() {
        None => Ok(()),
        Some(row) => Err(CliError::new(
            format_args!("{}: {} pixels differ from no optimisations, none may", row.name, row.differing_pixels),
            "this is a fault of the renderer; please report it with the scene",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_differences() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0]), 4.0);
        assert_eq!(median(&mut []), 0.0);
        let picture = |texels: Vec<[f32; 4]>| Picture {
            width: texels.len() as u32,
            height: 1,
            display: vec![[0; 4]; texels.len()],
            exposure: None,
            radiance: texels,
            report: Default::default(),
        };
        let a = picture(vec![[0.0; 4], [1.0; 4], [f32::NAN; 4]]);
        let b = picture(vec![[-0.0, 0.0, 0.0, 0.0], [1.0; 4], [f32::NAN; 4]]);
        assert_eq!((differing(&a, &a), differing(&a, &b)), (0, 1));
    }

    #[test]
    fn the_rows_are_the_papers_and_the_exact_ones_use_no_normals_from_depth() {
        let rows = configurations();
        assert_eq!(rows.iter().filter(|row| row.paper_ms.is_some()).count(), 6);
        for row in rows {
            assert_eq!(row.exact, matches!(row.ray_culling, RayCulling::None | RayCulling::Surface), "{}", row.name);
        }
    }
}
