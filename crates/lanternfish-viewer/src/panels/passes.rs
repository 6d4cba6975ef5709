//! Pass times and counters of a frame.

use egui::Ui;
use lanternfish_gpu::PassTime;
use lanternfish_scene::Named;

use super::{
    Facts, Requested, State,
    written::{Written, views_of},
};
use crate::Form;

/// Scene, adapter, size and frame time; buttons for screenshots and shots.
pub fn head(ui: &mut Ui, facts: &Facts<'_>, requested: &mut Requested) {
    ui.heading(facts.name);
    ui.label(format!("{} triangles, {} lights", facts.triangle_count, facts.scene.lights.len()));
    ui.label(format!("{}, {}", facts.adapter.name, facts.adapter.driver));
    let [width, height] = facts.size;
    let eyes = if facts.eyes.is_some() { " per eye" } else { "" };
    ui.label(format!("{width} × {height} pixels{eyes}, mean of {} frames", facts.averaged));
    let window = facts.window_ms.map_or(String::new(), |ms| format!("; window {ms:.1} ms"));
    ui.label(format!("Frame {:.1} ms{window}", facts.frame_ms));
    ui.horizontal_wrapped(|ui| {
        requested.screenshot |=
            ui.button("Screenshot (F2)").on_hover_text("Writes A as a PNG file to the current folder").clicked();
        for (form, name, help) in [
            (
                Form::File,
                "Save shot (F4)",
                "Writes a file to the current folder from which `lanternfish render` renders this image",
            ),
            (Form::CommandLine, "Copy command line (F5)", "Copies a shell command that renders this image"),
        ] {
            if ui.button(name).on_hover_text(help).clicked() {
                requested.write = Some(form);
            }
        }
    });
}

/// Device time of each pass, and counters. A click on a pass shows its output; a second click shows the image again.
pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) {
    let written = state.written.clone();
    let passes = written.as_ref().map_or(facts.passes, |written| &written.passes);
    let total: f64 = passes.iter().map(|pass| pass.ms).sum();
    ui.strong(format!("{total:.1} ms on the device")).on_hover_text("Click a pass to show its output");
    egui::Grid::new("passes").striped(true).show(ui, |ui| {
        for pass in passes {
            let is_shown = written.as_ref().is_some_and(|written| written.pass == pass.name);
            // The time comes first, since names may be wider than the panel.
            ui.label(format!("{:.2}", pass.ms));
            one(ui, state, pass, passes, is_shown);
            ui.end_row();
        }
    });
    ui.strong("Counters");
    egui::Grid::new("counters").striped(true).show(ui, |ui| {
        for (name, count) in facts.counters {
            ui.label(name);
            ui.label(count.to_string());
            ui.end_row();
        }
    });
}

/// A pass and, if its output is shown, the debug views of its output.
fn one(ui: &mut Ui, state: &mut State, pass: &PassTime, passes: &[PassTime], is_shown: bool) {
    let views = views_of(&pass.name, &state.settings);
    let Some(first) = views.first() else {
        ui.label(&pass.name).on_hover_text("No debug view shows the output of this pass");
        return;
    };
    let names: Vec<_> = views.iter().map(|view| view.name()).collect();
    let help = match is_shown {
        true => "Click to show the image again".to_owned(),
        false => format!("Click to show its output: debug views {}", names.join(", ")),
    };
    ui.vertical(|ui| {
        ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
        if ui.selectable_label(is_shown, &pass.name).on_hover_text(help).clicked() {
            let before = state.written.take();
            let shown = state.settings.image.debug_view;
            if is_shown {
                state.settings.image.debug_view = before.and_then(|before| before.before);
            } else {
                let before = before.map_or(shown, |before| before.before);
                state.settings.image.debug_view = Some(*first);
                state.written = Some(Written { pass: pass.name.clone(), before, passes: passes.to_vec() });
            }
        } else if is_shown && views.len() > 1 {
            for row in views.chunks(2) {
                ui.horizontal(|ui| {
                    for view in row {
                        ui.selectable_value(&mut state.settings.image.debug_view, Some(*view), view.name())
                            .on_hover_text(view.help());
                    }
                });
            }
        }
    });
}
