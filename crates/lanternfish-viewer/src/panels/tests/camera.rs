//! The camera's section, and the presets.

use lanternfish::settings::Preset;
use lanternfish_scene::{Camera, Projection};

use super::*;

#[test]
fn a_camera_of_the_file_is_chosen_and_left_again() {
    let mut harness = shown();
    let first = harness.state().scene.cameras[0].clone();
    let projection = Projection::Perspective { fov_y: 0.5, near: 0.1 };
    let door = Camera { name: "door".to_owned(), ..Camera::look_at(glam::Vec3::X, glam::Vec3::Y, projection) };
    harness.state_mut().scene.cameras.push(door.clone());
    click(&mut harness, "Camera");
    choose(&mut harness, "camera", "door");
    assert_eq!(harness.state().state.controls.camera, door);
    click(&mut harness, "First view (Home)");
    assert_eq!(harness.state().state.controls.camera, first);
}

#[test]
fn the_field_of_view_is_in_degrees() {
    let mut harness = shown();
    click(&mut harness, "Camera");
    type_into(&mut harness, "field of view", "60");
    let Projection::Perspective { fov_y, .. } = harness.state().state.controls.camera.projection else {
        unreachable!()
    };
    assert!((fov_y.to_degrees() - 60.0).abs() < 1e-3, "{fov_y}");
    assert!(harness.state().state.controls.camera != harness.state().scene.cameras[0]);
}

#[test]
fn a_preset_sets_what_it_names_and_nothing_else() {
    let mut harness = shown();
    let mut expected = harness.state().state.settings.clone();
    expected.shadows.rays = 7;
    harness.state_mut().state.settings.shadows.rays = 7;
    for preset in [Preset::Draft, Preset::Realtime, Preset::Best, Preset::Good] {
        harness.get_by_label(&preset.to_string()).click();
        harness.run();
        let of_preset = Settings::of_preset(preset);
        // After realtime, sampled light and the history stay.
        if preset == Preset::Realtime {
            (expected.direct, expected.history) = (of_preset.direct, of_preset.history);
        }
        expected.indirect = of_preset.indirect;
        (expected.image.samples, expected.image.antialiasing) = (of_preset.image.samples, of_preset.image.antialiasing);
        assert_eq!(harness.state().state.settings, expected, "{preset}");
    }
}
