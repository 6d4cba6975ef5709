//! Adds the lights of the flags to a scene.

use std::path::Path;

use lanternfish_scene::{
    Environment, Scene,
    generate::{Rain, random_lights},
};

use crate::{
    args::{EnvironmentSun, LightArgs, RenderArgs},
    error::CliError,
    motion::Motion,
    parse::LightSet,
    progress::Progress,
    scene,
};

/// Adds the lights of the flags to those of the file and replaces the file's environment if a flag sets one. Returns the light
/// rain, in its state at 0 s.
pub fn apply_lights(scene: &mut Scene, flags: &LightArgs, seed: u32) -> Result<Option<Rain>, CliError> {
    let mut rain = None;
    match flags.lights {
        Some(LightSet::Rain { count, radius }) => rain = Some(Rain::add(scene, count, radius, seed)),
        Some(LightSet::Random { count, radius, seed, bounds }) => {
            scene.lights.extend(random_lights(&bounds, count, radius, seed));
        }
        None => {}
    }
    // Lights of the flags come last: `shot/shown.rs` tells them by that.
    if let Some(path) = &flags.environment {
        let mut environment = environment(path, flags.environment_rotation, flags.environment_scale)?;
        if flags.environment_sun != Some(EnvironmentSun::Image) {
            scene.lights.extend(environment.take_sun());
        }
        scene.environment = Some(environment);
    }
    let lights = [&flags.points, &flags.disks, &flags.rectangles].into_iter().flatten().chain(&flags.sun);
    scene.lights.extend(lights.cloned());
    if let Some(sky) = flags.sky {
        scene.sky = sky;
    }
    Ok(rain)
}

/// Reads an environment, rotates it by `rotation` degrees, and scales it.
fn environment(path: &Path, rotation: f32, scale: f32) -> Result<Environment, CliError> {
    let mut environment = Environment::load(path)?;
    environment.rotation = rotation.to_radians();
    for pixel in &mut environment.pixels {
        *pixel *= scale;
        if !pixel.is_finite() {
            let what = format!("{}: --environment-scale {scale} makes a pixel too bright for a float", path.display());
            return Err(CliError::new(what, "choose a smaller one"));
        }
    }
    Ok(environment)
}

/// The scene with the lights of these flags, at 0 s, and its motion.
pub fn lit_scene(args: &RenderArgs, progress: &mut Progress) -> Result<(Scene, Option<Motion>), CliError> {
    progress.step("load", &format!("Loading {}", args.scene), || scene_with_lights(args))
}

/// The same where nothing is told of.
pub fn scene_with_lights(args: &RenderArgs) -> Result<(Scene, Option<Motion>), CliError> {
    let mut scene = scene::load_part(&args.scene, &args.part)?;
    let rain = apply_lights(&mut scene, &args.lights, args.run.seed)?;
    let motion = Motion::of(&scene, &args.track, rain)?;
    motion.iter().try_for_each(|motion| motion.at_time(&mut scene, 0.0))?;
    Ok((scene, motion))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use glam::Vec3;
    use lanternfish_metrics::{RgbImage, write_exr};

    use super::*;
    use crate::cli::{Cli, Command};

    /// The window's shot counts the lights of flags from the end of the list.
    #[test]
    fn the_sun_of_an_environment_precedes_the_lights_of_flags() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.exr");
        let mut pixels = vec![[1.0; 3]; 256 * 128];
        pixels[20 * 256 + 7] = [60_000.0; 3];
        write_exr(&path, &RgbImage::new(256, 128, pixels).unwrap()).unwrap();
        let lights_of = |more: &[&str]| {
            let words = ["lanternfish", "render", "demo:cornell", "--point", "0,1,0,2", "--environment"];
            let words = words.into_iter().chain([path.to_str().unwrap()]).chain(more.iter().copied());
            let Command::Render(args) = Cli::parse_from(words).command else { panic!() };
            let args = args.render;
            let mut scene = Scene::default();
            apply_lights(&mut scene, &args.lights, 0).unwrap();
            (scene.lights.iter().map(|light| light.name.clone()).collect::<Vec<_>>(), scene.environment.unwrap())
        };
        let (names, sky) = lights_of(&[]);
        assert_eq!(names, ["sun of the environment", ""]);
        assert!(sky.pixels.iter().all(|pixel| *pixel == Vec3::ONE));
        let (names, sky) = lights_of(&["--environment-sun", "image"]);
        assert_eq!(names, [""]);
        assert!(sky.pixels.iter().any(|pixel| pixel.x > 50_000.0));
        let (_, turned) = lights_of(&["--environment-rotation", "90", "--environment-scale", "0.5"]);
        assert_eq!((sky.rotation, turned.rotation, turned.pixels[0]), (0.0, 90f32.to_radians(), Vec3::splat(0.5)));
    }
}
