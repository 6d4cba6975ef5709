//! The programs: one links shaders, the other compiles them with RADV.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use super::figures::Compiled;
use crate::{
    command::{cargo, run, run_for_output, run_with_input, workspace},
    files::at,
};

/// The compiler of RADV, built and opened.
pub struct Tool {
    program: PathBuf,
    /// Mesa's version, such as 25.0.7.
    pub mesa: String,
}

impl Tool {
    /// Builds the tool. `Ok(Err(reason))` if this machine cannot run it.
    pub fn ready() -> Result<Result<Self, String>, String> {
        let crate_manifest = workspace().join("shader-stats/Cargo.toml");
        let target = folder("build");
        let mut build = cargo(["build", "--quiet", "--locked", "--manifest-path"]);
        run(build.arg(crate_manifest).arg("--target-dir").arg(&target))?;
        let program = target.join("debug/lanternfish-shader-stats");
        let mut tool = Self { program, mesa: String::new() };
        let described = tool.command(super::CARDS[0]).output().map_err(|error| error.to_string())?;
        if !described.status.success() {
            let said = String::from_utf8_lossy(&described.stderr);
            let reason = said.trim().trim_start_matches("error: ");
            return Ok(Err(format!("no RADV of Mesa (Debian, Ubuntu: mesa-vulkan-drivers): {reason}")));
        }
        let driver = String::from_utf8_lossy(&described.stdout);
        tool.mesa = version(&driver).ok_or_else(|| format!("no version of Mesa: {driver}"))?;
        Ok(Ok(tool))
    }

    fn command(&self, card: &str) -> Command {
        let mut command = Command::new(&self.program);
        command.env("RADV_FORCE_FAMILY", card).env("VK_LOADER_DRIVERS_SELECT", "*radeon*");
        // The driver keeps no statistics with the shaders that it keeps.
        command.env("MESA_SHADER_CACHE_DISABLE", "1");
        command
    }

    /// Compiles the shaders of a folder for a card.
    pub fn compile(&self, card: &str, shaders: &Path) -> Result<Vec<Compiled>, String> {
        let table = run_for_output(self.command(card).arg(shaders))?;
        Compiled::read(table.split_once('\n').map_or("", |(_, table)| table))
    }
}

/// The shaders to link.
pub enum Wanted {
    /// Every file in its usual variants.
    Usual,
    /// Every variant whose name contains this.
    Containing(String),
    /// Those of these names.
    Named(Vec<String>),
}

/// Links shaders. Returns their folder.
///
/// The example is built as `cargo xtask test` builds it, so nothing is compiled twice.
pub fn link(wanted: &Wanted) -> Result<PathBuf, String> {
    let shaders = folder("shaders");
    if shaders.exists() {
        at(&shaders, fs::remove_dir_all(&shaders))?;
    }
    run(&mut cargo(["build", "--quiet", "--workspace", "--example", "link_shaders"]))?;
    let here = env::current_exe().map_err(|error| format!("path of this program: {error}"))?;
    let mut example = Command::new(here.with_file_name("examples").join("link_shaders"));
    example.arg(&shaders);
    match wanted {
        Wanted::Usual => run(&mut example),
        Wanted::Containing(text) => run(example.args(["--containing", text])),
        Wanted::Named(names) => run_with_input(example.arg("-"), &names.join("\n")),
    }?;
    Ok(shaders)
}

fn folder(name: &str) -> PathBuf {
    workspace().join("target/shader-stats").join(name)
}

/// The version in a driver's description: `Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)`.
fn version(driver: &str) -> Option<String> {
    let words = driver.split_once("Mesa ")?.1;
    let version = words.split(|c: char| !c.is_ascii_digit() && c != '.').next()?;
    (!version.is_empty()).then(|| version.to_owned())
}

/// The version of naga in a `Cargo.lock`.
pub fn naga(lock: &str) -> Option<&str> {
    lock.split_once("name = \"naga\"\nversion = \"")?.1.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read() {
        assert_eq!(version("Mesa 25.0.7-2~bpo12+1\n").as_deref(), Some("25.0.7"));
        assert_eq!(version("amdvlk 2025.Q1"), None);
    }

    #[test]
    fn the_tool_writes_spirv_as_the_renderer_does() {
        let lock = |path| fs::read_to_string(workspace().join(path)).expect("there is a lock file");
        let [own, renderer] = ["shader-stats/Cargo.lock", "Cargo.lock"].map(lock);
        assert_eq!(naga(&own).expect("it has naga"), naga(&renderer).expect("it has naga"), "the versions of naga");
    }
}
