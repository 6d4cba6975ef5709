//! Writes linked shaders as WGSL, for `cargo xtask shader-stats`.
//!
//! ```text
//! cargo run --package lanternfish-papers --example link_shaders FOLDER [- | --containing TEXT]
//! ```
//!
//! The first line of a text is `// ` and the shader's name: its file and its sorted features,
//! `shadows/trace+culling_tiled+soft+…`. Written are:
//!
//! - with `-`, the shaders whose names standard input has, one a line, or
//! - every variant whose name contains TEXT, or
//! - without either, every file in its usual variants ([`is_usual`]).
//!
//! Known are the variants that the library's own settings can request, and those of this crate's files.

use std::{cell::RefCell, collections::BTreeSet, error::Error, fs, path::Path, thread};

use lanternfish::{
    techniques,
    testing::every_shader::{EveryShader, all_settings},
};
use lanternfish_gpu::Feature;
use lanternfish_papers::{FOLDERS, register, shaders::SHADERS};

/// Shaders that a thread holds at a time.
const CHUNK: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [folder, wanted @ ..] = &words[..] else { return Err("no folder".into()) };
    let folder = Path::new(folder);
    fs::create_dir_all(folder)?;

    let every = every_shader();
    let names = RefCell::new(BTreeSet::new());
    for every in &every {
        every.link(|root, features| {
            names.borrow_mut().insert(name(root.module, features));
            false
        });
    }
    let declared = names.into_inner();
    let names: Vec<String> = match wanted {
        [] => declared.iter().filter(|name| is_usual(name, &declared)).cloned().collect(),
        [flag, text] if flag == "--containing" => declared.iter().filter(|name| name.contains(text)).cloned().collect(),
        [all] if all == "-" => {
            let names = std::io::stdin().lines().map(|name| Ok(sorted(&name?)));
            names.collect::<std::io::Result<BTreeSet<_>>>()?.into_iter().collect()
        }
        _ => return Err(format!("{wanted:?}: neither - nor --containing TEXT").into()),
    };
    if let Some(missing) = names.iter().find(|name| !declared.contains(*name)) {
        return Err(format!("no variant {missing}; the most similar: {}", nearest(missing, &declared)).into());
    }

    let threads = thread::available_parallelism()?.get();
    let chunks: Vec<_> = names.chunks(CHUNK).enumerate().collect();
    let write = |first: usize| {
        for (i, chunk) in chunks.iter().skip(first).step_by(threads) {
            let linked = every.iter().flat_map(|every| every.link(|root, of| chunk.contains(&name(root.module, of))));
            for (k, shader) in linked.enumerate() {
                let text = format!("// {}\n{}", sorted(&shader.label), shader.source);
                fs::write(folder.join(format!("{}.wgsl", i * CHUNK + k)), text).expect("the folder can be written");
            }
        }
    };
    let write = &write;
    thread::scope(|scope| (0..threads).for_each(|first| drop(scope.spawn(move || write(first)))));
    Ok(())
}

/// The shaders of the library as its own settings request them: with the papers' techniques too there are thousands
/// more, of the same passes. Then those of this crate.
fn every_shader() -> [EveryShader; 2] {
    let library = EveryShader::new(vec![&lanternfish::shaders::SHADERS], techniques::shaders(), &all_settings());
    register();
    let own: BTreeSet<_> = SHADERS.sources().iter().map(|(path, _)| *path).collect();
    let folders = techniques::shaders().into_iter().chain(FOLDERS.iter().copied());
    let folders = folders.filter(|folder| folder.roots.iter().all(|root| own.contains(root.module)));
    [library, EveryShader::new(vec![&SHADERS], folders.collect(), &[])]
}

/// Features of other settings than the defaults: `shading/` and `shadows/` have a thousand combinations of them.
const OTHER_SETTINGS: [&str; 6] =
    ["culling_all", "culling_tiled", "cull_improved", "cull_naive", "ray_counts", "tracer_ray_query"];

/// False if the same variant with arrays of textures is declared, which the cards have, and for combinations of
/// [`OTHER_SETTINGS`].
fn is_usual(of: &str, declared: &BTreeSet<String>) -> bool {
    let by_settings = of.starts_with("shading/") || of.starts_with("shadows/");
    let is_other = by_settings && of.split('+').any(|feature| OTHER_SETTINGS.contains(&feature));
    !is_other && !declared.contains(&sorted(&format!("{of}+binding_arrays")))
}

fn name(module: &str, features: &[Feature]) -> String {
    let features: BTreeSet<_> = features.iter().map(|feature| feature.name()).collect();
    features.iter().fold(module.to_owned(), |name, feature| format!("{name}+{feature}"))
}

fn sorted(label: &str) -> String {
    let mut words: Vec<_> = label.split('+').collect();
    words[1..].sort();
    words.join("+")
}

/// The variant with the fewest other features, of the same file if there is one.
fn nearest<'a>(missing: &str, declared: &'a BTreeSet<String>) -> &'a str {
    let words = |name: &'a str| name.split('+').collect::<BTreeSet<_>>();
    let file = missing.split('+').next();
    let missing: BTreeSet<&str> = missing.split('+').collect();
    let difference =
        |name: &&'a String| (name.split('+').next() != file, words(name).symmetric_difference(&missing).count());
    declared.iter().min_by_key(difference).map_or("none", String::as_str)
}
