//! `lanternfish view`: a scene in a window, with the flags of `render`.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    rc::Rc,
};

use lanternfish::settings::Exposure;
use lanternfish_metrics::{ColorType, write_png};
use lanternfish_scene::RecordKeeper;
use lanternfish_viewer::{Form, Opened, Shown, Start, ViewerError, Written};

use crate::{
    args::view::OnlyWindowArgs,
    error::CliError,
    mistakes::IMAGE_TOOLS,
    opened::{Loaded, in_window},
    output::{self, check_writable},
    progress::Progress,
    recording::Recorded,
    render::lit_scene,
    scene::SceneName,
    shot::{self, Shot, shown},
    stereo,
};

pub const HELP: &str = "\
Examples:
  lanternfish view
  lanternfish view scene.glb
  lanternfish view shot.toml --shadows bvh
  lanternfish view scene.glb --record walk.toml
  lanternfish view scene.glb --stereo parallel

Frames are those of --quality realtime unless another is given; while the camera rests, their mean.
W A S D fly, dragging looks around, V shows the camera and its clusters from above, F1 lists all
keys. A file that is dropped on the window is opened. `lanternfish render walk.toml --frames A-B`
renders a recorded flight.

The window's size and position are stored in lanternfish/window.toml in the folder of settings
(XDG_CONFIG_HOME, or ~/.config).
";

/// Duration of a recorded step, seconds.
const STEP: f32 = 1.0 / 60.0;

/// Opens the window and returns when it is closed.
pub fn run(shot: Shot, window: &OnlyWindowArgs) -> Result<(), CliError> {
    let args = &shot.args;
    if args.scene.image().is_some() {
        return Err(CliError::new(format_args!("{}: the window shows a scene, not an image", args.scene), IMAGE_TOOLS));
    }
    let mut progress = Progress::start(args.run.quiet);
    let (name, size) = (args.scene.to_string(), args.output.size);
    let eyes = args.stereo.stereo;
    let adapter = args.run.adapter.clone().unwrap_or_default();
    if let Some(folder) = &window.shaders {
        check_folder(folder)?;
    }
    let record = window.record.as_deref();
    let record = record.map(|path| Ok::<_, CliError>((STEP, recorder(&shot, path)?))).transpose()?;
    let size_is_chosen = shot.gives("size");
    let Loaded { scene, camera, exposure, moment, rain, opened } = loaded(shot, &mut progress)?;
    let settings = in_window(&opened.shot, exposure);
    progress.finish();
    // The opened scene. A file that is dropped on the window replaces it.
    let opened = Rc::new(RefCell::new(opened));
    let open_another = Rc::clone(&opened);
    eyes.map(|eyes| stereo::cameras(eyes, &camera, size.aspect())).transpose()?;
    let start = Start {
        name,
        scene,
        camera,
        eyes,
        settings,
        size: [size.width, size.height],
        size_is_chosen,
        moment,
        rain,
        kept: kept_at(),
        adapter,
        open: Box::new(move |path| {
            let (now, opened) = dropped(path).map_err(|error| error.to_string())?;
            open_another.replace(now);
            Ok(opened)
        }),
        keep: Box::new(keep),
        write: Box::new(move |seen, form| written(&opened.borrow(), seen, form).map_err(|error| error.to_string())),
        record,
        shaders: window.shaders.clone(),
    };
    lanternfish_viewer::run(start).map_err(failed)
}

/// Converts an error that keeps a window from opening.
fn failed(error: ViewerError) -> CliError {
    match error {
        ViewerError::Gpu(error) => error.into(),
        ViewerError::Render(error) => error.into(),
        error => CliError::new(error, ""),
    }
}

/// Returns an error for a folder without shaders.
fn check_folder(folder: &Path) -> Result<(), CliError> {
    let holds = folder.join("shading").join("forward.wesl").is_file();
    let remedy = "name the library's sources: --shaders crates/lanternfish/src";
    holds.then_some(()).ok_or_else(|| CliError::new(format!("{}: there are no shaders", folder.display()), remedy))
}

/// Writes the recording when the window closes. The path was checked before.
fn recorder(shot: &Shot, path: &Path) -> Result<RecordKeeper, CliError> {
    check_writable(path)?;
    let (path, scene, flags) = (path.to_owned(), shot.args.scene.clone(), shot.flags_of_recording()?);
    Ok(Box::new(move |recording| {
        let recorded = Recorded { scene: scene.clone(), flags: flags.clone(), recording: recording.clone() };
        recorded.write(&path).map_err(|error| error.to_string())
    }))
}

/// The file for the window's size and position, in the user's configuration folder; `None` if the user has none.
fn kept_at() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let of_home = || Some(folder("HOME")?.join(".config"));
    let of_windows = || folder("APPDATA").filter(|_| cfg!(windows));
    let folder = folder("XDG_CONFIG_HOME").or_else(of_windows).or_else(of_home)?;
    Some(folder.join("lanternfish").join("window.toml"))
}

fn loaded(shot: Shot, progress: &mut Progress) -> Result<Loaded, CliError> {
    let lit = lit_scene(&shot.args, progress)?;
    Loaded::of(shot, lit, |note| progress.note(note))
}

/// A file that was dropped on the window, with default flags. A shot sets the renderer's settings, a scene does not.
fn dropped(path: &Path) -> Result<(shown::Opened, Opened), CliError> {
    let name = SceneName::from(path.as_os_str());
    let is_shot = shot::is_shot(&name);
    let shot = if is_shot { shot::read(path)? } else { shot::plain(&name) };
    let Loaded { scene, camera, exposure, moment, rain, opened } = loaded(shot, &mut Progress::hidden())?;
    let shot = &opened.shot;
    let (settings, eyes) = (is_shot.then(|| in_window(shot, exposure)), shot.args.stereo.stereo);
    let exposure = (!is_shot).then(|| exposure.map_or(Exposure::Auto, Exposure::Ev));
    let name = shot.args.scene.to_string();
    Ok((opened, Opened { name, scene, camera, eyes, settings, exposure, moment, rain }))
}

/// Writes the window's state as a shot in the current folder, under a free name, or as a command line for a shell.
fn written(opened: &shown::Opened, seen: &Shown<'_>, form: Form) -> Result<Written, CliError> {
    let Shown { settings, scene, camera, eyes, size, moment } = *seen;
    let (shot, camera) = opened.shown(&shown::Shown { settings, scene, camera, eyes, size, moment })?;
    let text = match form {
        Form::CommandLine => shown::command_line(&shot),
        Form::File => {
            let path = free_name("toml");
            output::write_text(&path, &shown::text(&shot)?)?;
            let note = if opened.is_studio() { "; its studio light follows its camera" } else { "" };
            format!("{} written{note}", path.display())
        }
    };
    Ok(Written { text, camera })
}

/// A free file name in the current folder.
fn free_name(ending: &str) -> PathBuf {
    let mut names = (1..).map(|i| PathBuf::from(format!("lanternfish-{i}.{ending}")));
    names.find(|path| !path.exists()).expect("numbers do not run out")
}

/// Writes a screenshot to the current folder, under a free name.
fn keep(pixels: &[u8], [width, height]: [u32; 2]) -> Result<String, String> {
    let path = free_name("png");
    write_png(&path, [width, height], ColorType::Rgba, pixels).map_err(|error| error.to_string())?;
    Ok(format!("{} written", path.display()))
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::motion::Moment;

    use super::*;

    #[test]
    fn a_dropped_file_is_opened_or_refused_with_a_reason() {
        let folder = tempfile::tempdir().unwrap();
        let shot = folder.path().join("box.toml");
        let text =
            "scene = \"demo:cornell\"\n[view]\neye = [0, 1, 3]\ntarget = [0, 1, 0]\n[look]\ntone-map = \"aces\"\n";
        std::fs::write(&shot, text).unwrap();
        let (now, opened) = dropped(&shot).unwrap();
        assert!(!opened.scene.lights.is_empty() && now.shot.args.scene.to_string() == "demo:cornell");
        assert_eq!((opened.camera.eye(), opened.moment), (glam::Vec3::new(0.0, 1.0, 3.0), None));
        // A shot sets the renderer's settings; a scene keeps the window's.
        assert_eq!(opened.settings.unwrap().image.tone_map, lanternfish::settings::ToneMap::Aces);
        let scene = folder.path().join("one.gltf");
        std::fs::write(&scene, r#"{"asset": {"version": "2.0"}, "scenes": [{}], "scene": 0}"#).unwrap();
        assert!(dropped(&scene).unwrap().1.settings.is_none());
        // Frames are shown alone, whatever the shot's accumulation.
        std::fs::write(
            &shot,
            "scene = \"demo:cornell\"\n[technique]\naccumulate = 64\n[indirect]\nquality = \"good\"\n",
        )
        .unwrap();
        assert_eq!(dropped(&shot).unwrap().1.settings.unwrap().image.samples, lanternfish::settings::Samples::Four);
        // The studio is an environment, which direct light alone does not see: the sun instead, not a black object.
        let lit_by = |words: &str| {
            std::fs::write(&shot, format!("scene = \"plane.obj\"\n{words}")).unwrap();
            let scene = dropped(&shot).unwrap().1.scene;
            (scene.lights.len(), scene.environment.is_some())
        };
        std::fs::write(folder.path().join("plane.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        assert_eq!(lit_by(""), (0, true));
        // White is white in the studio; the next scene is metered again.
        let exposure = |name: &str| dropped(&folder.path().join(name)).unwrap().1.exposure;
        assert_eq!((exposure("plane.obj"), exposure("one.gltf")), (Some(Exposure::Ev(0.0)), Some(Exposure::Auto)));
        assert_eq!(dropped(&shot).unwrap().1.settings.unwrap().image.exposure, Exposure::Ev(0.0));
        assert_eq!(lit_by("[indirect]\nindirect = \"none\"\n"), (1, false));
        let missing = dropped(&folder.path().join("nothing.glb")).err().unwrap().to_string();
        assert!(missing.contains("nothing.glb"), "{missing}");
    }

    /// A file whose only node moves for 2 s.
    const MOVING: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{}],
        "buffers": [{"byteLength": 32, "uri": "data:application/octet-stream;base64,AAAAAAAAAEAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAA="}],
        "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 8, "byteLength": 24}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3"}],
        "animations": [{"samplers": [{"input": 0, "output": 1}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}]}"#;

    #[test]
    fn the_window_starts_at_the_time_of_the_shot() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("moving.gltf"), MOVING).unwrap();
        let opened = |text: &str| {
            let shot = folder.path().join("shot.toml");
            std::fs::write(&shot, format!("scene = \"moving.gltf\"\n[track]\n{text}")).unwrap();
            dropped(&shot).unwrap().1
        };
        assert_eq!(opened("").moment, None);
        assert_eq!(opened("time = 0.5").moment, Some(Moment { animation: Some(0), time: 0.5 }));
        assert_eq!(opened("animation = \"0\"").moment, Some(Moment { animation: Some(0), time: 0.0 }));
    }
}
