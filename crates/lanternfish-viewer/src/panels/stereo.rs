//! Stereo: the switch, the kind of eyes, and their separation.

use egui::Ui;
use lanternfish_scene::Eyes;

use super::State;

/// Message while stereo is on: there is no B.
pub const ALONE: &str = "Stereo is on: B is not shown";

pub fn show(ui: &mut Ui, state: &mut State) {
    let mut is_shown = state.stereo.is_shown;
    let switch = ui.checkbox(&mut is_shown, "Stereo, side by side (T)");
    if switch.on_hover_text("Images of the left and right eye side by side, rendered in one frame").changed() {
        state.show_stereo(is_shown);
    }
    let eyes = &mut state.stereo.eyes;
    ui.horizontal_wrapped(|ui| {
        ui.label("stereo").on_hover_text("As --stereo of the command line");
        let is = |eyes: &Eyes, other: Eyes| std::mem::discriminant(eyes) == std::mem::discriminant(&other);
        for (other, name, help) in [
            (Eyes::Parallel(Eyes::HUMAN), "parallel", "Both eyes look parallel to the camera"),
            (Eyes::Vive, "vive", "HTC Vive"),
        ] {
            if ui.selectable_label(is(eyes, other), name).on_hover_text(help).clicked() && !is(eyes, other) {
                *eyes = other;
            }
        }
        if let Eyes::Rig([left, right, bottom, top], ..) = eyes {
            ui.label(format!("slopes {left}, {right}, {bottom}, {top}"));
        }
    });
    if let Eyes::Parallel(metres) | Eyes::Rig(_, metres, _) = eyes {
        ui.horizontal(|ui| {
            let label = ui.label("eye separation").on_hover_text("Larger: stronger depth, and objects appear smaller");
            let value = egui::DragValue::new(metres).range(0.0..=1000.0).speed(0.0005).max_decimals(4).suffix(" m");
            ui.add(value).labelled_by(label.id);
        });
    }
    if !state.stereo.is_possible(&state.controls.camera) {
        ui.label("The camera is orthographic: parallel eyes would see the same image, so it is shown once.");
    }
}
