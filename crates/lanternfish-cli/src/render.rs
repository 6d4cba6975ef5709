//! From a scene's file to a picture's.

use std::{path::Path, time::Instant};

use glam::Vec3;
use lanternfish::{
    GpuScene, Renderer, Report,
    debug_views::Scale,
    settings::{Exposure, Indirect, Occlusion},
};
use lanternfish_gpu::{Gpu, driver_warning};
use lanternfish_scene::{
    Environment, Scene,
    generate::{light_rain, random_lights},
};

use crate::{
    args::LightArgs,
    camera,
    error::CliError,
    legend,
    light_rig::{self, Lighting},
    output::{self, Output},
    parse::LightSet,
    progress::Progress,
    report::{self, Run},
    scene,
    shot::Shot,
    stereo::{self, StereoLayout},
};

pub fn run(shot: &Shot, started: Instant) -> Result<(), CliError> {
    let args = &shot.args;
    // Everything that can be refused without work is refused first.
    let output = Output::choose(args.output.output.as_deref(), &args.scene)?;
    let outputs = match args.track.frames {
        Some(frames) => (1..=frames).map(|number| output.numbered(number)).collect::<Result<_, _>>()?,
        None => vec![output],
    };
    let output = &outputs[0];
    let environment = args.lights.environment.as_deref().map(|path| (path, "--environment"));
    let read: Vec<_> = [(args.scene.path(), "the scene")].into_iter().chain(environment).collect();
    let pictures: Vec<_> = outputs.iter().map(|output| (output.path.as_path(), "the picture")).collect();
    output::refuse_same(&pictures, &read)?;
    if let Some(path) = &args.run.report {
        output::check_writable(path)?;
        output::refuse_same(&[(path, "--report")], &[read, pictures].concat())?;
    }
    let (settings, size) = (args.settings(), args.output.size);
    if let Some(view) = settings.debug_view.filter(|_| output.is_radiance()) {
        let what = format!("{}: --debug-view {view} is a picture, .exr holds radiance", output.path.display());
        return Err(CliError::new(what, "end the name with .png, or leave --debug-view out"));
    }
    let layers = args.stereo.stereo.is_some() && args.stereo.stereo_layout == StereoLayout::Layers;
    if layers && !output.is_radiance() {
        let what = format!("{}: --stereo-layout layers makes two layers, which only .exr holds", output.path.display());
        return Err(CliError::new(what, "end the name with .exr, or leave --stereo-layout out"));
    }
    let mut progress = Progress::start(args.run.quiet);

    let part = args.part.scene_of_file.as_deref();
    let mut scene = progress.step("load", &format!("Loading {}", args.scene), || {
        let mut scene = scene::load_part(&args.scene, part)?;
        apply_lights(&mut scene, &args.lights, args.run.seed)?;
        Ok::<_, CliError>(scene)
    })?;
    let aspect = size.width as f32 / size.height as f32;
    let (cameras, is_inside) = camera::choose_each(&scene, &shot.views(), aspect)?;
    if is_inside {
        progress.note(camera::INSIDE);
    }
    let shows_light = settings.debug_view.is_none();
    // A picture of a quantity wants no light.
    let lights = Lighting {
        is_seen: shows_light,
        reaches_surfaces: settings.indirect.sees_surroundings() || settings.occlusion != Occlusion::None,
    };
    light_rig::light(&mut scene, &args.lights, &cameras[0], lights, |note| progress.note(note))?;
    if settings.occlusion != Occlusion::None && settings.indirect.sees_surroundings() && shows_light {
        progress.note(
            "--occlusion has no part in this picture: rays of --indirect sampled see the surroundings themselves; \
             with --indirect none they light what --occlusion finds open",
        );
    }
    let misses_sky = settings.indirect != Indirect::None && !settings.indirect.sees_surroundings();
    let has_sky = scene.sky != Vec3::ZERO || scene.environment.is_some();
    if misses_sky && settings.occlusion == Occlusion::None && has_sky && shows_light {
        progress
            .note("the surroundings light nothing: --indirect virtual-lights does not see them, --occlusion deep does");
    }
    let lit_by_sky = settings.occlusion != Occlusion::None && !settings.indirect.sees_surroundings() && shows_light;
    if lit_by_sky && !has_sky {
        progress.note("--occlusion shades the light of the surroundings, and there are none; try --sky 0.5,0.5,0.5 or --environment FILE");
    }

    let choice = args.run.adapter.clone().unwrap_or_default();
    let gpu = progress.step("adapter", "Opening the adapter", || Gpu::open(&choice))?;
    progress.warn(driver_warning(&gpu.device.adapter_info()));
    let mut renderer =
        progress.step("compile", "Compiling shaders", || Renderer::new(&gpu.device, &gpu.queue, settings.clone()))?;
    let mut uploaded = progress.step("upload", "Building the BVH, uploading", || renderer.upload(&scene))?;
    // Kept where a picture may ask for more light.
    let mut scene = Some(scene).filter(|scene| {
        let is_metered = settings.exposure == Exposure::Auto && !output.is_radiance();
        let is_lit = lights.is_seen && lights.reaches_surfaces;
        is_metered && is_lit && light_rig::may_have_faint_sky(scene, &args.lights)
    });
    let scale = settings.debug_view.and_then(Scale::of);
    if let (Some(scale), Some(view)) = (&scale, settings.debug_view) {
        progress.note(&format!("scale of {view}: {scale}"));
    }
    let mut cost = Report::default();
    let mut exposure = None;
    for (camera, output) in cameras.iter().zip(&outputs) {
        let eyes = args.stereo.stereo.map(|eyes| eyes.cameras(camera, aspect)).transpose()?;
        let cameras = eyes.as_ref().map_or(std::slice::from_ref(camera), |eyes| eyes);
        let views: Vec<_> = cameras.iter().map(|camera| (camera, size.width, size.height)).collect();
        let draw = |progress: &mut Progress, renderer: &mut Renderer, uploaded: &GpuScene| {
            let bar = progress.bar();
            progress.step("render", "Rendering", || {
                renderer.render_frames(uploaded, &views, |done| {
                    let share = f64::from(done) / f64::from(settings.accumulate);
                    bar.show(share, format!("{done} of {} frames", settings.accumulate));
                })
            })
        };
        let mut pictures = draw(&mut progress, &mut renderer, &uploaded)?;
        if let Some(mut scene) = scene.take()
            && let Some(sky) = light_rig::faint_sky(&pictures[0])
        {
            scene.sky = sky;
            renderer.update(&mut uploaded, &scene)?;
            pictures = draw(&mut progress, &mut renderer, &uploaded)?;
            let sky = sky.to_array().map(|x| x.to_string()).join(",");
            progress.note(&format!(
                "the scene's lights leave most of the picture black, and it has no surroundings: a faint sky was added \
                 (--sky {sky} repeats that, --light-rig none leaves it out)"
            ));
        }
        let writing = format!("Writing {}", output.path.display());
        if layers {
            let named: Vec<_> = ["left", "right"].into_iter().zip(&pictures).collect();
            progress.step("write", &writing, || output.write_layers(&named))?;
        }
        let first = pictures.remove(0);
        // The pictures of a track are shown at one exposure, that of the first: each by itself would flicker.
        if let Some(ev) = first.exposure.filter(|_| exposure.is_none() && !output.is_radiance()) {
            exposure = Some(ev);
            if settings.exposure == Exposure::Auto {
                renderer.set_exposure(Exposure::Ev(ev))?;
                let all = if outputs.len() > 1 { ", metered in the first picture" } else { "" };
                progress.note(&format!("shown at {ev:+} EV{all}; --exposure {ev} repeats that, more is brighter"));
            }
        }
        let picture = match pictures.pop() {
            Some(second) => stereo::side_by_side(first, second),
            None => first,
        };
        report::add(&mut cost, picture.report.clone());
        let picture = match &scale {
            Some(scale) => legend::below(picture, scale),
            None => picture,
        };
        if !layers {
            progress.step("write", &writing, || output.write(&picture))?;
        }
    }

    let mut seconds = progress.finish();
    seconds.push(("total", started.elapsed().as_secs_f64()));
    let run = Run {
        scene: &args.scene,
        output: &output.path,
        adapter: &gpu.description,
        size,
        frames: args.track.frames,
        exposure,
        settings: &settings,
        seed: args.run.seed,
        cost: &cost,
        seconds: &seconds,
    };
    if let Some(path) = &args.run.report {
        output::write_text(path, &run.to_json())?;
    }
    let mut text = String::new();
    if args.run.timings {
        text = run.to_table() + "\n";
    }
    for output in &outputs {
        text += &format!("{}\n", output.path.display());
    }
    output::print(&text)
}

/// Adds the lights of the flags to those of the file, and puts their surroundings in the place of the file's.
pub fn apply_lights(scene: &mut Scene, flags: &LightArgs, seed: u32) -> Result<(), CliError> {
    match flags.lights {
        Some(LightSet::Rain { count, radius }) => {
            scene.lights.extend(light_rain(&scene.bounds(), count, radius, seed, 0.0));
        }
        Some(LightSet::Random { count, radius, seed, bounds }) => {
            scene.lights.extend(random_lights(&bounds, count, radius, seed));
        }
        None => {}
    }
    scene.lights.extend([&flags.points, &flags.disks, &flags.rectangles].into_iter().flatten().cloned());
    scene.lights.extend(flags.sun.clone());
    if let Some(sky) = flags.sky {
        scene.sky = sky;
    }
    if let Some(path) = &flags.environment {
        scene.environment = Some(environment(path, flags.environment_rotation, flags.environment_scale)?);
    }
    Ok(())
}

/// Reads an environment, turns it by `rotation` degrees, and multiplies it.
fn environment(path: &Path, rotation: f32, scale: f32) -> Result<Environment, CliError> {
    let mut environment = Environment::load(path)?;
    environment.rotation = rotation.to_radians();
    for pixel in &mut environment.pixels {
        *pixel *= scale;
        if !pixel.is_finite() {
            let what =
                format!("{}: --environment-scale {scale} makes a pixel brighter than numbers go", path.display());
            return Err(CliError::new(what, "choose a smaller one"));
        }
    }
    Ok(environment)
}
