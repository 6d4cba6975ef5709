//! Two eyes: switched, set apart, clicked.

use super::*;

#[test]
fn two_eyes_are_switched_set_apart_and_clicked() {
    let mut harness = shown();
    assert_eq!(harness.state().state.eyes(), None);
    let whole = harness.state().requested.room;
    harness.key_press(Key::B);
    harness.key_press(Key::T);
    harness.run();
    let state = &harness.state().state;
    assert_eq!((state.eyes(), state.wipe.other), (Some(Eyes::Parallel(0.063)), Other::Nothing));
    assert!(harness.query_by_label(stereo::ALONE).is_some(), "it is said that there is no B");
    assert_eq!(harness.state().requested.room, whole * Vec2::new(0.5, 1.0));
    harness.state_mut().state.message.clear();
    harness.key_press(Key::B);
    harness.run();
    assert!(harness.state().state.wipe.other == Other::Nothing && harness.query_by_label(stereo::ALONE).is_some());

    unfold(&mut harness, "Two eyes");
    type_into(&mut harness, "eye separation", "0.1");
    assert_eq!(harness.state().state.eyes(), Some(Eyes::Parallel(0.1)));
    harness.get_by_label("vive").click();
    harness.run();
    let room = harness.state().requested.room;
    assert!(harness.state().state.eyes() == Some(Eyes::Vive) && room.x <= 0.5 * whole.x);
    assert!((room.x / room.y - Eyes::Vive.aspect().unwrap()).abs() < 1e-3, "{room}");
    harness.get_by_label("parallel").click();
    harness.run();
    let mut clicked = |x: f32| {
        harness.drag_at(egui::pos2(x, 500.0));
        harness.step();
        harness.drop_at(egui::pos2(x, 500.0));
        harness.step();
        harness.state().pixel.expect("a pixel is requested")
    };
    // The panel on the left and half of the image lie before the middle between the panels.
    let [(left, eye), (right, other)] = [500.0, 500.0 + 0.5 * whole.x].map(&mut clicked);
    assert!((eye, other) == (0, 1) && left.abs_diff_eq(right, 1e-3), "{left} of {eye}, {right} of {other}");
    harness.get_by_label("Stereo, side by side (T)").click();
    harness.run();
    assert!(harness.state().state.eyes().is_none() && harness.state().requested.room == whole);
}
