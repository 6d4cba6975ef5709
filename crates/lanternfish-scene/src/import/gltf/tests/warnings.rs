//! What is left out is said once.

use std::fmt::Debug;
use std::sync::{Arc, Mutex};

use serde_json::{Value, json};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

use super::File;

/// Keeps the messages of warnings.
#[derive(Clone, Default)]
struct Warnings(Arc<Mutex<Vec<String>>>);

impl Visit for Warnings {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            self.0.lock().expect("no test panics while it holds the lock").push(format!("{value:?}"));
        }
    }
}

impl Subscriber for Warnings {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() == Level::WARN
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn event(&self, event: &Event<'_>) {
        event.record(&mut self.clone());
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
}

/// The warnings while the file is loaded.
pub fn warnings(file: &File) -> Vec<String> {
    let warnings = Warnings::default();
    tracing::subscriber::with_default(warnings.clone(), || file.scene());
    let messages = warnings.0.lock().expect("nothing else holds the lock");
    messages.clone()
}

#[test]
fn every_kind_of_omission_is_one_warning() {
    let mut file = File::with_triangle();
    assert!(warnings(&file).is_empty(), "nothing is left out");
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    for mode in [0, 1, 3] {
        let mut points = primitive.clone();
        points["mode"] = json!(mode);
        file.json["meshes"][0]["primitives"].as_array_mut().expect("primitives").push(points);
    }
    file.json["extensionsUsed"] = json!(["KHR_materials_unlit", "EXT_one", "EXT_two"]);
    let expected = [
        "folder/test.glb: read without these extensions, which are not supported: EXT_one, EXT_two",
        "folder/test.glb: left out: points and lines (3)",
    ];
    assert_eq!(warnings(&file), expected);
}

#[test]
fn what_bends_and_moves_is_counted() {
    let mut file = File::with_triangle();
    let moving = |what: &Value| what.as_array().expect("a list").clone();
    file.json["animations"] = json!([{ "channels": [], "samplers": [] }, { "channels": [], "samplers": [] }]);
    file.json["skins"] = json!([{ "joints": [0] }, { "joints": [0] }]);
    let mesh = &mut file.json["meshes"][0];
    mesh["primitives"][0]["targets"] = json!([{}, {}, {}]);
    let primitive = mesh["primitives"][0].clone();
    mesh["primitives"].as_array_mut().expect("primitives").push(primitive);
    // A skin counts once, and only where it bends something.
    let mut nodes = moving(&file.json["nodes"]);
    let place = nodes.iter().position(|node| node["mesh"] == 0).expect("the triangle's node");
    nodes[place]["skin"] = json!(1);
    nodes.push(nodes[place].clone());
    nodes[place]["translation"] = json!([1, 0, 0]);
    nodes.push(json!({ "skin": 0 }));
    file.json["scene"] = json!(0);
    file.json["scenes"] = json!([{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }]);
    file.json["nodes"] = json!(nodes);
    let expected = [
        "folder/test.glb: left out: animations: what they move stays where it is (2)",
        "folder/test.glb: left out: morph targets: what they bend is drawn as it is stored (3)",
        "folder/test.glb: left out: skins: what they bend is drawn as it is stored (1)",
    ];
    assert_eq!(warnings(&file), expected);
}
