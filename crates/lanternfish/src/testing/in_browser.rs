//! Compiles shaders with the compiler of a browser: Tint, in Chromium. Its rules are WGSL's, and naga lacks some of them.

use std::{
    collections::BTreeMap,
    env,
    io::Write as _,
    path::Path,
    process::{Command, Stdio},
    sync::Arc,
};

use lanternfish_gpu::LinkedShader;

/// Panics if a browser refuses one of the shaders that a page can have, or warns of it: those without an extension of wgpu, which are ray
/// queries and arrays of textures. A page hands over the linked text as it is.
pub fn check(shaders: &[Arc<LinkedShader>]) {
    let is_native = |shader: &&Arc<LinkedShader>| shader.source.lines().any(|line| line.starts_with("enable wgpu_"));
    let (native, shaders): (Vec<_>, Vec<_>) = shaders.iter().partition(is_native);
    // Some features of a variant change nothing in it.
    let labels: BTreeMap<&str, &str> =
        shaders.iter().map(|shader| (shader.source.as_str(), shader.label.as_str())).collect();
    let texts: Vec<_> = labels.keys().copied().collect();
    let Some(messages) = compile(&texts) else { return };
    println!(
        "a browser compiled {} texts of {} variants; {} variants have extensions that no browser has",
        texts.len(),
        shaders.len(),
        native.len()
    );
    let named = messages.iter().map(|message| {
        let (index, what) = message.split_once(' ').expect("an index");
        format!("{}: {what}", labels[texts[index.parse::<usize>().expect("an index")]])
    });
    let named: Vec<_> = named.collect();
    assert!(named.is_empty(), "{}\n{} errors and warnings of a browser", named.join("\n"), named.len());
}

/// What a browser says of these texts: for each error and warning the text's index, its kind, and a message, `3 error: …`. None where a
/// program is missing, which is said.
pub fn compile(texts: &[&str]) -> Option<Vec<String>> {
    let (Ok(chromium), Ok(modules)) = (env::var("LANTERNFISH_CHROMIUM"), env::var("LANTERNFISH_PLAYWRIGHT")) else {
        println!("LEFT OUT (tool): shaders in a browser: `cargo xtask test` runs it, with Chromium, node and npm");
        return None;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lanternfish-web/tests/compile.mjs");
    let mut node = Command::new("node");
    node.arg(script).args([chromium, modules]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut node = node.spawn().expect("node runs");
    // It reads everything before it prints.
    node.stdin.take().expect("piped").write_all(texts.join("\0").as_bytes()).expect("node reads");
    let output = node.wait_with_output().expect("node ends");
    assert!(output.status.success(), "node: {}", output.status);
    let mut lines: Vec<_> = String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect();
    assert_eq!(lines.pop(), Some(format!("compiled {}", texts.len())));
    Some(lines)
}
