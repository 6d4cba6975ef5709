//! Omitted content causes one warning per kind.

use std::fmt::Debug;
use std::sync::{Arc, Mutex};

use serde_json::json;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

use super::File;

/// Records the messages of warnings.
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

/// The warnings that loading the file causes.
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
    let primitives = file.json["meshes"][0]["primitives"].as_array_mut().expect("primitives");
    primitives.extend(vec![json!({ "attributes": {} }); 3]);
    file.json["extensionsUsed"] = json!(["KHR_materials_unlit", "EXT_one", "EXT_two"]);
    let expected = [
        "folder/test.glb: read without these extensions, which are not supported: EXT_one, EXT_two",
        "folder/test.glb: left out: primitives without positions (3)",
    ];
    assert_eq!(warnings(&file), expected);
}

#[test]
fn unsupported_animations_are_counted() {
    let mut file = File::with_triangle();
    let of_a_material = json!({ "sampler": 0, "target": { "path": "pointer" } });
    file.json["animations"] = json!([{ "channels": [of_a_material.clone(), of_a_material], "samplers": [] }]);
    let expected = ["folder/test.glb: left out: animations of targets that are not nodes (2)"];
    assert_eq!(warnings(&file), expected);

    let pointers = [
        ("/cameras/0/perspective/yfov", "animations of cameras (1)"),
        (
            "/extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle",
            "animations of other properties of lights (2)",
        ),
        ("/extensions/EXT_lights_area/lights/0/intensity", ""),
        ("/materials/0/emissiveFactor", "animations of materials (1)"),
        ("/meshes/0/weights", "animations of meshes (1)"),
        ("", "animations of other properties (3)"),
        ("nodes/0/translation", ""),
        ("/extensions/EXT_one", ""),
        ("/nodes", "animations of other properties of nodes (5)"),
        ("/nodes/0/matrix", ""),
        ("/nodes/0/weights/1", ""),
        ("/nodes/-1/translation", ""),
        ("/nodes/99999999999999999999/scale", ""),
        ("/materials/0/normalTexture/extensions/KHR_texture_transform/offset", "animations of texture transforms (1)"),
        ("/nodes/0/extensions/KHR_node_visibility/visible", "animations of the visibility of nodes (1)"),
    ];
    let channel = |(pointer, _): &(&str, &str)| {
        let extensions = json!({ "KHR_animation_pointer": { "pointer": pointer } });
        json!({ "sampler": 0, "target": { "path": "pointer", "extensions": extensions } })
    };
    let channels: Vec<_> = pointers.iter().map(channel).collect();
    file.json["animations"] = json!([{ "channels": channels, "samplers": [] }]);
    file.json["extensionsRequired"] = json!(["KHR_animation_pointer"]);
    let stated = pointers.iter().filter(|(_, expected)| !expected.is_empty());
    let mut expected: Vec<_> = stated.map(|(_, expected)| format!("folder/test.glb: left out: {expected}")).collect();
    expected.sort();
    assert_eq!(warnings(&file), expected);
}
