//! Functions that the tests of the command line share.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

/// The program in a folder, without input, with the log variables of the test's environment removed.
pub fn lanternfish(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish"));
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Sorted names of the files in a folder.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Writes a scene of this name: a triangle in the plane z = 0 with its right angle at the origin and legs of 1 m. Its animation "fly" moves it along x by
/// `distance`, m, in the first second.
pub fn write_flying(folder: &Path, name: &str, distance: f32) {
    let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let data = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 1., 0., 0., 0., distance, 0., 0.]);
    fs::write(folder.join(format!("{name}.bin")), &data).unwrap();
    let accessor = |view: usize, count: usize, shape: &str| {
        format!(r#"{{"bufferView": {view}, "componentType": 5126, "count": {count}, "type": "{shape}"}}"#)
    };
    let (positions, times, values) = (accessor(0, 3, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3"));
    let scene = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"name": "{name}", "mesh": 0, "extras": {{"semantic": 8}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}], "accessors": [{positions}, {times}, {values}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 8}},
        {{"buffer": 0, "byteOffset": 44, "byteLength": 24}}], "buffers": [{{"byteLength": 68, "uri": "{name}.bin"}}],
        "animations": [{{"name": "fly", "samplers": [{{"input": 1, "output": 2}}],
        "channels": [{{"sampler": 0, "target": {{"node": 0, "path": "translation"}}}}]}}]}}"#
    );
    fs::write(folder.join(format!("{name}.gltf")), scene).unwrap();
}
