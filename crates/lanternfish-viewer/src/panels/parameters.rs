//! A widget for every setting, built from the parameter descriptions of techniques and settings.

use egui::Ui;
use lanternfish::{
    Settings,
    settings::Preset,
    technique::{Choice, Kind, ParameterInfo, Range},
};
use lanternfish_scene::{Named, Setting as _};

use super::State;

/// A setting's current value and default as text, and the names of its values with help texts.
struct Value {
    now: Option<String>,
    default: Option<String>,
    names: Vec<(&'static str, &'static str)>,
}

pub fn show(ui: &mut Ui, state: &mut State) {
    let defaults = state.defaults.clone();
    let (settings, unfold) = (&mut state.settings, state.unfold);
    presets(ui, settings);
    technique(ui, &mut settings.indirect, &defaults.indirect, &mut state.message, unfold);
    technique(ui, &mut settings.caustics, &defaults.caustics, &mut state.message, unfold);
    technique(ui, &mut settings.occlusion, &defaults.occlusion, &mut state.message, unfold);
    technique(ui, &mut settings.direct, &defaults.direct, &mut state.message, unfold);
    technique(ui, &mut settings.culling, &defaults.culling, &mut state.message, unfold);
    for parameter in Settings::PARAMETERS.iter().filter(|parameter| parameter.info.has_panel) {
        let name = parameter.info.name;
        let names = (parameter.of)(&mut settings.clone()).names();
        let value = Value { now: settings.get(name), default: defaults.get(name), names };
        if let Some(text) = widget(ui, &parameter.info, &value) {
            tell(&mut state.message, name, settings.set(name, &text));
        }
    }
    ui.separator();
    if ui.button("Reset all").clicked() {
        *settings = defaults;
    }
}

/// Draws the presets of `--quality`: a click sets indirect light and antialiasing; for moving views, the history and
/// sampled direct light. The other presets leave both.
fn presets(ui: &mut Ui, settings: &mut Settings) {
    ui.horizontal(|ui| {
        ui.label("quality").on_hover_text("Presets, as --quality of the command line");
        let realtime = Settings::of_preset(Preset::Realtime);
        for preset in Preset::ALL {
            let of_preset = Settings::of_preset(*preset);
            let mut set = settings.clone();
            set.indirect = of_preset.indirect;
            (set.image.antialiasing, set.image.samples) = (of_preset.image.antialiasing, of_preset.image.samples);
            if *preset == Preset::Realtime {
                (set.direct, set.history) = (realtime.direct.clone(), realtime.history);
            }
            if ui.selectable_label(*settings == set, preset.name()).on_hover_text(preset.help()).clicked() {
                *settings = set;
            }
        }
    });
}

fn tell(message: &mut String, name: &str, done: Result<(), String>) {
    match done {
        Ok(()) => message.clear(),
        Err(what) => *message = format!("{name}: {what}"),
    }
}

/// Draws the choice of a kind of technique, and its parameters. `unfold` expands or collapses the parameters.
fn technique<K: Kind + ?Sized>(
    ui: &mut Ui,
    chosen: &mut Choice<K>,
    defaults: &Choice<K>,
    message: &mut String,
    unfold: Option<bool>,
) {
    let say = |choice: &Choice<K>| Some(choice.name().to_owned());
    let first = K::HELP.lines().next().unwrap_or(K::HELP);
    let choice = ParameterInfo::new(K::FLAG, "NAME", Range::Names, first);
    let value = Value { now: say(chosen), default: say(defaults), names: chosen.names() };
    if let Some(text) = widget(ui, &choice, &value) {
        let of_defaults = (defaults.name() == text).then(|| defaults.clone());
        *chosen = of_defaults.or_else(|| Choice::named(&text)).unwrap_or_else(|| chosen.clone());
    }
    let Some(technique) = chosen.technique() else { return };
    let (parameters, name) = (technique.parameters(), chosen.name());
    // The window's defaults if they use this technique; otherwise the technique's own.
    let plain = if defaults.name() == name { Some(defaults.clone()) } else { Choice::named(name) };
    let plain = plain.unwrap_or_else(|| chosen.clone());
    egui::CollapsingHeader::new(format!("{} {name}", K::FLAG)).open(unfold).show(ui, |ui| {
        for (info, own) in parameters {
            let get = |choice: &Choice<K>| choice.technique().and_then(|technique| technique.get(info.name));
            let value = Value { now: own.text(), default: get(&plain), names: own.names() };
            if let (Some(text), Some(technique)) = (widget(ui, &info, &value), chosen.technique_mut()) {
                tell(message, info.name, technique.set(info.name, &text));
            }
        }
    });
}

/// Draws a row: name, value, and a reset button if the value differs from the default. Returns the changed value.
fn widget(ui: &mut Ui, info: &ParameterInfo, value: &Value) -> Option<String> {
    let shown = value.now.clone().unwrap_or_default();
    let mut changed = None;
    ui.horizontal(|ui| {
        let label = ui.label(info.name).on_hover_text(info.text());
        let response = match info.range {
            Range::Names | Range::Numbers => choice(ui, info, value, &mut changed),
            Range::Switch(..) => {
                let mut is_on = shown == "on";
                let response = ui.checkbox(&mut is_on, "");
                if response.changed() {
                    changed = Some(if is_on { "on" } else { "off" }.to_owned());
                }
                response
            }
            Range::Count(least, most) => {
                let mut number: u32 = shown.parse().unwrap_or(least);
                let response = ui.add(egui::DragValue::new(&mut number).range(least..=most).speed(0.1));
                if response.changed() {
                    changed = Some(number.to_string());
                }
                response
            }
            Range::Positive | Range::Number(..) => {
                let (least, most) =
                    if let Range::Number(least, most) = info.range { (least, most) } else { (1e-6, 1e6) };
                let mut number: f32 = shown.parse().unwrap_or(least.max(1.0));
                let speed = f64::from(0.01 * number);
                let response = ui.add(egui::DragValue::new(&mut number).range(least..=most).speed(speed));
                if response.changed() {
                    changed = Some(number.to_string());
                }
                response
            }
            Range::Text => text(ui, info, &shown, &mut changed),
        };
        response.labelled_by(label.id);
        if value.now != value.default
            && let Some(default) = value.default.clone().or_else(|| Some("none".to_owned()))
        {
            let back = ui.small_button("reset").on_hover_text(format!("Reset {} to {default}", info.name));
            if back.clicked() {
                changed = Some(default);
            }
        }
    });
    changed
}

fn choice(ui: &mut Ui, info: &ParameterInfo, value: &Value, changed: &mut Option<String>) -> egui::Response {
    let now = value.now.as_deref().unwrap_or("none");
    let list = egui::ComboBox::from_id_salt(("parameter", info.name)).selected_text(now);
    let shown = list.show_ui(ui, |ui| {
        for (name, meaning) in &value.names {
            if ui.selectable_label(*name == now, *name).on_hover_text(*meaning).clicked() {
                *changed = Some((*name).to_owned());
            }
        }
    });
    shown.response
}

/// A text field. Its value applies when it loses focus.
fn text(ui: &mut Ui, info: &ParameterInfo, shown: &str, changed: &mut Option<String>) -> egui::Response {
    let id = ui.scope_id().with(("typed", info.name));
    let mut typed: String = ui.data(|data| data.get_temp(id)).unwrap_or_else(|| shown.to_owned());
    let response = ui.add(egui::TextEdit::singleline(&mut typed).desired_width(80.0));
    if response.lost_focus() {
        if typed != shown {
            *changed = Some(typed);
        }
        ui.data_mut(|data| data.remove::<String>(id));
    } else if response.changed() {
        ui.data_mut(|data| data.insert_temp(id, typed));
    }
    response
}
