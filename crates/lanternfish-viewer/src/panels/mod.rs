//! Panels around the image: settings, camera, stereo, comparison, pixel, lights, overlays, pass times, memory,
//! animation, keys.

mod camera;
mod keys;
mod lights;
mod memory;
mod parameters;
mod passes;
mod pixel;
mod rendering;
mod sides;
mod stereo;
#[cfg(test)]
mod tests;
mod written;

use egui::Ui;
use glam::Vec2;
use lanternfish::Settings;
use lanternfish_gpu::{AdapterDescription, PassTime};
use lanternfish_scene::{Controls, Eyes, Scene};

pub use self::{
    lights::{Edit, Listing},
    memory::Memory,
    pixel::Pointed,
    written::Written,
};
use crate::{
    Form,
    overlay::{self, Overlays},
    stereo::Stereo,
    wipe::{Other, Textures, Wipe},
};

/// The state that the panels change.
#[derive(Debug)]
pub struct State {
    /// Settings of A.
    pub settings: Settings,
    /// The comparison with B.
    pub wipe: Wipe,
    /// The stereo setting.
    pub stereo: Stereo,
    /// The clicked pixel.
    pub pointed: Option<Pointed>,
    /// State of the list of lights.
    pub listing: Listing,
    /// The settings that "Reset all" restores: those at the start, or of the opened file.
    pub defaults: Settings,
    /// The camera and its controls.
    pub controls: Controls,
    /// The overlays.
    pub overlays: Overlays,
    /// The pass whose output is shown.
    pub written: Option<Written>,
    /// The playback of animation and light rain.
    pub clip: Option<Clip>,
    /// The last message: an error or a result.
    pub message: String,
    /// True if the list of keys is shown.
    pub shows_keys: bool,
    /// True if the panels are shown.
    pub shows_panels: bool,
    /// True if all sections were last expanded at once, false if collapsed.
    pub is_unfolded: bool,
    /// Expands (true) or collapses (false) all sections in this frame.
    pub unfold: Option<bool>,
}

impl State {
    /// The eyes of the stereo image; `None` for a mono image.
    pub fn eyes(&self) -> Option<Eyes> {
        self.stereo.of(&self.controls.camera)
    }

    /// Switches stereo on or off. Stereo ends the comparison with B.
    pub fn show_stereo(&mut self, is_shown: bool) {
        self.stereo.is_shown = is_shown;
        if is_shown && self.wipe.other != Other::Nothing {
            (self.wipe.other, self.wipe.shows_map, self.wipe.edits_b) = (Other::Nothing, false, false);
            self.message = stereo::ALONE.to_owned();
        }
    }
}

/// The playback of an animation, light rain or both, and the time that is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Names of all animations.
    pub names: Vec<String>,
    /// Index of the selected animation; `None` for light rain alone.
    pub animation: Option<usize>,
    /// Duration of the animation, or range of the time slider for light rain alone, s.
    pub duration: f32,
    /// True if there is light rain. It continues when the animation loops.
    pub has_rain: bool,
    /// The time that is shown, s.
    pub time: f32,
    /// True while playing.
    pub is_playing: bool,
}

impl Clip {
    /// Advances the time by `seconds`. Without rain the time wraps at the duration. With rain it does not, and the
    /// animation loops on its own.
    pub fn go_on(&mut self, seconds: f32) {
        self.time += seconds;
        if !self.has_rain {
            self.time = self.time.rem_euclid(self.duration.max(1e-3));
        }
    }

    /// The clip without rain; `None` if it has no animation.
    pub fn without_rain(self) -> Option<Self> {
        self.animation.map(|_| Self { has_rain: false, ..self })
    }
}

/// The data that the panels display.
#[derive(Debug)]
pub struct Facts<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// Number of triangles.
    pub triangle_count: usize,
    /// The adapter that renders.
    pub adapter: &'a AdapterDescription,
    /// Width and height of the image, or of each eye's, pixels.
    pub size: [u32; 2],
    /// The eyes of the stereo image; `None` for a mono image.
    pub eyes: Option<Eyes>,
    /// Number of frames that the image averages.
    pub averaged: u32,
    /// Device time of each pass of the last frame.
    pub passes: &'a [PassTime],
    /// Counters of the last frame: name and value.
    pub counters: &'a [(String, u64)],
    /// Device memory.
    pub memory: &'a Memory,
    /// Time of a frame from recording to completion, ms; 0 before the first.
    pub frame_ms: f64,
    /// Average time of panels and paint, ms; `None` before the first measurement.
    pub window_ms: Option<f64>,
    /// Textures of the images.
    pub textures: Textures,
    /// Number of frames that B averages, or its samples per pixel.
    pub progress_of_b: u64,
    /// Mean ꟻLIP error of A and B, 0 to 1; `None` until it is computed.
    pub mean_difference: Option<f32>,
}

/// Requests of the panels to the window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requested {
    /// Write a screenshot.
    pub screenshot: bool,
    /// Write the current view in this form.
    pub write: Option<Form>,
    /// Probe a pixel: position in the image, 0 to 1 from the top left, and index of the eye.
    pub pixel: Option<(Vec2, usize)>,
    /// Edit a light.
    pub edit: Option<Edit>,
    /// Close the window.
    pub close: bool,
    /// Size of the image's area, or of each eye's, points.
    pub viewport_size: Vec2,
    /// True if the user moved the camera.
    pub is_moving: bool,
}

impl Requested {
    /// Merges the requests of two passes over the panels; values of the later one take precedence.
    pub fn and(self, now: Self) -> Self {
        Self {
            screenshot: self.screenshot | now.screenshot,
            close: self.close | now.close,
            write: now.write.or(self.write),
            pixel: now.pixel.or(self.pixel),
            edit: now.edit.or(self.edit),
            ..now
        }
    }
}

/// Draws the panels and the image, and handles input. `seconds`: time since the last call.
pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, seconds: f32) -> Requested {
    let mut requested = Requested::default();
    keys::take(ui, state, &mut requested);
    if state.shows_panels {
        egui::Panel::left("settings").default_size(290.0).show(ui, |ui| {
            ui.heading(if state.wipe.edits_b { "Settings of B" } else { "Settings" });
            scrolled("settings/all").show(ui, |ui| settings(ui, state));
        });
        egui::Panel::right("frame").default_size(290.0).show(ui, |ui| {
            passes::head(ui, facts, &mut requested);
            ui.separator();
            scrolled("frame/all").show(ui, |ui| right(ui, state, facts, &mut requested));
        });
        egui::Panel::bottom("below").show(ui, |ui| below(ui, state));
    }
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
        rendering::show(ui, state, facts, seconds, &mut requested);
        if facts.frame_ms == 0.0 {
            preparing(ui);
        }
    });
    state.unfold = None;
    if state.shows_keys {
        // High enough for all of them, if there is room.
        let window = egui::Window::new("Keys").collapsible(false).vscroll(true).default_height(640.0);
        window.open(&mut state.shows_keys).show(ui.ctx(), keys::page);
    }
    requested
}

/// Says why the image is still black.
fn preparing(ui: &mut Ui) {
    let text = egui::RichText::new("Preparing the first image: shaders are compiled").color(egui::Color32::WHITE);
    let at = egui::Rect::from_center_size(ui.max_rect().center(), egui::vec2(400.0, 40.0));
    ui.put(at, egui::Label::new(text.heading()));
}

/// A scroll area for contents wider than their panel. A wider panel would resize the viewport and restart accumulation.
fn scrolled(name: &str) -> egui::ScrollArea {
    egui::ScrollArea::both().id_salt(name).auto_shrink([false, true])
}

/// The sections of the right panel.
fn right(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, requested: &mut Requested) {
    let unfold = state.unfold;
    let heading = |name: &'static str| egui::CollapsingHeader::new(name).open(unfold);
    heading("Camera").show(ui, |ui| camera::show(ui, state, facts, requested));
    heading("Stereo").show(ui, |ui| stereo::show(ui, state));
    heading("Compare").show(ui, |ui| sides::show(ui, state, facts));
    heading("Pixel").show(ui, |ui| {
        if pixel::show(ui, state, facts) {
            focus(state, requested);
        }
    });
    heading("Lights").show(ui, |ui| {
        if let Some(edit) = lights::show(ui, state, facts) {
            requested.edit = Some(edit);
        }
    });
    heading("Overlays").show(ui, |ui| overlay::switches(ui, &mut state.overlays, &state.settings));
    heading("Passes").default_open(true).show(ui, |ui| passes::show(ui, state, facts));
    heading("Memory").show(ui, |ui| memory::show(ui, facts));
}

/// The settings of the edited side.
fn settings(ui: &mut Ui, state: &mut State) {
    let of_b = state.wipe.edits_b;
    let swap = |state: &mut State| std::mem::swap(&mut state.settings, &mut state.wipe.settings);
    if of_b {
        swap(state);
    }
    let shown = state.settings.image.debug_view;
    parameters::show(ui, state);
    if state.settings.image.debug_view != shown {
        // The user chose another debug view.
        state.written = None;
    }
    if of_b {
        swap(state);
    }
}

/// Points the camera at the clicked surface.
fn focus(state: &mut State, requested: &mut Requested) {
    if let Some(place) = state.pointed.as_ref().and_then(Pointed::place) {
        state.controls.focus(place.p);
        requested.is_moving = true;
    }
}

/// Playback, fly speed and the last message.
fn below(ui: &mut Ui, state: &mut State) {
    ui.horizontal(|ui| {
        if let Some(clip) = &mut state.clip {
            if ui.button(if clip.is_playing { "Pause" } else { "Play" }).clicked() {
                clip.is_playing = !clip.is_playing;
            }
            let name = clip.animation.and_then(|animation| clip.names.get(animation));
            let name = name.map_or("light rain", String::as_str);
            egui::ComboBox::from_id_salt("animation").selected_text(name).show_ui(ui, |ui| {
                for (i, name) in clip.names.iter().enumerate() {
                    ui.selectable_value(&mut clip.animation, Some(i), name);
                }
            });
            let times = clip.time.min(0.0)..=clip.duration.max(clip.time);
            ui.add(egui::Slider::new(&mut clip.time, times).suffix(" s"));
        }
        ui.label(format!("{:.2} m/s", state.controls.speed))
            .on_hover_text("Fly speed; the wheel changes it while a key to fly or the right button is held");
        ui.label(&state.message);
        if ui.small_button("Keys (F1)").clicked() {
            state.shows_keys = true;
        }
    });
}
