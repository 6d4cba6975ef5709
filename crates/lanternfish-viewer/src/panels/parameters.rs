//! A widget for every setting, made from what techniques and settings state of themselves.

use egui::Ui;
use lanternfish::{
    Settings,
    technique::{Choice, Kind, ParameterInfo, Range},
};

use super::State;

/// A setting's value as text; what it is where nobody says otherwise; the names of its values, with words on each.
struct Value {
    now: Option<String>,
    usual: Option<String>,
    names: Vec<(&'static str, &'static str)>,
}

pub fn show(ui: &mut Ui, state: &mut State) {
    let usual = state.usual.clone();
    let (settings, unfold) = (&mut state.settings, state.unfold);
    technique(ui, &mut settings.indirect, &usual.indirect, &mut state.message, unfold);
    technique(ui, &mut settings.occlusion, &usual.occlusion, &mut state.message, unfold);
    technique(ui, &mut settings.culling, &usual.culling, &mut state.message, unfold);
    for parameter in Settings::PARAMETERS {
        let name = parameter.info.name;
        let names = (parameter.of)(&mut settings.clone()).names();
        let value = Value { now: settings.get(name), usual: usual.get(name), names };
        if let Some(text) = widget(ui, &parameter.info, &value) {
            tell(&mut state.message, name, settings.set(name, &text));
        }
    }
    ui.separator();
    if ui.button("Reset all").clicked() {
        *settings = usual;
    }
}

fn tell(message: &mut String, name: &str, done: Result<(), String>) {
    match done {
        Ok(()) => message.clear(),
        Err(what) => *message = format!("{name}: {what}"),
    }
}

/// Which technique of a kind, and its parameters, which may be unfolded or folded now.
fn technique<K: Kind + ?Sized>(
    ui: &mut Ui,
    chosen: &mut Choice<K>,
    usual: &Choice<K>,
    message: &mut String,
    unfold: Option<bool>,
) {
    let all = Choice::<K>::all();
    let words = all.iter().filter_map(|choice| Some((choice.name(), choice.technique()?.summary())));
    let names: Vec<_> = [(K::NONE_NAME, K::NONE_SUMMARY)].into_iter().chain(words).collect();
    let say = |choice: &Choice<K>| Some(choice.name().to_owned());
    let first = K::HELP.lines().next().unwrap_or(K::HELP);
    let choice = ParameterInfo::new(K::FLAG, "NAME", Range::Names, first);
    let value = Value { now: say(chosen), usual: say(usual), names };
    if let Some(text) = widget(ui, &choice, &value) {
        let of_usual = (usual.name() == text).then(|| usual.clone());
        *chosen = of_usual.or_else(|| Choice::named(&text)).unwrap_or_else(|| chosen.clone());
    }
    let Some(technique) = chosen.technique() else { return };
    let (parameters, name) = (technique.parameters(), chosen.name());
    // As the window began with it, where it began with this technique; else the technique's own defaults.
    let plain = if usual.name() == name { Some(usual.clone()) } else { Choice::named(name) };
    let plain = plain.unwrap_or_else(|| chosen.clone());
    egui::CollapsingHeader::new(format!("{} {name}", K::FLAG)).open(unfold).show(ui, |ui| {
        for (info, names) in parameters {
            let get = |choice: &Choice<K>| choice.technique().and_then(|technique| technique.get(info.name));
            let value = Value { now: get(chosen), usual: get(&plain), names };
            if let (Some(text), Some(technique)) = (widget(ui, &info, &value), chosen.technique_mut()) {
                tell(message, info.name, technique.set(info.name, &text));
            }
        }
    });
}

/// A row: the name, the value, and where it is another than before, a click back. What it was changed to.
fn widget(ui: &mut Ui, words: &ParameterInfo, value: &Value) -> Option<String> {
    let shown = value.now.clone().unwrap_or_default();
    let mut changed = None;
    ui.horizontal(|ui| {
        let label = ui.label(words.name).on_hover_text(words.help);
        let response = match words.range {
            Range::Names | Range::Numbers => choice(ui, words, value, &mut changed),
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
            Range::Positive => {
                let mut number: f32 = shown.parse().unwrap_or(1.0);
                let speed = f64::from(0.01 * number);
                let response = ui.add(egui::DragValue::new(&mut number).range(1e-6..=1e6).speed(speed));
                if response.changed() {
                    changed = Some(number.to_string());
                }
                response
            }
            Range::Text => text(ui, words, &shown, &mut changed),
        };
        response.labelled_by(label.id);
        if value.now != value.usual
            && let Some(usual) = value.usual.clone().or_else(|| Some("none".to_owned()))
        {
            let back = ui.small_button("reset").on_hover_text(format!("Reset {} to {usual}", words.name));
            if back.clicked() {
                changed = Some(usual);
            }
        }
    });
    changed
}

fn choice(ui: &mut Ui, words: &ParameterInfo, value: &Value, changed: &mut Option<String>) -> egui::Response {
    let now = value.now.as_deref().unwrap_or("none");
    let list = egui::ComboBox::from_id_salt(("parameter", words.name)).selected_text(now);
    let shown = list.show_ui(ui, |ui| {
        for (name, meaning) in &value.names {
            if ui.selectable_label(*name == now, *name).on_hover_text(*meaning).clicked() {
                *changed = Some((*name).to_owned());
            }
        }
    });
    shown.response
}

/// What is typed counts when it is done.
fn text(ui: &mut Ui, words: &ParameterInfo, shown: &str, changed: &mut Option<String>) -> egui::Response {
    let id = ui.scope_id().with(("typed", words.name));
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
