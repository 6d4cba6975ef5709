//! Camera: the cameras of the file, the first view, and the field of view.

use egui::Ui;
use lanternfish_scene::{Camera, Projection};

use super::{Facts, Requested, State};

pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, requested: &mut Requested) {
    let controls = &mut state.controls;
    let cameras = &facts.scene.cameras;
    let before = controls.camera.clone();
    ui.horizontal(|ui| {
        let is_shown = |camera: &&Camera| camera.world_from_camera == before.world_from_camera;
        let shown = cameras.iter().position(|camera| is_shown(&camera)).map(|index| name(cameras, index));
        let label = ui.label("camera");
        let list = egui::ComboBox::from_id_salt("camera").selected_text(shown.as_deref().unwrap_or("moved"));
        let list = list.show_ui(ui, |ui| {
            for (index, camera) in cameras.iter().enumerate() {
                if ui.selectable_label(is_shown(&camera), name(cameras, index)).clicked() {
                    controls.camera = camera.clone();
                }
            }
            if cameras.is_empty() {
                ui.label("The file has no camera");
            }
        });
        list.response.labelled_by(label.id).on_hover_text("The cameras of the file");
        if ui.button("First view (Home)").on_hover_text("Return to the view at the start").clicked() {
            controls.go_home();
        }
    });
    ui.horizontal(|ui| match &mut controls.camera.projection {
        Projection::Perspective { fov_y, .. } => {
            let label = ui.label("field of view").on_hover_text("Full vertical angle, as --fov-y of the command line");
            let mut degrees = fov_y.to_degrees();
            let value = egui::DragValue::new(&mut degrees).range(1.0..=170.0).speed(0.2).max_decimals(1).suffix("°");
            if ui.add(value).labelled_by(label.id).changed() {
                *fov_y = degrees.to_radians();
            }
        }
        Projection::Orthographic { half_height, .. } => {
            let label = ui.label("half height").on_hover_text("Half the height of the parallel view");
            let speed = 0.01 * *half_height;
            let value = egui::DragValue::new(half_height).range(1e-4..=1e6).speed(speed).suffix(" m");
            ui.add(value).labelled_by(label.id);
        }
        Projection::Frustum { .. } => _ = ui.label("The view is off-axis"),
    });
    requested.is_moving |= controls.camera != before;
}

/// The name of a camera, or its index where it has none.
fn name(cameras: &[Camera], index: usize) -> String {
    let name = &cameras[index].name;
    if name.is_empty() { format!("camera {index}") } else { name.clone() }
}
