//! A shot that is shown and changed: what a window and a browser's page open.

use lanternfish::settings::{Exposure, History, Preset, Settings};
use lanternfish_scene::{Camera, Scene, generate::Rain, motion::Moment};

use crate::{
    camera,
    error::CliError,
    light_rig::{self, Lighting},
    motion::Motion,
    paper,
    shot::{Shot, shown},
};

/// A loaded scene.
pub struct Loaded {
    /// The scene with its lights, at 0 s.
    pub scene: Scene,
    /// The camera.
    pub camera: Camera,
    /// The automatic exposure, EV, if it is not metered.
    pub exposure: Option<f32>,
    /// The animation and time to show.
    pub moment: Option<Moment>,
    /// The light rain.
    pub rain: Option<Rain>,
    /// Its shot.
    pub opened: shown::Opened,
}

impl Loaded {
    /// A scene as it was read with the flags' lights, with the shot's camera, and light around it where it has none.
    pub fn of(shot: Shot, (mut scene, motion): (Scene, Option<Motion>), say: impl Fn(&str)) -> Result<Self, CliError> {
        let args = &shot.args;
        let size = args.output.size;
        let first = shot.first();
        let moment = |motion: &Motion| Some(Moment { animation: motion.animation(), time: first.time? });
        let (moment, rain) = (motion.as_ref().and_then(moment), motion.as_ref().and_then(Motion::rain).cloned());
        let camera = camera::choose(&scene, &first.view, size.aspect())?;
        let lights = Lighting { is_seen: true, takes_ground: false, is_metered: false, ..Lighting::of(args) };
        let before = scene.lights.len();
        let rig = light_rig::light(&mut scene, &args.lights, &camera, lights, say)?;
        let by_rig = scene.lights.len() - before;
        let opened = shown::Opened::new(shot, &scene, &camera, by_rig, rain.clone());
        Ok(Self { scene, camera, exposure: rig.exposure(), moment, rain, opened })
    }
}

/// A shot's settings for interactive frames: those of `quality realtime` unless it gives another, or a paper; with the
/// history and sampled direct light unless it or its preset sets them; and with the multisampling of single frames, because
/// frames are shown alone while the view moves. `exposure`: the automatic one, EV, if it is not metered.
pub fn in_window(shot: &Shot, exposure: Option<f32>) -> Settings {
    let mut args = shot.args.clone();
    if !shot.gives("quality") && args.paper.is_none() {
        args.quality = Preset::Realtime;
    }
    let samples = args.settings_of(1).image.samples;
    let mut settings = args.settings().with_samples(samples);
    paper::for_moving(args.paper, &mut settings);
    if !shot.gives("history") {
        settings.history = History::On;
    }
    if settings.direct.is_none() && !shot.gives("direct") {
        settings.direct = args.sampled_direct();
    }
    exposed(settings, exposure)
}

/// Settings with the automatic exposure, EV, if it is not metered.
pub fn exposed(mut settings: Settings, exposure: Option<f32>) -> Settings {
    if let Some(ev) = exposure.filter(|_| settings.image.exposure == Exposure::Auto) {
        settings.image.exposure = Exposure::Ev(ev);
    }
    settings
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::ToneMap;

    use super::*;
    use crate::{render::scene_with_lights, shot::with_flags};

    #[test]
    fn flags_by_name_are_those_of_the_command_line() {
        let flags = |words: &[(&str, &str)]| {
            words.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect::<Vec<_>>()
        };
        let scene = "demo:cornell".into();
        let given = flags(&[("quality", "draft"), ("lights", "rain:10"), ("size", "64x32"), ("as", "archer")]);
        let shot = with_flags(&scene, None, &given).unwrap();
        assert_eq!(
            (shot.args.output.size.width, shot.args.settings().get("culling")),
            (64, Some("raster-grid".into()))
        );
        let lit = scene_with_lights(&shot.args).unwrap();
        assert!(lit.0.lights.len() >= 10);
        let loaded = Loaded::of(shot, lit, |_| ()).unwrap();
        assert!(loaded.rain.is_some() && loaded.moment.is_none());
        // A shot's text, and flags over its keys.
        let text = "scene = \"demo:cornell\"\n[look]\ntone-map = \"aces\"\n[technique]\nsamples = \"1\"\n";
        let shot = with_flags(&"a.toml".into(), Some(text), &flags(&[("samples", "4")])).unwrap();
        assert_eq!(shot.args.settings().image.tone_map, ToneMap::Aces);
        assert_eq!(shot.args.settings().get("samples").as_deref(), Some("4"));
        for (name, value, what) in
            [("tone-mpa", "aces", "tone-map"), ("tone-map", "nonesuch", "tone-map"), ("lights", "rain", "lights")]
        {
            let error = with_flags(&scene, None, &flags(&[(name, value)])).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
