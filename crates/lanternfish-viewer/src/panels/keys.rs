//! The list of keys.

use egui::{Key, Ui};

use super::{Requested, State, focus, stereo};
use crate::{Form, wipe::Other};

const KEYS: [(&str, &str); 21] = [
    ("W A S D", "Fly forward, left, back, right"),
    ("E Q", "Fly up, down"),
    ("Shift", "Move four times as fast"),
    ("Drag, right button", "Look around"),
    ("Drag, left button", "Orbit around the centre"),
    ("Wheel", "Move closer to the centre, or away"),
    ("Wheel while flying", "Fly faster, slower; also with the right button held"),
    ("Home", "Return to the first view"),
    ("Click", "Inspect the pixel (\u{201c}Pixel\u{201d} on the right)"),
    ("F", "Focus on the clicked point, and orbit around it"),
    ("B", "Compare A | B, on or off"),
    ("T", "Stereo side by side, on or off"),
    ("V", "Bird's-eye view: a second camera shows the first one and its clusters"),
    ("Space", "Play and pause animations and light rain"),
    (", .", "Step one frame back, forward"),
    ("F2", "Write a screenshot"),
    ("F3", "Hide and show the panels"),
    ("F4", "Save a shot: a file that renders this view"),
    ("F5", "Copy a command line that renders this view"),
    ("F6", "Expand or collapse all sections"),
    ("F1", "This help; Escape closes it, or the window"),
];

/// Draws the list of keys.
pub fn page(ui: &mut Ui) {
    egui::Grid::new("keys").show(ui, |ui| {
        for (key, help) in KEYS {
            ui.strong(key);
            ui.label(help);
            ui.end_row();
        }
    });
}

/// Handles keys that no widget uses.
pub fn take(ui: &Ui, state: &mut State, requested: &mut Requested) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let mut focuses = false;
    ui.input_mut(|input| {
        let mut pressed = |key| input.consume_key(egui::Modifiers::NONE, key);
        state.shows_keys ^= pressed(Key::F1);
        state.shows_panels ^= pressed(Key::F3);
        if pressed(Key::F6) {
            state.is_unfolded ^= true;
            state.unfold = Some(state.is_unfolded);
        }
        requested.screenshot |= pressed(Key::F2);
        if pressed(Key::F4) {
            requested.write = Some(Form::File);
        }
        if pressed(Key::F5) {
            requested.write = Some(Form::CommandLine);
        }
        if pressed(Key::Escape) {
            requested.close = !state.shows_keys;
            state.shows_keys = false;
        }
        if pressed(Key::T) {
            state.show_stereo(!state.stereo.is_shown);
        }
        if pressed(Key::B) {
            match state.wipe.other {
                _ if state.stereo.is_shown => state.message = stereo::ALONE.to_owned(),
                Other::Nothing => state.wipe.other = Other::Settings,
                _ => state.wipe.other = Other::Nothing,
            }
        }
        focuses = pressed(Key::F);
        if pressed(Key::Home) {
            state.controls.go_home();
        }
        state.overlays.wants_birds_eye ^= pressed(Key::V);
        if let Some(clip) = &mut state.clip {
            clip.is_playing ^= pressed(Key::Space);
            let step = f32::from(i8::from(pressed(Key::Period)) - i8::from(pressed(Key::Comma))) / 24.0;
            clip.go_on(step);
        }
    });
    if focuses {
        focus(state, requested);
    }
}
