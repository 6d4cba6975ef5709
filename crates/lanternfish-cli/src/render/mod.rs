//! Renders a scene's file to an image, or to the images of a sequence.
//!
//! 1. Refuse what can be refused without work. Skip existing frames, if requested ([`existing`]).
//! 2. Read the scene, choose cameras and light ([`crate::stage`]), all at 0 s, whichever frames are requested.
//! 3. Upload it in this state and render frame after frame ([`renderings`]).

pub mod existing;
mod lights;
pub mod many;
pub mod metadata;
mod renderings;

use std::{
    process::{Command, Stdio},
    time::Instant,
};

use glam::Vec3;
use lanternfish::{
    Aovs, GpuScene, RenderedImage, Renderer,
    debug_views::Scale,
    direct_light::reach::lights_in_reach,
    settings::{Background, DebugView, Exposure, Indirect, Occlusion, Settings, Shadows},
};
use lanternfish_gpu::{Engine, Gpu, driver_warning};
use lanternfish_metrics::Animation;
use lanternfish_scene::Scene;
use rayon::prelude::*;

pub use self::lights::{apply_lights, lit_scene, scene_with_lights};
use self::{existing::Expected, renderings::RenderedImages};
use crate::{
    args::RenderArgs,
    camera::Cameras,
    error::{CliError, check_image_memory},
    light_rig::{FillLight, Lighting},
    output::{self, Output},
    outputs::{Classes, Names, Quantity},
    paper,
    progress::Progress,
    report::{Run, without_effect},
    shot::{Shot, ShotFrame},
    stage::{Posed, Stage},
    stereo::StereoLayout,
};

/// An image to render, or an existing one.
#[derive(Debug)]
struct Planned<F> {
    frame: F,
    /// The frame to render first, for images that show changes since then.
    before: Option<F>,
    /// The frame that motion of its surfaces leads to.
    next: Option<F>,
    output: Output,
    is_there: bool,
}

impl Planned<ShotFrame> {
    fn posed(self, cameras: &mut Cameras<'_>) -> Result<Planned<Posed>, CliError> {
        let Self { frame, before, next, output, is_there } = self;
        let mut posed = |frame| Posed::of(frame, cameras);
        let (frame, before) = (posed(frame)?, before.map(&mut posed).transpose()?);
        Ok(Planned { frame, before, next: next.map(posed).transpose()?, output, is_there })
    }
}

/// Renders one scene on `device`, which is opened if there is none.
fn run(shot: &Shot, started: Instant, device: &mut Option<Device>) -> Result<(), CliError> {
    let args = &shot.args;
    let planned = plan(shot)?;
    let output = &planned[0].output.clone();
    let classes = args.output.classes.as_deref().map(Classes::read).transpose()?.unwrap_or_default();
    let (settings, size) = (args.settings(), args.output.size);
    let (is_sequence, count) = (args.track.is_sequence(), planned.len());
    let mut progress = Progress::start(args.run.quiet);
    let there = planned.iter().filter(|planned| planned.is_there).count();
    if there > 0 {
        progress.note(&format!("{there} of {} images exist and are complete", planned.len()));
    }
    if there == planned.len() {
        if args.run.report.is_some() {
            progress.note("nothing is rendered, so there is no report");
        }
        progress.finish();
        let lines = planned.iter().enumerate().map(|(index, planned)| told(index, count, &planned.output));
        output::print(&lines.collect::<String>())?;
        return open(args, &planned);
    }

    let images = if args.stereo.stereo.is_some() { 2 } else { 1 };
    let of_outputs = match args.quantities() {
        [] => 0,
        quantities => Aovs::BYTES_PER_PIXEL + output.bytes_of(quantities),
    };
    // An animation is kept until its end.
    let of_frames = if output.is_animation() { images * planned.len() as u64 } else { 0 };
    check_image_memory(
        size,
        of_frames + images * (RenderedImage::BYTES_PER_PIXEL + output.bytes_per_pixel()) + of_outputs,
    )?;
    if output.is_radiance() && settings.image.exposure != Exposure::Auto {
        progress.note("--exposure does not change an .exr file, which holds radiance; it is for .png");
    }
    if settings.image.debug_view == Some(DebugView::Motion) && planned.iter().all(|planned| planned.before.is_none()) {
        progress.note("motion is relative to an earlier frame; --time SECONDS or --frames A-B sets the time");
    }
    let is_metered = renderings::are_metered(&settings, output);
    let lights = Lighting { is_metered, ..Lighting::of(args) };
    let mut opened = None;
    let pose = |cameras: &mut Cameras<'_>| planned.into_iter().map(|planned| planned.posed(cameras)).collect();
    let Stage { scene, motion, first, posed: planned, rig, lighting } =
        Stage::<Vec<_>>::of(shot, (shot.first(), pose), lights, &mut progress, |scene, progress| {
            let counts_lights = matches!(settings.image.debug_view, Some(DebugView::LightCount | DebugView::RayCount));
            if scene.lights.is_empty() && counts_lights {
                progress
                    .note("this view counts lights, and the scene has none: the studio and the sky are an environment");
            }
            if scene.triangle_counts().1 > LARGE {
                opened.insert(new_renderer(device, args, &settings.for_scene(scene), progress)?).check_memory(scene)?;
            }
            Ok(())
        })?;
    note_unused_light(&progress, &scene, &settings);
    let has_sky = scene.sky != Vec3::ZERO || scene.environment.is_some();

    let own = || new_renderer(device, args, &settings.for_scene(&scene), &mut progress);
    let renderer = opened.map_or_else(own, Ok)?;
    // Upload the state at 0 s, so that every frame has the same acceleration structure, whichever frame is first.
    let uploaded = progress.step("upload", "Building the BVH, uploading", || renderer.upload(&scene))?;
    note_many_lights(&progress, &uploaded, &renderer);
    let scale = settings.image.debug_view.and_then(Scale::of);
    if let (Some(scale), Some(view)) = (&scale, settings.image.debug_view) {
        progress.note(&format!("scale of {view}: {scale}"));
    }
    let is_lit = lights.is_seen && lights.reaches_surfaces;
    let may_lack_light = (is_metered && is_lit && FillLight::may_lack(&scene, &args.lights)).then_some(lighting);
    let names = (!args.quantities().is_empty()).then(|| Names::of(&scene, &classes));
    let mut renderings = RenderedImages::new(args, renderer, uploaded, scene, motion, rig, may_lack_light);
    renderings.names = names;
    if is_metered {
        // Do not render a frame twice.
        let next = planned.iter().find(|planned| !planned.is_there).map(|planned| &planned.frame.frame);
        let is_next = next.is_some_and(|next| next.time == first.frame.time && next.view == first.frame.view);
        renderings.meter(&first, is_next, &mut progress)?;
    }
    renderings.animation = output.is_animation().then(|| Animation::new(args.track.fps));
    let mut last = String::new();
    for (index, Planned { frame, before, next, output, is_there }) in planned.iter().enumerate() {
        if !is_there {
            if let Some(before) = before {
                renderings.show(before, &mut progress)?;
            }
            renderings.make(frame, next.as_ref(), output, &mut progress)?;
        }
        last = told(index, count, output);
        // The last line of output must be an image's path.
        if is_sequence && index + 1 < count {
            output::print(&last)?;
        }
    }

    if let Some(animation) = renderings.animation.take() {
        progress.step("write", &format!("Writing {}", output.path.display()), || animation.write(&output.path))?;
    }
    progress.warn(lost_cells(&renderings.cost.counters));
    let mut seconds = progress.finish();
    seconds.push(("total", started.elapsed().as_secs_f64()));
    let run = Run {
        scene: &args.scene,
        output: &output.path,
        adapter: &device.as_ref().expect("the renderer is on it").gpu.description,
        size,
        frames: is_sequence.then(|| u32::try_from(count - there).expect("frames have numbers")),
        exposure: renderings.exposure,
        settings: &settings,
        seed: args.run.seed,
        cost: &renderings.cost,
        memory: &renderings.memory(),
        without_effect: &without_effect(&settings, has_sky, &renderings.cost.counters),
        seconds: &seconds,
    };
    if let Some(path) = &args.run.report {
        output::write_text(path, &run.to_json())?;
    }
    let mut table = String::new();
    if args.run.timings {
        let of_paper = args.paper.map(|paper| paper::table(paper, &settings) + "\n").unwrap_or_default();
        table = of_paper + &run.to_table() + "\n";
    }
    output::print(&(table + &last))?;
    open(args, &planned)
}

/// Placed triangles from which on choosing a camera and light takes seconds.
const LARGE: usize = 10_000_000;

/// The adapter, and what was compiled for it.
struct Device {
    gpu: Gpu,
    engine: Engine,
}

/// A renderer on the device, which is opened if there is none.
fn new_renderer(
    device: &mut Option<Device>,
    args: &RenderArgs,
    settings: &Settings,
    progress: &mut Progress,
) -> Result<Renderer, CliError> {
    let device = match device {
        Some(device) => device,
        None => {
            let choice = args.run.adapter.clone().unwrap_or_default();
            let gpu = progress.step("adapter", "Opening the adapter", || Gpu::open(&choice))?;
            progress.warn(driver_warning(&gpu.device.adapter_info()));
            let engine = Engine::new(&gpu.device, &gpu.queue);
            device.insert(Device { gpu, engine })
        }
    };
    let engine = &device.engine;
    Ok(progress.step("compile", "Compiling shaders", || Renderer::with_engine(engine, settings.clone()))?)
}

/// Opens the last image in the system's viewer, if requested.
fn open<F>(args: &RenderArgs, planned: &[Planned<F>]) -> Result<(), CliError> {
    let Some(last) = planned.last().filter(|_| args.output.open) else { return Ok(()) };
    let path = &last.output.path;
    let opener: &[&str] = if cfg!(windows) {
        &["cmd", "/c", "start", ""]
    } else if cfg!(target_os = "macos") {
        &["open"]
    } else {
        &["xdg-open"]
    };
    let mut command = Command::new(opener[0]);
    // A relative path may begin with a hyphen.
    command.args(&opener[1..]).arg(std::path::absolute(path).unwrap_or_else(|_| path.clone()));
    match command.stdin(Stdio::null()).stdout(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(()),
        _ => {
            let what = format!("--open: `{}` has not opened {}", opener[0], path.display());
            Err(CliError::new(what, "the image is complete: open it in a program of your choice"))
        }
    }
}

/// The images and their files. Refuses everything that can be refused without work.
fn plan(shot: &Shot) -> Result<Vec<Planned<ShotFrame>>, CliError> {
    let args = &shot.args;
    let named = args.output.output.as_deref();
    let animation = Output::animation(named.filter(|_| args.track.is_sequence()));
    let output = animation.map_or_else(|| Output::choose(named, &args.scene), Ok)?;
    let output = output.over(args.settings().image.background);
    if output.is_animation() && (args.track.skip_existing || !args.quantities().is_empty()) {
        let what = format!("{}: --skip-existing and --outputs are for a file for each frame", output.path.display());
        return Err(CliError::new(what, "leave them out, or end the name with .png or .exr"));
    }
    if args.output.output.is_none() {
        output::refuse_texture(&output.path, &args.scene)?;
    }
    if output.is_opaque() && args.settings().image.background == Background::Transparent {
        let what = format!("{}: .jpg and .gif files have no alpha", output.path.display());
        return Err(CliError::new(what, "end the name with .png or .exr, or name a colour: --background white"));
    }
    let is_more = args.track.is_sequence() || args.run.timings || !args.quantities().is_empty() || args.output.open;
    if output.is_stdout() && is_more {
        let hint = "name a file, or leave out what makes several, prints a table or opens it";
        return Err(CliError::new("-o -: one image alone goes to standard output", hint));
    }
    let of = |frame: &ShotFrame| frame.number.map_or_else(|| output.clone(), |number| output.numbered(number));
    let frames = shot.frames();
    let outputs: Vec<_> = frames.iter().map(of).collect();
    outputs.iter().try_for_each(|output| output::check_writable(&output.path))?;
    let environment = args.lights.environment.as_deref().map(|path| (path, "--environment"));
    let classes = args.output.classes.as_deref().map(|path| (path, "--classes"));
    let read: Vec<_> = [(args.scene.path(), "the scene")].into_iter().chain(environment).chain(classes).collect();
    let quantities = args.quantities();
    let others: Vec<_> = outputs.iter().flat_map(|output| output.others(quantities)).collect();
    let others = others.iter().map(|path| (path.as_path(), "a file of --outputs"));
    let renderings: Vec<_> = outputs.iter().map(|output| (output.path.as_path(), "the image")).chain(others).collect();
    output::refuse_same(&renderings, &read)?;
    if let Some(path) = &args.run.report {
        output::check_writable(path)?;
        output::refuse_same(&[(path, "--report")], &[read, renderings].concat())?;
    }
    if let Some(view) = args.settings().image.debug_view.filter(|_| output.is_radiance()) {
        let what = format!("{}: --debug-view {view} is an image, .exr and .npz hold radiance", output.path.display());
        return Err(CliError::new(what, "end the name with .png, or leave --debug-view out"));
    }
    let layers = args.stereo.stereo.is_some() && args.stereo.stereo_layout == StereoLayout::Layers;
    if layers && !output.has_layers() {
        let what = format!("{}: --stereo-layout layers makes two layers, which only .exr holds", output.path.display());
        return Err(CliError::new(what, "end the name with .exr, or leave --stereo-layout out"));
    }
    if args.stereo.stereo.is_some() && !quantities.is_empty() {
        return Err(CliError::new("--outputs with --stereo: they are of one camera", "leave one of them out"));
    }
    if args.output.classes.is_some() && !quantities.contains(&Quantity::Semantic) {
        return Err(CliError::new("--classes without --outputs semantic", "add it, or leave --classes out"));
    }
    if let Some(quantity) = quantities.iter().find(|quantity| quantity.needs_floats() && !output.is_radiance()) {
        let what = format!("{}: a .png file cannot hold --outputs {}", output.path.display(), quantity.name());
        return Err(CliError::new(what, "end the name with .exr or .npz"));
    }
    let expected = Expected::of(args);
    let is_there = |output: &Output| args.track.skip_existing && expected.fault(output).is_none();
    let there: Vec<_> = outputs.par_iter().map(is_there).collect();
    let shows_motion = args.settings().image.debug_view == Some(DebugView::Motion);
    let before = |frame: &ShotFrame| shot.beside(frame, -1).filter(|_| shows_motion);
    let next = |frame: &ShotFrame| shot.beside(frame, 1).filter(|_| quantities.contains(&Quantity::Motion));
    let planned = frames.into_iter().zip(outputs).zip(there);
    let of =
        |((frame, output), is_there)| Planned { before: before(&frame), next: next(&frame), frame, output, is_there };
    Ok(planned.map(of).collect())
}

/// The line on standard output when the image of this index of `count` and all before it are finished.
fn told(index: usize, count: usize, output: &Output) -> String {
    match output.is_stdout() || (output.is_animation() && index + 1 < count) {
        true => String::new(),
        false => format!("{}\n", output.path.display()),
    }
}

/// A warning if the radiance cache was full.
fn lost_cells(counters: &[(String, u64)]) -> Option<String> {
    let lost = |(name, count): &&(String, u64)| {
        *count > 0 && ["indirect/lost_entries", "radiance_cache/lost"].contains(&name.as_str())
    };
    counters.iter().find(lost).map(|_| {
        "the radiance cache is full; multi-bounce light is approximate and not reproducible. \
         Raise --cache-entries, or choose --hit-light shaded"
            .to_owned()
    })
}

#[cfg(test)]
#[test]
fn a_full_cache_gives_a_warning() {
    let counters = |count| [("indirect/rays".to_owned(), 7), ("radiance_cache/lost".to_owned(), count)];
    assert_eq!(lost_cells(&counters(0)), None);
    assert!(lost_cells(&counters(1)).is_some_and(|text| text.contains("--cache-entries")));
}

/// Lights in reach of a point from which on a ray to each is slow beside samples.
const MANY_LIGHTS: f32 = 100.0;

/// Notes that so many lights reach a point that samples would be several times as fast.
fn note_many_lights(progress: &Progress, uploaded: &GpuScene, renderer: &Renderer) {
    let settings = renderer.settings();
    let in_reach = lights_in_reach(uploaded);
    if settings.direct.is_none() && settings.shadows.technique != Shadows::None && in_reach > MANY_LIGHTS {
        progress.note(&format!(
            "about {in_reach:.0} lights reach a point, and each gets a ray; --direct sampled is faster, and exact with --accumulate"
        ));
    }
}

/// Notes which light has no effect on the image.
fn note_unused_light(progress: &Progress, scene: &Scene, settings: &Settings) {
    if settings.image.debug_view.is_some() {
        return;
    }
    let (has_occlusion, sees_environment) =
        (settings.occlusion != Occlusion::NONE, settings.indirect.sees_environment());
    if has_occlusion && sees_environment {
        progress.note(
            "--occlusion has no effect on this image: --indirect sampled traces rays to the environment; \
             with --indirect none, --occlusion shades the environment's light",
        );
    }
    let misses_sky = settings.indirect != Indirect::NONE && !sees_environment;
    let has_sky = scene.sky != Vec3::ZERO || scene.environment.is_some();
    if misses_sky && !has_occlusion && has_sky {
        progress
            .note("the environment's image lights nothing: --indirect virtual-lights ignores it, --occlusion deep includes it");
    }
    let has_ambient = settings.get("occlusion-ambient").is_some_and(|ambient| ambient != "0");
    if has_occlusion && !sees_environment && !has_sky && !has_ambient {
        progress.note("--occlusion shades the light of the environment, and there is none; try --sky 0.5,0.5,0.5 or --environment FILE");
    }
}
