//! What keys do.

use egui::{Key, Ui};

use super::{Requested, State, focus, stereo};
use crate::{Form, wipe::Other};

const KEYS: [(&str, &str); 19] = [
    ("W A S D", "Fly forward, left, back, right"),
    ("E Q", "Fly up, down"),
    ("Shift", "Four times as fast"),
    ("Drag, right button", "Look about"),
    ("Drag, left button", "Go round what is in the middle"),
    ("Wheel", "Fly faster, slower"),
    ("Click", "What lies under the pixel (\u{201c}Pixel\u{201d} on the right)"),
    ("F", "Look at what was clicked, and go round it"),
    ("B", "Another image on the right of a line, or none"),
    ("T", "Two eyes: stereo, side by side; or one"),
    ("V", "The view from above: a second camera looks at the first one and its clusters"),
    ("Space", "Play and pause animations and light rain"),
    (", .", "A frame back, on"),
    ("F2", "A screenshot"),
    ("F3", "Hide and show the panels"),
    ("F4", "A shot: a file that renders what is seen"),
    ("F5", "A command line that renders it, to be pasted"),
    ("F6", "Unfold and fold everything behind headings"),
    ("F1", "This page; Escape closes it, or the window"),
];

/// The page that tells of them.
pub fn page(ui: &mut Ui) {
    egui::Grid::new("keys").show(ui, |ui| {
        for (key, words) in KEYS {
            ui.strong(key);
            ui.label(words);
            ui.end_row();
        }
    });
}

/// Takes the keys that belong to no widget.
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
