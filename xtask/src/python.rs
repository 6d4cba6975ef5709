//! `cargo xtask python`: builds the wheel, installs it in a folder, and runs the tests of the Python package with pytest; with
//! `--quick` those that show whether the wheel works at all.

use std::{
    env::{self, consts},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    command::{cargo, run as step, succeeds, workspace},
    test::keep_shaders,
};

/// What the tests import.
const MODULES: &str = "import numpy, pytest, trimesh, PIL, wheel, pip";
const PACKAGES: [&str; 6] = ["numpy", "pytest", "trimesh", "pillow", "maturin", "wheel"];

/// What `--quick` runs.
const QUICK: &str = "tests/test_smoke.py";

/// `words` go to pytest.
pub fn run(words: &[String]) -> Result<(), String> {
    // With the tests, as `cargo xtask test` builds them: without them dependencies have other features, and all are built again.
    step(&mut cargo(["build", "--workspace", "--lib", "--bins", "--tests"]))?;
    // Built beside this program.
    let here = env::current_exe().map_err(|error| format!("path of this program: {error}"))?;
    let built = here.parent().expect("a program lies in a folder");
    let folder = workspace().join("target/python");
    let Some(python) = python(&folder) else {
        eprintln!(
            "LEFT OUT (tool): python: no python3 with a venv into which {} can be installed",
            PACKAGES.join(", ")
        );
        return Ok(());
    };
    let source = workspace().join("crates/lanternfish-python");
    let installed = install(&python, &source, built, &folder)?;
    let mut tests = Command::new(python);
    let words = words.iter().map(|word| if word == "--quick" { QUICK } else { word });
    tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]).args(words).current_dir(&source);
    tests.env("PYTHONPATH", &installed).env("PYTHONDONTWRITEBYTECODE", "1");
    tests.env("LANTERNFISH_PROGRAM", built.join(format!("lanternfish{}", consts::EXE_SUFFIX)));
    keep_shaders(&mut tests);
    step(&mut tests)
}

/// A Python that has the modules: the machine's, or one in a virtual environment, which is made once.
fn python(folder: &Path) -> Option<PathBuf> {
    let succeed = |python: &Path, words: &[&str]| succeeds(Command::new(python).args(words));
    // Maturin's module needs its program beside Python's.
    let has_modules =
        |python: &Path| succeed(python, &["-c", MODULES]) && succeed(python, &["-m", "maturin", "--version"]);
    let environment = folder.join("venv");
    let own = environment.join("bin/python");
    let known = [PathBuf::from("python3"), own.clone()].into_iter().find(|python| has_modules(python));
    known.or_else(|| {
        step(Command::new("python3").args(["-m", "venv"]).arg(&environment)).ok()?;
        step(Command::new(&own).args(["-m", "pip", "install", "--quiet"]).args(PACKAGES)).ok()?;
        Some(own).filter(|own| has_modules(own))
    })
}

/// Packs a wheel of the module that was built, with the metadata that maturin gives a release, and installs it in a folder, which is
/// returned. Maturin would build all again: for one package alone dependencies have other features.
fn install(python: &Path, source: &Path, built: &Path, folder: &Path) -> Result<PathBuf, String> {
    let [content, wheels, installed] = ["content", "wheels", "installed"].map(|name| folder.join(name));
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    for made in [&content, &wheels, &installed] {
        if made.exists() {
            fs::remove_dir_all(made).map_err(failed)?;
        }
        fs::create_dir_all(made).map_err(failed)?;
    }
    let module = |words: &[&str]| {
        let mut command = Command::new(python);
        command.arg("-m").args(words).current_dir(source);
        command
    };
    let metadata = ["maturin", "pep517", "write-dist-info", "--interpreter", "python3", "--metadata-directory"];
    step(module(&metadata).arg(&content).stdout(std::process::Stdio::null()))?;
    package(source, built, &content.join("lanternfish")).map_err(failed)?;
    step(module(&["wheel", "pack", "--dest-dir"]).arg(&wheels).arg(&content))?;
    let wheel = fs::read_dir(&wheels).map_err(failed)?.flatten().map(|entry| entry.path()).next();
    let wheel = wheel.ok_or_else(|| format!("{}: no wheel", wheels.display()))?;
    let quiet = ["pip", "install", "--quiet", "--no-deps", "--no-index", "--no-warn-script-location", "--target"];
    step(module(&quiet).arg(&installed).arg(wheel))?;
    Ok(installed)
}

/// Makes the package of its Python files and the extension module, as the wheel has them.
fn package(source: &Path, built: &Path, package: &Path) -> std::io::Result<()> {
    fs::create_dir_all(package)?;
    for file in fs::read_dir(source.join("python/lanternfish"))? {
        let file = file?;
        if file.file_type()?.is_file() {
            fs::copy(file.path(), package.join(file.file_name()))?;
        }
    }
    let module = format!("{}lanternfish_python{}", consts::DLL_PREFIX, consts::DLL_SUFFIX);
    fs::copy(built.join(module), package.join("_lanternfish.abi3.so")).map(|_| ())
}
