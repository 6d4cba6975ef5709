//! Comparison of A and B: choice of B, and their difference.

use egui::Ui;

use super::{Facts, State, stereo};
use crate::wipe::Other;

pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) {
    if state.stereo.is_shown {
        ui.label(stereo::ALONE);
        return;
    }
    let wipe = &mut state.wipe;
    ui.horizontal_wrapped(|ui| {
        ui.label("B:");
        for (other, name, help) in [
            (Other::Nothing, "nothing", "A only"),
            (Other::Settings, "other settings", "The same scene under other settings"),
            (
                Other::PathTracer,
                "path tracer",
                "Reference image of full light transport, traced on the CPU while the camera rests",
            ),
        ] {
            ui.selectable_value(&mut wipe.other, other, name).on_hover_text(help);
        }
    });
    if ui.button("Copy A to B").on_hover_text("B takes the current settings; the panel edits A").clicked() {
        (wipe.settings, wipe.other, wipe.edits_b) = (state.settings.clone(), Other::Settings, false);
    }
    if wipe.other != Other::Settings {
        wipe.edits_b = false;
    }
    if wipe.other == Other::Nothing {
        wipe.shows_map = false;
        return;
    }
    if wipe.other == Other::Settings {
        ui.horizontal(|ui| {
            ui.label("Settings panel edits");
            ui.selectable_value(&mut wipe.edits_b, false, "A");
            ui.selectable_value(&mut wipe.edits_b, true, "B");
        });
    }
    let of_b = match wipe.other {
        Other::PathTracer => format!("B: {} samples per pixel", facts.progress_of_b),
        _ => format!("B: mean of {} frames", facts.progress_of_b),
    };
    ui.label(of_b);
    ui.add(egui::Slider::new(&mut wipe.line, 0.0..=1.0).show_value(false).text("line"));
    ui.checkbox(&mut wipe.shows_map, "Difference map")
        .on_hover_text("FLIP: black is no visible difference, pale yellow the largest one");
    let mean =
        facts.mean_difference.map_or("appears once both images are at rest".to_owned(), |mean| format!("{mean:.4}"));
    ui.label(format!("Mean difference (FLIP): {mean}"));
}
