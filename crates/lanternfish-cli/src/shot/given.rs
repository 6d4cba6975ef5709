//! What a command line, a recording or the keys of a shot give.

use std::ffi::OsStr;

use clap::ArgMatches;
use lanternfish::settings::GivenSettings;
use lanternfish_scene::nearest;

use super::{Shot, camera_path::CameraPath};
use crate::{
    args::{
        RenderArgs,
        flags::Flags as _,
        keys::{Key, is_given, keys},
        render_command, settings,
    },
    paper,
    scene::SceneName,
};

/// Flags of which one counts, or those of one list: ways of placing the camera, and of its field of view.
const WAYS: [&[&[&str]]; 2] = [
    &[&["eye", "target", "camera"], &["view"], &["pose", "pose_convention"], &["azimuth", "elevation"]],
    &[&["fov_y"], &["intrinsics"]],
];
/// Flags that choose a time, or several.
const WHEN: [&str; 2] = ["time", "frames"];

/// Values of some flags.
#[derive(Clone, Debug, Default)]
pub(super) struct Given {
    /// Flags of the command itself. Those that are not given have their defaults.
    pub args: RenderArgs,
    /// Those of them that are given, by id.
    pub ids: Vec<String>,
    /// Settings.
    pub settings: GivenSettings,
}

impl Given {
    /// The flags on the command line of a command with some or all flags of `render`, under the same ids.
    pub fn of(matches: &ArgMatches) -> Self {
        let mut given = Self { settings: settings::given(matches), ..Self::default() };
        for key in keys().into_iter().filter(|key| key.setting.is_none() && is_given(matches, &key.id)) {
            given.args.take(&key.id, matches);
            given.ids.push(key.id);
        }
        given
    }

    /// Flags by name and value. An error is the name, what is wrong, and a hint.
    pub fn named(flags: &[(String, String)]) -> Result<Self, [String; 3]> {
        let (keys, mut given) = (keys(), Self::default());
        for (name, value) in flags {
            let Some(key) = keys.iter().find(|key| key.is_called(name)) else {
                let nearest = nearest(name, &keys.iter().map(|key| key.name.as_str()).collect::<Vec<_>>());
                return Err([name.clone(), "there is none".to_owned(), format!("it may be {nearest:?}")]);
            };
            given.read(key, value.as_ref()).map_err(|what| [name.clone(), what, String::new()])?;
        }
        match given.conflict() {
            Some([a, b]) => Err([b, format!("it cannot be used with {a:?}"), "leave one of them out".to_owned()]),
            None => Ok(given),
        }
    }

    /// Reads a value of a key, or says what is expected.
    pub fn read(&mut self, key: &Key, text: &OsStr) -> Result<(), String> {
        match &key.setting {
            Some(setting) => {
                let value = setting.read(text.to_str().unwrap_or_default())?;
                self.settings.give(setting.info.name, value);
            }
            None => self.put(&key.id, |args| args.read(&key.id, text))?,
        }
        Ok(())
    }

    /// Gives the flag of this id, which `set` sets.
    pub fn put<T>(&mut self, id: &str, set: impl FnOnce(&mut RenderArgs) -> T) -> T {
        if !self.ids.iter().any(|other| other == id) {
            self.ids.push(id.to_owned());
        }
        set(&mut self.args)
    }

    /// Names of the first two flags that exclude each other.
    pub fn conflict(&self) -> Option<[String; 2]> {
        let command = render_command();
        let given = |id: &str| self.ids.iter().position(|other| other == id);
        let flags = command.get_arguments().filter(|flag| given(flag.get_id().as_str()).is_some());
        let mut pairs =
            flags.flat_map(|flag| command.get_arg_conflicts_with(flag).into_iter().map(move |other| [flag, other]));
        let pair = pairs.find(|[_, other]| given(other.get_id().as_str()).is_some())?;
        let mut pair = pair.map(|flag| (given(flag.get_id().as_str()), flag.get_long().unwrap_or_default().to_owned()));
        pair.sort();
        Some(pair.map(|(_, name)| name))
    }

    /// These flags over those of a shot, each with the settings of its paper below its own.
    pub fn over(&self, shot: &Self) -> Self {
        let gives = |ids: &[&str]| self.ids.iter().any(|id| ids.contains(&id.as_str()));
        let is_orbit = gives(&["orbit"]) || shot.ids.iter().any(|id| id == "orbit");
        let is_replaced = |id: &str| {
            let mut ways = WAYS.iter().filter(|ways| ways.iter().any(|way| way.contains(&id)));
            // An orbit may have a time and frames.
            (WHEN.contains(&id) && gives(&WHEN) && !is_orbit)
                || ways.any(|ways| ways.iter().any(|way| !way.contains(&id) && gives(way)))
        };
        let mut all = Self { settings: self.with_paper().above(shot.with_paper()), ..Self::default() };
        let kept = shot.ids.iter().filter(|id| !is_replaced(id)).map(|id| (id, &shot.args));
        for (id, args) in kept.chain(self.ids.iter().map(|id| (id, &self.args))) {
            all.put(id, |all| all.copy(id, args));
        }
        all
    }

    /// The settings, with those of `--as PAPER` below them.
    fn with_paper(&self) -> GivenSettings {
        self.settings.clone().above(paper::given(self.args.paper))
    }

    /// A shot of a scene.
    pub fn shot(self, scene: SceneName, path: Option<CameraPath>) -> Shot {
        let settings = self.with_paper();
        let Self { mut args, ids, .. } = self;
        args.scene = scene;
        args.give(&settings);
        args.finish();
        Shot { args, path, ids }
    }
}
