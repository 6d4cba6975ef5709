//! Converts flags to a shot: every key, with the flag's help above it.

use std::{
    ffi::{OsStr, OsString},
    fmt::Write as _,
};

use clap::ArgMatches;
use lanternfish_scene::{Camera, Projection};

use super::{Shot, camera_path::CameraPath, track::Track};
use crate::{
    args::{
        RenderArgs,
        flags::Flags as _,
        keys::{Key, keys},
        spelling::Form,
    },
    camera,
    ending::has_ending,
    error::CliError,
    output,
    parse::degrees,
    scene::{self, SceneName},
};

const HEADER: &str = "\
# A shot of Lanternfish: lanternfish render THIS.toml
# Tables are the headings and keys the flags of `lanternfish help render --all`. A flag on the command line overrides
# its key. Paths are relative to this file. A key after # is not set.
";

const TRACK: &str = "\
# Interpolation between keyframes. One of: linear, catmull-rom.
# interpolation = \"catmull-rom\"
# Moments of the camera: seconds, m, m, degrees. All have the same keys; what [view] says stays as it says.
# keyframes = [
#     { time = 0, eye = [0, 2, 8], target = [0, 2, 0], fov-y = 45 },
#     { time = 4, eye = [6, 2, 4], target = [0, 2, 0], fov-y = 45 },
# ]
";

/// Most columns of a comment.
const WIDTH: usize = 118;

/// Prints the shot of the given arguments, one of which is `scene`, or writes it to the .toml file that they name as
/// output. The scene is read, so that errors in it are reported now.
pub fn write(scene: &SceneName, matches: &ArgMatches) -> Result<(), CliError> {
    let mut shot = super::resolve(scene, matches)?;
    if shot.recorded().is_some() {
        let what = format_args!("{scene}: a recording has a camera for every step and no keyframes").to_string();
        return Err(CliError::new(what, "`lanternfish render` renders it as it is, and flags override its own"));
    }
    let file = shot.args.output.output.clone().filter(|path| has_ending(path, "toml"));
    if let Some(file) = &file {
        if file.parent().is_some_and(|folder| !folder.as_os_str().is_empty()) {
            let what =
                format_args!("{}: a shot is written into this folder, to which its paths are relative", file.display());
            return Err(CliError::new(what, "give a name without a folder"));
        }
        output::refuse_same(&[(file, "the shot")], &[(shot.args.scene.path(), "the scene")])?;
        shot.ids.retain(|id| id != "output");
    }
    let (args, size) = (&shot.args, shot.args.output.size);
    let scene = scene::load_part(&args.scene, &args.part)?;
    let camera = camera::choose(&scene, &shot.views()[0], size.aspect())?;
    let text = text(&shot, Some(&camera))?;
    match file {
        None => output::print(&text),
        Some(file) => output::write_text(&file, &text).and_then(|()| output::print(&format!("{}\n", file.display()))),
    }
}

/// The shot as TOML.
pub fn text(shot: &Shot, camera: Option<&Camera>) -> Result<String, CliError> {
    let scene = &shot.args.scene;
    let named = scene.spelling().to_str().ok_or_else(|| {
        CliError::new(format_args!("{scene}: its name is not UTF-8"), "a shot is text: give the scene another name")
    })?;
    let mut text = format!("{HEADER}\n# The scene: a file, or demo:NAME.\nscene = {}\n", quoted(named));
    let mut table = "";
    let (keys, settings, usual) = (keys(), shot.args.given(), RenderArgs::default());
    for key in &keys {
        if key.table != table {
            table = &key.table;
            text += &format!("\n[{table}]\n");
            match table {
                "view" => text += &camera.map(describe).unwrap_or_default(),
                "track" => match &shot.path {
                    Some(CameraPath::Keyframes(track)) => text += &keyframes(track),
                    _ => text += TRACK,
                },
                _ => {}
            }
        }
        comment(&mut text, &key.help());
        let form = key.form(&usual);
        let values: Vec<OsString> = match &key.setting {
            Some(setting) => {
                let given = settings.texts().find(|(name, _)| *name == key.name).map(|(_, text)| text);
                let usual = || setting.value.text().filter(|_| setting.info.shows_default);
                given.or_else(usual).map(OsString::from).into_iter().collect()
            }
            None => if shot.ids.contains(&key.id) { &shot.args } else { &usual }.texts(&key.id),
        };
        let line = match &values[..] {
            [] => format!("# {} = {}", key.name, key.sample(form)),
            _ if key.is_list() => {
                let values = values.iter().map(|value| Ok(format!("    {},\n", toml(key, form, value)?)));
                format!("{} = [\n{}]", key.name, values.collect::<Result<String, CliError>>()?)
            }
            [value, ..] => format!("{} = {}", key.name, toml(key, form, value)?),
        };
        text += &line;
        text.push('\n');
    }
    Ok(text)
}

/// Formats a value of the command line as TOML.
fn toml(key: &Key, form: Form, value: &OsStr) -> Result<String, CliError> {
    let text = value.to_str().ok_or_else(|| {
        CliError::new(format!("--{} {}: not UTF-8", key.name, value.display()), "a shot is text: give it another name")
    })?;
    let Form::Numbers(separator) = form else { return Ok(quoted(text)) };
    let numbers: Option<Vec<_>> = text.split(separator).map(number).collect();
    Ok(match (text, numbers.as_deref()) {
        ("true" | "on", _) => "true".to_owned(),
        ("false" | "off", _) => "false".to_owned(),
        (_, Some([number])) => number.clone(),
        // Rows of a matrix.
        (_, Some(numbers)) if numbers.len() == 16 => {
            let rows = numbers.chunks(4).map(|row| format!("    {},\n", row.join(", ")));
            format!("[\n{}]", rows.collect::<String>())
        }
        (_, Some(numbers)) => format!("[{}]", numbers.join(", ")),
        (_, None) => quoted(text),
    })
}

/// Formats a number of the command line as TOML, which has fewer spellings. It parses to the same number.
fn number(text: &str) -> Option<String> {
    let text = text.trim();
    let integer = text.parse::<i64>().map(|number| number.to_string());
    integer.ok().or_else(|| Some(format!("{:?}", text.parse::<f32>().ok().filter(|number| number.is_finite())?)))
}

/// Formats text as a TOML string.
pub fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => write!(quoted, "\\u{:04X}", u32::from(c)).expect("String"),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

/// A comment with the present camera, as a starting point.
fn describe(camera: &Camera) -> String {
    let eye = camera.eye();
    let target = eye + camera.world_from_camera.transform_vector3(glam::Vec3::NEG_Z);
    let fov_y = match camera.projection {
        Projection::Perspective { fov_y, .. } => format!(", fov-y = {:.2}", fov_y.to_degrees()),
        Projection::Frustum { .. } | Projection::Orthographic { .. } => String::new(),
    };
    let list = |v: glam::Vec3| format!("[{:.3}, {:.3}, {:.3}]", v.x, v.y, v.z);
    format!("# This camera, rounded: eye = {}, target = {}{fov_y}\n", list(eye), list(target))
}

fn keyframes(track: &Track) -> String {
    let mut text = format!("interpolation = \"{}\"\nkeyframes = [\n", track.interpolation);
    for frame in &track.keyframes {
        let point = |name: &str, p: Option<glam::Vec3>| {
            p.map(|p| format!(", {name} = [{:?}, {:?}, {:?}]", p.x, p.y, p.z)).unwrap_or_default()
        };
        let fov_y = frame.fov_y.map(|angle| format!(", fov-y = {}", degrees(angle))).unwrap_or_default();
        let (eye, target) = (point("eye", frame.eye), point("target", frame.target));
        writeln!(text, "    {{ time = {:?}{eye}{target}{fov_y} }},", frame.time).expect("String");
    }
    text + "]\n"
}

/// Adds a wrapped comment.
fn comment(text: &mut String, words: &str) {
    let mut width = usize::MAX;
    for word in words.split_whitespace() {
        let more = word.chars().count() + 1;
        if width.saturating_add(more) > WIDTH {
            if width != usize::MAX {
                text.push('\n');
            }
            text.push('#');
            width = 1;
        }
        text.push(' ');
        text.push_str(word);
        width += more;
    }
    if width != usize::MAX {
        text.push('\n');
    }
}
