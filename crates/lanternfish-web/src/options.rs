//! Settings by name, from JavaScript.

use js_sys::{Array, Object};
use lanternfish::{Settings, settings::Preset};
use lanternfish_scene::Setting as _;
use wasm_bindgen::{JsCast as _, prelude::*};

use crate::failed;

/// What an image is like.
pub struct Options {
    pub size: [u32; 2],
    pub camera: usize,
    preset: Preset,
    /// Settings of the library.
    names: Vec<(String, String)>,
}

impl Options {
    /// From an object's properties, all of which have a default: `width`, `height` (96), `camera` (0, an index), `quality`, and every
    /// setting of the library by its name.
    pub fn of(object: &Object) -> Result<Self, JsValue> {
        let mut options = Self { size: [96; 2], camera: 0, preset: Preset::default(), names: Vec::new() };
        for entry in Object::entries(object).iter() {
            let entry: Array = entry.unchecked_into();
            let text = |index| entry.get(index).as_string().or_else(|| Some(entry.get(index).as_f64()?.to_string()));
            match (text(0), text(1)) {
                (Some(name), Some(value)) => options.put(&name, &value)?,
                _ => return Err(failed("a setting is a text or a number")),
            }
        }
        Ok(options)
    }

    pub fn put(&mut self, name: &str, value: &str) -> Result<(), JsValue> {
        let number = || value.parse::<u32>().map_err(|_| failed(format!("{name}: a whole number is expected")));
        let wrong = |what: String| failed(format!("{name}: {what}"));
        match name {
            "width" => self.size[0] = number()?,
            "height" => self.size[1] = number()?,
            "camera" => self.camera = number()? as usize,
            "quality" => self.preset.read(value).map_err(wrong)?,
            _ => {
                Settings::check(name, value).map_err(wrong)?;
                self.names.retain(|(own, _)| own != name);
                self.names.push((name.to_owned(), value.to_owned()));
            }
        }
        Ok(())
    }

    pub fn settings(&self) -> Result<Settings, JsValue> {
        let names = || self.names.iter().map(|(name, value)| (name.as_str(), value.as_str()));
        let frames =
            names().find(|(name, _)| *name == "accumulate").and_then(|(_, text)| text.parse().ok()).unwrap_or(1);
        let choices = names().filter(|(name, _)| Settings::is_choice(name));
        let mut settings = Settings::of_choices(self.preset, choices, frames).map_err(failed)?;
        names()
            .filter(|(name, _)| !Settings::is_choice(name))
            .try_for_each(|(name, value)| settings.set(name, value))
            .map_err(failed)?;
        Ok(settings)
    }
}

/// All settings, as JSON: a list of `{ name, kind, help, values, value, everyday }`. `values` is empty for numbers, `value` the default.
#[wasm_bindgen]
pub fn settings() -> String {
    let row = |parameter: lanternfish::settings::AnyParameter| {
        let values: Vec<_> = parameter.names.iter().map(|(name, _)| *name).collect();
        let info = parameter.info;
        serde_json::json!({
            "name": info.name, "kind": parameter.kind, "help": info.help, "values": values, "value": parameter.default,
            "everyday": info.is_everyday,
        })
    };
    serde_json::Value::from_iter(Settings::parameters().into_iter().map(row)).to_string()
}
