//! `lanternfish-bench forward-plus`: the tables of [Elagabani2025, ch. 5]: savings of each optimisation of shadow rays, and errors of
//! normals from depth.

use std::time::Instant;

use clap::Args;
use lanternfish::{
    GpuScene, RenderedImage, Renderer,
    settings::{Culling, DebugView, RayCulling, RayRangeCulling, Settings, Shadows, ToneMap},
    techniques::{TileSize, Tiled},
};
use lanternfish_cli::{choices::choice, error::CliError, parse::Size, progress::Progress};
use lanternfish_metrics::{ColorType, PIXELS_PER_DEGREE, flip_ldr, write_png};

use crate::{
    document::Document,
    image::{self, differing, displayed, rgb},
    run::{Run, RunArgs, counter, medians, ms_of},
    subject::{Subject, SubjectArgs},
    table::{DASH, Row, decimal},
    technique,
};

/// Flags of `forward-plus`.
#[derive(Debug, Args)]
pub struct ForwardPlusArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Tracer of the shadow rays.
    #[arg(long, value_name = "NAME", value_parser = choice::<Shadows>(), default_value_t = Settings::default().shadows.technique)]
    shadows: Shadows,
    #[command(flatten)]
    subject: SubjectArgs,
}

/// One configuration.
struct Case {
    name: &'static str,
    culling: Culling,
    ray_culling: RayCulling,
    /// File name of the heat map, if one is written.
    heat_map: Option<&'static str>,
    /// Frame time in the thesis, ms; none: the thesis has no such row, and rays are culled by range too.
    paper_ms: Option<f64>,
}

impl Case {
    /// True if the image must be identical to that without optimisations. Normals from depth are wrong at edges, where light may be lost.
    fn is_exact(&self) -> bool {
        matches!(self.ray_culling, RayCulling::None | RayCulling::Surface)
    }

    fn ray_range_culling(&self) -> RayRangeCulling {
        if self.paper_ms.is_some() { RayRangeCulling::Off } else { RayRangeCulling::On }
    }
}

fn tiled(tile_size: TileSize, aabb_test: bool) -> Culling {
    technique::tiled(Tiled { tile_size, aabb_test })
}

/// The rows of table 5.1 in their order, at tiles of 8 × 8, and ours.
fn cases() -> Vec<Case> {
    use RayCulling::{Improved, Naive, None as NoCulling, Surface};
    let px8 = |aabb| tiled(TileSize::Px8, aabb);
    let rows = [
        ("no optimisations", technique::NO_CULLING, NoCulling, Some("rays-none.png"), Some(16.0)),
        ("light culling", px8(false), NoCulling, Some("rays-culling.png"), Some(11.52)),
        ("light culling + AABB", px8(true), NoCulling, Some("rays-culling-aabb.png"), Some(10.93)),
        ("light culling + AABB + naive normals", px8(true), Naive, Some("rays-naive.png"), Some(9.59)),
        ("light culling + AABB + improved normals", px8(true), Improved, Some("rays-improved.png"), Some(9.67)),
        ("improved normals", technique::NO_CULLING, Improved, None, Some(13.55)),
        ("ours: range per pixel", technique::NO_CULLING, NoCulling, None, None),
        (
            "ours: light culling + AABB + surface normals + range per pixel",
            px8(true),
            Surface,
            Some("rays-surface.png"),
            None,
        ),
    ];
    let case =
        |(name, culling, ray_culling, heat_map, paper_ms)| Case { name, culling, ray_culling, heat_map, paper_ms };
    rows.map(case).into()
}

/// The rows of table 5.2.
fn tile_sizes() -> [Case; 3] {
    let paper = [("8 x 8", TileSize::Px8, 9.44), ("16 x 16", TileSize::Px16, 9.56), ("32 x 32", TileSize::Px32, 9.99)];
    paper.map(|(name, size, ms)| Case {
        name,
        culling: tiled(size, true),
        ray_culling: RayCulling::Improved,
        heat_map: None,
        paper_ms: Some(ms),
    })
}

/// The threshold of the thesis' ranges [Elagabani2025, eq. 4.1].
const PAPER_THRESHOLD: f32 = 0.02;

/// What every case shares.
struct Bench<'a> {
    run: Run,
    subject: Subject,
    args: &'a ForwardPlusArgs,
    /// Threshold of the lights' ranges.
    range_threshold: f32,
    /// Whether heat maps are written.
    has_heat_maps: bool,
}

impl Bench<'_> {
    fn settings(&self, case: &Case) -> Settings {
        Settings::direct_light()
            .with_culling(case.culling.clone())
            .with_ray_culling(case.ray_culling)
            .with_ray_range_culling(case.ray_range_culling())
            .with_shadows(self.args.shadows)
            .with_attenuation(self.subject.look.lights.attenuation)
            .with_attenuation_near_radius(self.subject.look.lights.near_radius)
            .with_attenuation_coefficients(self.subject.look.lights.coefficients)
            .with_range_threshold(self.range_threshold)
    }

    fn renderer(&self, settings: Settings) -> Result<(Renderer, GpuScene), CliError> {
        let renderer = Renderer::with_engine(&self.run.engine, settings)?;
        let uploaded = renderer.upload(&self.subject.scene)?;
        Ok((renderer, uploaded))
    }

    fn render(&self, (renderer, uploaded): &mut (Renderer, GpuScene)) -> Result<RenderedImage, CliError> {
        let Size { width, height } = self.args.subject.size;
        Ok(renderer.render(uploaded, &self.subject.cameras[0], width, height)?)
    }

    fn write(&self, name: &str, rendering: &RenderedImage) -> Result<(), CliError> {
        image::write(&self.run.folder.join(name), rendering)
    }

    /// Pairs of a pixel and a light: listed by this technique of light culling, or (`in_range`) in range.
    fn listed(&self, culling: &Culling, in_range: RayRangeCulling) -> Result<u64, CliError> {
        let case =
            Case { name: "", culling: culling.clone(), ray_culling: RayCulling::None, heat_map: None, paper_ms: None };
        let settings = self.settings(&case).with_ray_range_culling(in_range);
        Ok(counter(&self.render(&mut self.renderer(settings)?)?.report, "shadows/rays"))
    }

    /// Renders a case once to warm up and then for its times. Changes are from `none`, the first row of its table.
    fn row(
        &self,
        case: &Case,
        first: Option<&RenderedImage>,
        none: Option<&Row>,
    ) -> Result<(Row, RenderedImage), CliError> {
        eprintln!("  {}", case.name);
        let mut ready = self.renderer(self.settings(case))?;
        let rendering = self.render(&mut ready)?;
        let [frame_ms, shadow_ms] = medians(self.run.runs, || {
            let started = Instant::now();
            let passes = self.render(&mut ready)?.report.passes;
            // Wall-clock time if the adapter has no timestamps.
            let wall_ms = 1e3 * started.elapsed().as_secs_f64();
            let ms = if passes.is_empty() { wall_ms } else { ms_of(&passes, "") };
            Ok::<_, CliError>([ms, ms_of(&passes, "shadows/trace")])
        })?;
        if let Some(name) = case.heat_map.filter(|_| self.has_heat_maps) {
            let settings = self.settings(case).with_debug_view(Some(DebugView::RayCount));
            self.write(name, &self.render(&mut self.renderer(settings)?)?)?;
        }
        let counter = |name| counter(&rendering.report, name);
        let [listed, reaching] =
            [RayRangeCulling::Off, RayRangeCulling::On].map(|in_range| self.listed(&case.culling, in_range));
        let false_positives = 1.0 - reaching? as f64 / (listed? as f64).max(1.0);
        let row = Row::default()
            .text("name", "", case.name)
            .fixed("frame_ms", "frame ms", 2, frame_ms)
            .fixed("shadow_ms", "shadow rays ms", 2, shadow_ms)
            .percent("shadow_part", "of the frame", 1, shadow_ms / frame_ms.max(1e-9))
            .count("rays", "rays", counter("shadows/rays"))
            .count("light_tests", "light tests", counter("light_culling/light_tests"))
            .count("listed_lights", "listed lights", counter("light_culling/listed_lights"))
            .count("list_bytes", "list bytes", counter("light_culling/tile_bytes"))
            .percent("false_positives", "false positives", 1, false_positives)
            .count(
                "differing_pixels",
                "pixels that differ",
                first.map_or(0, |first| differing(first, &rendering)) as u64,
            )
            .data("exact", case.is_exact())
            .optional("paper_ms", "thesis: frame ms", case.paper_ms);
        let change = |key| {
            let (value, of) = (row.f64(key), none.unwrap_or(&row).f64(key));
            let is_known = of > 0.0 && !row.get(key).is_null();
            if is_known { format!("{:+.2} %", 100.0 * (value / of - 1.0)) } else { DASH.to_owned() }
        };
        let changes = [("frame ms, change", "frame_ms"), ("rays, change", "rays"), ("thesis, change", "paper_ms")];
        let changes = changes.into_iter().fold(Row::default(), |changes, (name, key)| changes.shown(name, change(key)));
        Ok((row.and(changes), rendering))
    }

    /// Measures these configurations. Writes the first image of all tables, and stores it in `first`.
    fn table(&self, cases: &[Case], first: &mut Option<RenderedImage>) -> Result<Vec<Row>, CliError> {
        let mut rows = Vec::new();
        for case in cases {
            let (row, rendering) = self.row(case, first.as_ref(), rows.first())?;
            rows.push(row);
            if first.is_none() {
                self.write("image.png", &rendering)?;
                *first = Some(rendering);
            }
        }
        Ok(rows)
    }

    /// Renders normals reconstructed from depth, writes them and their error maps, and measures the errors against geometric normals
    /// [Elagabani2025, fig. 5.3].
    fn normals(&self) -> Result<Vec<Row>, CliError> {
        let view = |view| {
            let (debug_view, tone_map) = (Some(view), ToneMap::None);
            let settings = Settings::direct_light()
                .with_debug_view(debug_view)
                .with_shadows(Shadows::None)
                .with_tone_map(tone_map);
            self.render(&mut self.renderer(settings)?)
        };
        let reference = view(DebugView::GeometricNormal)?;
        self.write("normals-reference.png", &reference)?;
        let views = [("naive", DebugView::NormalNaive, 0.07975), ("improved", DebugView::NormalImproved, 0.02264)];
        let row = |(name, of, paper)| {
            let rendering = view(of)?;
            self.write(&format!("normals-{name}.png"), &rendering)?;
            let error = flip_ldr(&displayed(&reference)?, &displayed(&rendering)?, PIXELS_PER_DEGREE)?;
            let file = self.run.folder.join(format!("normals-{name}-error.png"));
            write_png(&file, rendering.width, rendering.height, ColorType::Rgb, &error.magma())?;
            let [degrees, over_ten] = angles(&rgb(&reference), &rgb(&rendering));
            Ok(Row::default()
                .text("name", "", name)
                .fixed("mean_flip", "mean FLIP", 5, error.mean().into())
                .fixed("mean_degrees", "mean angle", 2, degrees)
                .said_as(format_args!("{degrees:.2}°"))
                .percent("share_over_ten_degrees", "over 10°", 2, over_ten)
                .fixed("paper_flip", "thesis: mean FLIP", 5, paper))
        };
        views.into_iter().map(row).collect()
    }
}

/// Mean angle between normals packed as (n + 1) / 2, degrees, and the fraction of angles above 10°, over the pixels with a surface.
fn angles(ground_truth: &[u8], actual: &[u8]) -> [f64; 2] {
    let unpack = |n: &[u8; 3]| glam::DVec3::from(n.map(|v| f64::from(v) / 127.5 - 1.0)).normalize_or_zero();
    let pixels = ground_truth.as_chunks::<3>().0.iter().zip(actual.as_chunks::<3>().0);
    // Background pixels are black, which no packed normal is.
    let covered = pixels.filter(|(ground_truth, _)| **ground_truth != [0; 3]);
    let angles: Vec<f64> = covered.map(|(a, b)| unpack(a).angle_between(unpack(b)).to_degrees()).collect();
    let count = angles.len().max(1) as f64;
    [angles.iter().sum::<f64>() / count, angles.iter().filter(|angle| **angle > 10.0).count() as f64 / count]
}

/// Measures and writes the report.
///
/// # Errors
///
/// Fails if images that must be identical differ.
pub fn run(args: &ForwardPlusArgs) -> Result<(), CliError> {
    let subject = Subject::load(&args.subject, true, &mut Progress::hidden())?;
    if subject.scene.lights.is_empty() {
        return Err(CliError::new("the scene has no lights to bench", "add some, e.g. --lights rain:10"));
    }
    let (run, range_threshold) = (Run::start(&args.run, "forward-plus")?, subject.look.lights.range_threshold);
    let mut bench = Bench { run, subject, args, range_threshold, has_heat_maps: true };
    let mut first = None;
    let rows = bench.table(&cases(), &mut first)?;
    let tiles = bench.table(&tile_sizes(), &mut first)?;
    let normals = bench.normals()?;
    // The same by the thesis' own rule for ranges, if the subject's lights end earlier.
    let mut papers = [Vec::new(), Vec::new()];
    if range_threshold != PAPER_THRESHOLD {
        (bench.range_threshold, bench.has_heat_maps) = (PAPER_THRESHOLD, false);
        let mut first = None;
        papers = [bench.table(&cases(), &mut first)?, bench.table(&tile_sizes(), &mut first)?];
    }
    let papers_rows = papers[0].clone();

    let (Subject { scene, look, .. }, Size { width, height }) = (&bench.subject, args.subject.size);
    let surface = first.iter().flat_map(|first| &first.radiance).filter(|texel| texel[3] > 0.0).count();
    let (title, source) = ("Forward+ with ray-traced shadows", &args.subject.scene);
    let mut report = Document::of_scene(title, source, &bench.run.gpu, args.run.runs);
    let facts = Row::default().data("width", width).data("height", height).data("light_count", scene.lights.len());
    let facts = facts.data("range_threshold", decimal(look.lights.range_threshold)).data("surface_pixels", surface);
    report.facts(facts);
    let what = format!(
        "{width} x {height} pixels, {} lights (range threshold {})",
        scene.lights.len(),
        look.lights.range_threshold
    );
    report.introduction(&what, &format!("median of {} runs", args.run.runs));
    report.paragraph("The thesis' figures: Sponza, ten lights, 1920 x 1080, Ryzen 7 3700X and Nvidia RTX 2060 SUPER.");
    let wrong =
        rows.iter().chain(&papers_rows).find(|row| row.get("exact") == true && row.f64("differing_pixels") > 0.0);
    let wrong = wrong.map(|row| format!("{}: {} pixels", row.words("name"), row.words("differing_pixels")));
    let text = "Pixels may differ only where normals are rebuilt from depth. As in the thesis, rays are culled by facing alone; ours also by each \
                light's range. False positives: of the pairs of a pixel and a listed light, those out of range.";
    report.section("Optimisations (table 5.1), tiles of 8 x 8", text, "configurations", rows);
    report.section("Tile sizes (table 5.2): culling, AABB test, improved normals", "", "tile_sizes", tiles);
    let [rows, tiles] = papers;
    let text = "Ranges by eq. 4.1: the same tables where lights end at 0.02.";
    report.section("Table 5.1 at the thesis' threshold", text, "configurations_at_paper_threshold", rows);
    report.section("Table 5.2 at the thesis' threshold", "", "tile_sizes_at_paper_threshold", tiles);
    report.section("Normals from depth (fig. 5.3)", "", "normals", normals);
    report.heading("Images");
    report.paragraph(
        "Rays per pixel (fig. 5.2; black 0, red 10 and more): `rays-*.png`. Normals and their errors: `normals-*.png`.",
    );
    report.write(&bench.run.folder)?;
    match wrong {
        None => Ok(()),
        Some(wrong) => Err(CliError::new(
            format_args!("{wrong} differ from no optimisations, none may"),
            "this is a fault of the renderer; please report it with the scene",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_are_the_papers() {
        assert_eq!(cases().iter().filter(|case| case.paper_ms.is_some()).count(), 6);
        let exact: Vec<_> = cases().iter().filter(|case| case.is_exact()).map(|case| case.name).collect();
        let expected = [
            "no optimisations",
            "light culling",
            "light culling + AABB",
            "ours: range per pixel",
            "ours: light culling + AABB + surface normals + range per pixel",
        ];
        assert_eq!(exact, expected, "those that use no normals from depth");
        let by_range = |case: &Case| case.ray_range_culling() == RayRangeCulling::On;
        assert!(
            cases().iter().all(|case| by_range(case) == case.name.starts_with("ours")),
            "his rows cull by facing alone"
        );
    }

    #[test]
    fn equal_images_have_no_error_and_a_rotated_normal_has_its_angle() {
        let ground_truth = [255, 128, 128, 128, 255, 128, 0, 0, 0];
        let [degrees, over_ten] = angles(&ground_truth, &ground_truth);
        assert!(degrees < 1e-3 && over_ten == 0.0);
        let [degrees, over_ten] = angles(&ground_truth, &[128, 255, 128, 128, 255, 128, 9, 9, 9]);
        assert!((degrees - 45.0).abs() < 0.5 && over_ten == 0.5);
    }
}
