//! `cargo xtask python`: builds the extension module and runs the tests of the Python package with pytest.

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
const MODULES: &str = "import numpy, pytest, trimesh, PIL";
const PACKAGES: [&str; 4] = ["numpy", "pytest", "trimesh", "pillow"];

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
    package(&source, built, &folder.join("lanternfish")).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut tests = Command::new(python);
    tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]).args(words).current_dir(&source);
    tests.env("PYTHONPATH", &folder).env("PYTHONDONTWRITEBYTECODE", "1");
    tests.env("LANTERNFISH_PROGRAM", built.join(format!("lanternfish{}", consts::EXE_SUFFIX)));
    keep_shaders(&mut tests);
    step(&mut tests)
}

/// A Python that has the modules: the machine's, or one in a virtual environment, which is made once.
fn python(folder: &Path) -> Option<PathBuf> {
    let has_modules = |python: &Path| succeeds(Command::new(python).args(["-c", MODULES]));
    let environment = folder.join("venv");
    let own = environment.join("bin/python");
    let known = [PathBuf::from("python3"), own.clone()].into_iter().find(|python| has_modules(python));
    known.or_else(|| {
        step(Command::new("python3").args(["-m", "venv", "--system-site-packages"]).arg(&environment)).ok()?;
        step(Command::new(&own).args(["-m", "pip", "install", "--quiet"]).args(PACKAGES)).ok()?;
        Some(own).filter(|own| has_modules(own))
    })
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
