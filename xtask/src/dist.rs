//! `cargo xtask dist`: the program as an archive for Linux.

use std::{fmt::Write as _, fs, path::Path, process::Command};

use serde_json::Value;

use crate::{
    command::{cargo, find_program, run, run_for_output, workspace},
    files::{self, at},
};

/// What the program is built for: x86-64 Linux with this version of glibc or a newer one.
const TARGET: &str = "x86_64-unknown-linux-gnu";
const GLIBC: (u32, u32) = (2, 28);

/// Builds the program in the profile `dist`, linked to an old glibc by zig, and packs it with the texts of all licences into
/// `target/archive/lanternfish-VERSION-x86_64-linux.tar.gz`. Vulkan is opened at run time.
pub fn run_dist() -> Result<(), String> {
    if find_program("cargo-zigbuild").is_none() {
        return Err(
            "no cargo-zigbuild, which links to an old glibc: pip install cargo-zigbuild ziglang==0.15.2".to_owned()
        );
    }
    let (major, minor) = GLIBC;
    let target = format!("{TARGET}.{major}.{minor}");
    run(&mut cargo(["zigbuild", "--profile", "dist", "--target", &target, "--package", "lanternfish-cli"]))?;

    let program = workspace().join(format!("target/{TARGET}/dist/lanternfish"));
    let bytes = at(&program, fs::read(&program))?;
    let needed = newest_glibc(&bytes).ok_or("the program names no version of glibc")?;
    if needed > GLIBC {
        return Err(format!("the program needs glibc {}.{}, not {major}.{minor}", needed.0, needed.1));
    }

    let mut metadata = cargo(["metadata", "--format-version", "1", "--filter-platform", TARGET]);
    let metadata = run_for_output(metadata.args(["--manifest-path", "crates/lanternfish-cli/Cargo.toml"]))?;
    let metadata: Value = serde_json::from_str(&metadata).map_err(|error| error.to_string())?;
    let version = version(&metadata)?;
    let name = format!("lanternfish-{version}-x86_64-linux");
    let folder = workspace().join("target/archive").join(&name);
    files::write(&folder.join("lanternfish"), &bytes)?;
    files::write(&folder.join("LICENSES-OF-DEPENDENCIES.txt"), licences(&metadata)?)?;
    for file in ["LICENSE-APACHE", "LICENSE-MIT", "README.md", "CHANGELOG.md"] {
        files::copy(&workspace().join(file), &folder.join(file))?;
    }
    run(Command::new("chmod").arg("755").arg(folder.join("lanternfish")))?;
    let archive = folder.with_file_name(format!("{name}.tar.gz"));
    let tar = ["--owner=0", "--group=0", "--use-compress-program=gzip -9", "-cf"];
    run(Command::new("tar").args(tar).arg(&archive).arg("-C").arg(workspace().join("target/archive")).arg(&name))?;
    let size = at(&archive, fs::metadata(&archive))?.len();
    println!("{} ({:.1} MB; glibc {}.{} or newer)", archive.display(), size as f64 / 1e6, needed.0, needed.1);
    Ok(())
}

/// The newest version of glibc that a program names among its symbols.
fn newest_glibc(program: &[u8]) -> Option<(u32, u32)> {
    const NAME: &[u8] = b"GLIBC_";
    let named = program.windows(NAME.len()).enumerate().filter(|(_, window)| *window == NAME);
    let version = |(at, _): (usize, &[u8])| {
        let text = &program[at + NAME.len()..];
        let end = text.iter().position(|byte| !byte.is_ascii_digit() && *byte != b'.')?;
        let (major, minor) = std::str::from_utf8(&text[..end]).ok()?.split_once('.')?;
        Some((major.parse().ok()?, minor.split('.').next()?.parse().ok()?))
    };
    named.filter_map(version).max()
}

/// The version of the command line.
fn version(metadata: &Value) -> Result<&str, String> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let program =
        packages.filter(|package| package["name"] == "lanternfish-cli").find_map(|package| package["version"].as_str());
    program.ok_or_else(|| "cargo metadata names no lanternfish-cli".to_owned())
}

/// Name, version and licence of each package, and the texts of its licences.
fn licences(metadata: &Value) -> Result<String, String> {
    let mut all = String::new();
    for package in metadata["packages"].as_array().ok_or("cargo metadata names no packages")? {
        if package["source"].is_null() {
            continue;
        }
        let text = |key: &str| package[key].as_str().unwrap_or("not stated");
        let _ = writeln!(all, "{}\n{} {}: {}\n", "=".repeat(80), text("name"), text("version"), text("license"));
        let folder = Path::new(text("manifest_path")).parent().ok_or("a manifest lies in no folder")?;
        let mut files: Vec<_> = at(folder, fs::read_dir(folder))?.filter_map(Result::ok).collect();
        files.sort_by_key(fs::DirEntry::file_name);
        let is_licence = |file: &fs::DirEntry| {
            let name = file.file_name().to_string_lossy().to_ascii_uppercase();
            ["LICENSE", "LICENCE", "COPYING", "NOTICE", "COPYRIGHT"].iter().any(|start| name.starts_with(start))
        };
        for file in files.iter().filter(|file| is_licence(file) && file.path().is_file()) {
            let _ = writeln!(all, "{}\n", String::from_utf8_lossy(&at(folder, fs::read(file.path()))?));
        }
    }
    Ok(all)
}

#[test]
fn the_newest_glibc_is_found() {
    assert_eq!(newest_glibc(b"GLIBC_2.2.5\0GLIBC_2.28\0GLIBC_2.4\0GLIBC_PRIVATE\0"), Some((2, 28)));
    assert_eq!(newest_glibc(b"musl"), None);
}
