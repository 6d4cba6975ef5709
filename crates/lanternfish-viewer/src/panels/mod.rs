//! What stands about the picture: settings, passes and their times, the scene's animation, keys.

mod knobs;
mod lights;
mod passes;
mod pixel;
mod sides;
#[cfg(test)]
mod tests;

use egui::{Key, PointerButton, Ui};
use glam::Vec2;
use lanternfish::{FrameReport, Settings};
use lanternfish_gpu::AdapterDescription;
use lanternfish_scene::Scene;

pub use self::{
    lights::{Edit, Listing},
    pixel::Pointed,
};
use crate::{
    Form,
    controls::{Controls, Way},
    wipe::{self, Other, Textures, Wipe},
};

/// What the panels change.
#[derive(Debug)]
pub struct State {
    /// What is asked for.
    pub settings: Settings,
    /// What is on the other side of the line, and where that is.
    pub wipe: Wipe,
    /// The pixel that was clicked.
    pub pointed: Option<Pointed>,
    /// Which lights are listed.
    pub listing: Listing,
    /// Those that a click on "as it was" goes back to.
    pub usual: Settings,
    /// The camera and how it moves.
    pub controls: Controls,
    /// What is played.
    pub clip: Option<Clip>,
    /// A line that tells of the last thing that went wrong, or was done.
    pub message: String,
    /// Whether the page of keys is shown.
    pub shows_keys: bool,
    /// Whether the panels are shown.
    pub shows_panels: bool,
}

/// An animation of the scene, and where in it the scene is.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Names of all that there are.
    pub names: Vec<String>,
    /// Which of them, by its index.
    pub animation: usize,
    /// How long it is, s.
    pub duration: f32,
    /// What is shown of it, s.
    pub time: f32,
    /// Whether time passes.
    pub is_playing: bool,
}

/// What the panels tell of.
#[derive(Debug)]
pub struct Facts<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// Its triangles.
    pub triangle_count: usize,
    /// What renders.
    pub adapter: &'a AdapterDescription,
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Frames that it is the mean of.
    pub averaged: u32,
    /// The last frame.
    pub report: Option<&'a FrameReport>,
    /// Milliseconds from when a frame is begun to when the device is done with it.
    pub frame_ms: f64,
    /// Milliseconds that panels and painting take, once that is known.
    pub window_ms: Option<f64>,
    /// The pictures.
    pub textures: Textures,
    /// Frames that the other side's picture is the mean of, or samples of each of its pixels.
    pub progress_of_b: u64,
    /// How different the two sides look, 0 to 1, once that is known.
    pub mean_difference: Option<f32>,
}

/// What is asked of the window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// A file with the picture.
    pub screenshot: bool,
    /// What is seen, in a form that renders it.
    pub write: Option<Form>,
    /// What lies under a pixel: shares of the picture's sides.
    pub pixel: Option<Vec2>,
    /// Another light.
    pub edit: Option<Edit>,
    /// To be closed.
    pub close: bool,
    /// Points that are left for the picture, across and down.
    pub room: Vec2,
    /// Whether the camera was moved by hand.
    pub is_moving: bool,
}

impl Asked {
    /// What was asked first, and now.
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

/// Draws everything, and takes what was clicked and pressed. `seconds`: since the last time.
pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, seconds: f32) -> Asked {
    let mut asked = Asked::default();
    keys(ui, state, &mut asked);
    if state.shows_panels {
        egui::Panel::left("settings").default_size(290.0).show(ui, |ui| {
            ui.heading(if state.wipe.edits_b { "Settings of B" } else { "Settings" });
            egui::ScrollArea::vertical().id_salt("settings/all").show(ui, |ui| settings(ui, state));
        });
        egui::Panel::right("frame").default_size(270.0).show(ui, |ui| {
            passes::head(ui, facts, &mut asked);
            ui.separator();
            egui::ScrollArea::vertical().id_salt("frame/all").show(ui, |ui| right(ui, state, facts, &mut asked));
        });
        egui::Panel::bottom("below").show(ui, |ui| below(ui, state));
    }
    egui::CentralPanel::default()
        .frame(egui::Frame::NONE)
        .show(ui, |ui| picture(ui, state, facts, seconds, &mut asked));
    if state.shows_keys {
        let window = egui::Window::new("Keys").collapsible(false).vscroll(true).open(&mut state.shows_keys);
        window.show(ui.ctx(), page_of_keys);
    }
    asked
}

/// What is behind headings on the right.
fn right(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, asked: &mut Asked) {
    ui.collapsing("Two sides", |ui| sides::show(ui, state, facts));
    ui.collapsing("Pixel", |ui| {
        if pixel::show(ui, state, facts) {
            focus(state, asked);
        }
    });
    ui.collapsing("Lights", |ui| {
        if let Some(edit) = lights::show(ui, state, facts) {
            asked.edit = Some(edit);
        }
    });
    let passes = egui::CollapsingHeader::new("Passes").default_open(true);
    passes.show(ui, |ui| passes::show(ui, facts));
}

/// The settings of the side that the panel is of.
fn settings(ui: &mut Ui, state: &mut State) {
    let of_b = state.wipe.edits_b;
    let exchange = |state: &mut State| std::mem::swap(&mut state.settings, &mut state.wipe.settings);
    if of_b {
        exchange(state);
    }
    knobs::show(ui, state);
    if of_b {
        exchange(state);
    }
}

/// Looks at the surface that was clicked.
fn focus(state: &mut State, asked: &mut Asked) {
    if let Some(place) = state.pointed.as_ref().and_then(Pointed::place) {
        state.controls.focus(place.p);
        asked.is_moving = true;
    }
}

const KEYS: [(&str, &str); 16] = [
    ("W A S D", "Fly forward, left, back, right"),
    ("E Q", "Fly up, down"),
    ("Shift", "Four times as fast"),
    ("Drag, right button", "Look about"),
    ("Drag, left button", "Go round what is in the middle"),
    ("Wheel", "Fly faster, slower"),
    ("Click", "What lies under the pixel (\u{201c}Pixel\u{201d} on the right)"),
    ("F", "Look at what was clicked, and go round it"),
    ("B", "Another picture on the right of a line, or none"),
    ("Space", "Play and pause the animation"),
    (", .", "A frame back, on"),
    ("F2", "A screenshot"),
    ("F3", "Hide and show the panels"),
    ("F4", "A shot: a file that renders what is seen"),
    ("F5", "A command line that renders it, to be pasted"),
    ("F1", "This page; Escape closes it, or the window"),
];

fn page_of_keys(ui: &mut Ui) {
    egui::Grid::new("keys").show(ui, |ui| {
        for (key, words) in KEYS {
            ui.strong(key);
            ui.label(words);
            ui.end_row();
        }
    });
}

/// Keys that belong to no widget.
fn keys(ui: &Ui, state: &mut State, asked: &mut Asked) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let mut focuses = false;
    ui.input_mut(|input| {
        let mut pressed = |key| input.consume_key(egui::Modifiers::NONE, key);
        state.shows_keys ^= pressed(Key::F1);
        state.shows_panels ^= pressed(Key::F3);
        asked.screenshot |= pressed(Key::F2);
        if pressed(Key::F4) {
            asked.write = Some(Form::File);
        }
        if pressed(Key::F5) {
            asked.write = Some(Form::CommandLine);
        }
        if pressed(Key::Escape) {
            asked.close = !state.shows_keys;
            state.shows_keys = false;
        }
        if pressed(Key::B) {
            state.wipe.other = match state.wipe.other {
                Other::Nothing => Other::Settings,
                _ => Other::Nothing,
            };
        }
        focuses = pressed(Key::F);
        if let Some(clip) = &mut state.clip {
            clip.is_playing ^= pressed(Key::Space);
            let step = f32::from(i8::from(pressed(Key::Period)) - i8::from(pressed(Key::Comma))) / 24.0;
            clip.time = (clip.time + step).rem_euclid(clip.duration.max(1e-3));
        }
    });
    if focuses {
        focus(state, asked);
    }
}

/// The picture, and the hand that moves the camera over it.
fn picture(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, seconds: f32, asked: &mut Asked) {
    let rect = ui.available_rect_before_wrap();
    asked.room = Vec2::new(rect.width(), rect.height());
    let response = ui.interact(rect, ui.scope_id().with("picture"), egui::Sense::click_and_drag());
    wipe::paint(ui, rect, &state.wipe, &facts.textures);
    wipe::line(ui, rect, &mut state.wipe);
    if let Some(pointed) = state.pointed.as_ref().filter(|pointed| pointed.camera == state.controls.camera) {
        let at = rect.lerp_inside(egui::vec2(pointed.at.x, pointed.at.y));
        ui.painter().circle_stroke(at, 5.0, egui::Stroke::new(3.0, egui::Color32::BLACK));
        ui.painter().circle_stroke(at, 5.0, egui::Stroke::new(1.5, egui::Color32::WHITE));
    }
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked()) {
        let at = (at - rect.min) / rect.size();
        asked.pixel = Some(Vec2::new(at.x, at.y));
    }
    let controls = &mut state.controls;
    let dragged = response.drag_delta();
    if response.dragged_by(PointerButton::Secondary) {
        controls.look(dragged.x, dragged.y);
    } else if response.dragged_by(PointerButton::Primary) {
        controls.orbit(dragged.x, dragged.y);
    }
    asked.is_moving |= response.dragged() && dragged != egui::Vec2::ZERO;
    if response.hovered() {
        controls.accelerate(ui.input(|input| input.smooth_scroll_delta.y) / 50.0);
    }
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let (way, is_fast) = ui.input(|input| {
        let towards = |more, less| f32::from(i8::from(input.key_down(more)) - i8::from(input.key_down(less)));
        let way = Way { right: towards(Key::D, Key::A), up: towards(Key::E, Key::Q), forward: towards(Key::W, Key::S) };
        (way, input.modifiers.shift)
    });
    if way != Way::default() {
        controls.fly(way, if is_fast { 4.0 * seconds } else { seconds });
        asked.is_moving = true;
    }
}

/// The animation, and what went wrong.
fn below(ui: &mut Ui, state: &mut State) {
    ui.horizontal(|ui| {
        if let Some(clip) = &mut state.clip {
            if ui.button(if clip.is_playing { "Pause" } else { "Play" }).clicked() {
                clip.is_playing = !clip.is_playing;
            }
            let name = clip.names.get(clip.animation).map_or("", String::as_str);
            egui::ComboBox::from_id_salt("animation").selected_text(name).show_ui(ui, |ui| {
                for (i, name) in clip.names.iter().enumerate() {
                    ui.selectable_value(&mut clip.animation, i, name);
                }
            });
            let duration = clip.duration;
            ui.add(egui::Slider::new(&mut clip.time, 0.0..=duration).suffix(" s"));
        }
        ui.label(format!("{:.2} m/s", state.controls.speed))
            .on_hover_text("How fast the camera flies: the wheel changes it");
        ui.label(&state.message);
        if ui.small_button("Keys (F1)").clicked() {
            state.shows_keys = true;
        }
    });
}
