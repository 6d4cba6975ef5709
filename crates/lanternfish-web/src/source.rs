//! What a page renders, from JavaScript.

use std::path::PathBuf;

use js_sys::{Array, Object, Uint8Array};
use lanternfish::settings::{AnyParameter, Preset, Settings};
use lanternfish_cli::{
    paper::Paper,
    scene::SceneName,
    shot::{self, Shot},
};
use lanternfish_scene::{Named as _, generate::DEMOS, hold_files};
use wasm_bindgen::{JsCast as _, prelude::*};

use crate::failed;

/// A scene or a shot.
pub struct Source {
    name: SceneName,
    /// The shot's text.
    text: Option<String>,
}

impl Source {
    /// The name of a generated scene, the bytes of a GLB file, or a list of names and bytes, whose first is the scene's
    /// or shot's file. All are held for what is read from now on.
    pub fn of(source: &JsValue) -> Result<Self, JsValue> {
        if let Some(name) = source.as_string() {
            hold_files(Vec::new());
            return Ok(Self { name: name.into(), text: None });
        }
        let wanted =
            || failed("a scene is a name such as demo:cornell, the bytes of a GLB file, or a list of [name, bytes]");
        let file = |name: JsValue, bytes: JsValue| {
            Some((PathBuf::from(name.as_string()?), bytes.dyn_ref::<Uint8Array>()?.to_vec()))
        };
        let files: Option<Vec<_>> = match source.dyn_ref::<Array>() {
            None => file("scene.glb".into(), source.clone()).map(|file| vec![file]),
            Some(list) => list.iter().map(|pair| file(Array::from(&pair).get(0), Array::from(&pair).get(1))).collect(),
        };
        let files = files.filter(|files| !files.is_empty()).ok_or_else(wanted)?;
        let name = SceneName::from(files[0].0.clone());
        let text = shot::is_shot(&name).then(|| String::from_utf8_lossy(&files[0].1).into_owned());
        hold_files(files);
        Ok(Self { name, text })
    }

    /// With flags of `lanternfish render`, by their names.
    pub fn shot(&self, flags: &Flags) -> Result<Shot, JsValue> {
        shot::with_flags(&self.name, self.text.as_deref(), &flags.0).map_err(failed)
    }
}

/// Flags of `lanternfish render`: names and values.
#[derive(Clone)]
pub struct Flags(Vec<(String, String)>);

impl Flags {
    /// An object's properties. `width` and `height` are those of `size`.
    pub fn of(object: &Object) -> Result<Self, JsValue> {
        let (mut flags, mut size) = (Self(Vec::new()), [None, None]);
        for entry in Object::entries(object).iter() {
            let entry: Array = entry.unchecked_into();
            let text = |index| entry.get(index).as_string().or_else(|| Some(entry.get(index).as_f64()?.to_string()));
            let (Some(name), Some(value)) = (text(0), text(1)) else {
                return Err(failed("a setting is a text or a number"));
            };
            match name.as_str() {
                "width" => size[0] = Some(value),
                "height" => size[1] = Some(value),
                _ => flags.put(&name, &value),
            }
        }
        match size {
            [Some(width), Some(height)] => flags.put("size", &format!("{width}x{height}")),
            [None, None] => {}
            _ => return Err(failed("an image has a width and a height")),
        }
        Ok(flags)
    }

    pub fn put(&mut self, name: &str, value: &str) {
        self.remove(name);
        self.0.push((name.to_owned(), value.to_owned()));
    }

    pub fn remove(&mut self, name: &str) {
        self.0.retain(|(own, _)| own != name);
    }
}

/// The built-in scenes, and all settings, as JSON: a list of `{ name, kind, help, values, value, everyday }`. `values`
/// is empty for numbers, `value` the default.
#[wasm_bindgen]
pub fn settings() -> String {
    let row = |AnyParameter { info, kind, value }| {
        let values: Vec<_> = value.names().iter().map(|(name, _)| *name).collect();
        serde_json::json!({
            "name": info.name, "kind": kind, "help": info.text(), "values": values, "value": value.text(),
            "everyday": info.is_everyday,
        })
    };
    let own = |name: &str, help: &str, values: Vec<String>, value: Option<&str>| serde_json::json!({ "name": name, "kind": "", "help": help, "values": values, "value": value, "everyday": true });
    let scenes = DEMOS.iter().map(|name| format!("demo:{name}")).collect();
    let papers = Paper::all().into_iter().map(|paper| paper.name().to_owned()).collect();
    let presets = Preset::all().into_iter().map(|preset| preset.name().to_owned()).collect();
    let first = [
        own("scene", "A built-in scene", scenes, None),
        own("as", "A paper's technique for every stage of the frame", papers, None),
        own("quality", "Preset", presets, Some("draft")),
    ];
    serde_json::Value::from_iter(first.into_iter().chain(Settings::parameters().into_iter().map(row))).to_string()
}
