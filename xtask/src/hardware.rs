//! `cargo xtask hardware`: packs a kit for a bare machine with a graphics card (without Rust, repository or possibly Vulkan
//! loader).
//!
//! Contents of `target/hardware`:
//! - `run.sh` and the scripts that it sources; see `run.sh --help`;
//! - `lanternfish.tar.gz` and `lanternfish-bench.tar.gz`: the command line and the benches, built for release, without symbols;
//! - `tests.tar.gz`: the test programs that need an adapter, as built by `cargo xtask test`, without symbols;
//! - `shared.tar.gz`: scenes, shots and tracks, in the layout of `LANTERNFISH_SHARED`;
//! - `lib.tar.gz`: libraries that `run.sh` provides to a machine that lacks them.
//!
//! `cargo xtask hardware papers` packs a kit of the five papers: the Bistro in place of the city, and no tests.

mod libraries;
pub mod programs;
#[cfg(test)]
mod tests;

use std::{
    env, fs, io,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    command::{cargo, commit, run as step, workspace},
    files::{self, at, make_empty},
    test,
};

/// Largest total size of a kit, bytes.
const MOST_BYTES: u64 = 60 << 20;

/// The scripts by name. The last is the entry point, written last: a folder without it is not a complete kit.
const SCRIPTS: [(&str, &str); 4] = [
    ("driver.sh", include_str!("hardware/kit/driver.sh")),
    ("tests.sh", include_str!("hardware/kit/tests.sh")),
    ("parts.sh", include_str!("hardware/kit/parts.sh")),
    ("run.sh", include_str!("hardware/kit/run.sh")),
];

/// Scenes, below the shared folder: of either kit, of the kit for tests, and of the papers' kit.
const SCENES: [&str; 3] =
    ["assets/sponza/Sponza.glb", "assets/candela-city/candela_city.glb", "assets/bistro/bistro-exterior.glb"];

/// A file below `docs`, and what is replaced in the kit's copy.
type Page = (&'static str, &'static [(&'static str, &'static str)]);

/// Shots, below `docs`, each with the number of its scene.
const SHOTS: [(&str, usize); 5] = [
    ("shots/sponza-ten.toml", 0),
    ("shots/virtual-lights-walk.toml", 0),
    ("shots/indirect-sponza.toml", 0),
    ("shots/deep-images-sponza.toml", 0),
    ("tracks/bistro.toml", 2),
];
/// The start of a scene's path in a shot, there and in the kit, where `shots` lies beside `assets`.
const PATHS: &[(&str, &str)] = &[("\"../../../shared/", "\"../")];

/// A track. The kit leaves its technique out: a walk chooses its own.
const TRACK: Page = ("tracks/atrium.toml", &[("shadows = \"none\"\n", ""), ("indirect = \"none\"\n", "")]);

/// Builds, and packs the kit; `papers`: that of the five papers.
pub fn run(words: &[String]) -> Result<(), String> {
    let of_papers = match words {
        [] => false,
        [word] if word == "papers" => true,
        _ => return Err(format!("hardware takes `papers` alone, no {words:?}")),
    };
    programs::check_strip()?;
    let packages = ["--package", "lanternfish-cli", "--package", "lanternfish-bench"];
    let release = programs::build(&mut cargo(["build", "--release"].iter().chain(&packages)))?;
    let tests = match of_papers {
        true => None,
        false => Some(programs::build(cargo(test::TARGETS).arg("--no-run"))?),
    };

    let kit = workspace().join("target/hardware");
    // The contents to pack, and a scratch folder for unpacked packages.
    let contents = workspace().join("target/hardware-contents");
    let scratch = workspace().join("target/hardware-packages");
    for folder in [&kit, &contents, &scratch] {
        make_empty(folder)?;
    }
    for name in ["tests", "shared", "lib"] {
        make_empty(&contents.join(name))?;
    }
    for program in &programs::RELEASED {
        programs::strip(&program.find(&release)?, &contents.join(program.name))?;
    }
    for (program, tests) in programs::TESTS.iter().flat_map(|program| tests.iter().map(move |tests| (program, tests))) {
        programs::strip(&program.find(tests)?, &contents.join("tests").join(program.name))?;
    }
    copy_shared(&contents.join("shared"), if of_papers { &[0, 2] } else { &[0, 1] })?;
    if let Err(what) = libraries::gather(&scratch, &contents.join("lib")) {
        eprintln!("==> Left out: libraries ({what})");
    }
    pack(&contents, &kit)?;
    for folder in [contents, scratch] {
        at(&folder, fs::remove_dir_all(&folder))?;
    }

    let files = files::below(&kit)?;
    let sizes = files.iter().map(|file| {
        let size = at(file, fs::metadata(file))?.len();
        Ok((file.file_name().unwrap_or_default().to_string_lossy().into_owned(), size))
    });
    print!("{}", table(&sizes.collect::<Result<Vec<_>, String>>()?)?);
    println!("{}", kit.display());
    Ok(())
}

/// Formats sizes as a table. Returns an error if the total is too large.
fn table(files: &[(String, u64)]) -> Result<String, String> {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let total: u64 = files.iter().map(|(_, size)| size).sum();
    let row = |name: &str, size| format!("{:>8.2} MiB  {name}\n", mib(size));
    let mut table: String = files.iter().map(|(name, size)| row(name, *size)).collect();
    table += &row("in all", total);
    if total > MOST_BYTES {
        return Err(format!("the kit is larger than {} MiB:\n{table}", MOST_BYTES >> 20));
    }
    Ok(table)
}

/// Copies the scenes of these numbers that are present, the shots of them, and the track.
fn copy_shared(shared: &Path, scenes: &[usize]) -> Result<(), String> {
    let source = env::var_os("LANTERNFISH_SHARED").map_or_else(|| workspace().join("../shared"), PathBuf::from);
    for scene in scenes.iter().map(|scene| SCENES[*scene]) {
        if source.join(scene).is_file() {
            files::copy(&source.join(scene), &shared.join(scene))?;
        } else {
            eprintln!("==> Left out: {scene} (not in {})", source.display());
        }
    }
    for (shot, _) in SHOTS.iter().filter(|(_, scene)| shared.join(SCENES[*scene]).is_file()) {
        copy_page(&(shot, PATHS), shared)?;
    }
    copy_page(&TRACK, shared)
}

/// Copies a page of `docs`. Each of its changes must apply once.
fn copy_page((name, changes): &Page, shared: &Path) -> Result<(), String> {
    let from = workspace().join("docs").join(name);
    let mut text = files::read(&from)?;
    for (old, new) in *changes {
        if text.matches(old).count() != 1 {
            return Err(format!("{}: {old:?} is not there once", from.display()));
        }
        text = text.replace(old, new);
    }
    files::write(&shared.join(name), text)
}

/// Packs every entry of `contents` into a tarball of the kit, and adds the scripts.
fn pack(contents: &Path, kit: &Path) -> Result<(), String> {
    let entries = at(contents, fs::read_dir(contents))?;
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name().to_string_lossy().into_owned();
        let tarball = kit.join(format!("{name}.tar.gz"));
        let mut tar = Command::new("tar");
        tar.args(["--owner=0", "--group=0", "--use-compress-program=gzip -9", "-cf"]).arg(tarball);
        step(tar.arg("-C").arg(contents).arg(name))?;
    }
    // The doctor's report states it.
    files::write(&kit.join("commit"), commit().unwrap_or_default())?;
    for (name, text) in SCRIPTS {
        let script = kit.join(name);
        files::write(&script, text)?;
        at(&script, make_executable(&script))?;
    }
    Ok(())
}

/// Makes a file executable.
fn make_executable(file: &Path) -> io::Result<()> {
    #[cfg(unix)]
    fs::set_permissions(file, std::os::unix::fs::PermissionsExt::from_mode(0o755))?;
    #[cfg(not(unix))]
    let _ = file;
    Ok(())
}
