//! Builds deep images and times the build steps.

use std::time::Instant;

use lanternfish::{GpuScene, settings::Settings};
use lanternfish_cli::{error::CliError, times::ms_of};
use lanternfish_gpu::{Frame, PassTime, Profiler, read_back};
use lanternfish_papers::{
    DeepBuilder, DeepImageSettings,
    deep_images::{DeepImageBuilder, DeepImages},
};

use super::cases::in_words;
use crate::{
    bench::{Bench, LONG},
    table::Row,
};

/// Keys and names of the steps.
const STEPS: [(&str, &str); 6] = [
    ("sample_ms", "sample"),
    ("gather_ms", "gather"),
    ("scan_ms", "scan"),
    ("fill_ms", "fill"),
    ("sort_ms", "sort"),
    ("compact_ms", "compact"),
];
/// Builds images once to warm up and then `runs` times, and returns the times of the fastest of those runs and the last images.
///
/// A first build longer than [`LONG`] is not repeated, and its times are returned. They are also returned if `runs` is 0. They include
/// pipeline compilation.
pub fn build(
    bench: &Bench,
    profiler: &mut Profiler,
    scene: &GpuScene,
    runs: u32,
    group: &'static str,
    settings: DeepImageSettings,
) -> Result<(Row, DeepImages), CliError> {
    let (gpu, directions, resolution) = (&bench.gpu, settings.directions.count(), settings.resolution);
    let row = format!("{group}: {}, {directions} x {resolution}²", in_words(&settings));
    let made = bench.made(&row, &Settings::direct_light().with_structure(settings));
    let made = DeepImageSettings::of(&made.structure);
    let mut builder = DeepImageBuilder::new(&gpu.device, made)?;
    let mut best: Option<(f64, Vec<PassTime>)> = None;
    let mut images = None;
    for run in 0..=runs {
        // Frees the previous images before the next build.
        drop(images.take());
        let started = Instant::now();
        let mut frame = Frame::new(&gpu.device, &gpu.queue, profiler);
        let recorded = builder.record(&mut frame, scene);
        frame.submit();
        let made = match recorded {
            Ok(made) => made,
            Err(error) => {
                profiler.finished();
                return Err(error.into());
            }
        };
        // Waits for the device.
        read_back::<u32>(&gpu.device, &gpu.queue, &made.chunks[0].list_starts, 1)?;
        images = Some(made);
        let passes = profiler.finished();
        let total = ms_of(&passes, "");
        let is_long = run == 0 && started.elapsed() > LONG;
        if (run > 0 || is_long || runs == 0) && best.as_ref().is_none_or(|(least, _)| total < *least) {
            best = Some((total, passes));
        }
        if is_long {
            break;
        }
    }
    let (images, (total_ms, passes)) = (images.expect("built"), best.expect("run"));
    let step = |name: &str| ms_of(&passes, &format!("deep_images/{name}"));
    // Passes that draw all triangles, each into one or all images of a chunk.
    let draws = match made.builder {
        DeepBuilder::SinglePass | DeepBuilder::SinglePassLiteral => Some("deep_images/sample"),
        DeepBuilder::PerTriangle => None,
        DeepBuilder::PerDirection => Some("deep_images/gather"),
        // One pass per layer of surfaces, and a last one that finds no fragments.
        DeepBuilder::DepthPeeling => Some("deep_images/gather/draw"),
    };
    let draw_passes = draws.map_or(0, |draw| passes.iter().filter(|pass| pass.name.starts_with(draw)).count());
    let row = Row::default()
        .data("group", group)
        .text("images", "images", in_words(&settings))
        .data("builder", lanternfish_scene::Named::name(settings.builder))
        .data("set", settings.directions.to_string())
        .data("sort", lanternfish_scene::Named::name(settings.sort))
        .number("directions", "directions", directions)
        .texels("resolution", resolution)
        .data("supersampling", settings.supersampling)
        // Each ray reads one chunk, but every pass over rays runs once per chunk.
        .data("chunks", images.chunks.len());
    let with = |row: Row, (key, name): (&'static str, &str)| row.fixed(key, name, 1, step(name));
    let row = STEPS
        .into_iter()
        .fold(row, with)
        .fixed("total_ms", "all, ms", 1, total_ms)
        .shown("per direction, ms", format_args!("{:.2}", total_ms / directions as f64))
        .number("draw_passes", "draw passes", draw_passes)
        // Numbers of fragments before and after merging.
        .count("drawn", "drawn", images.counts.drawn)
        .count("kept", "kept", images.counts.kept)
        // Memory of lists and fragments.
        .megabytes("bytes", "MB", images.counts.bytes);
    Ok((row, images))
}
