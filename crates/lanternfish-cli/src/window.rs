//! `lanternfish view`: a scene in a window, under the flags of `render`.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    rc::Rc,
};

use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::{Camera, Scene};
use lanternfish_viewer::{Form, Opened, RecordKeeper, Shown, Start, ViewerError, Written};

use crate::{
    args::OnlyWindowArgs,
    camera,
    error::CliError,
    light_rig::{self, Lighting},
    output::{self, check_writable},
    pictures,
    progress::Progress,
    recording::Recorded,
    render::apply_lights,
    scene::{self, SceneName},
    shot::{self, Shot, shown},
};

pub const HELP: &str = "\
Examples:
  lanternfish view
  lanternfish view scene.glb
  lanternfish view shot.toml --shadows bvh
  lanternfish view scene.glb --record walk.toml
  lanternfish view before.exr after.exr

W A S D fly, dragging looks about; F1 shows all keys. A file that is dropped on the window is opened.
Pictures (.exr, .png) are shown side by side, with a map and the mean of what differs.
";

/// The built-in scene that is seen where none is named.
pub const FIRST: &str = "demo:atrium";

/// Seconds of a step of what is recorded.
const STEP: f32 = 1.0 / 60.0;

/// Opens the window, and returns when it is closed.
pub fn run(shot: Shot, window: &OnlyWindowArgs) -> Result<(), CliError> {
    if pictures::is_picture(&shot.args.scene) {
        return pictures::run(&shot, window);
    }
    if let Some(more) = window.pictures.first() {
        let what = format_args!("{}: the window shows one scene, and this is another file", more.display());
        return Err(CliError::new(what, "name one scene, or pictures alone: .exr and .png files"));
    }
    let args = &shot.args;
    let mut progress = Progress::start(args.run.quiet);
    let (name, settings, size) = (args.scene.to_string(), args.settings(), args.output.size);
    let adapter = args.run.adapter.clone().unwrap_or_default();
    if let Some(folder) = &window.shaders {
        check_folder(folder)?;
    }
    let record = window.record.as_deref();
    let record = record.map(|path| Ok::<_, CliError>((STEP, recorder(&shot, path)?))).transpose()?;
    let (scene, camera, by_rig) = loaded(&shot, &mut progress)?;
    progress.finish();
    // What is opened now: a file that is dropped takes its place.
    let opened = Rc::new(RefCell::new(shown::Opened::new(shot, &scene, &camera, by_rig)));
    let open_another = Rc::clone(&opened);
    let start = Start {
        name,
        scene,
        camera,
        settings,
        size: [size.width, size.height],
        adapter,
        open: Box::new(move |path| {
            let (now, scene, camera) = dropped(path).map_err(|error| error.to_string())?;
            let name = now.shot.args.scene.to_string();
            open_another.replace(now);
            Ok(Opened { name, scene, camera })
        }),
        keep: Box::new(keep),
        write: Box::new(move |seen, form| written(&opened.borrow(), seen, form).map_err(|error| error.to_string())),
        record,
        shaders: window.shaders.clone(),
    };
    lanternfish_viewer::run(start).map_err(failed)
}

/// What keeps a window from opening.
pub fn failed(error: ViewerError) -> CliError {
    match error {
        ViewerError::Gpu(error) => error.into(),
        ViewerError::Render(error) => error.into(),
        error => CliError::new(error, ""),
    }
}

/// An error for a folder that has no shaders.
fn check_folder(folder: &Path) -> Result<(), CliError> {
    let holds = folder.join("shading").join("forward.wesl").is_file();
    let remedy = "name the library's sources: --shaders crates/lanternfish/src";
    holds.then_some(()).ok_or_else(|| CliError::new(format!("{}: no shaders are there", folder.display()), remedy))
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

/// The scene in its light, where it is seen from, and how many of its lights, the last, are a rig's.
fn loaded(shot: &Shot, progress: &mut Progress) -> Result<(Scene, Camera, usize), CliError> {
    let args = &shot.args;
    let part = args.part.scene_of_file.as_deref();
    let mut scene = progress.step("load", &format!("Loading {}", args.scene), || {
        let mut scene = scene::load_part(&args.scene, part)?;
        apply_lights(&mut scene, &args.lights, args.run.seed)?;
        Ok::<_, CliError>(scene)
    })?;
    let size = args.output.size;
    let camera = camera::choose(&scene, &shot.first().view, size.width as f32 / size.height as f32)?;
    let lights = Lighting { is_seen: true, reaches_surfaces: true };
    let before = scene.lights.len();
    light_rig::light(&mut scene, &args.lights, &camera, lights, |note| progress.note(note))?;
    let by_rig = scene.lights.len() - before;
    Ok((scene, camera, by_rig))
}

/// A file that was dropped on the window, under the flags that nobody gave.
fn dropped(path: &Path) -> Result<(shown::Opened, Scene, Camera), CliError> {
    let name = SceneName::from(path.as_os_str());
    let shot = match shot::is_shot(&name) {
        true => shot::read(path, Vec::new())?,
        false => shot::plain(&name),
    };
    let (scene, camera, by_rig) = loaded(&shot, &mut Progress::hidden())?;
    Ok((shown::Opened::new(shot, &scene, &camera, by_rig), scene, camera))
}

/// What is seen, as a shot in the current folder under a name that is not taken, or as a line for a shell.
fn written(opened: &shown::Opened, seen: &Shown<'_>, form: Form) -> Result<Written, CliError> {
    let Shown { settings, scene, camera, size, moment } = *seen;
    let (shot, camera) = opened.shown(&shown::Shown { settings, scene, camera, size, moment })?;
    let text = match form {
        Form::CommandLine => shown::command_line(&shot),
        Form::File => {
            let path = free_name("toml");
            output::write_text(&path, &shown::text(&shot)?)?;
            let note = if opened.is_studio() { "; its studio light turns with its camera" } else { "" };
            format!("{} is written{note}", path.display())
        }
    };
    Ok(Written { text, camera })
}

/// A name in the current folder that is not taken.
fn free_name(ending: &str) -> PathBuf {
    let mut names = (1..).map(|i| PathBuf::from(format!("lanternfish-{i}.{ending}")));
    names.find(|path| !path.exists()).expect("there is always another number")
}

/// Writes a screenshot into the current folder, under a name that is not taken.
fn keep(pixels: &[u8], [width, height]: [u32; 2]) -> Result<String, String> {
    let path = free_name("png");
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
        let (opened, scene, camera) = dropped(&shot).unwrap();
        assert!(!scene.lights.is_empty() && opened.shot.args.scene.to_string() == "demo:cornell");
        assert_eq!(camera.eye(), glam::Vec3::new(0.0, 1.0, 3.0));
        let missing = dropped(&folder.path().join("nothing.glb")).err().unwrap().to_string();
        assert!(missing.contains("nothing.glb"), "{missing}");
    }
}
