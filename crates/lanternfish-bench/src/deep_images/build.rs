//! Builds images and times the steps.

use std::time::{Duration, Instant};

use lanternfish::{
    GpuScene,
    deep_images::{DeepImageBuilder, DeepImages, Holes},
    settings::{DeepBuilder, DeepImageSettings},
};
use lanternfish_gpu::{Frame, Gpu, PassTime, Profiler, read_back};
use serde::Serialize;

use super::configurations::in_words;
use lanternfish_cli::error::CliError;

/// A build that takes longer is not run again.
const LONG: Duration = Duration::from_secs(10);

/// Figures of building a set of images.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Built {
    pub group: &'static str,
    pub images: String,
    pub builder: &'static str,
    pub directions: usize,
    pub resolution: u32,
    pub supersampling: u32,
    /// Number of chunks that the images are divided into: a ray looks into one chunk, but every pass over rays runs once for each.
    pub chunks: usize,
    /// Milliseconds a step, of the run that took least.
    pub sample_ms: f64,
    pub gather_ms: f64,
    pub scan_ms: f64,
    pub fill_ms: f64,
    pub sort_ms: f64,
    pub compact_ms: f64,
    pub total_ms: f64,
    /// Passes that draw all triangles, into one or all images of a chunk.
    pub draw_passes: usize,
    /// Fragments before merging, and after it.
    pub drawn: u64,
    pub kept: u64,
    /// Bytes of lists and fragments.
    pub bytes: u64,
    /// Holes compared with images drawn direction by direction, where that was asked for.
    pub holes: Option<HoleShares>,
}

/// [`Holes`], for the report.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct HoleShares {
    pub missing: f64,
    pub spurious: f64,
    pub missing_by_cosine: [f64; 4],
    pub fragments: f64,
}

impl From<Holes> for HoleShares {
    fn from(holes: Holes) -> Self {
        let Holes { missing, spurious, missing_by_cosine, fragments } = holes;
        Self { missing, spurious, missing_by_cosine, fragments }
    }
}

/// Builds images once, `runs` times more for the figures (once only, where that takes long), and gives the last ones. Without more runs
/// the first one's figures are given, which have the compilation in them.
pub fn build(
    gpu: &Gpu,
    profiler: &mut Profiler,
    scene: &GpuScene,
    runs: u32,
    group: &'static str,
    settings: DeepImageSettings,
) -> Result<(Built, DeepImages), CliError> {
    let mut builder = DeepImageBuilder::new(&gpu.device, settings)?;
    let mut best: Option<(f64, Vec<PassTime>)> = None;
    let mut images = None;
    for run in 0..=runs {
        // No two of them at a time.
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
        let total: f64 = passes.iter().map(|pass| pass.ms).sum();
        let is_only = runs == 0;
        let is_long = run == 0 && started.elapsed() > LONG;
        if (run > 0 || is_long || is_only) && best.as_ref().is_none_or(|(least, _)| total < *least) {
            best = Some((total, passes));
        }
        if is_long {
            break;
        }
    }
    let (images, (total_ms, passes)) = (images.expect("built"), best.expect("run"));
    let times = |step: &str| -> Vec<f64> {
        passes.iter().filter(|pass| pass.name.starts_with(step)).map(|pass| pass.ms).collect()
    };
    // The sum of nothing is minus zero.
    let step = |name: &str| 0.0 + times(name).iter().sum::<f64>();
    let draws: &[&str] = match settings.builder {
        DeepBuilder::SinglePass => &["deep_images/sample"],
        DeepBuilder::PerTriangle => &[],
        DeepBuilder::PerDirection => &["deep_images/gather"],
        // One for each layer of surfaces, and one that finds no more.
        DeepBuilder::DepthPeeling => &["deep_images/gather/draw"],
    };
    let figures = Built {
        group,
        images: in_words(&settings),
        builder: settings.builder.name(),
        directions: images.directions.len(),
        resolution: settings.resolution,
        supersampling: settings.supersampling,
        chunks: images.chunks.len(),
        sample_ms: step("deep_images/sample"),
        gather_ms: step("deep_images/gather"),
        scan_ms: step("deep_images/scan"),
        fill_ms: step("deep_images/fill"),
        sort_ms: step("deep_images/sort"),
        compact_ms: step("deep_images/compact"),
        total_ms,
        draw_passes: draws.iter().map(|name| times(name).len()).sum(),
        drawn: images.counts.drawn,
        kept: images.counts.kept,
        bytes: images.counts.bytes,
        holes: None,
    };
    Ok((figures, images))
}
