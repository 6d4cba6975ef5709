//! Recorded camera input as a file: `view --record` writes it; every command takes it as a shot, and `replay` times it.
//!
//! ```toml
//! recording = 1
//! scene = "demo:atrium"
//! flags = [["lights", "rain:1000"]]
//! step = 0.016666668
//! speed = 5.2
//! reach = 10.4
//! first = ["perspective", 0.7853982, 0.05, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1.7, 8]
//! steps = [
//!     [],
//!     [["look", 3, -1], ["fly", 0, 0, 1, 0.016666668]],
//!     29,
//! ]
//! ```
//!
//! `flags` are the given flags of `render`, except those of the camera. A step is the list of its camera moves; a number in
//! place of a step repeats the previous step that many times. A camera is its projection and the columns of its world-from-camera matrix.

use std::{fmt::Write as _, path::Path};

use glam::Affine3A;
use lanternfish_scene::{Camera, Move, Projection, Recording, Way};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{error::CliError, output::write_text, scene::SceneName, shot::quoted};

/// Version of the format. Other versions are refused.
const VERSION: i64 = 1;
/// Most steps: ten hours.
const MOST_STEPS: usize = 2_160_000;

/// A recording and its scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    pub scene: SceneName,
    /// Flags of `render`, by name and value.
    pub flags: Vec<(String, String)>,
    pub recording: Recording,
}

impl Recorded {
    /// Writes the file completely or not at all. The path of the scene is written as an absolute path.
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        let scene = match self.scene.demo() {
            Some(_) => self.scene.to_string(),
            None => std::path::absolute(self.scene.path())
                .unwrap_or_else(|_| self.scene.path().to_owned())
                .display()
                .to_string(),
        };
        write_text(path, &self.text(&scene))
    }

    fn text(&self, scene: &str) -> String {
        let Recording { first, speed, reach, step, steps } = &self.recording;
        let flags = self.flags.iter().map(|(name, value)| format!("[{}, {}]", quoted(name), quoted(value)));
        let mut text = format!(
            "# Recorded camera input: `lanternfish render` renders it, and `lanternfish replay` times it.\n\nrecording = {VERSION}\nscene = {}\nflags = [{}]\n\
             step = {step:?}\nspeed = {speed:?}\nreach = {reach:?}\nfirst = [{}]\nsteps = [\n",
            quoted(scene),
            flags.collect::<Vec<_>>().join(", "),
            camera(first)
        );
        for run in steps.chunk_by(|a, b| a == b) {
            let moves: Vec<_> = run[0].iter().map(one).collect();
            writeln!(text, "    [{}],", moves.join(", ")).expect("String");
            if run.len() > 1 {
                writeln!(text, "    {},", run.len() - 1).expect("String");
            }
        }
        text + "]\n"
    }

    /// Reads a recording.
    pub fn parse(table: &DeTable<'_>) -> Result<Self, String> {
        Reader { table }.recorded()
    }
}

/// True if a TOML file is a recording, of any version.
pub fn is_recording(table: &DeTable<'_>) -> bool {
    table.iter().any(|(key, _)| key.get_ref() == "recording")
}

/// Formats one move as a list.
fn one(one: &Move) -> String {
    match one {
        Move::Look(right, down) => format!("[\"look\", {right:?}, {down:?}]"),
        Move::Orbit(right, down) => format!("[\"orbit\", {right:?}, {down:?}]"),
        Move::Fly(Way { right, up, forward }, seconds) => {
            format!("[\"fly\", {right:?}, {up:?}, {forward:?}, {seconds:?}]")
        }
        Move::Accelerate(notches) => format!("[\"accelerate\", {notches:?}]"),
        Move::Dolly(notches) => format!("[\"dolly\", {notches:?}]"),
        Move::Place(to, speed, reach) => format!("[\"place\", {speed:?}, {reach:?}, {}]", camera(to)),
    }
}

/// Formats a camera as the values of a list.
fn camera(camera: &Camera) -> String {
    let (name, of_projection) = match camera.projection {
        Projection::Perspective { fov_y, near } => ("perspective", vec![fov_y, near]),
        Projection::Frustum { left, right, bottom, top, near } => ("frustum", vec![left, right, bottom, top, near]),
        Projection::Orthographic { half_height, near, far } => ("orthographic", vec![half_height, near, far]),
    };
    let columns = camera.world_from_camera.to_cols_array();
    let numbers = of_projection.iter().chain(&columns).map(|number| format!("{number:?}"));
    format!("\"{name}\", {}", numbers.collect::<Vec<_>>().join(", "))
}

type Value<'t> = Spanned<DeValue<'t>>;

struct Reader<'r> {
    table: &'r DeTable<'r>,
}

impl Reader<'_> {
    fn recorded(&self) -> Result<Recorded, String> {
        if integer(self.get("recording")?) != Some(VERSION) {
            return Err(format!("a recording of another version than {VERSION}"));
        }
        let scene = word(self.get("scene")?).ok_or("`scene` is a string")?;
        let flag = |flag: &Value<'_>| match list(flag)?.iter().map(word).collect::<Vec<_>>()[..] {
            [Some(name), Some(value)] => Ok((name.to_owned(), value.to_owned())),
            _ => Err("a flag is a name and a value, both strings".to_owned()),
        };
        let flags = list(self.get("flags")?)?.iter().map(flag).collect::<Result<_, String>>()?;
        let number = |name| self.get(name).and_then(number);
        let (step, speed, reach) = (number("step")?, number("speed")?, number("reach")?);
        if !(step > 0.0 && step <= 3600.0) {
            return Err(format!("`step` is {step}: seconds, above 0"));
        }
        let recording =
            Recording { first: place(list(self.get("first")?)?)?, speed, reach, step, steps: self.steps()? };
        if let Some(what) = recording.cameras().iter().find_map(|camera| camera.validate().err()) {
            return Err(format!("invalid camera: {what}"));
        }
        Ok(Recorded { scene: scene.into(), flags, recording })
    }

    fn steps(&self) -> Result<Vec<Vec<Move>>, String> {
        let mut steps: Vec<Vec<Move>> = Vec::new();
        for value in list(self.get("steps")?)? {
            let more = integer(value);
            let step = match more {
                Some(_) => steps.last().cloned().ok_or("`steps` starts with a step")?,
                None => list(value)?.iter().map(done).collect::<Result<_, _>>()?,
            };
            let times = usize::try_from(more.unwrap_or(1)).unwrap_or(0);
            if times > MOST_STEPS - steps.len() {
                return Err(format!("there are more than {} steps", MOST_STEPS));
            }
            steps.extend(std::iter::repeat_n(step, times));
        }
        Ok(steps)
    }

    fn get(&self, name: &str) -> Result<&Value<'_>, String> {
        self.table
            .iter()
            .find(|(key, _)| key.get_ref() == name)
            .map(|(_, value)| value)
            .ok_or_else(|| format!("`{name}` is missing"))
    }
}

fn done(value: &Value<'_>) -> Result<Move, String> {
    let words = list(value)?;
    let (name, rest) =
        words.split_first().and_then(|(name, rest)| Some((word(name)?, rest))).ok_or("a move has a name")?;
    if name == "place" {
        return match rest {
            [speed, reach, rest @ ..] => Ok(Move::Place(place(rest)?, number(speed)?, number(reach)?)),
            _ => Err("`place` has speed, reach and a camera".to_owned()),
        };
    }
    let numbers = rest.iter().map(number).collect::<Result<Vec<f32>, _>>()?;
    match (name, &numbers[..]) {
        ("look", [right, down]) => Ok(Move::Look(*right, *down)),
        ("orbit", [right, down]) => Ok(Move::Orbit(*right, *down)),
        ("fly", &[right, up, forward, seconds]) => Ok(Move::Fly(Way { right, up, forward }, seconds)),
        ("accelerate", [notches]) => Ok(Move::Accelerate(*notches)),
        ("dolly", [notches]) => Ok(Move::Dolly(*notches)),
        _ => Err(format!("unknown move: {name:?} with {} numbers", numbers.len())),
    }
}

fn place(values: &[Value<'_>]) -> Result<Camera, String> {
    let (name, rest) =
        values.split_first().and_then(|(name, rest)| Some((word(name)?, rest))).ok_or("a camera has a name")?;
    let numbers = rest.iter().map(number).collect::<Result<Vec<f32>, _>>()?;
    let (of_projection, columns) = numbers.split_at(numbers.len().saturating_sub(12));
    let projection = match (name, of_projection) {
        ("perspective", &[fov_y, near]) => Projection::Perspective { fov_y, near },
        ("frustum", &[left, right, bottom, top, near]) => Projection::Frustum { left, right, bottom, top, near },
        ("orthographic", &[half_height, near, far]) => Projection::Orthographic { half_height, near, far },
        _ => return Err(format!("unknown camera: {name:?} with {} numbers", numbers.len())),
    };
    let columns: &[f32; 12] = columns.try_into().expect("twelve are split off");
    Ok(Camera { name: String::new(), world_from_camera: Affine3A::from_cols_array(columns), projection })
}

fn list<'v, 't>(value: &'v Value<'t>) -> Result<&'v [Value<'t>], String> {
    match value.get_ref() {
        DeValue::Array(list) => Ok(list),
        _ => Err("expected a list".to_owned()),
    }
}

fn word<'v>(value: &'v Value<'_>) -> Option<&'v str> {
    match value.get_ref() {
        DeValue::String(text) => Some(text),
        _ => None,
    }
}

fn integer(value: &Value<'_>) -> Option<i64> {
    match value.get_ref() {
        DeValue::Integer(number) if number.radix() == 10 => number.as_str().parse().ok(),
        _ => None,
    }
}

fn number(value: &Value<'_>) -> Result<f32, String> {
    let text = match value.get_ref() {
        DeValue::Float(number) => number.as_str(),
        DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
        _ => return Err("expected a number".to_owned()),
    };
    let number = text.parse().ok().filter(|number: &f32| number.is_finite());
    number.ok_or_else(|| format!("{text}: expected a number"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::Vec3;

    use super::*;

    fn parse(text: &str) -> Result<Recorded, String> {
        Recorded::parse(DeTable::parse(text).unwrap().get_ref())
    }

    fn recorded() -> Recorded {
        let projection = Projection::Perspective { fov_y: 0.7, near: 0.049_999_997 };
        let first = Camera::look_at(Vec3::new(0.1, 1.7, -8.333_333), Vec3::new(0.3, 0.9, 0.1), projection);
        let fly = |forward| Move::Fly(Way { right: -0.25, up: 1e-7, forward }, 1.0 / 60.0);
        let parallel = Projection::Orthographic { half_height: 3.0, near: 0.0, far: 70.0 };
        let placed = Camera::look_at(Vec3::ONE, Vec3::ZERO, parallel);
        let wave = |i: i32| vec![Move::Look((i as f32).sin(), 1e-3 * i as f32), fly(0.7 * (i as f32).cos())];
        let mut steps = vec![vec![], vec![fly(1.0)], vec![fly(1.0)], vec![fly(1.0)], vec![Move::Orbit(3.0, -0.1)]];
        steps.extend((0..300).map(wave));
        steps.push(vec![Move::Accelerate(-1.5), Move::Dolly(0.3), Move::Place(placed, 2.0, 3.1)]);
        Recorded {
            scene: "demo:cornell".into(),
            flags: vec![
                ("lights".to_owned(), "rain:60".to_owned()),
                ("environment".to_owned(), "/a \"b\"\\c".to_owned()),
            ],
            recording: Recording { first, speed: 1.0 / 3.0, reach: 4.0, step: 1.0 / 60.0, steps },
        }
    }

    #[test]
    fn recordings_survive_a_round_trip_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.toml");
        let written = recorded();
        written.write(&path).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let read = parse(&text).unwrap();
        assert_eq!(read, written);
        let bits = |camera: &Camera| camera.world_from_camera.to_cols_array().map(f32::to_bits);
        let (again, cameras) = (read.recording.cameras(), written.recording.cameras());
        assert!(again.len() == 306 && again.iter().zip(&cameras).all(|(again, camera)| bits(again) == bits(camera)));
        // Equal steps are written once.
        assert!(text.contains("\n    2,\n"));
    }

    #[test]
    fn broken_recordings_are_refused_with_a_reason() {
        let valid = recorded().text("demo:cornell");
        for (from, to, expected) in [
            ("recording = 1", "recording = 2", "another version"),
            ("step = 0.016666668", "step = 0", "above 0"),
            ("\"orbit\", 3.0", "\"orbits\", 3.0", "unknown move"),
            ("\"perspective\", 0.7", "\"perspective\"", "unknown camera"),
            ("\"perspective\", 0.7", "\"perspective\", -1", "invalid camera"),
            ("\n    2,\n", "\n    99999999,\n", "more than"),
            ("reach = 4.0\n", "", "`reach` is missing"),
            ("steps = [\n", "steps = [\n 3,\n", "starts with a step"),
            ("speed = 0.33333334", "speed = inf", "expected a number"),
        ] {
            assert!(valid.contains(from), "{from}");
            let error = parse(&valid.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(expected), "{error} for {to:?}");
        }
    }
}
