//! Tests of the panels without a window: each widget is present and changes the settings.

mod camera;
mod eyes;

use egui::Key;
use egui_kittest::{Harness, kittest::Queryable};
use lanternfish::{
    RenderError, Settings,
    indirect::{IndirectPasses, IndirectTechnique},
    settings::{Culling, DebugView, Indirect, ToneMap},
    shaders::{SHADERS, Shaders},
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::AdapterDescription;
use lanternfish_reference::{Settings as Transport, Tracer};
use lanternfish_scene::{LightKind, generate::demo};

use super::*;
use crate::{background::ProbeResult, wipe::Other};

struct Shown {
    scene: Scene,
    /// The last pixel that was requested.
    pixel: Option<(Vec2, usize)>,
    /// The last form that was requested.
    write: Option<Form>,
    passes: Vec<PassTime>,
    memory: Memory,
    frame_ms: f64,
    state: State,
    requested: Requested,
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
        kind: wgpu::DeviceType::Cpu,
        features: wgpu::Features::empty(),
        limits: wgpu::Limits::default(),
    }
}

fn shown<'a>() -> Harness<'a, Shown> {
    let scene = demo("cornell").unwrap();
    let state = State {
        settings: Settings::default(),
        wipe: Wipe::new(&Settings::default()),
        stereo: Stereo::new(None),
        pointed: None,
        listing: Listing::default(),
        written: None,
        overlays: Overlays::default(),
        defaults: Settings::default(),
        controls: Controls::new(scene.cameras[0].clone(), 2.0),
        clip: None,
        message: String::new(),
        shows_keys: false,
        shows_panels: true,
        is_unfolded: false,
        unfold: None,
    };
    let draw = |ui: &mut Ui, shown: &mut Shown| {
        let adapter = adapter();
        let facts = Facts {
            name: "cornell",
            scene: &shown.scene,
            triangle_count: 32,
            adapter: &adapter,
            size: [640, 480],
            eyes: None,
            averaged: 3,
            passes: &shown.passes,
            counters: &[],
            memory: &shown.memory,
            frame_ms: shown.frame_ms,
            window_ms: Some(3.0),
            textures: Textures::default(),
            progress_of_b: 17,
            mean_difference: Some(0.125),
        };
        shown.requested = show(ui, &mut shown.state, &facts, 0.1);
        shown.write = shown.requested.write.or(shown.write);
        shown.pixel = shown.requested.pixel.or(shown.pixel);
        if let Some(edit) = shown.requested.edit.take() {
            shown.scene.lights = edit.applied(&shown.scene.lights);
        }
    };
    let builder = Harness::builder().with_size(egui::vec2(1200.0, 1400.0));
    builder.build_ui_state(
        draw,
        Shown {
            scene,
            pixel: None,
            write: None,
            passes: Vec::new(),
            memory: Memory::default(),
            frame_ms: 12.0,
            state,
            requested: Requested::default(),
        },
    )
}

#[test]
fn a_black_image_is_explained_until_the_first_frame() {
    let mut harness = shown();
    assert!(harness.query_by_label_contains("Preparing the first image").is_none());
    harness.state_mut().frame_ms = 0.0;
    harness.run();
    harness.get_by_label_contains("Preparing the first image");
}

/// Clicks on a button, or on a heading, which expands its section.
fn click(harness: &mut Harness<'_, Shown>, label: &str) {
    harness.get_by_label(label).click();
    harness.run();
}

fn press(harness: &mut Harness<'_, Shown>, key: Key) {
    harness.key_press(key);
    harness.run();
}

/// Opens a list and selects an entry.
fn choose(harness: &mut Harness<'_, Shown>, name: &str, entry: &str) {
    harness
        .get_by(|node| node.label().as_deref() == Some(name) && node.role() == egui::accesskit::Role::ComboBox)
        .click();
    harness.run();
    let item = harness.get_all_by_label(entry).last().expect("the list is open");
    item.click();
    harness.run();
}

#[test]
fn every_named_setting_has_a_widget_that_changes_it() {
    crate::testing::know_papers();
    let mut harness = shown();
    for parameter in
        Settings::PARAMETERS.iter().filter(|entry| entry.info.has_panel && matches!(entry.info.range, Range::Names))
    {
        let name = parameter.info.name;
        let now = harness.state().state.settings.get(name).unwrap_or_else(|| "none".to_owned());
        let names = (parameter.of)(&mut Settings::default()).names();
        let (other, _) = names.iter().find(|(value, _)| *value != now).unwrap();
        choose(&mut harness, name, other);
        assert_eq!(harness.state().state.settings.get(name).as_deref().unwrap_or("none"), *other, "{name}");
    }
    choose(&mut harness, Culling::FLAG, "tiled");
    choose(&mut harness, Indirect::FLAG, "none");
    let settings = &harness.state().state.settings;
    assert!(settings.culling.name() == "tiled" && settings.indirect == Indirect::NONE);
    assert!(settings.image.tone_map != ToneMap::Neutral && settings.image.debug_view == Some(DebugView::Depth));
    click(&mut harness, "Reset all");
    assert!(harness.state().state.settings == Settings::default());
}

/// A technique that a program registers.
#[derive(Clone, Debug, PartialEq)]
struct Fog {
    density: f32,
}

impl Default for Fog {
    fn default() -> Self {
        Self { density: 0.5 }
    }
}

impl Technique for Fog {
    const NAME: &'static str = "fog";
    const SUMMARY: &'static str = "Light scattered by fog";
    const PARAMETERS: &'static [Parameter<Self>] =
        &[Parameter::new("fog-density", "N", Range::Positive, "Higher: denser", |fog| &mut fog.density)];
    const SHADERS: Shaders = Shaders::of(&SHADERS, &[], &[]);
}

impl IndirectTechnique for Fog {
    fn build(
        &self,
        _device: &wgpu::Device,
        _settings: &Settings,
        _tracer: Option<lanternfish::rays::Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        Err(RenderError::NoFrames)
    }
}

#[test]
fn a_technique_that_a_program_registers_is_in_the_panel() {
    // Registration is global: with a shared process it would affect other tests.
    if std::env::var_os("NEXTEST").is_none() {
        return;
    }
    Indirect::from(Fog::default()).register();
    let mut harness = shown();
    choose(&mut harness, Indirect::FLAG, "fog");
    assert!(harness.state().state.settings.indirect.is::<Fog>());
    click(&mut harness, "indirect fog");
    harness.get_by_label("fog-density");
}

#[test]
fn technique_parameters_are_changed_and_reset() {
    let mut harness = shown();
    click(&mut harness, "indirect sampled");
    let initial = harness.state().state.settings.clone();
    choose(&mut harness, "indirect-resolution", "half");
    assert!(harness.state().state.settings != initial);
    click(&mut harness, "reset");
    assert!(harness.state().state.settings == initial);
}

#[test]
fn keys_fly_hide_the_panels_and_write_shots() {
    let mut harness = shown();
    let eye = harness.state().state.controls.eye();
    harness.key_down(Key::W);
    harness.step();
    harness.key_up(Key::W);
    assert!(harness.state().requested.is_moving && harness.state().state.controls.eye() != eye);
    harness.key_press(Key::F2);
    harness.step();
    harness.step();
    for (key, button, form) in
        [(Key::F4, "Save shot (F4)", Form::File), (Key::F5, "Copy command line (F5)", Form::CommandLine)]
    {
        harness.get_by_label(button).click();
        harness.run();
        assert_eq!(harness.state_mut().write.take(), Some(form));
        harness.key_press(key);
        harness.run();
        assert_eq!(harness.state_mut().write.take(), Some(form));
    }
    press(&mut harness, Key::F3);
    assert!(!harness.state().state.shows_panels && harness.query_by_label("Settings").is_none());
    press(&mut harness, Key::F1);
    assert!(harness.state().state.shows_keys && harness.query_by_label("Look around").is_some());
    // The list is seen to its end.
    let of = |harness: &Harness<'_, Shown>, label: &str| harness.get_by_label(label).rect();
    let (window, last) = (of(&harness, "Keys"), of(&harness, "This help; Escape closes it, or the window"));
    assert!(window.contains_rect(last), "{window:?} {last:?}");
    press(&mut harness, Key::Escape);
    assert!(!harness.state().state.shows_keys && !harness.state().requested.close);
    assert!(harness.state().state.controls.eye() != eye);
    press(&mut harness, Key::Home);
    assert_eq!(harness.state().state.controls.eye(), eye);
}

#[test]
fn b_is_chosen_and_edited_separately_and_the_line_is_dragged() {
    let mut harness = shown();
    assert!(harness.query_by_label("Line between A and B").is_none());
    click(&mut harness, "Compare");
    choose(&mut harness, "tone-map", "aces");
    click(&mut harness, "Copy A to B");
    let wipe = harness.state().state.wipe.clone();
    assert!(wipe.other == Other::Settings && wipe.settings.image.tone_map == ToneMap::Aces && !wipe.edits_b);
    // The panel edits A until B is selected.
    choose(&mut harness, "tone-map", "reinhard");
    assert_eq!(harness.state().state.wipe.settings.image.tone_map, ToneMap::Aces);
    click(&mut harness, "B");
    choose(&mut harness, "tone-map", "none");
    let state = &harness.state().state;
    assert_eq!((state.settings.image.tone_map, state.wipe.settings.image.tone_map), (ToneMap::Reinhard, ToneMap::None));
    assert!(harness.query_by_label("Settings of B").is_some());
    assert!(harness.query_by_label("B: mean of 17 frames").is_some());
    assert!(harness.query_by_label("Mean difference (FLIP): 0.1250").is_some());

    let (eye, from) = (state.controls.eye(), harness.get_by_label("Line between A and B").rect().center());
    harness.drag_at(from);
    harness.hover_at(from + egui::vec2(60.0, 0.0));
    harness.step();
    harness.drop_at(from + egui::vec2(60.0, 0.0));
    harness.run();
    let to = harness.get_by_label("Line between A and B").rect().center();
    assert!((to.x - from.x - 60.0).abs() < 8.0, "{from:?} to {to:?}");
    assert_eq!(harness.state().state.controls.eye(), eye, "dragging the line must not move the camera");

    click(&mut harness, "Difference map");
    assert!(harness.state().state.wipe.shows_map);
    click(&mut harness, "path tracer");
    let wipe = &harness.state().state.wipe;
    assert!(wipe.other == Other::PathTracer && !wipe.edits_b);
    assert!(harness.query_by_label("B: 17 samples per pixel").is_some());
    press(&mut harness, Key::B);
    assert_eq!(harness.state().state.wipe.other, Other::Nothing);
}

/// The probe of a pixel near the bottom of the image, as the window would set it.
fn pointed(harness: &Harness<'_, Shown>) -> Pointed {
    let Shown { scene, state, .. } = harness.state();
    let tracer = Tracer::new(scene, Transport::default()).unwrap();
    let camera = state.controls.camera.clone();
    let place = tracer.probe(&camera, [320.0, 465.0], [640, 480]).unwrap();
    let (lights, light_count) = tracer.lights_at(&place, 64);
    let result = ProbeResult { place: Some(place), lights, light_count, rays: tracer.rays_from(&place, 8) };
    Pointed {
        at: Vec2::new(0.5, 465.0 / 480.0),
        eye: 0,
        camera,
        probe_result: Some(result),
        cluster: None,
        tile: None,
        is_outdated: false,
    }
}

#[test]
fn a_click_requests_a_probe_and_a_drag_does_not() {
    let mut harness = shown();
    let place = egui::pos2(600.0, 500.0);
    harness.drag_at(place);
    harness.hover_at(place + egui::vec2(40.0, 0.0));
    harness.step();
    harness.drop_at(place + egui::vec2(40.0, 0.0));
    harness.step();
    assert_eq!(harness.state().pixel, None);
    harness.drag_at(place);
    harness.step();
    harness.drop_at(place);
    harness.step();
    let (at, eye) = harness.state().pixel.expect("a pixel is requested");
    let size = harness.state().requested.viewport_size;
    assert!(eye == 0 && (0.0..1.0).contains(&at.x) && (at.y - 500.0 / size.y).abs() < 0.01, "{at} of {size}");
}

#[test]
fn the_clicked_pixel_is_described_and_focused() {
    let mut harness = shown();
    click(&mut harness, "Pixel");
    assert!(harness.query_by_label("Click on the image.").is_some());
    let pointed = pointed(&harness);
    let place = *pointed.place().unwrap();
    harness.state_mut().state.pointed = Some(Pointed { probe_result: None, ..pointed.clone() });
    harness.run();
    assert!(harness.query_by_label("Reading…").is_some());
    harness.state_mut().state.pointed = Some(Pointed { tile: Some((glam::UVec2::new(20, 29), 17)), ..pointed });
    harness.run();
    let scene = &harness.state().scene;
    let material = &scene.materials[place.material];
    let expected = [
        format!("{:.3} m", place.distance),
        format!("{:.3}, {:.3}, {:.3} m", place.p.x, place.p.y, place.p.z),
        pixel::named(place.material, &material.name),
        format!("{:.2}", material.perceptual_roughness),
        "1 light in range".to_owned(),
        "20, 29".to_owned(),
        "17 lights".to_owned(),
    ];
    for label in expected {
        assert!(harness.query_all_by_label(&label).next().is_some(), "{label} is not shown");
    }
    click(&mut harness, "Focus (F)");
    let controls = &harness.state().state.controls;
    let towards = (place.p - controls.eye()).normalize();
    assert!(controls.forward().abs_diff_eq(towards, 1e-4) && (controls.reach - place.distance).abs() < 1e-3);
}

#[test]
fn lights_are_added_changed_and_deleted() {
    let mut harness = shown();
    click(&mut harness, "Lights");
    let count = harness.state().scene.lights.len();
    harness.state_mut().state.pointed = Some(pointed(&harness));
    harness.run();
    click(&mut harness, "Add a light there");
    let lights = harness.state().scene.lights.clone();
    assert_eq!(lights.len(), count + 1);
    let place = *harness.state().state.pointed.as_ref().unwrap().place().unwrap();
    let added = lights[count].position - place.p;
    assert!(added.length() > 0.01 && added.normalize().dot(place.geometric_normal) > 0.999);

    click(&mut harness, "Add a sun");
    let sun = count + 1;
    assert_eq!(harness.state().scene.lights[sun].kind, LightKind::Directional);
    click(&mut harness, &format!("#{sun} (sun)"));
    type_into(&mut harness, "elevation", "30");
    type_into(&mut harness, "illuminance", "5");
    let light = harness.state().scene.lights[sun].clone();
    assert!((light.direction.y + 0.5).abs() < 1e-4 && (light.intensity.max_element() - 5.0).abs() < 1e-4, "{light:?}");
    assert_eq!(harness.state().scene.lights[..sun], lights[..], "other lights are unchanged");
    click(&mut harness, "Delete");
    assert_eq!(harness.state().scene.lights, lights);

    // Search the light by its number, expand it, move it.
    let search = harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "Search");
    search.focus();
    harness.run();
    harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "Search").type_text(&format!("#{count}"));
    harness.run();
    assert!(harness.query_by_label("#0 (point)").is_none());
    click(&mut harness, &format!("#{count} (point)"));
    type_into(&mut harness, "y", "1.25");
    assert_eq!(harness.state().scene.lights[count].position.y, 1.25);
}

/// Types a value into a drag field.
fn type_into(harness: &mut Harness<'_, Shown>, name: &str, text: &str) {
    harness.get_by_role_and_label(egui::accesskit::Role::SpinButton, name).click();
    harness.run();
    harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::A);
    harness.event(egui::Event::Text(text.to_owned()));
    harness.step();
    press(harness, Key::Enter);
}

#[test]
fn a_click_on_a_pass_shows_its_output_and_a_second_the_image() {
    let mut harness = shown();
    let pass = |name: &str| PassTime { name: name.to_owned(), ms: 1.5 };
    let passes = ["prepass", "deep_images/build", "indirect/sampled/trace"].map(pass).to_vec();
    harness.state_mut().passes = passes.clone();
    harness.state_mut().memory.frames.lists = vec![("a list", 77)];
    harness.run();
    let view = |harness: &Harness<'_, Shown>| harness.state().state.settings.image.debug_view;
    click(&mut harness, "prepass");
    assert_eq!(view(&harness), Some(DebugView::Depth));
    // A debug view runs fewer passes; the list still has those of the image.
    harness.state_mut().passes.truncate(1);
    click(&mut harness, "roughness");
    assert_eq!(view(&harness), Some(DebugView::Roughness));
    click(&mut harness, "indirect/sampled/trace");
    assert_eq!(view(&harness), Some(DebugView::Indirect));
    click(&mut harness, "deep_images/build");
    assert_eq!(view(&harness), Some(DebugView::Indirect), "the pass has no debug view");
    click(&mut harness, "indirect/sampled/trace");
    assert!(view(&harness).is_none() && harness.state().state.written.is_none());
    // A debug view that the user chooses replaces that of a pass.
    harness.state_mut().passes = passes;
    harness.run();
    click(&mut harness, "prepass");
    choose(&mut harness, "debug-view", "base-color");
    assert!(harness.state().state.written.is_none() && view(&harness) == Some(DebugView::BaseColor));
    click(&mut harness, "Memory");
    assert!(harness.query_by_label("a list").is_some() && harness.query_by_label("77").is_some());
}

#[test]
fn overlays_are_switched_and_the_birds_eye_view_is_requested() {
    let mut harness = shown();
    press(&mut harness, Key::V);
    assert!(harness.state().state.overlays.wants_birds_eye);
    click(&mut harness, "Overlays");
    click(&mut harness, "Bird\u{2019}s-eye view (V)");
    assert!(!harness.state().state.overlays.wants_birds_eye, "a second request cancels the first");
    harness.get_by_label("Ranges of lights").click();
    click(&mut harness, "Tiles or clusters on the image");
    click(&mut harness, "Rays of its indirect light");
    assert!(harness.state().state.overlays.indirect_rays);
    let pointed = pointed(&harness);
    let state = &mut harness.state_mut().state;
    assert!(state.overlays.ranges && state.overlays.grid);
    let view = overlay::BirdsEye::new(&state.controls, 1.5, &[]);
    state.controls.camera = view.camera(&demo("cornell").unwrap().bounds());
    state.overlays.birds_eye = Some(view);
    state.pointed = Some(pointed);
    harness.run();
    assert!(harness.query_by_label("Back to the camera (V)").is_some());
}

#[test]
fn all_sections_expand_and_collapse_at_once() {
    let mut harness = shown();
    let labels = ["Click on the image.", "Copy A to B", "Add a sun", "Ranges of lights", "indirect-resolution"];
    let are_shown = |harness: &Harness<'_, Shown>| labels.map(|label| harness.query_by_label(label).is_some());
    assert_eq!(are_shown(&harness), [false; 5]);
    press(&mut harness, Key::F6);
    assert_eq!(are_shown(&harness), [true; 5]);
    press(&mut harness, Key::F6);
    assert_eq!(are_shown(&harness), [false; 5]);
}

/// Panel contents do not change the viewport size, which would restart accumulation.
#[test]
fn panel_contents_do_not_resize_the_viewport() {
    let mut harness = shown();
    let size = harness.state().requested.viewport_size;
    let pass =
        PassTime { name: "a/pass/whose/name/is/longer/than/any/other/and/than/the/panel".to_owned(), ms: 1234.5 };
    let pointed = pointed(&harness);
    let shown = harness.state_mut();
    shown.passes.push(pass);
    shown.state.pointed = Some(pointed);
    shown.state.message = "word ".repeat(100);
    harness.run();
    assert_eq!(harness.state().requested.viewport_size, size);
    press(&mut harness, Key::F6);
    assert_eq!(harness.state().requested.viewport_size, size);
    press(&mut harness, Key::F3);
    assert!(harness.state().requested.viewport_size.x > size.x, "hidden panels enlarge the viewport");
}
