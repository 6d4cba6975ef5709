//! Tests of stereo: switch, eye separation, clicks.

use super::*;

#[test]
fn stereo_is_switched_adjusted_and_clicked() {
    let mut harness = shown();
    assert_eq!(harness.state().state.eyes(), None);
    let mono = harness.state().requested.viewport_size;
    harness.key_press(Key::B);
    press(&mut harness, Key::T);
    let state = &harness.state().state;
    assert_eq!((state.eyes(), state.wipe.other), (Some(Eyes::Parallel(0.063)), Other::Nothing));
    assert!(harness.query_by_label(stereo::ALONE).is_some(), "a message states that there is no B");
    assert_eq!(harness.state().requested.viewport_size, mono * Vec2::new(0.5, 1.0));
    harness.state_mut().state.message.clear();
    press(&mut harness, Key::B);
    assert!(harness.state().state.wipe.other == Other::Nothing && harness.query_by_label(stereo::ALONE).is_some());

    click(&mut harness, "Stereo");
    type_into(&mut harness, "eye separation", "0.1");
    assert_eq!(harness.state().state.eyes(), Some(Eyes::Parallel(0.1)));
    click(&mut harness, "vive");
    let size = harness.state().requested.viewport_size;
    assert!(harness.state().state.eyes() == Some(Eyes::Vive) && size.x <= 0.5 * mono.x);
    assert!((size.x / size.y - Eyes::Vive.aspect().unwrap()).abs() < 1e-3, "{size}");
    click(&mut harness, "parallel");
    let mut clicked = |x: f32| {
        harness.drag_at(egui::pos2(x, 500.0));
        harness.step();
        harness.drop_at(egui::pos2(x, 500.0));
        harness.step();
        harness.state().pixel.expect("a pixel is requested")
    };
    // x = 500 lies in the left image. Clicks half a viewport apart hit the same position of the left and right image.
    let [(left, eye), (right, other)] = [500.0, 500.0 + 0.5 * mono.x].map(&mut clicked);
    assert!((eye, other) == (0, 1) && left.abs_diff_eq(right, 1e-3), "{left} of {eye}, {right} of {other}");
    click(&mut harness, "Stereo, side by side (T)");
    assert!(harness.state().state.eyes().is_none() && harness.state().requested.viewport_size == mono);
}
