//! What a frame of the window does about its pictures: it draws the next frame of each, changes the scene, and keeps screenshots.

use std::{sync::Arc, time::Instant};

use glam::UVec2;
use lanternfish_scene::Camera;

use super::Viewer;
use crate::{
    Form, Shown,
    background::Found,
    overlay::BirdsEye,
    panels::{Edit, Pointed, State},
    player,
    seen::at_rest,
    wipe::Other,
};

impl Viewer {
    /// The next frame of either side, while the device does nothing for them. What cannot be is told, and is as it was before.
    pub(super) fn draw_both(&mut self, seconds: f32) {
        self.seen.show_to(self.state.eyes());
        self.draw_beside();
        if let Err(error) = self.draw(seconds) {
            self.state.message = error.to_string();
            // What was asked for cannot be: what is shown can.
            self.state.settings = self.seen.settings().clone();
            self.state.written = None;
        }
    }

    /// The next frame of the picture, where there is one.
    fn draw(&mut self, seconds: f32) -> Result<(), lanternfish::RenderError> {
        self.seen.set(&self.state.settings)?;
        if let Some(clip) = &mut self.state.clip
            && player::play(&self.seen.scene, clip, &mut self.moment, seconds)
        {
            let (has_animation, animation, time) = (!clip.is_rain_alone, clip.animation, clip.time);
            self.let_go();
            let scene = Arc::make_mut(&mut self.seen.scene);
            if has_animation {
                scene.pose(animation, time);
            }
            if let Some(rain) = &self.rain {
                rain.fall(&mut scene.lights, time);
            }
            self.seen.update()?;
        }
        let share = self.pace.scale(u64::from(self.room.x) * u64::from(self.room.y), self.moves());
        let size = (self.room.as_vec2() * share).as_uvec2().max(UVec2::ONE);
        self.seen.resize(size);
        if self.seen.has_more(&self.state.controls.camera) {
            self.seen.draw(&self.state.controls.camera)?;
        }
        Ok(())
    }

    /// The next frame of the other side, before that of the first: what is compared is what is seen.
    fn draw_beside(&mut self) {
        let rests = !self.moves() && self.seen.size() == self.room && self.seen.averaged() > 0;
        if let Some(pointed) = self.state.pointed.clone().filter(|pointed| rests && pointed.is_of_before) {
            self.probe(pointed.at, pointed.eye, pointed.camera, pointed.found);
        }
        let State { wipe, controls, message, .. } = &mut self.state;
        if let Err(error) = self.beside.draw(&self.seen, wipe, &controls.camera, rests) {
            *message = format!("B: {error}");
            match self.beside.settings() {
                Some(settings) if *settings != wipe.settings => wipe.settings = settings.clone(),
                _ => wipe.other = Other::Nothing,
            }
        }
    }

    /// Goes over to the view from above, once the first camera's picture is whole, or back from it.
    pub(super) fn look_from_above(&mut self) {
        let rests = self.seen.size() == self.room && !self.moves();
        let State { overlays, controls, message, clip, .. } = &mut self.state;
        if !overlays.wants_birds_eye {
            return;
        }
        if self.recorder.is_some() {
            (overlays.wants_birds_eye, *message) = (false, "While a flight is recorded there is one camera".to_owned());
            return;
        }
        // What is looked at stands still.
        clip.iter_mut().for_each(|clip| clip.is_playing = false);
        if let Some(view) = overlays.birds_eye.take() {
            controls.camera = view.first.camera.clone();
            (controls.speed, controls.reach) = (view.first.speed, view.first.reach);
        } else if rests && self.seen.shows(&controls.camera) {
            match self.seen.clusters() {
                Ok(grids) => {
                    let view = BirdsEye::new(controls, self.room.x as f32 / self.room.y as f32, &grids);
                    controls.camera = view.camera(&self.seen.scene.bounds());
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

    /// Asks what lies under a pixel of an eye's picture.
    pub(super) fn point(&mut self, at: glam::Vec2, eye: usize) {
        self.probe(at, eye, self.state.controls.camera.clone(), None);
    }

    fn probe(&mut self, at: glam::Vec2, eye: usize, camera: Camera, found: Option<Found>) {
        let cameras = self.seen.cameras(&camera);
        self.beside.probe(&self.seen, cameras.get(eye).unwrap_or(&camera), at.to_array());
        self.state.pointed = Some(Pointed { at, eye, camera, found, cluster: None, tile: None, is_of_before: false });
    }

    /// Changes a light.
    pub(super) fn edit(&mut self, edit: Edit) {
        self.state.message.clear();
        let lights = edit.applied(&self.seen.scene.lights);
        // Those that somebody has moved or deleted fall no more, nor do the others.
        if self.rain.take_if(|rain| !rain.is_same(&self.seen.scene.lights, &lights)).is_some() {
            self.state.clip.take_if(|clip| clip.is_rain_alone);
        }
        self.let_go();
        if let Err(error) = self.seen.set_lights(lights) {
            self.state.message = error.to_string();
        }
        // While it is dragged, pictures are small ones.
        self.moved = Some(Instant::now());
    }

    /// Writes what is seen as it will be at rest, and goes on with the camera of what was written.
    pub(super) fn write(&mut self, form: Form) {
        let settings = at_rest(&self.state.settings);
        let shown = Shown {
            settings: &settings,
            scene: &self.seen.scene,
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
        self.beside.let_go();
        if let Some(pointed) = &mut self.state.pointed {
            pointed.is_of_before = true;
        }
    }

    /// Writes a screenshot, if one is asked for and the whole picture is there.
    pub(super) fn keep_picture(&mut self) {
        let size = self.seen.size();
        if !self.wants_screenshot || size != self.room || self.seen.averaged() == 0 {
            return;
        }
        self.wants_screenshot = false;
        let read = self.seen.pixels().map_err(|error| error.to_string());
        // Two eyes stand side by side.
        let all = if self.seen.eyes().is_some() { size * UVec2::new(2, 1) } else { size };
        let kept = read.and_then(|texels| (self.keep)(texels.as_flattened(), all.into()));
        self.state.message = kept.unwrap_or_else(|what| format!("no screenshot: {what}"));
    }
}
