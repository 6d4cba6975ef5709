//! What a frame took, pass by pass, and what it counted.

use egui::Ui;

use super::Facts;

/// Whether a screenshot is asked for.
pub fn show(ui: &mut Ui, facts: &Facts<'_>) -> bool {
    ui.heading(facts.name);
    let (triangles, lights) = facts.counts;
    ui.label(format!("{triangles} triangles, {lights} lights"));
    ui.label(format!("{}, {}", facts.adapter.name, facts.adapter.driver));
    let [width, height] = facts.size;
    ui.label(format!("{width} × {height} pixels, the mean of {} frames", facts.averaged));
    ui.label(format!("{:.1} ms from frame to frame", facts.frame_ms));
    let is_asked = ui.button("Screenshot (F2)").clicked();
    ui.separator();
    let Some(report) = facts.report else { return is_asked };
    let total: f64 = report.passes.iter().map(|pass| pass.ms).sum();
    egui::ScrollArea::vertical().id_salt("passes/all").show(ui, |ui| {
        ui.strong(format!("Passes, {total:.1} ms of the device"));
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
    });
    is_asked
}
