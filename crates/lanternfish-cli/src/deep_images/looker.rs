//! Renders an image of a scene's deep images, and its description.

use std::{fmt::Display, time::Instant};

use lanternfish::{
    GpuScene, RenderError, RenderedImage, Renderer,
    settings::{Settings, Shadows},
    view::View,
};
use lanternfish_gpu::{Frame, Gpu, GpuError, Profiler, read_back, read_texture};
use lanternfish_papers::{
    DeepImageSettings,
    deep_images::{
        DeepImageBuilder, DeepImages,
        view::{Colors, PointCloud, PointSize, TexelViews},
    },
};
use lanternfish_scene::Scene;

use super::{
    args::{DeepImagesArgs, DeepView},
    sheet::Sheet,
};
use crate::{error::CliError, progress::Progress, report::grouped};

/// Greatest width of images of texels without --upscale, pixels, unless one pixel per texel is wider.
const WIDTH: u32 = 1280;
/// Images that are shown transparently side by side, at most.
const TRANSPARENT: u32 = 6;
/// Colours of the heat map, from least to most.
const HEAT: [&str; 6] = ["black", "blue", "cyan", "green", "yellow", "red"];

/// The image, and the lines to print.
pub fn look(
    args: &DeepImagesArgs,
    gpu: &Gpu,
    scene: &Scene,
    view: &View,
    progress: &mut Progress,
) -> Result<(RenderedImage, String), CliError> {
    let settings = args.images.settings(gpu.device.limits().max_texture_dimension_2d)?;
    // The builders draw the BVH's triangles.
    let renderer = Renderer::new(&gpu.device, &gpu.queue, Settings::direct_light().with_shadows(Shadows::BVH))?;
    let uploaded = progress.step("upload", "Building the BVH, uploading", || renderer.upload(scene))?;
    let mut looker = Looker { args, gpu, profiler: Profiler::new(&gpu.device, &gpu.queue), lines: String::new() };
    let images = progress.step("build", "Building deep images", || looker.build(settings, &uploaded))?;
    let sheet = progress.step("show", "Drawing", || match args.shown.view {
        DeepView::Points => looker.points(&images, &uploaded, view),
        DeepView::Layer => looker.layers(&images, &[args.shown.layer]),
        DeepView::Layers => looker.layers(&images, &(0..args.shown.layers as i32).collect::<Vec<_>>()),
        DeepView::Count => looker.counts(&images),
        DeepView::Transparent => looker.transparent(&images),
    })?;
    Ok((sheet.into_image(), looker.lines))
}

struct Looker<'a> {
    args: &'a DeepImagesArgs,
    gpu: &'a Gpu,
    profiler: Profiler,
    /// The lines to print.
    lines: String,
}

impl Looker<'_> {
    fn say(&mut self, name: &str, value: impl Display) {
        self.lines += &format!("{name:<12}{value}\n");
    }

    /// Records and submits a frame, waits with `wait`, and reports its time.
    fn frame<R, W>(
        &mut self,
        name: &str,
        record: impl FnOnce(&mut Frame<'_>) -> Result<R, RenderError>,
        wait: impl FnOnce(&Gpu, &R) -> Result<W, CliError>,
    ) -> Result<(R, W), CliError> {
        let started = Instant::now();
        let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
        let recorded = record(&mut frame).map_err(|error| with_remedy(error, self.args.shown.view))?;
        frame.submit();
        let waited = wait(self.gpu, &recorded)?;
        let wall = 1e3 * started.elapsed().as_secs_f64();
        let passes = self.profiler.finished();
        match passes.is_empty() {
            false => self.say(name, format_args!("{:.1} ms", passes.iter().map(|pass| pass.ms).sum::<f64>())),
            // The device has no timestamps.
            true => self.say(name, format_args!("{wall:.1} ms, with compiling and waiting")),
        }
        Ok((recorded, waited))
    }

    fn build(&mut self, settings: DeepImageSettings, scene: &GpuScene) -> Result<DeepImages, CliError> {
        let mut builder = DeepImageBuilder::new(&self.gpu.device, settings)?;
        let wait = |gpu: &Gpu, images: &DeepImages| {
            let last = images.chunks.last().expect("a set has directions");
            Ok(read_back::<u32>(&gpu.device, &gpu.queue, &last.list_starts, 1)?)
        };
        let (images, _) = self.frame("build", |frame| builder.record(frame, scene), wait)?;
        let (count, counts) = (images.directions.len(), images.counts);
        let resolution = settings.resolution;
        let texels = count as f64 * f64::from(resolution).powi(2);
        self.say("directions", settings.directions.to_string());
        self.say("images", format_args!("{count} of {resolution} x {resolution} texels, {}", settings.builder));
        let each = counts.kept as f64 / texels;
        let (stored, drawn) = (grouped(counts.kept), grouped(counts.drawn));
        self.say("fragments", format_args!("{stored}, {each:.2} per texel, of {drawn} drawn"));
        self.say("bytes", grouped(counts.bytes));
        Ok(images)
    }

    fn points(&mut self, images: &DeepImages, scene: &GpuScene, view: &View) -> Result<Sheet, CliError> {
        let cloud = PointCloud::new(&self.gpu.device, &images.settings)?;
        let image = self.args.shown.image;
        let usual = PointSize::for_images(image.map_or(images.directions.len(), |_| 1));
        let size = PointSize { texels: self.args.shown.point_size.unwrap_or(usual.texels), ..usual };
        let (_, pixels) = self.frame(
            "points",
            |frame| cloud.record(frame, scene, images, image, view, size),
            |gpu, rendering| Ok(read_texture(&gpu.device, &gpu.queue, rendering.display.texture())?),
        )?;
        match image {
            Some(image) => self.say_image(images, image),
            None => self.say("shown", "all images"),
        }
        Ok(Sheet::new(view.size.x, pixels))
    }

    /// Layers of one image, on one grey scale. Layers beyond the longest list are omitted.
    fn layers(&mut self, images: &DeepImages, layers: &[i32]) -> Result<Sheet, CliError> {
        let texels = TexelViews::new(&self.gpu.device, &images.settings)?;
        let image = self.args.shown.image.unwrap_or(0);
        let upscale = self.upscale(images, layers.len() as u32);
        let mut shown = Vec::new();
        let mut scale = (0.0, 0.0);
        let edge = images.chunks[0].grid.resolution.saturating_mul(upscale);
        let (_, renderings) = self.frame(
            "layers",
            |frame| {
                // The scale spans the complete image, from the nearest first surface to the farthest last one.
                let first = texels.layer(frame, images, image, 0)?.extent();
                let last = texels.layer(frame, images, image, -1)?.extent();
                scale = (first.map_or(0.0, |(least, _)| least), last.map_or(0.0, |(_, most)| most));
                let mut depths = Vec::new();
                for layer in layers {
                    match texels.layer(frame, images, image, *layer) {
                        Err(RenderError::NoSuch { .. }) if !shown.is_empty() => break,
                        read => depths.push(read?),
                    }
                    shown.push(layer.to_string());
                }
                Sheet::check(depths.len() as u32, edge)?;
                let colors = Colors::Grey(scale.0, scale.1);
                depths.iter().map(|depths| texels.paint(frame, depths, colors, upscale)).collect::<Result<Vec<_>, _>>()
            },
            |gpu, renderings| {
                let read = |i: usize| read_texture(&gpu.device, &gpu.queue, renderings[i].texture());
                Ok((0..renderings.len()).map(read).collect::<Result<Vec<_>, _>>()?)
            },
        )?;
        self.say_image(images, image);
        self.say("layers", shown.join(", "));
        let (white, dark) = scale;
        self.say(
            "scale",
            format_args!("white {white:.2} m, darkest {dark:.2} m along the axis; dark blue: no fragment"),
        );
        Ok(Sheet::side_by_side(renderings.into_iter().map(|pixels| Sheet::new(edge, pixels)).collect()))
    }

    fn counts(&mut self, images: &DeepImages) -> Result<Sheet, CliError> {
        let texels = TexelViews::new(&self.gpu.device, &images.settings)?;
        let image = self.args.shown.image.unwrap_or(0);
        let upscale = self.upscale(images, 1);
        let ((counts, red, _), pixels) = self.frame(
            "count",
            |frame| {
                let counts = texels.counts(frame, images, image)?;
                // Each colour stands for an integer.
                let steps = HEAT.len() as u32 - 1;
                let red = counts.extent().map_or(1, |(_, most)| most as u32).max(1).next_multiple_of(steps);
                let rendering = texels.paint(frame, &counts, Colors::Heat(red as f32), upscale)?;
                Ok((counts, red, rendering))
            },
            |gpu, (_, _, rendering)| Ok(read_texture(&gpu.device, &gpu.queue, rendering.texture())?),
        )?;
        self.say_image(images, image);
        let most = counts.extent().map_or(0.0, |(_, most)| most);
        self.say("count", format_args!("{:.2} per texel on average, {most} at most", counts.mean()));
        let steps = HEAT.len() as u32 - 1;
        let legend: Vec<_> = (0..).zip(HEAT).map(|(i, color)| format!("{color} {}", i * red / steps)).collect();
        self.say("scale", legend.join(", "));
        Ok(Sheet::new(images.chunks[0].grid.resolution * upscale, pixels))
    }

    /// Images whose surfaces are transparent: the chosen one, or some, evenly spaced among all.
    fn transparent(&mut self, images: &DeepImages) -> Result<Sheet, CliError> {
        let texels = TexelViews::new(&self.gpu.device, &images.settings)?;
        let all = images.directions.len() as u32;
        let shown: Vec<u32> = match self.args.shown.image {
            Some(image) => vec![image],
            None => (0..TRANSPARENT.min(all)).map(|i| i * all / TRANSPARENT.min(all)).collect(),
        };
        let upscale = self.upscale(images, shown.len() as u32);
        let edge = images.chunks[0].grid.resolution.saturating_mul(upscale);
        let (_, renderings) = self.frame(
            "transparent",
            |frame| {
                Sheet::check(shown.len() as u32, edge)?;
                let mut paint = |image: &u32| {
                    let darkness = texels.transparent(frame, images, *image)?;
                    texels.paint(frame, &darkness, Colors::Grey(0.0, 1.0), upscale)
                };
                shown.iter().map(&mut paint).collect::<Result<Vec<_>, _>>()
            },
            |gpu, renderings| {
                let read = |rendering: &wgpu::TextureView| read_texture(&gpu.device, &gpu.queue, rendering.texture());
                Ok(renderings.iter().map(read).collect::<Result<Vec<_>, _>>()?)
            },
        )?;
        for image in shown {
            self.say_image(images, image);
        }
        Ok(Sheet::side_by_side(renderings.into_iter().map(|pixels| Sheet::new(edge, pixels)).collect()))
    }

    /// Pixels per texel edge, for a sheet of `count` images.
    fn upscale(&self, images: &DeepImages, count: u32) -> u32 {
        let wide = WIDTH / (Sheet::columns(count) * images.chunks[0].grid.resolution);
        self.args.output.upscale.unwrap_or(wide.max(1))
    }

    fn say_image(&mut self, images: &DeepImages, image: u32) {
        let axis = images.directions.axes()[image as usize];
        self.say("shown", format_args!("image {image}, along {:.3},{:.3},{:.3}", axis.x, axis.y, axis.z));
    }
}

/// Converts an error for the command line, with a hint that names this command's flags.
fn with_remedy(error: RenderError, view: DeepView) -> CliError {
    let hint = match &error {
        RenderError::Size { .. } if view != DeepView::Points => "choose a smaller --upscale, --resolution or --layers",
        RenderError::Gpu(GpuError::TooLarge { .. }) | RenderError::Overflow { .. } => {
            "choose a smaller --resolution, fewer --directions, or another adapter with --adapter"
        }
        _ => return error.into(),
    };
    CliError::new(error, hint)
}
