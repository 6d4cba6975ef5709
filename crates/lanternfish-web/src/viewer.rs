//! A view that moves.

use js_sys::{Date, Function, Object};
use lanternfish::ResolutionScaling;
use lanternfish_scene::Camera;
use lanternfish_viewer::{Controls, Way};
use wasm_bindgen::prelude::*;
use web_sys::ImageData;

use crate::{options::Options, session::Session};

/// Longest time of a frame while the view moves, ms: as in the window.
const BUDGET: f64 = 60.0;

/// A scene with a camera that moves, and settings that change.
#[wasm_bindgen]
pub struct Viewer {
    session: Session,
    options: Options,
    controls: Controls,
    scaling: ResolutionScaling,
    /// Camera and size of the last frame, and the number of such frames at rest.
    shown: Option<(Camera, [u32; 2])>,
    frames: u32,
}

#[wasm_bindgen]
impl Viewer {
    /// Opens a scene, given as for `render`. `progress` is called with what is done.
    pub async fn open(
        #[wasm_bindgen(unchecked_param_type = "string | Uint8Array | [string, Uint8Array][]")] source: JsValue,
        #[wasm_bindgen(unchecked_param_type = "Record<string, string | number>")] options: Object,
        #[wasm_bindgen(unchecked_param_type = "(what: string) => void")] progress: Function,
    ) -> Result<Self, JsValue> {
        let options = Options::of(&options)?;
        let tell = |what: &str| drop(progress.call1(&JsValue::NULL, &what.into()));
        let session = Session::open(&source, options.settings()?, tell).await?;
        let camera = session.scene.cameras.get(options.camera).cloned();
        let camera = camera.unwrap_or_else(|| session.scene.default_camera(1.5));
        let bounds = session.scene.bounds();
        let size = if bounds.is_empty() { 1.0 } else { (bounds.max - bounds.min).length() };
        let (controls, scaling) = (Controls::new(camera, size), ResolutionScaling::new(BUDGET));
        Ok(Self { session, options, controls, scaling, shown: None, frames: 0 })
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

    /// Changes a setting by its name.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), JsValue> {
        self.options.put(name, value)?;
        self.session.set(self.options.settings()?)?;
        self.shown = None;
        Ok(())
    }

    /// The next image, of at most this size: smaller where a frame takes long while the view moves. None if nothing has changed.
    pub async fn image(&mut self, width: u32, height: u32) -> Result<Option<ImageData>, JsValue> {
        let camera = self.controls.camera.clone();
        let is_moving = self.shown.as_ref().is_none_or(|(shown, _)| *shown != camera);
        let scale = self.scaling.scale(u64::from(width) * u64::from(height), is_moving);
        let size = [width, height].map(|side| ((side as f32 * scale) as u32).max(1));
        let now = Some((camera, size));
        if self.shown != now {
            (self.shown, self.frames) = (now, 0);
        }
        if self.frames >= self.session.settings().image.accumulate {
            return Ok(None);
        }
        let started = Date::now();
        self.session.frame(&self.controls.camera, size).await?;
        self.scaling.took(u64::from(size[0]) * u64::from(size[1]), Date::now() - started);
        self.frames += 1;
        self.session.image().await.map(Some)
    }
}
