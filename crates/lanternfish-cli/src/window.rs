//! `lanternfish view`: a scene in a window, under the flags of `render`.

use std::path::{Path, PathBuf};

use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Scene};
use lanternfish_viewer::{Opened, RecordKeeper, Start, ViewerError};

use crate::{
    args::RenderArgs,
    camera,
    error::CliError,
    light_rig::{self, Lighting},
    output::check_writable,
    progress::Progress,
    recording::Recorded,
    render::apply_lights,
    scene::{self, SceneName},
    shot::{self, Shot},
};

pub const HELP: &str = "\
Examples:
  lanternfish view
  lanternfish view scene.glb
  lanternfish view shot.toml --shadows bvh
  lanternfish view scene.glb --record walk.toml

W A S D fly, dragging looks about; F1 shows all keys. A file that is dropped on the window is opened.
";

/// The built-in scene that is seen where none is named.
pub const FIRST: &str = "demo:atrium";

/// Seconds of a step of what is recorded.
const STEP: f32 = 1.0 / 60.0;

/// Opens the window, and returns when it is closed. What is done to the camera is written to `record`, if it is named.
pub fn run(shot: &Shot, record: Option<&Path>) -> Result<(), CliError> {
    let args = &shot.args;
    let mut progress = Progress::start(args.run.quiet);
    let settings = args.settings();
    let (name, (scene, camera)) = (args.scene.to_string(), loaded(args, &mut progress)?);
    progress.finish();
    let size = args.output.size;
    let start = Start {
        name,
        scene,
        camera,
        settings,
        size: [size.width, size.height],
        adapter: args.run.adapter.clone().unwrap_or_default(),
        open: Box::new(|path| dropped(path).map_err(|error| error.to_string())),
        keep: Box::new(keep),
        record: record.map(|path| Ok::<_, CliError>((STEP, recorder(shot, path)?))).transpose()?,
    };
    lanternfish_viewer::run(start).map_err(|error| match error {
        ViewerError::Gpu(error) => error.into(),
        ViewerError::Render(error) => error.into(),
        error => CliError::new(error, ""),
    })
}

/// Writes what was recorded, at the end; that it can be written is known before.
fn recorder(shot: &Shot, path: &Path) -> Result<RecordKeeper, CliError> {
    check_writable(path)?;
    let (path, scene, flags) = (path.to_owned(), shot.args.scene.clone(), shot.said()?);
    Ok(Box::new(move |recording| {
        let recorded = Recorded { scene: scene.clone(), flags: flags.clone(), recording: recording.clone() };
        recorded.write(&path).map_err(|error| error.to_string())
    }))
}

/// The scene in its light, and where it is seen from.
fn loaded(args: &RenderArgs, progress: &mut Progress) -> Result<(Scene, Camera), CliError> {
    let part = args.part.scene_of_file.as_deref();
    let mut scene = progress.step("load", &format!("Loading {}", args.scene), || {
        let mut scene = scene::load_part(&args.scene, part)?;
        apply_lights(&mut scene, &args.lights, args.run.seed)?;
        Ok::<_, CliError>(scene)
    })?;
    let size = args.output.size;
    let camera = camera::choose(&scene, &args.view, size.width as f32 / size.height as f32)?;
    let lights = Lighting { is_seen: true, reaches_surfaces: true };
    light_rig::light(&mut scene, &args.lights, &camera, lights, |note| progress.note(note))?;
    Ok((scene, camera))
}

/// A file that was dropped on the window, under the flags that nobody gave.
fn dropped(path: &Path) -> Result<Opened, CliError> {
    let name = SceneName::from(path.as_os_str());
    let shot = match shot::is_shot(&name) {
        true => shot::read(path, Vec::new())?,
        false => shot::plain(&name),
    };
    let (scene, camera) = loaded(&shot.args, &mut Progress::hidden())?;
    Ok(Opened { name: name.to_string(), scene, camera })
}

/// Writes a screenshot into the current folder, under a name that is not taken.
fn keep(pixels: &[u8], [width, height]: [u32; 2]) -> Result<String, String> {
    let names = (1..).map(|i| PathBuf::from(format!("lanternfish-{i}.png")));
    let path = names.into_iter().find(|path| !path.exists()).expect("there is always another number");
    write_png(&path, width, height, ColorType::Rgba, pixels).map_err(|error| error.to_string())?;
    Ok(format!("{} is written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_dropped_is_opened_or_refused_with_a_reason() {
        let folder = tempfile::tempdir().unwrap();
        let shot = folder.path().join("box.toml");
        std::fs::write(&shot, "scene = \"demo:cornell\"\n[view]\neye = [0, 1, 3]\ntarget = [0, 1, 0]\n").unwrap();
        let opened = dropped(&shot).unwrap();
        assert!(!opened.scene.lights.is_empty() && opened.name.ends_with("box.toml"));
        assert_eq!(glam::Vec3::from(opened.camera.world_from_camera.translation), glam::Vec3::new(0.0, 1.0, 3.0));
        let missing = dropped(&folder.path().join("nothing.glb")).err().unwrap().to_string();
        assert!(missing.contains("nothing.glb"), "{missing}");
    }
}
