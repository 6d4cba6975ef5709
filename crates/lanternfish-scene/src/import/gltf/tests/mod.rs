//! Tests of the glTF import, with small files that the tests build.

mod accessors;
mod basisu;
mod compression;
mod conformance;
mod container;
mod draco;
mod geometry;
mod hostile;
mod materials;
mod motion;
mod nodes;
mod samples;
mod scenes;
mod surface;
mod thin;
mod variants;
mod warnings;

use std::path::Path;

use serde_json::{Value, json};

use lanternfish_limits::memory::Budget;

use crate::{LoadOptions, Primitive, Scene, SceneError, import::files::Files};

pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// The corners of a triangle in the plane z = 0, counter-clockwise seen from +z.
pub const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Damaged data: cut, or with a changed bit or byte. Every fourth `i` changes a byte of the header, which is at `header`.
pub fn damaged(bytes: &[u8], i: usize, header: std::ops::Range<usize>) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    let at = i * 7919 % damaged.len();
    match i % 4 {
        0 => damaged.truncate(at),
        1 => damaged[at] ^= 1 << (i / 4 % 8),
        2 => damaged[at] = 255,
        _ => damaged[header.start + i % header.len()] = (i / header.len()) as u8,
    }
    damaged
}

/// A file under construction. All binary data is in the BIN chunk.
pub struct File {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl File {
    /// A file without any content.
    pub fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "buffers": [{}], "bufferViews": [], "accessors": [],
            "meshes": [], "nodes": [], "materials": [], "textures": [], "images": [], "samplers": [], "cameras": [],
        });
        Self { json, bin: Vec::new() }
    }

    /// A file with one mesh of one primitive, at one node.
    pub fn with_primitive(build: impl FnOnce(&mut Self) -> Value) -> Self {
        let mut file = Self::new();
        let primitive = build(&mut file);
        file.push("meshes", json!({ "primitives": [primitive] }));
        file.push("nodes", json!({ "mesh": 0 }));
        file
    }

    /// A file with [`TRIANGLE`] at one node.
    pub fn with_triangle() -> Self {
        Self::with_primitive(|file| json!({ "attributes": { "POSITION": file.floats("VEC3", &TRIANGLE) } }))
    }

    /// Appends a value to one of the file's lists and returns its index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().expect("a list of the file");
        list.push(value);
        list.len() - 1
    }

    /// Adds a new buffer view of `bytes`, aligned to 4 bytes, and returns its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    /// Adds an accessor of all `bytes` and returns its index.
    pub fn accessor(&mut self, shape: &str, component_type: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component_type, "type": shape, "count": count }),
        )
    }

    pub fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let size = shape.strip_prefix("VEC").map_or(1, |size| size.parse().expect("a size"));
        self.accessor(shape, F32, values.len() / size, &bytes_of(values))
    }

    pub fn u16_indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor("SCALAR", U16, values.len(), &bytes)
    }

    /// The file as GLB.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json["buffers"] == json!([{}]) {
            json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let (mut json, mut bin) = (json.to_string().into_bytes(), self.bin.clone());
        json.resize(json.len().next_multiple_of(4), b' ');
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + 8 + bin.len();
        let u32_bytes = |value: usize| (value as u32).to_le_bytes();
        [
            b"glTF",
            &u32_bytes(2),
            &u32_bytes(length),
            &u32_bytes(json.len()),
            b"JSON",
            &json[..],
            &u32_bytes(bin.len()),
            b"BIN\0",
            &bin[..],
        ]
        .concat()
    }

    pub fn load(&self) -> Result<Scene, SceneError> {
        load_bytes(&self.glb())
    }

    /// The scene of a file that must load.
    pub fn scene(&self) -> Scene {
        let scene = self.load().unwrap_or_else(|error| panic!("{error}\n{}", self.json));
        scene.validate().unwrap_or_else(|fault| panic!("{fault}\n{}", self.json));
        scene
    }

    /// The only primitive of a file that must load.
    pub fn primitive(&self) -> Primitive {
        let mut scene = self.scene();
        assert_eq!((scene.meshes.len(), scene.meshes[0].primitives.len()), (1, 1));
        scene.meshes[0].primitives.remove(0)
    }

    /// The message of a file that must be refused as invalid.
    pub fn fault(&self) -> String {
        match self.load() {
            Err(SceneError::Invalid { what, .. }) => what,
            other => panic!("not refused as invalid: {other:?}"),
        }
    }
}

pub fn load_bytes(bytes: &[u8]) -> Result<Scene, SceneError> {
    load_within(bytes, 1 << 40)
}

/// Loads the file within a budget of `memory` bytes.
pub fn load_within(bytes: &[u8], memory: u64) -> Result<Scene, SceneError> {
    let path = Path::new("folder/test.glb");
    let budget = Budget::of(memory);
    let files = Files::beside(path, &LoadOptions::default(), None, &budget)?;
    super::read(bytes, path, &LoadOptions::default(), &files).map_err(|fault| fault.at(path))
}

/// Writes the file and loads it with these options.
pub fn load_with_options(file: &File, options: &LoadOptions) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file.glb");
    std::fs::write(&path, file.glb()).expect("written");
    crate::load_with(&path, options)
}

/// The message of a file that needs more than `memory` bytes.
#[track_caller]
pub fn too_much(bytes: &[u8], memory: u64) -> String {
    match load_within(bytes, memory) {
        Err(error @ SceneError::TooMuch { .. }) => error.to_string(),
        other => panic!("not refused for its size: {:?}", other.map(|scene| scene.triangle_counts())),
    }
}

pub fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[track_caller]
pub fn assert_contains(text: &str, part: &str) {
    assert!(text.contains(part), "{part:?} is not in {text:?}");
}
