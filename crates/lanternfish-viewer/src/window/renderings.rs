//! What a frame of the window does about its images: it draws the next frame of each, changes the scene, and keeps screenshots.

use std::{sync::Arc, time::Instant};

use glam::UVec2;
use lanternfish_scene::Camera;

use super::Viewer;
use crate::{
    Form, Shown,
    background::Found,
    overlay::BirdsEye,
    panels::{Clip, Edit, Pointed, State},
    player,
    viewport::at_rest,
    wipe::Other,
};

impl Viewer {
    /// The next frame of either side, while the device does nothing for them. What cannot be is told, and is as it was before.
    pub(super) fn draw_both(&mut self, seconds: f32) {
        self.viewport.show_to(self.state.eyes());
        self.draw_beside();
        if let Err(error) = self.draw(seconds) {
            self.state.message = error.to_string();
            // What was requested cannot be: what is shown can.
            self.state.settings = self.viewport.settings().clone();
            self.state.written = None;
        }
    }

    /// The next frame of the image, where there is one.
    fn draw(&mut self, seconds: f32) -> Result<(), lanternfish::RenderError> {
        self.viewport.set(&self.state.settings)?;
        if let Some(clip) = &mut self.state.clip
            && player::play(&self.viewport.scene, clip, &mut self.moment, seconds)
        {
            let (animation, time) = (clip.animation, clip.time);
            self.let_go();
            let scene = Arc::make_mut(&mut self.viewport.scene);
            if let Some(animation) = animation {
                scene.pose(animation, time);
            }
            if let Some(rain) = &self.rain {
                rain.fall(&mut scene.lights, time);
            }
            self.viewport.update()?;
        }
        let fraction = self.resolution_scaling.scale(u64::from(self.room.x) * u64::from(self.room.y), self.moves());
        let size = (self.room.as_vec2() * fraction).as_uvec2().max(UVec2::ONE);
        self.viewport.resize(size);
        if self.viewport.has_more(&self.state.controls.camera) {
            self.viewport.draw(&self.state.controls.camera)?;
        }
        Ok(())
    }

    /// The next frame of the other side, before that of the first: what is compared is what is seen.
    fn draw_beside(&mut self) {
        let rests = !self.moves() && self.viewport.size() == self.room && self.viewport.averaged() > 0;
        if let Some(pointed) = self.state.pointed.clone().filter(|pointed| rests && pointed.is_of_before) {
            self.probe(pointed.at, pointed.eye, pointed.camera, pointed.found);
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

    /// Goes over to the view from above, once the first camera's image is whole, or back from it.
    pub(super) fn look_from_above(&mut self) {
        let rests = self.viewport.size() == self.room && !self.moves();
        let State { overlays, controls, message, clip, .. } = &mut self.state;
        if !overlays.wants_birds_eye {
            return;
        }
        if self.recorder.is_some() {
            (overlays.wants_birds_eye, *message) =
                (false, "Stereo and bird's-eye view are off while a flight is recorded".to_owned());
            return;
        }
        // What is looked at stands still.
        clip.iter_mut().for_each(|clip| clip.is_playing = false);
        if let Some(view) = overlays.birds_eye.take() {
            controls.camera = view.first.camera.clone();
            (controls.speed, controls.reach) = (view.first.speed, view.first.reach);
        } else if rests && self.viewport.shows(&controls.camera) {
            match self.viewport.clusters() {
                Ok(grids) => {
                    let view = BirdsEye::new(controls, self.room.x as f32 / self.room.y as f32, &grids);
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

    /// Asks what lies under a pixel of an eye's image.
    pub(super) fn point(&mut self, at: glam::Vec2, eye: usize) {
        self.probe(at, eye, self.state.controls.camera.clone(), None);
    }

    fn probe(&mut self, at: glam::Vec2, eye: usize, camera: Camera, found: Option<Found>) {
        let cameras = self.viewport.cameras(&camera);
        self.comparison.probe(&self.viewport, cameras.get(eye).unwrap_or(&camera), at.to_array());
        self.state.pointed = Some(Pointed { at, eye, camera, found, cluster: None, tile: None, is_of_before: false });
    }

    /// Changes a light.
    pub(super) fn edit(&mut self, edit: Edit) {
        self.state.message.clear();
        let changed = edit.changed();
        let lights = edit.applied(&self.viewport.scene.lights);
        self.let_go();
        match self.viewport.set_lights(lights) {
            Ok(()) => self.mind_the_rain(changed),
            Err(error) => self.state.message = error.to_string(),
        }
        // While it is dragged, images are small ones.
        self.moved = Some(Instant::now());
    }

    /// Rain of which a light was changed by hand, or deleted, falls no more.
    fn mind_the_rain(&mut self, changed: Option<(usize, bool)>) {
        let (Some(rain), Some((index, is_gone))) = (&mut self.rain, changed) else { return };
        if rain.indices().contains(&index) {
            self.rain = None;
            self.state.message = "Light rain is paused: one of its lights was edited".to_owned();
            self.state.clip = self.state.clip.take().and_then(Clip::without_rain);
        } else if is_gone && index < rain.indices().start {
            rain.moves_up();
        }
    }

    /// Writes what is seen as it will be at rest, and goes on with the camera of what was written.
    pub(super) fn write(&mut self, form: Form) {
        let settings = at_rest(&self.state.settings);
        let shown = Shown {
            settings: &settings,
            scene: &self.viewport.scene,
            camera: &self.state.controls.camera,
            eyes: self.state.eyes(),
            size: self.room.into(),
            moment: self.moment,
        };
        self.state.message = match (self.write)(&shown, form) {
            Err(what) => what,
            Ok(written) => {
                self.state.controls.camera.clone_from(&written.camera);
                match form {
                    Form::File => written.text,
                    Form::CommandLine => {
                        let said = format!("copied: {}", written.text);
                        self.surface.context().copy_text(written.text);
                        said
                    }
                }
            }
        };
    }

    /// The scene becomes another: nobody else holds on to it.
    fn let_go(&mut self) {
        self.comparison.let_go();
        if let Some(pointed) = &mut self.state.pointed {
            pointed.is_of_before = true;
        }
    }

    /// Writes a screenshot, if one is requested and the whole image is there.
    pub(super) fn keep_image(&mut self) {
        let size = self.viewport.size();
        if !self.wants_screenshot || size != self.room || self.viewport.averaged() == 0 {
            return;
        }
        self.wants_screenshot = false;
        let read = self.viewport.pixels().map_err(|error| error.to_string());
        // Two eyes stand side by side.
        let all = if self.viewport.eyes().is_some() { size * UVec2::new(2, 1) } else { size };
        let kept = read.and_then(|texels| (self.keep)(texels.as_flattened(), all.into()));
        self.state.message = kept.unwrap_or_else(|what| format!("no screenshot: {what}"));
    }
}
