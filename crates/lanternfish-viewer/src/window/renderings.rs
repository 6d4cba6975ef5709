//! The images of the window: draws the next frame of each side, changes the scene, writes screenshots and shots.

use std::{sync::Arc, time::Instant};

use glam::UVec2;
use lanternfish_scene::Camera;

use super::Viewer;
use crate::{
    Form, Shown,
    background::ProbeResult,
    overlay::BirdsEye,
    panels::{Clip, Edit, Pointed, State},
    player,
    viewport::at_rest,
    wipe::Other,
};

impl Viewer {
    /// Draws the next frame of both sides; no frame may be in flight. An error is shown as a message, and the last working settings stay.
    pub(super) fn draw_both(&mut self, seconds: f32) {
        self.viewport.show_to(self.state.eyes());
        self.draw_comparison();
        if let Err(error) = self.draw(seconds) {
            self.state.message = error.to_string();
            // The requested settings failed; the current ones work.
            self.state.settings = self.viewport.requested().clone();
            self.state.written = None;
        }
        self.slice_scheduler.begin();
    }

    /// Draws the next frame of A, if it would change the image.
    fn draw(&mut self, seconds: f32) -> Result<(), lanternfish::RenderError> {
        self.viewport.set(&self.state.settings)?;
        if let Some(clip) = &mut self.state.clip
            && player::play(&self.viewport.scene, clip, &mut self.moment, seconds)
        {
            let (animation, time) = (clip.animation, clip.time);
            self.release_scene();
            let scene = Arc::make_mut(&mut self.viewport.scene);
            if let Some(animation) = animation {
                scene.pose(animation, time);
            }
            if let Some(rain) = &self.rain {
                rain.fall(&mut scene.lights, time);
            }
            self.viewport.update()?;
        }
        let fraction = self
            .resolution_scaling
            .scale(u64::from(self.viewport_size.x) * u64::from(self.viewport_size.y), self.is_in_motion());
        let size = (self.viewport_size.as_vec2() * fraction).as_uvec2().max(UVec2::ONE);
        self.viewport.resize(size);
        if self.viewport.has_more(&self.state.controls.camera) {
            self.viewport.draw(&self.state.controls.camera)?;
        }
        Ok(())
    }

    /// Draws the next frame of B. It runs before A's, so that the comparison uses the displayed image of A.
    fn draw_comparison(&mut self) {
        let rests = !self.moves() && self.viewport.size() == self.viewport_size && self.viewport.averaged() > 0;
        if let Some(pointed) = self.state.pointed.clone().filter(|pointed| rests && pointed.is_outdated) {
            self.probe(pointed.at, pointed.eye, pointed.camera, pointed.probe_result);
        }
        let State { wipe, controls, message, .. } = &mut self.state;
        if let Err(error) = self.comparison.draw(&self.viewport, wipe, &controls.camera, rests) {
            *message = format!("B: {error}");
            match self.comparison.settings() {
                Some(settings) if *settings != wipe.settings => wipe.settings = settings.clone(),
                _ => wipe.other = Other::Nothing,
            }
        }
    }

    /// Enters the bird's-eye view once the first camera's image has full resolution, or leaves it.
    pub(super) fn toggle_birds_eye(&mut self) {
        let rests = self.viewport.size() == self.viewport_size && !self.moves();
        let State { overlays, controls, message, clip, .. } = &mut self.state;
        if !overlays.wants_birds_eye {
            return;
        }
        if self.recorder.is_some() {
            (overlays.wants_birds_eye, *message) =
                (false, "Stereo and bird's-eye view are off while a flight is recorded".to_owned());
            return;
        }
        // Playback stops while the view changes.
        clip.iter_mut().for_each(|clip| clip.is_playing = false);
        if let Some(view) = overlays.birds_eye.take() {
            controls.camera = view.first.camera.clone();
            (controls.speed, controls.reach) = (view.first.speed, view.first.reach);
        } else if rests && self.viewport.shows(&controls.camera) {
            match self.viewport.clusters() {
                Ok(grids) => {
                    let view =
                        BirdsEye::new(controls, self.viewport_size.x as f32 / self.viewport_size.y as f32, &grids);
                    controls.camera = view.camera(&self.viewport.scene.bounds());
                    overlays.birds_eye = Some(view);
                }
                Err(error) => *message = error.to_string(),
            }
        } else {
            return;
        }
        overlays.wants_birds_eye = false;
        self.moved = Some(Instant::now());
    }

    /// Requests a probe of a pixel of an eye's image. `at`: 0 to 1 from the top left.
    pub(super) fn point(&mut self, at: glam::Vec2, eye: usize) {
        self.probe(at, eye, self.state.controls.camera.clone(), None);
    }

    fn probe(&mut self, at: glam::Vec2, eye: usize, camera: Camera, probe_result: Option<ProbeResult>) {
        let cameras = self.viewport.cameras(&camera);
        self.comparison.probe(&self.viewport, cameras.get(eye).unwrap_or(&camera), at.to_array());
        self.state.pointed =
            Some(Pointed { at, eye, camera, probe_result, cluster: None, tile: None, is_outdated: false });
    }

    /// Changes a light.
    pub(super) fn edit(&mut self, edit: Edit) {
        self.state.message.clear();
        let changed = edit.changed();
        let lights = edit.applied(&self.viewport.scene.lights);
        self.release_scene();
        match self.viewport.set_lights(lights) {
            Ok(()) => self.update_rain(changed),
            Err(error) => self.state.message = error.to_string(),
        }
        // During a drag, images have a low resolution.
        self.moved = Some(Instant::now());
    }

    /// Stops light rain if one of its lights was changed or deleted, and shifts its indices if an earlier light was deleted.
    fn update_rain(&mut self, changed: Option<(usize, bool)>) {
        let (Some(rain), Some((index, is_gone))) = (&mut self.rain, changed) else { return };
        if rain.indices().contains(&index) {
            self.rain = None;
            self.state.message = "Light rain is paused: one of its lights was edited".to_owned();
            self.state.clip = self.state.clip.take().and_then(Clip::without_rain);
        } else if is_gone && index < rain.indices().start {
            rain.moves_up();
        }
    }

    /// Writes the current view with settings as at rest, and continues with the written camera.
    pub(super) fn write(&mut self, form: Form) {
        let settings = at_rest(&self.state.settings);
        let shown = Shown {
            settings: &settings,
            scene: &self.viewport.scene,
            camera: &self.state.controls.camera,
            eyes: self.state.eyes(),
            size: self.viewport_size.into(),
            moment: self.moment,
        };
        self.state.message = match (self.write)(&shown, form) {
            Err(what) => what,
            Ok(written) => {
                self.state.controls.camera.clone_from(&written.camera);
                match form {
                    Form::File => written.text,
                    Form::CommandLine => {
                        let message = format!("copied: {}", written.text);
                        self.surface.context().copy_text(written.text);
                        message
                    }
                }
            }
        };
    }

    /// Releases all references to the scene before it changes, and marks the clicked pixel as outdated.
    fn release_scene(&mut self) {
        self.comparison.release_scene();
        if let Some(pointed) = &mut self.state.pointed {
            pointed.is_outdated = true;
        }
    }

    /// Writes a screenshot, if one is requested and the image has full resolution.
    pub(super) fn keep_image(&mut self) {
        let size = self.viewport.size();
        if !self.wants_screenshot || size != self.viewport_size || self.viewport.averaged() == 0 {
            return;
        }
        self.wants_screenshot = false;
        let read = self.viewport.pixels().map_err(|error| error.to_string());
        // Stereo images are side by side.
        let all = if self.viewport.eyes().is_some() { size * UVec2::new(2, 1) } else { size };
        let written = read.and_then(|texels| (self.keep)(texels.as_flattened(), all.into()));
        self.state.message = written.unwrap_or_else(|what| format!("screenshot failed: {what}"));
    }
}
