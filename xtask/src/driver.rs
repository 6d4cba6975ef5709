//! Installs Mesa's software driver if there is no suitable driver: on Debian and its derivatives, as root or through
//! sudo. macOS and Windows include a driver. One that may be a graphics card's own is never replaced.

use std::{fs, path::Path, process::Command};

use crate::command::{find_program, run, succeeds};

/// The flag that forbids installing anything.
pub const NO_INSTALL: &str = "--no-driver-install";
/// Installs Mesa's drivers and the Vulkan loader that wgpu opens. Some of apt's sources may be unreachable.
const INSTALL: &str = "apt-get update; DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends \
                       mesa-vulkan-drivers libvulkan1";
/// Before [`INSTALL`]: adds Debian 12's backports to apt's sources, unless they are there, and removes them after a
/// failure, which would make every later update fail.
const FROM_BACKPORTS: &str = r"
file=/etc/apt/sources.list.d/lanternfish-bookworm-backports.sources
trap 'test $? = 0 || rm -f $file' EXIT
grep -rqs '^[^#]*bookworm-backports' /etc/apt/sources.list /etc/apt/sources.list.d || printf '%s\n' 'Types: deb' \
    'URIs: http://deb.debian.org/debian' 'Suites: bookworm-backports' 'Components: main' \
    'Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg' > $file
";

/// Installs what is missing if there certainly is no graphics card: before the build, while the user can enter a
/// password.
pub fn before_build(may_install: bool) -> Result<(), String> {
    if may_install && !may_have_graphics_card() { install() } else { Ok(()) }
}

/// Installs what is missing if `list_adapters` (a built `lanternfish info --adapters`) lists no adapter, or for tests,
/// which run on software even beside a graphics card, none of software. Returns an error if there is no adapter then.
pub fn after_build(may_install: bool, is_test: bool, list_adapters: impl Fn() -> Command) -> Result<(), String> {
    let list = || list_adapters().output().ok().filter(|output| output.status.success());
    let is_enough = |adapters: &[u8]| !is_test || String::from_utf8_lossy(adapters).contains(" Cpu,");
    if may_install && !list().is_some_and(|output| is_enough(&output.stdout)) {
        install()?;
    }
    let advice = "no graphics adapter found. Mesa's software driver is enough; as root: `apt-get install mesa-vulkan-drivers \
                  libvulkan1` (Debian, Ubuntu), `dnf install mesa-vulkan-drivers vulkan-loader` (Fedora), `pacman -S \
                  vulkan-swrast vulkan-icd-loader` (Arch), `apk add mesa-vulkan-swrast vulkan-loader` (Alpine)";
    list().map(drop).ok_or_else(|| advice.to_owned())
}

/// True if the kernel shows a device that a graphics card's driver may use. A virtual machine may show one without a
/// driver.
fn may_have_graphics_card() -> bool {
    let mut devices = fs::read_dir("/dev/dri").into_iter().flatten().flatten();
    devices.any(|entry| entry.file_name().to_string_lossy().starts_with("renderD"))
        || ["/dev/nvidiactl", "/dev/dxg"].iter().any(|path| Path::new(path).exists())
}

fn install() -> Result<(), String> {
    if !cfg!(target_os = "linux") || find_program("apt-get").is_none() {
        return Ok(());
    }
    let [mesa, loader] = ["mesa-vulkan-drivers", "libvulkan1"].map(major_version);
    let is_debian_12 = succeeds(Command::new("sh").args(["-c", ". /etc/os-release && test $ID$VERSION_ID = debian12"]));
    if is_debian_12 && mesa.is_none_or(|mesa| mesa < 25 && !may_have_graphics_card()) {
        let script = format!("{FROM_BACKPORTS}{INSTALL} --target-release bookworm-backports");
        let Err(error) = as_root(&script) else { return Ok(()) };
        eprintln!("warning: {error}\ngoing on with Debian 12's own driver, which is slow, and wrong with many lights");
    }
    if mesa.is_some() && loader.is_some() { Ok(()) } else { as_root(INSTALL) }
}

/// The major version of an installed package.
fn major_version(package: &str) -> Option<u32> {
    let query = ["--show", "--showformat=${db:Status-Status} ${Version}\\n", package];
    let text = String::from_utf8(Command::new("dpkg-query").args(query).output().ok()?.stdout).ok()?;
    text.lines().find_map(|line| line.strip_prefix("installed ")?.split('.').next()?.parse().ok())
}

/// Runs a script as root, directly or through sudo.
fn as_root(script: &str) -> Result<(), String> {
    let is_root = succeeds(Command::new("sh").args(["-c", "test $(id -u) = 0"]));
    eprintln!("==> No suitable Vulkan driver: installing Mesa's software one ({NO_INSTALL} prevents that)");
    if !is_root && find_program("sudo").is_none() {
        return Err(format!("run this as root, or call the task with {NO_INSTALL}:\n{script}"));
    }
    run(Command::new(if is_root { "env" } else { "sudo" }).args(["sh", "-c", script]))
}

#[test]
fn without_an_adapter_the_error_states_what_to_type() {
    let error = after_build(false, false, || Command::new("no-such-program-at-all")).unwrap_err();
    assert!(error.contains("apt-get install mesa-vulkan-drivers libvulkan1"), "{error}");
}
