//! `lanternfish reference`: renders the ground truth of a shot by path tracing on the CPU.
//!
//! 1. Read the scene as `render` does ([`crate::shot`], [`crate::stage`]).
//! 2. Resume from the output, if requested and if its settings match ([`fingerprint`], [`mod@file`]).
//! 3. Add samples pass by pass until the goal is reached or the user interrupts ([`trace`], [`crate::signals`]).
//! 4. Write mean and variance.

mod args;
mod file;
pub mod fingerprint;
pub mod merge;
mod sums;
#[cfg(test)]
mod tests;
mod trace;

use std::time::Instant;

use clap::ArgMatches;
use lanternfish::settings::{Background, Exposure, ImageSettings};
use lanternfish_reference::{
    Film, Settings, Tracer,
    settings::{Integrator, UNLIMITED},
};
use lanternfish_scene::{Camera, Scene};

pub use self::{
    args::{HELP, ReferenceArgs, shared_flags},
    merge::MergeArgs,
};
use self::{
    file::{Before, Look, Making, Target},
    trace::Goal,
};
use crate::{
    args::{EnvironmentSun, RenderArgs},
    camera::{self, Cameras},
    error::{CliError, check_image_memory, say},
    light_rig::Lighting,
    output,
    parse::{Frames, Size},
    progress::Progress,
    report::{grouped, steps},
    shot, signals,
    stage::{Posed, Stage},
    table::{Row, to_text},
};

/// Traces, and returns the exit code: 0, or that of an interrupting signal such as Ctrl-C.
pub fn run(args: &ReferenceArgs, matches: &ArgMatches, started: Instant) -> Result<u8, CliError> {
    let mut shot = shot::resolve(&args.scene, matches)?;
    let frames = shot.args.track.frames.take();
    let is_track = frames.is_some() || shot.args.track.orbit.is_some();
    if let Some(Frames::Span(_)) = frames {
        shot.args.track.time = Some(0.0);
    }
    // The rays of a path tracer find a sun in the image.
    shot.args.lights.environment_sun.get_or_insert(EnvironmentSun::Image);
    let frame = shot.first();
    let (flags, size) = (&shot.args, shot.args.output.size);
    let settings = args.settings(flags, args.samples.seed.unwrap_or(0))?;
    let path = args.output.output.clone();
    let part = args.samples.range.map(|part| format!(".{part}")).unwrap_or_default();
    let path = path.unwrap_or_else(|| output::default_path(&args.scene).with_extension(format!("reference{part}.exr")));
    let target = Target::choose(path, args.output.variance.clone(), args.output.resume)?;
    if let Some(part) = args.samples.range.filter(|_| target.is_png()) {
        let what = format!("{}: --samples {part} makes a part, which PNG does not hold", target.path.display());
        return Err(CliError::new(what, "end the name with .exr"));
    }
    let writing = target.bytes_per_pixel(args.samples.range.is_some());
    check_image_memory(size, Film::BYTES_PER_PIXEL + writing)?;
    let environment = flags.lights.environment.as_deref();
    let read = [args.scene.path(), flags.scene.path()].into_iter().chain(environment);
    if let Some(other) = target.overlap(read) {
        let what = format!("{}: both read and written", other.display());
        return Err(CliError::new(what, "give the image another name"));
    }
    if let Some(threads) = args.run.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        pool.map_err(|error| CliError::new(format_args!("--threads {threads}: {error}"), "choose fewer"))?;
    }
    let mut progress = Progress::start(flags.run.quiet);
    if is_track {
        progress.note("a reference is one image, at the start of the track; --time chooses another time");
    }
    if flags.settings().image.background != Background::Environment {
        progress.note("the shot's --background is not used: the path tracer shows the environment");
    }
    if flags.lights.lights.is_some() && args.samples.seed.is_some() && flags.run.seed == 0 {
        progress.note("--seed is the seed of the noise; --rain-seed is the seed of --lights rain");
    }

    let is_seen = settings.integrator == Integrator::Path;
    let lights =
        Lighting { is_seen, reaches_surfaces: true, catches_shadows: false, is_metered: false, ..Lighting::of(flags) };
    let check = |scene: &Scene, _: &mut Progress| Ok(Tracer::check_memory(scene)?);
    let Stage { mut scene, motion, first: Posed { frame, mut camera }, rig, .. } =
        Stage::of(&shot, (frame, |_: &mut Cameras<'_>| Ok(())), lights, &mut progress, check)?;
    // As in `render`: choose cameras and light at 0 s, then move the scene to the frame's time.
    if let (Some(motion), Some(time)) = (motion, frame.time) {
        let bounds = scene.bounds();
        motion.at_time(&mut scene, time)?;
        camera = camera::follow(&scene, &bounds, &frame.view, size.aspect(), &camera)?;
    }
    let camera = &camera;

    let making = Making {
        fingerprint: fingerprint::of(&scene, camera, size, &settings),
        seed: settings.seed,
        part: args.samples.range,
        facts: facts(flags, &settings, camera, size),
    };
    let before = match args.output.resume {
        true => target.before(&making, size, args.samples.seed)?,
        false => None,
    };
    if args.output.resume && before.is_none() {
        progress.note(&format!("{}: no such file yet, so tracing starts from 0", target.path.display()));
    }
    let Before { mut film, seed, dropped } = match before {
        Some(before) => before,
        None => {
            let first = making.part.map_or(0, |part| part.first - 1);
            let film = Film::part(size.width as usize, size.height as usize, first)?;
            Before { film, seed: settings.seed, dropped: 0 }
        }
    };
    let (settings, making) = (Settings { seed, ..settings }, Making { seed, ..making });

    let tracer = progress.step("build", "Building the BVHs", || Tracer::new(&scene, settings.clone()))?;
    // The film is allocated. Without memory for writing, hours of tracing would be lost.
    check_image_memory(size, writing)?;
    let ImageSettings { exposure, tone_map, .. } = flags.settings().image;
    let meters = target.is_png() && settings.integrator == Integrator::Path && exposure == Exposure::Auto;
    let coverage = if meters { tracer.coverage(camera, size.width as usize, size.height as usize) } else { Vec::new() };
    let exposure = rig.exposure().filter(|_| meters).map_or(exposure, Exposure::Ev);
    let look = Look { integrator: settings.integrator, exposure, tone_map, coverage };
    signals::end_when_requested();
    let goal = goal(args);
    let bar = progress.bar();
    let run = progress.step("trace", "Tracing", || {
        trace::trace(&tracer, camera, &mut film, &goal, &bar, |film| match target.takes_checkpoints() {
            true => target.write(film, &making, dropped + film.dropped(), &look),
            false => Ok(()),
        })
    })?;
    drop(bar);
    let dropped = dropped + film.dropped();
    progress.step("write", &format!("Writing {}", target.path.display()), || {
        target.write(&film, &making, dropped, &look)
    })?;

    if meters {
        let ev = look.exposure(&film.mean());
        progress.note(&format!("shown at {ev:+} EV; --exposure {ev} repeats it, larger is brighter"));
    }
    let noise = film.noise().relative;
    progress.result(&format!("{}: {}", target.path.display(), outcome(&film, noise, run.seconds)));
    let on = if target.is_resumable() { "; the same command with --resume continues" } else { "" };
    let black = film.row_samples().iter().filter(|row| **row == 0).count();
    if black > 0 {
        let height = film.row_samples().len();
        progress.note(&format!("{black} of {height} rows have no samples yet and are black{on}"));
    } else if run.interrupted.is_some() {
        let goal = goal.spp.map(|spp| format!(" of {spp}")).unwrap_or_default();
        progress.note(&format!("stopped at {}{goal} samples per pixel{on}", film.samples()));
    } else if let Some(error) = goal.until_error.filter(|error| noise > *error) {
        progress.note(&format!(
            "the expected error is {:.3} % after {} samples per pixel, not yet {:.3} %",
            100.0 * noise,
            film.samples(),
            100.0 * error
        ));
    }
    let mut seconds = progress.finish();
    seconds.push(("total", started.elapsed().as_secs_f64()));
    if dropped > 0 {
        say(&format_args!(
            "warning: {} samples were not finite and count as black: a fault of the scene or of Lanternfish",
            grouped(dropped)
        ));
    }
    let mut text = String::new();
    if flags.run.timings {
        text = table(&tracer, &scene, &film, &run, dropped, &seconds);
    }
    text += &format!("{}\n", target.path.display());
    output::print(&text)?;
    Ok(run.interrupted.unwrap_or(0))
}

/// Summary of the run: `256 samples per pixel in 51.2 s, expected error 1.21 %`.
fn outcome(film: &Film, noise: f64, seconds: f64) -> String {
    let most = film.row_samples().iter().max().copied().unwrap_or_default();
    let more = if most > film.samples() { format!(" to {most}") } else { String::new() };
    let error =
        if noise.is_finite() { format!("{:.2} %", 100.0 * noise) } else { "unknown below 2 samples".to_owned() };
    format!("{}{more} samples per pixel in {seconds:.1} s, expected error {error}", film.samples())
}

fn goal(args: &ReferenceArgs) -> Goal {
    let samples = &args.samples;
    if let Some(part) = samples.range {
        return Goal { spp: Some(part.last - part.first + 1), ..Goal::default() };
    }
    let is_unbounded = samples.until_error.is_some() || samples.time_limit.is_some();
    Goal {
        spp: samples.spp.or((!is_unbounded).then_some(args::SPP)),
        until_error: samples.until_error.map(f64::from),
        time_limit: samples.time_limit.map(f64::from),
    }
}

/// Text attributes that describe the settings and distinguish different ones.
fn facts(flags: &RenderArgs, settings: &Settings, camera: &Camera, size: Size) -> Vec<(String, String)> {
    let point = |p: glam::Vec3| format!("{},{},{}", p.x, p.y, p.z);
    let eye = camera.eye();
    let forward = camera.world_from_camera.transform_vector3(glam::Vec3::NEG_Z);
    let (integrator, max_distance) = match settings.integrator {
        Integrator::Path => ("path", None),
        Integrator::Occlusion => ("occlusion", None),
        Integrator::Obscurance { max_distance } => ("obscurance", Some(max_distance)),
        Integrator::Normal => ("normal", None),
    };
    let max_depth = match settings.max_depth {
        UNLIMITED => "unlimited".to_owned(),
        depth => depth.to_string(),
    };
    let mut facts = vec![
        ("lanternfish.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("lanternfish.scene", flags.scene.public_name()),
        ("lanternfish.size", format!("{}x{}", size.width, size.height)),
        ("lanternfish.eye", point(eye)),
        ("lanternfish.forward", point(forward)),
        ("lanternfish.integrator", integrator.to_owned()),
        ("lanternfish.max-depth", max_depth),
        ("lanternfish.materials", settings.materials.to_string()),
        ("lanternfish.attenuation", settings.attenuation.to_string()),
        ("lanternfish.attenuation-near-radius", settings.attenuation_near_radius.to_string()),
        ("lanternfish.attenuation-coefficients", settings.attenuation_coefficients.to_string()),
        ("lanternfish.range-threshold", settings.range_threshold.to_string()),
        ("lanternfish.light-radius", settings.light_radius.to_string()),
        ("lanternfish.sun-diameter", settings.sun_diameter.to_string()),
        ("lanternfish.light-choice", settings.light_choice.to_string()),
        ("lanternfish.light-paths", settings.light_paths.to_string()),
    ];
    facts.extend(max_distance.map(|distance| ("lanternfish.max-distance", distance.to_string())));
    facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Table of counters and durations.
fn table(
    tracer: &Tracer<'_>,
    scene: &Scene,
    film: &Film,
    run: &trace::Run,
    dropped: u64,
    seconds: &[(&'static str, f64)],
) -> String {
    let counters = [
        ("triangles", grouped(tracer.triangle_count() as u64)),
        ("lights", grouped(scene.lights.len() as u64)),
        ("threads", rayon::current_num_threads().to_string()),
        ("samples per pixel", grouped(film.samples())),
        ("samples, this run", grouped(run.added)),
        ("samples per second", trace::metric(run.added as f64 / run.seconds.max(1e-9))),
        ("samples dropped", grouped(dropped)),
        ("expected error", format!("{:.3} %", 100.0 * film.noise().relative)),
    ];
    let counters = counters.map(|(name, value)| Row::default().text("", "counter", name).shown("value", value));
    format!("{}\n{}\n", to_text(&counters), to_text(&steps(seconds)))
}
