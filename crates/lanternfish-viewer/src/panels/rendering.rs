//! The image, its overlays, and pointer and keyboard input of the camera.

use egui::{Key, PointerButton, Ui};
use glam::Vec2;
use lanternfish_scene::Way;

use super::{Facts, Requested, State};
use crate::{
    overlay::{self, Drawn},
    stereo,
    wipe::{self, Other, Painted, Textures},
};

/// Draws the image and overlays, and moves the camera by input. `seconds`: time since the last call.
pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, seconds: f32, requested: &mut Requested) {
    let rect = ui.available_rect_before_wrap();
    let eyes = state.eyes();
    let places = stereo::places(rect, eyes);
    requested.viewport_size = Vec2::new(places[0].width(), places[0].height());
    let response = ui.interact(rect, ui.scope_id().with("rendering"), egui::Sense::click_and_drag());
    match places[..] {
        [left, right] => {
            let of = |a| Textures { a, ..Textures::default() };
            wipe::paint(ui, left, Painted::A, &of(facts.textures.a));
            wipe::paint(ui, right, Painted::A, &of(facts.textures.b));
        }
        _ => wipe::paint(ui, rect, state.wipe.painted(&facts.textures), &facts.textures),
    }
    if state.wipe.other != Other::Nothing && !state.wipe.shows_map {
        wipe::line(ui, rect, &mut state.wipe.line);
    }
    let probe_result =
        state.pointed.as_ref().filter(|pointed| !pointed.is_outdated).and_then(|at| at.probe_result.as_ref());
    for (camera, place) in stereo::cameras(eyes, &state.controls.camera, places[0].aspect_ratio()).iter().zip(&places) {
        let drawn = Drawn { scene: facts.scene, settings: &state.settings, camera, probe_result, size: facts.size };
        overlay::paint(ui, *place, &state.overlays, &drawn);
    }
    if let Some(pointed) = state.pointed.as_ref().filter(|pointed| pointed.camera == state.controls.camera)
        && let Some(place) = places.get(pointed.eye)
    {
        let at = place.lerp_inside(egui::vec2(pointed.at.x, pointed.at.y));
        ui.painter().circle_stroke(at, 5.0, egui::Stroke::new(3.0, egui::Color32::BLACK));
        ui.painter().circle_stroke(at, 5.0, egui::Stroke::new(1.5, egui::Color32::WHITE));
    }
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked()) {
        let eye = places.iter().position(|place| place.contains(at));
        requested.pixel = eye.map(|eye| {
            let at = (at - places[eye].min) / places[eye].size();
            (Vec2::new(at.x, at.y), eye)
        });
    }
    let controls = &mut state.controls;
    let dragged = response.drag_delta();
    if response.dragged_by(PointerButton::Secondary) {
        controls.look(dragged.x, dragged.y);
    } else if response.dragged_by(PointerButton::Primary) {
        controls.orbit(dragged.x, dragged.y);
    }
    requested.is_moving |= response.dragged() && dragged != egui::Vec2::ZERO;
    let notches = if response.hovered() { ui.input(|input| input.smooth_scroll_delta.y) / 50.0 } else { 0.0 };
    if ui.ctx().egui_wants_keyboard_input() {
        controls.dolly(notches);
        return;
    }
    let (way, is_fast) = ui.input(|input| {
        let towards = |more, less| f32::from(i8::from(input.key_down(more)) - i8::from(input.key_down(less)));
        let way = Way { right: towards(Key::D, Key::A), up: towards(Key::E, Key::Q), forward: towards(Key::W, Key::S) };
        (way, input.modifiers.shift)
    });
    if way != Way::default() || response.dragged_by(PointerButton::Secondary) {
        controls.accelerate(notches);
    } else {
        controls.dolly(notches);
        requested.is_moving |= notches != 0.0;
    }
    if way != Way::default() {
        controls.fly(way, if is_fast { 4.0 * seconds } else { seconds });
        requested.is_moving = true;
    }
}
