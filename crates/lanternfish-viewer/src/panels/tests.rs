//! The panels without a window: every widget is found, changed, and reaches the settings.

use egui_kittest::{Harness, kittest::Queryable};
use lanternfish::{
    Settings,
    rooms::{Family, Range},
    settings::{Culling, DebugView, Indirect, ToneMap},
};
use lanternfish_gpu::AdapterDescription;
use lanternfish_scene::generate::demo;

use super::*;

struct Shown {
    state: State,
    asked: Asked,
}

fn adapter() -> AdapterDescription {
    AdapterDescription {
        name: "an adapter".to_owned(),
        backend: String::new(),
        driver: String::new(),
        device_type: String::new(),
        ray_query: false,
        texture_arrays: false,
        timestamps: false,
    }
}

fn shown<'a>() -> Harness<'a, Shown> {
    let scene = demo("cornell").unwrap();
    let state = State {
        settings: Settings::default(),
        usual: Settings::default(),
        controls: Controls::new(scene.cameras[0].clone(), 2.0),
        clip: None,
        message: String::new(),
        shows_keys: false,
        shows_panels: true,
    };
    let draw = |ui: &mut Ui, shown: &mut Shown| {
        let adapter = adapter();
        let facts = Facts {
            name: "cornell",
            counts: (32, 1),
            adapter: &adapter,
            size: [640, 480],
            averaged: 3,
            report: None,
            frame_ms: 12.0,
            picture: None,
        };
        shown.asked = show(ui, &mut shown.state, &facts, 0.1);
    };
    let builder = Harness::builder().with_size(egui::vec2(1200.0, 1400.0));
    builder.build_ui_state(draw, Shown { state, asked: Asked::default() })
}

/// Opens a list and takes one of its entries.
fn choose(harness: &mut Harness<'_, Shown>, name: &str, entry: &str) {
    harness
        .get_by(|node| node.label().as_deref() == Some(name) && node.role() == egui::accesskit::Role::ComboBox)
        .click();
    harness.run();
    let found = harness.get_all_by_label(entry).last().expect("the list is open");
    found.click();
    harness.run();
}

#[test]
fn every_named_setting_is_found_and_reaches_the_settings() {
    let mut harness = shown();
    for knob in Settings::KNOBS.iter().filter(|knob| matches!(knob.words.range, Range::Names)) {
        let name = knob.words.name;
        let now = harness.state().state.settings.get(name).unwrap_or_else(|| "none".to_owned());
        let names = (knob.of)(&mut Settings::default()).names();
        let (other, _) = names.iter().find(|(value, _)| *value != now).unwrap();
        choose(&mut harness, name, other);
        assert_eq!(harness.state().state.settings.get(name).as_deref().unwrap_or("none"), *other, "{name}");
    }
    choose(&mut harness, Culling::FLAG, "tiled");
    choose(&mut harness, Indirect::FLAG, "none");
    let settings = &harness.state().state.settings;
    assert!(settings.culling.name() == "tiled" && settings.indirect == Indirect::None);
    assert!(settings.tone_map != ToneMap::Neutral && settings.debug_view == Some(DebugView::Depth));
    harness.get_by_label("All as they were").click();
    harness.run();
    assert!(harness.state().state.settings == Settings::default());
}

#[test]
fn settings_of_rooms_are_found_and_a_click_brings_them_back() {
    let mut harness = shown();
    harness.get_by_label("indirect sampled").click();
    harness.run();
    let usual = harness.state().state.settings.clone();
    choose(&mut harness, "indirect-resolution", "half");
    assert!(harness.state().state.settings != usual);
    harness.get_by_label("reset").click();
    harness.run();
    assert!(harness.state().state.settings == usual);
}

#[test]
fn keys_fly_hide_the_panels_and_ask_for_a_screenshot() {
    let mut harness = shown();
    let eye = harness.state().state.controls.eye();
    harness.key_down(Key::W);
    harness.step();
    harness.key_up(Key::W);
    assert!(harness.state().asked.is_moving && harness.state().state.controls.eye() != eye);
    harness.key_press(Key::F2);
    harness.step();
    harness.step();
    harness.key_press(Key::F3);
    harness.run();
    assert!(!harness.state().state.shows_panels && harness.query_by_label("Settings").is_none());
    harness.key_press(Key::F1);
    harness.run();
    assert!(harness.state().state.shows_keys && harness.query_by_label("Look about").is_some());
    harness.key_press(Key::Escape);
    harness.run();
    assert!(!harness.state().state.shows_keys && !harness.state().asked.close);
}
