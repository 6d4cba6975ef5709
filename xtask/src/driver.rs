//! A graphics driver, where there is none: Mesa's software one.
//!
//! Only Linux can be without: on macOS and Windows the system brings Metal and Direct3D.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

use crate::command::{find_program, run, succeeds};

/// Debian's and Ubuntu's packages: the loader that wgpu opens, and Mesa's drivers, the software one among them.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Installs a software driver unless this machine has a loader and any driver.
///
/// Quick, and no proof: a driver whose hardware is not there counts. [`ensure_adapter`] is sure.
pub fn ensure_driver() -> Result<(), String> {
    if !cfg!(target_os = "linux") || (has_loader() && has_driver()) {
        return Ok(());
    }
    eprintln!("No Vulkan driver found; installing Mesa's software driver.");
    install()
}

/// Installs a software driver unless `list_adapters` (a built `lanternfish info --adapters`) finds an adapter.
pub fn ensure_adapter(mut list_adapters: impl FnMut() -> Command) -> Result<(), String> {
    if succeeds(&mut list_adapters()) {
        return Ok(());
    }
    if cfg!(target_os = "linux") {
        eprintln!("The drivers of this machine offer no adapter; installing Mesa's software driver.");
        install()?;
        if succeeds(&mut list_adapters()) {
            return Ok(());
        }
    }
    Err("no graphics adapter found, and installing a driver did not help: `lanternfish info --adapters` and \
         `vulkaninfo --summary` may say why"
        .to_owned())
}

fn install() -> Result<(), String> {
    let packages = PACKAGES.join(" ");
    if find_program("apt-get").is_none() {
        return Err(format!(
            "no Vulkan driver, and this is not Debian or Ubuntu: install Mesa's software driver and the Vulkan loader \
             by your system's own means (Fedora: mesa-vulkan-drivers vulkan-loader; Arch: vulkan-swrast \
             vulkan-icd-loader; Alpine: mesa-vulkan-swrast vulkan-loader; Debian: {packages}), then try again"
        ));
    }
    // Standing sources may be partly out of reach: whether the install works is what counts.
    if let Err(error) = run(&mut apt_get(&["update"])?) {
        eprintln!("{error}; trying all the same");
    }
    let words: Vec<&str> = ["install", "--yes", "--no-install-recommends"].into_iter().chain(PACKAGES).collect();
    run(&mut apt_get(&words)?).map_err(|error| format!("{error}\n\nInstall {packages} by hand, then try again"))
}

/// `apt-get` as root, directly or through sudo.
fn apt_get(words: &[&str]) -> Result<Command, String> {
    let root = Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    let mut command = if root {
        Command::new("env")
    } else if let Some(sudo) = find_program("sudo") {
        let mut command = Command::new(sudo);
        command.arg("env");
        command
    } else {
        return Err(format!(
            "no Vulkan driver, and no right to install one: run `apt-get install {}` as root, then try again",
            PACKAGES.join(" ")
        ));
    };
    command.args(["DEBIAN_FRONTEND=noninteractive", "apt-get"]).args(words);
    Ok(command)
}

/// Whether the dynamic linker will find the Vulkan loader.
fn has_loader() -> bool {
    let mut folders: Vec<PathBuf> =
        ["/usr/lib", "/usr/lib64", "/lib", "/lib64", "/usr/local/lib"].iter().map(PathBuf::from).collect();
    // Debian's and Ubuntu's folders by architecture, e.g. x86_64-linux-gnu.
    folders.extend(subfolders("/usr/lib"));
    folders.extend(subfolders("/lib"));
    folders.extend(env::split_paths(&env::var_os("LD_LIBRARY_PATH").unwrap_or_default()));
    folders.iter().any(|folder| folder.join("libvulkan.so.1").exists())
}

fn subfolders(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect()
}

/// Whether the loader will find a driver's manifest, by its own rules.
fn has_driver() -> bool {
    // These variables replace the search.
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        if let Some(files) = env::var_os(variable) {
            return env::split_paths(&files).any(|path| path.is_file() || has_manifest(&path));
        }
    }
    let home = env::var_os("HOME").map(PathBuf::from);
    let in_home = |folder: &str| home.as_ref().map(|home| home.join(folder));
    let mut roots: Vec<PathBuf> =
        ["/etc", "/etc/xdg", "/usr/local/etc", "/usr/local/share", "/usr/share"].iter().map(PathBuf::from).collect();
    roots.extend(in_home(".config"));
    roots.extend(in_home(".local/share"));
    for variable in ["XDG_CONFIG_HOME", "XDG_CONFIG_DIRS", "XDG_DATA_HOME", "XDG_DATA_DIRS"] {
        roots.extend(env::split_paths(&env::var_os(variable).unwrap_or_default()));
    }
    roots.iter().any(|root| has_manifest(&root.join("vulkan/icd.d")))
}

fn has_manifest(folder: &Path) -> bool {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).any(|path| path.extension().is_some_and(|ending| ending == "json"))
}
