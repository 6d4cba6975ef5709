//! Tests of the image viewer without a window: selection, exposure, zoom, and displayed values.

use egui::{Key, pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable};
use lanternfish::settings::{Exposure, ToneMap};
use lanternfish_metrics::RgbImage;

use super::{
    ImageOfFile,
    panel::{self, Difference, Requested, State},
    shown::Look,
};
use crate::wipe::Textures;

fn rendering(name: &str, value: f32, is_radiance: bool) -> ImageOfFile {
    let image = RgbImage::new(8, 4, vec![[value, value, f32::NAN]; 32]).unwrap();
    ImageOfFile { name: name.to_owned(), image, is_radiance }
}

fn shown<'a>() -> Harness<'a, (State, Requested)> {
    let renderings =
        vec![rendering("first.exr", 0.5, true), rendering("second.exr", 4.0, true), rendering("third.png", 1.0, false)];
    let state = State::new(renderings, Exposure::Ev(1.0), ToneMap::None);
    let draw = |ui: &mut egui::Ui, (state, requested): &mut (State, Requested)| {
        let textures =
            Textures { a: Some(egui::TextureId::User(1)), b: state.b.map(|_| egui::TextureId::User(2)), map: None };
        let difference = if state.b.is_some() { Difference::Mean(0.25) } else { Difference::OfOne };
        *requested = panel::show(ui, state, &textures, difference);
    };
    Harness::builder().with_size(vec2(900.0, 600.0)).build_ui_state(draw, (state, Requested::default()))
}

#[test]
fn radiance_is_exposed_and_nan_pixels_are_marked() {
    let look = Look { ev: 1.0, tone_map: ToneMap::None };
    let finite = |value: f32, is_radiance: bool| ImageOfFile {
        image: RgbImage::new(1, 1, vec![[value; 3]]).unwrap(),
        ..rendering("a", 0.0, is_radiance)
    };
    assert_eq!(finite(0.5, true).bytes(look), [[255; 4]]);
    assert_eq!(finite(0.5, false).bytes(look), [[128, 128, 128, 255]]);
    assert_eq!(rendering("a", 1.0, true).bytes(look)[0], [0, 255, 255, 255]);
    let state = State::new(vec![finite(0.02, true)], Exposure::Auto, ToneMap::Neutral);
    assert!(state.look.ev > 1.0 && state.b.is_none(), "a dark image gets a higher exposure: {}", state.look.ev);
}

#[test]
fn sides_are_chosen_swapped_and_removed() {
    let mut harness = shown();
    assert_eq!((harness.state().0.a, harness.state().0.b), (0, Some(1)));
    assert!(harness.query_by_label("Mean difference (FLIP): 0.2500").is_some());
    harness.key_press(Key::Space);
    harness.run();
    assert_eq!((harness.state().0.a, harness.state().0.b), (1, Some(0)));
    harness.get_all_by_label("B").nth(2).unwrap().click();
    harness.run();
    assert_eq!(harness.state().0.b, Some(2));
    harness.get_all_by_label("B").nth(2).unwrap().click();
    harness.run();
    assert_eq!(harness.state().0.b, None);
    assert!(harness.query_by_label("Line between A and B").is_none());
    harness.state_mut().0.add(vec![rendering("dropped.png", 0.0, false)]);
    harness.run();
    assert_eq!(harness.state().0.b, Some(3));
    harness.key_press(Key::M);
    harness.run();
    assert!(harness.state().0.shows_map);
    harness.key_press(Key::Escape);
    harness.run();
}

#[test]
fn the_wheel_zooms_and_a_drag_pans() {
    let mut harness = shown();
    let before = harness.state().0.place;
    harness.hover_at(pos2(700.0, 200.0));
    harness.run();
    harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, 100.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: egui::Modifiers::NONE,
    });
    harness.run();
    let enlarged = harness.state().0.place;
    assert!(enlarged != before, "{enlarged:?}");
    harness.drag_at(pos2(700.0, 200.0));
    harness.hover_at(pos2(730.0, 220.0));
    harness.step();
    harness.drop_at(pos2(730.0, 220.0));
    harness.run();
    assert!(harness.state().0.place != enlarged);
    harness.get_by_label("Fit (F)").click();
    harness.run();
    assert_eq!(harness.state().0.place, before);
}
