//! What a frame took, pass by pass, and what it counted.

use egui::Ui;

use super::{Asked, Facts};
use crate::Form;

/// What is rendered, and how large; and what can be kept of it.
pub fn head(ui: &mut Ui, facts: &Facts<'_>, asked: &mut Asked) {
    ui.heading(facts.name);
    ui.label(format!("{} triangles, {} lights", facts.triangle_count, facts.scene.lights.len()));
    ui.label(format!("{}, {}", facts.adapter.name, facts.adapter.driver));
    let [width, height] = facts.size;
    ui.label(format!("{width} × {height} pixels, the mean of {} frames", facts.averaged));
    let window = facts.window_ms.map_or(String::new(), |ms| format!("; the window {ms:.1} ms"));
    ui.label(format!("A frame {:.1} ms{window}", facts.frame_ms));
    ui.horizontal_wrapped(|ui| {
        asked.screenshot |= ui.button("Screenshot (F2)").on_hover_text("A PNG of A in the current folder").clicked();
        for (form, name, words) in [
            (
                Form::File,
                "Save as a shot (F4)",
                "A file in the current folder that `lanternfish render` makes this picture of",
            ),
            (Form::CommandLine, "Copy as a command line (F5)", "The same as a line for a shell"),
        ] {
            if ui.button(name).on_hover_text(words).clicked() {
                asked.write = Some(form);
            }
        }
    });
}

/// Device time of each pass, and counters.
pub fn show(ui: &mut Ui, facts: &Facts<'_>) {
    let Some(report) = facts.report else { return };
    let total: f64 = report.passes.iter().map(|pass| pass.ms).sum();
    ui.strong(format!("{total:.1} ms of the device"));
    egui::Grid::new("passes").striped(true).show(ui, |ui| {
        for pass in &report.passes {
            ui.label(&pass.name);
            ui.label(format!("{:.2}", pass.ms));
            ui.end_row();
        }
    });
    ui.strong("Counted");
    egui::Grid::new("counters").striped(true).show(ui, |ui| {
        for (name, count) in &report.counters {
            ui.label(name);
            ui.label(count.to_string());
            ui.end_row();
        }
    });
}
