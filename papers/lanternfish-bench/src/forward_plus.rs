//! `lanternfish-bench forward-plus`: the tables of [Elagabani2025, ch. 5]: savings of each optimisation of shadow rays,
//! and errors of normals from depth.

mod positions;
mod savings;

use clap::Args;
use lanternfish::{
    RenderError, RenderedImage,
    settings::{DebugView, RayCulling, Settings, Shadows, ToneMap},
};
use lanternfish_cli::{
    choices::choice,
    error::CliError,
    images::{differing, displayed, rgb},
    parse::{self, Size},
    timed::Timed,
    times::{counter, frame_time, ms_of},
};
use lanternfish_gpu::ShaderTexts;
use lanternfish_metrics::{PIXELS_PER_DEGREE, flip_ldr};
use lanternfish_papers::normals::{naive_normals, shown_normals_from_depth};

use crate::{
    bench::{Bench, RunArgs, identical},
    case::{Case, changed},
    stage::Stage,
    table::{DASH, Row, decimal},
    view::{SubjectArgs, View},
};

/// Flags of `forward-plus`.
#[derive(Debug, Args)]
pub struct ForwardPlusArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Tracer of the shadow rays.
    #[arg(long, value_name = "NAME", value_parser = choice::<Shadows>(), default_value_t = Settings::default().shadows.technique)]
    shadows: Shadows,
    /// Width and height of the images of normals, pixels. Default: those of the view.
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    normals_size: Option<Size>,
    #[command(flatten)]
    subject: SubjectArgs,
}

/// A row: its name, its settings, and the frame time in the thesis, ms. None: the thesis has no such row, and rays are
/// culled by range too.
type Declared = (&'static str, &'static str, Option<f64>);

/// Light culling by tiles of 8 × 8, without and with the test of bounding boxes.
const TILED: &str = "culling tiled, tile-size 8, aabb off";
const AABB: &str = "culling tiled, tile-size 8";

/// The rows of table 5.1 in their order, at tiles of 8 × 8, and ours.
const OPTIMISATIONS: [Declared; 8] = [
    ("no optimisations", "culling all, ray-culling none", Some(16.0)),
    ("light culling", "TILED, ray-culling none", Some(11.52)),
    ("light culling + AABB", "AABB, ray-culling none", Some(10.93)),
    ("light culling + AABB + naive normals", "AABB, ray-culling naive", Some(9.59)),
    ("light culling + AABB + improved normals", "AABB, ray-culling improved", Some(9.67)),
    ("improved normals", "culling all, ray-culling improved", Some(13.55)),
    ("ours: range per pixel", "culling all, ray-culling none", None),
    ("ours: light culling + AABB + surface normals + range per pixel", "AABB, ray-culling surface", None),
];
/// File names of heat maps, in the order of [`OPTIMISATIONS`]; empty: none.
const HEAT_MAPS: [&str; 8] =
    ["rays-none", "rays-culling", "rays-culling-aabb", "rays-naive", "rays-improved", "", "", "rays-surface"];

/// The rows of table 5.2.
const TILE_SIZES: [Declared; 3] = [
    ("8 x 8", "culling tiled, tile-size 8, ray-culling improved", Some(9.44)),
    ("16 x 16", "culling tiled, tile-size 16, ray-culling improved", Some(9.56)),
    ("32 x 32", "culling tiled, tile-size 32, ray-culling improved", Some(9.99)),
];

/// Ray culling by naive normals: `improved`, with another text of its shader.
const NAIVE: &str = "ray-culling naive";

/// Changes of settings as they are declared, with or without the test of ranges. The thesis culls by facing alone.
fn declared(changes: &str, by_range: &str) -> String {
    let changes = changes.replace("TILED", TILED).replace("AABB", AABB).replace(NAIVE, "ray-culling improved");
    format!("{changes}, ray-range-culling {by_range}")
}

/// A case as it is declared.
fn case(look: &Settings, (name, changes, paper_ms): &Declared) -> Case {
    Case::of(look, name, &declared(changes, if paper_ms.is_some() { "off" } else { "on" }))
}

/// True if the image must be identical to that without optimisations. Normals from depth are wrong at edges, where
/// light may be lost.
fn is_exact(settings: &Settings) -> bool {
    matches!(settings.shadows.ray_culling, RayCulling::None | RayCulling::Surface)
}

/// What every case shares.
struct ForwardPlus {
    bench: Bench,
    view: View,
}

impl ForwardPlus {
    /// A renderer of these settings, which `changes` have declared.
    fn stage(&self, settings: &Settings, changes: &str) -> Result<Stage, RenderError> {
        let texts = if changes.contains(NAIVE) { naive_normals() } else { ShaderTexts::new() };
        self.stage_with(settings, texts)
    }

    fn stage_with(&self, settings: &Settings, texts: ShaderTexts) -> Result<Stage, RenderError> {
        match texts.is_empty() {
            true => self.bench.stage(&self.view.scene, settings),
            false => self.bench.edited_stage(&self.view.scene, settings, texts),
        }
    }

    /// Pairs of a pixel and a light: listed by this technique of light culling, or (`by_range` on) in range.
    fn listed(&self, settings: &Settings, by_range: &str) -> Result<u64, CliError> {
        let settings = changed(settings, &format!("ray-culling none, ray-range-culling {by_range}"));
        Ok(counter(&self.bench.first_frame(&self.view, &settings)?.report, "shadows/rays"))
    }

    /// Renders a case once to warm up and then for its times. Changes are from `none`, the first row of its table.
    fn row(
        &self,
        Case { name, settings, .. }: &Case,
        (_, changes, paper_ms): &Declared,
        first: &mut Option<RenderedImage>,
        none: Option<&Row>,
    ) -> Result<Row, CliError> {
        let mut stage = self.stage(settings, changes)?;
        let image = stage.frame(&self.view)?;
        let [frame, shadow, shadow_part] = Timed::each(self.bench.runs, || {
            let (ms, passes) = frame_time(|| stage.frame(&self.view))?;
            let shadow_ms = ms_of(&passes.report.passes, "shadows/trace");
            Ok::<_, CliError>([ms, shadow_ms, shadow_ms / ms.max(1e-9)])
        })?;
        let (frame_ms, shadow_ms) = (frame.median(), shadow.median());
        let differing = first.as_ref().map_or(0, |first| differing(first, &image));
        let counter = |name| counter(&image.report, name);
        let [listed, reaching] = ["off", "on"].map(|by_range| self.listed(settings, by_range));
        let false_positives = 1.0 - reaching? as f64 / (listed? as f64).max(1.0);
        let row = Row::default()
            .text("name", "", name)
            .fixed("frame_ms", "frame ms", 2, frame_ms)
            .fixed("shadow_ms", "shadow rays ms", 2, shadow_ms)
            .data("frame_ms_runs", frame)
            .percent("shadow_part", "of the frame", 1, shadow_ms / frame_ms.max(1e-9))
            .data("shadow_part_runs", shadow_part)
            .count("rays", "rays", counter("shadows/rays"))
            .count("light_tests", "light tests", counter("light_culling/light_tests"))
            .count("listed_lights", "listed lights", counter("light_culling/listed_lights"))
            .count("list_bytes", "list bytes", counter("light_culling/tile_bytes"))
            .percent("false_positives", "false positives", 1, false_positives)
            .count("differing_pixels", "pixels that differ", differing as u64)
            .data("exact", is_exact(settings))
            .optional("paper_ms", "thesis: frame ms", *paper_ms);
        let change = |key| {
            let (value, of) = (row.f64(key), none.unwrap_or(&row).f64(key));
            let is_known = of > 0.0 && !row.get(key).is_null();
            if is_known { format!("{:+.2} %", 100.0 * (value / of - 1.0)) } else { DASH.to_owned() }
        };
        let changes = [("frame ms, change", "frame_ms"), ("rays, change", "rays"), ("thesis, change", "paper_ms")];
        let changes = changes.into_iter().fold(Row::default(), |changes, (name, key)| changes.shown(name, change(key)));
        if first.is_none() {
            self.bench.write("image", &image)?;
            *first = Some(image);
        }
        Ok(row.and(changes))
    }

    /// Measures these configurations. Writes the first image of all tables, and stores it in `first`.
    fn table(&self, declared: &[Declared], first: &mut Option<RenderedImage>) -> Result<Vec<Row>, CliError> {
        let mut rows = Vec::new();
        for (i, declared) in declared.iter().enumerate() {
            let mut case = case(&self.view.look, declared);
            case.settings = self.bench.made(&case.name, &case.settings);
            rows.push(self.bench.step("rows", &case.name, || self.row(&case, declared, first, rows.first()))?);
            let heat_map = HEAT_MAPS[i];
            if declared.1 == OPTIMISATIONS[i].1 && !heat_map.is_empty() {
                let settings = case.settings.with_debug_view(DebugView::RayCount);
                self.bench.write(heat_map, &self.stage(&settings, declared.1)?.frame(&self.view)?)?;
            }
        }
        Ok(rows)
    }

    /// Renders normals reconstructed from depth, writes them and their error maps, and measures the errors against
    /// geometric normals [Elagabani2025, fig. 5.3].
    fn normals(&self) -> Result<Vec<Row>, CliError> {
        let view = |view, texts| {
            let (debug_view, tone_map) = (Some(view), ToneMap::None);
            let settings = Settings::direct_light()
                .with_debug_view(debug_view)
                .with_shadows(Shadows::None)
                .with_tone_map(tone_map);
            self.stage_with(&settings, texts)?.frame(&self.view)
        };
        let reference = view(DebugView::GeometricNormal, ShaderTexts::new())?;
        self.bench.write("normals-reference", &reference)?;
        let naive = naive_normals().into_iter().chain(shown_normals_from_depth()).collect();
        let views = [("naive", naive, 0.07975), ("improved", shown_normals_from_depth(), 0.02264)];
        let row = |(name, texts, paper)| {
            let image = view(DebugView::Normal, texts)?;
            self.bench.write(&format!("normals-{name}"), &image)?;
            let error = flip_ldr(&displayed(&reference)?, &displayed(&image)?, PIXELS_PER_DEGREE)?;
            self.bench.write_rgb(&format!("normals-{name}-error"), [image.width, image.height], &error.magma())?;
            let [degrees, over_ten] = angles(&rgb(&reference), &rgb(&image));
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

/// Mean angle between normals packed as (n + 1) / 2, degrees, and the fraction of angles above 10°, over the pixels
/// with a surface.
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
    let title = "Forward+ with ray-traced shadows";
    let bench = Bench::start(&args.run, "forward-plus", title, Some(&args.subject.scene))?;
    let (mut view, _) = View::load(&args.subject, true, &bench)?;
    if view.scene.lights.is_empty() {
        return Err(CliError::new("the scene has no lights to bench", "add some, e.g. --lights rain:10"));
    }
    let (direct, threshold, lights) =
        (Settings::direct_light(), view.look.lights.range_threshold, view.scene.lights.len());
    (view.look.shadows.technique, view.look.image.exposure, view.look.image.tone_map) =
        (args.shadows, direct.image.exposure, direct.image.tone_map);
    let mut of = ForwardPlus { bench, view };
    let mut first = None;
    let rows = of.table(&OPTIMISATIONS, &mut first)?;
    let tiles = of.table(&TILE_SIZES, &mut first)?;
    let savings = of.savings()?;
    let size = of.view.size;
    of.view.size = args.normals_size.unwrap_or(size);
    let normals = of.normals()?;
    of.view.size = size;
    let (bench, Size { width, height }) = (of.bench, of.view.size);
    let surface = first.iter().flat_map(|first| &first.radiance).filter(|texel| texel[3] > 0.0).count();
    let facts = Row::default().data("width", width).data("height", height).data("light_count", lights);
    bench.facts(facts.data("range_threshold", decimal(threshold)).data("surface_pixels", surface));
    let what = format!("{width} x {height} pixels, {lights} lights (range threshold {threshold})");
    bench.report().introduction(&what, &format!("median of {} runs", args.run.runs));
    bench
        .report()
        .paragraph("The thesis' figures: Sponza, ten lights, 1920 x 1080, Ryzen 7 3700X and Nvidia RTX 2060 SUPER.");
    let wrong = rows.iter().find(|row| row.get("exact") == true && row.f64("differing_pixels") > 0.0).map(|row| {
        let [name, pixels] = ["name", "differing_pixels"].map(|key| row.words(key));
        format!("{name}: {pixels} pixels differ from no optimisations")
    });
    let text = "Pixels may differ only where normals are rebuilt from depth. As in the thesis, rays are culled by facing alone; ours also by each \
                light's range. False positives: of the pairs of a pixel and a listed light, those out of range.";
    bench.section("Optimisations (table 5.1), tiles of 8 x 8", text, "configurations", rows);
    bench.section("Tile sizes (table 5.2): culling, AABB test, improved normals", "", "tile_sizes", tiles);
    bench.section("Savings in pairs", savings::TEXT, "savings", savings);
    bench.section("Positions from depth (alg. 4.1)", positions::TEXT, "positions", positions::rows());
    bench.section("Normals from depth (fig. 5.3)", "", "normals", normals);
    bench.report().heading("Images");
    bench.report().paragraph(
        "Rays per pixel (fig. 5.2; black 0, red 10 and more): `rays-*.png`. Normals and their errors: `normals-*.png`.",
    );
    bench.finish()?;
    identical(wrong)
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::RayRangeCulling;

    use super::*;

    #[test]
    fn the_rows_are_the_papers() {
        let look = Settings::direct_light();
        assert_eq!(OPTIMISATIONS.iter().filter(|(.., paper_ms)| paper_ms.is_some()).count(), 6);
        let cases: Vec<Case> = OPTIMISATIONS.iter().chain(&TILE_SIZES).map(|declared| case(&look, declared)).collect();
        let exact: Vec<_> = cases.iter().filter(|case| is_exact(&case.settings)).map(|case| &*case.name).collect();
        let expected = [
            "no optimisations",
            "light culling",
            "light culling + AABB",
            "ours: range per pixel",
            "ours: light culling + AABB + surface normals + range per pixel",
        ];
        assert_eq!(exact, expected, "those that use no normals from depth");
        for case in &cases {
            let by_range = case.settings.shadows.ray_range_culling == RayRangeCulling::On;
            assert_eq!(by_range, case.name.starts_with("ours"), "his rows cull by facing alone");
        }
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
