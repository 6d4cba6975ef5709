//! A view that moves.

use js_sys::{Date, Function, Object};
use lanternfish::ResolutionScaling;
use lanternfish_cli::opened::in_window;
use lanternfish_cli::shot::shown;
use lanternfish_scene::{Camera, Controls, Way, motion::Moment};
use wasm_bindgen::prelude::*;
use web_sys::{ImageData, OffscreenCanvas};

use crate::{
    canvas::Canvas,
    failed,
    session::{Session, Side},
    source::{Flags, Source},
};

/// Longest time of a frame while the view moves, ms: as in the window.
const BUDGET: f64 = 60.0;

/// A scene on a canvas, with a camera that moves, and settings that change.
#[wasm_bindgen]
pub struct Viewer {
    source: Source,
    flags: Flags,
    session: Session,
    canvas: Canvas,
    first: Side,
    /// The second of two techniques, and the fraction of the width from which on it is shown.
    second: Option<Side>,
    split: f32,
    controls: Controls,
    scaling: ResolutionScaling,
    /// Camera and size of the last frame, and the number of such frames at rest.
    shown: Option<(Camera, [u32; 2])>,
    frames: u32,
}

#[wasm_bindgen]
impl Viewer {
    /// Opens a scene, with options as for `render`. `progress` is called with what is done.
    pub async fn open(
        canvas: OffscreenCanvas,
        #[wasm_bindgen(unchecked_param_type = "string | Uint8Array | [string, Uint8Array][]")] source: JsValue,
        #[wasm_bindgen(unchecked_param_type = "Record<string, string | number>")] options: Object,
        #[wasm_bindgen(unchecked_param_type = "(what: string) => void")] progress: Function,
    ) -> Result<Self, JsValue> {
        let (source, flags) = (Source::of(&source)?, Flags::of(&options)?);
        let tell = |what: &str| drop(progress.call1(&JsValue::NULL, &what.into()));
        let session = Session::open(source.shot(&flags)?, tell).await?;
        let canvas = Canvas::new(&session.device, canvas)?;
        let loaded = &session.loaded;
        let first = Side::new(&session, in_window(&loaded.opened.shot, loaded.exposure))?;
        let bounds = loaded.scene.bounds();
        let size = if bounds.is_empty() { 1.0 } else { (bounds.max - bounds.min).length() };
        let (controls, scaling) = (Controls::new(loaded.camera.clone(), size), ResolutionScaling::new(BUDGET));
        let mut viewer = Self {
            source,
            flags,
            session,
            canvas,
            first,
            second: None,
            split: 0.5,
            controls,
            scaling,
            shown: None,
            frames: 0,
        };
        if let Some(moment) = viewer.session.loaded.moment {
            viewer.at(moment)?;
        }
        tell("compiling what the first image needs");
        Ok(viewer)
    }

    /// Orbits by a motion of the pointer to the right and down.
    pub fn orbit(&mut self, right: f32, down: f32) {
        self.controls.orbit(right, down);
    }

    /// Looks around by a motion of the pointer.
    pub fn look(&mut self, right: f32, down: f32) {
        self.controls.look(right, down);
    }

    /// Flies for some seconds; each direction is -1 to 1.
    pub fn fly(&mut self, right: f32, up: f32, forward: f32, seconds: f32) {
        self.controls.fly(Way { right, up, forward }, seconds);
    }

    /// Moves nearer by some notches of the wheel.
    pub fn dolly(&mut self, notches: f32) {
        self.controls.dolly(notches);
    }

    /// Returns to the first camera.
    pub fn home(&mut self) {
        self.controls.go_home();
    }

    /// Lets the file's animation, or falling lights, go on for some seconds. False if nothing moves.
    pub fn play(&mut self, seconds: f32) -> Result<bool, JsValue> {
        let loaded = &self.session.loaded;
        let animation = (!loaded.scene.motion.animations.is_empty()).then_some(0);
        if animation.is_none() && loaded.rain.is_none() {
            return Ok(false);
        }
        let before = loaded.moment.unwrap_or(Moment { animation, time: 0.0 });
        self.at(Moment { time: before.time + seconds, ..before }).map(|()| true)
    }

    /// True after an error of the device: nothing can be rendered any more.
    pub fn is_broken(&self) -> bool {
        self.session.device.check().is_err()
    }

    /// Changes a setting by its name, of which no other scene results; without a value, to its default.
    pub fn set(&mut self, name: &str, value: Option<String>) -> Result<(), JsValue> {
        let mut flags = self.flags.clone();
        match value {
            Some(value) => flags.put(name, &value),
            None => flags.remove(name),
        }
        let exposure = self.session.loaded.exposure;
        let settings = in_window(&self.source.shot(&flags)?, exposure);
        self.first.set(&self.session, settings)?;
        self.flags = flags;
        self.shown = None;
        Ok(())
    }

    /// Shows other settings, by name, to the right of a fraction of the width; without any, one technique again.
    pub fn compare(
        &mut self,
        #[wasm_bindgen(unchecked_optional_param_type = "Record<string, string | number>")] options: Option<Object>,
    ) -> Result<(), JsValue> {
        self.second = None;
        if let Some(options) = options {
            let flags = Flags::of(&options)?;
            let settings = in_window(&self.source.shot(&flags)?, self.session.loaded.exposure);
            self.second = Some(Side::new(&self.session, settings)?);
        }
        self.shown = None;
        Ok(())
    }

    /// Moves the line between two techniques.
    pub fn split(&mut self, part: f32) -> Result<(), JsValue> {
        self.split = part;
        if self.shown.is_some() { self.present() } else { Ok(()) }
    }

    /// Shows the next image, of at most this size: smaller where a frame takes long while the view moves. Returns its width and height;
    /// none if nothing has changed.
    pub async fn frame(&mut self, width: u32, height: u32) -> Result<Option<Vec<u32>>, JsValue> {
        let camera = self.controls.camera.clone();
        let is_moving = self.shown.as_ref().is_none_or(|(shown, _)| *shown != camera);
        let scale = self.scaling.scale(u64::from(width) * u64::from(height), is_moving);
        let size = [width, height].map(|side| ((side as f32 * scale) as u32).max(1));
        let now = Some((camera, size));
        if self.shown != now {
            (self.shown, self.frames) = (now, 0);
        }
        if self.frames >= self.first.renderer.settings().image.accumulate {
            return Ok(None);
        }
        let started = Date::now();
        self.first.frame(&self.session, &self.controls.camera, size).await?;
        if let Some(second) = &mut self.second {
            second.frame(&self.session, &self.controls.camera, size).await?;
        }
        self.scaling.took(u64::from(size[0]) * u64::from(size[1]), Date::now() - started);
        self.frames += 1;
        self.present()?;
        Ok(Some(size.to_vec()))
    }

    /// The image that is shown, of the first technique.
    pub async fn image(&self) -> Result<ImageData, JsValue> {
        self.first.image(&self.session).await
    }

    /// The view as a shot, which `lanternfish render` renders.
    pub fn shot(&self) -> Result<String, JsValue> {
        let (loaded, size) = (&self.session.loaded, self.shown.as_ref().map_or([1280, 720], |(_, size)| *size));
        let now = shown::Shown {
            settings: self.first.renderer.settings(),
            scene: &loaded.scene,
            camera: &self.controls.camera,
            eyes: None,
            size,
            moment: loaded.moment,
        };
        let (shot, _) = loaded.opened.shown(&now).map_err(failed)?;
        shown::text(&shot).map_err(failed)
    }
}

impl Viewer {
    fn at(&mut self, moment: Moment) -> Result<(), JsValue> {
        let loaded = &mut self.session.loaded;
        loaded.moment = Some(moment);
        if let Some(rain) = &loaded.rain {
            rain.fall(&mut loaded.scene.lights, moment.time);
        }
        if let Some(animation) = moment.animation {
            let duration = loaded.scene.motion.animations[animation].duration();
            loaded.scene.pose(animation, if duration > 0.0 { moment.time % duration } else { 0.0 });
        }
        self.first.update(&self.session)?;
        if let Some(second) = &mut self.second {
            second.update(&self.session)?;
        }
        self.shown = None;
        Ok(())
    }

    fn present(&self) -> Result<(), JsValue> {
        let second = self.second.as_ref().map(|second| Ok::<_, JsValue>((second.texture()?, self.split)));
        self.canvas.show(&self.session.device, self.first.texture()?, second.transpose()?)
    }
}
