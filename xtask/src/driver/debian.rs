//! What to install on Debian and Ubuntu, and how.

use std::{fs, path::Path, process::Command};

use super::{Purpose, sources};
use crate::{
    apt::{self, NO_INSTALL, as_root},
    command::run,
};

/// Mesa's drivers, the software one among them, and the loader that wgpu opens.
pub const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];
/// The first Mesa whose software driver has all that the renderer and its tests use.
const WANTED_MESA: u32 = 25;
/// The release whose own Mesa, 22.3.6, is older, and the one beside it that has a newer.
const OLD_RELEASE: &str = "bookworm";
const BACKPORTS: &str = "bookworm-backports";
/// Where the newer one is added to apt's sources.
const BACKPORTS_FILE: &str = "/etc/apt/sources.list.d/bookworm-backports.sources";

/// What decides.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Whether it is the release whose Mesa is too old.
    pub is_old_release: bool,
    /// The first number of the installed Mesa's version.
    pub mesa: Option<u32>,
    /// Whether the Vulkan loader is installed.
    pub has_loader: bool,
    /// Whether a graphics card's driver works.
    pub has_graphics_card: bool,
}

/// What there is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    Nothing,
    /// Install what the distribution has.
    Distributions,
    /// Install from the backports; where that fails and `has_one`, go on with the older driver.
    Backport {
        has_one: bool,
    },
}

impl Machine {
    pub fn look(has_graphics_card: bool) -> Self {
        let mesa = installed_version(PACKAGES[0]);
        Self {
            is_old_release: is_old_release(&fs::read_to_string("/etc/os-release").unwrap_or_default()),
            mesa: mesa.and_then(|version| version.split('.').next()?.parse().ok()),
            has_loader: installed_version(PACKAGES[1]).is_some(),
            has_graphics_card,
        }
    }
}

/// Beside a graphics card's driver nothing is replaced: there only tests get a software driver, if there is none, and the
/// distribution's.
pub fn plan(machine: &Machine, purpose: Purpose) -> Step {
    let has_one = machine.mesa.is_some() && machine.has_loader;
    let is_fit = has_one && machine.mesa >= Some(WANTED_MESA);
    match machine.has_graphics_card {
        true if purpose == Purpose::Pictures => Step::Nothing,
        false if machine.is_old_release && !is_fit => Step::Backport { has_one },
        _ if has_one => Step::Nothing,
        _ => Step::Distributions,
    }
}

pub fn install(step: Step) -> Result<(), String> {
    match step {
        Step::Nothing => Ok(()),
        Step::Distributions => {
            eprintln!(
                "==> No Vulkan driver: installing Mesa's software one ({NO_INSTALL} leaves the machine as it is)"
            );
            apt::install(&[], &PACKAGES)
        }
        Step::Backport { has_one } => {
            eprintln!(
                "==> Debian 12's software Vulkan driver is too old: installing Mesa {WANTED_MESA} from {BACKPORTS} \
                 ({NO_INSTALL} leaves the machine as it is)"
            );
            match install_backport() {
                Err(error) if has_one => {
                    eprintln!("warning: {error}; going on with the driver that is there");
                    Ok(())
                }
                result => result,
            }
        }
    }
}

fn install_backport() -> Result<(), String> {
    let sources = sources::read(Path::new("/etc/apt"));
    let is_added = !sources.iter().any(|source| source.offers(BACKPORTS));
    if is_added {
        let source = sources.iter().find(|source| source.offers(OLD_RELEASE));
        let source = source.ok_or("apt's sources name no mirror of bookworm to take backports from")?;
        write_as_root(BACKPORTS_FILE, &source.stanza(BACKPORTS))?;
    }
    let installed = apt::install(&["--target-release", BACKPORTS], &PACKAGES);
    if installed.is_err() && is_added {
        // A mirror without backports would fail every update from now on.
        run(&mut as_root(&["rm", "--force", BACKPORTS_FILE])?)?;
    }
    installed
}

fn write_as_root(path: &str, text: &str) -> Result<(), String> {
    let aside = std::env::temp_dir().join(format!("lanternfish-source-{}", std::process::id()));
    fs::write(&aside, text).map_err(|error| format!("{}: {error}", aside.display()))?;
    let aside_name = aside.to_string_lossy();
    let written = as_root(&["install", "--mode=644", &aside_name, path]).and_then(|mut command| run(&mut command));
    let _ = fs::remove_file(&aside);
    written
}

/// The version of an installed package.
fn installed_version(package: &str) -> Option<String> {
    let mut query = Command::new("dpkg-query");
    let output = query.args(["--show", "--showformat=${db:Status-Status} ${Version}\\n", package]).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().find_map(|line| line.strip_prefix("installed ")).map(str::to_owned)
}

/// Whether `/etc/os-release` is that of the release whose Mesa is too old.
fn is_old_release(os_release: &str) -> bool {
    let is = |name: &str, value: &str| {
        let found = os_release.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        found.is_some_and(|found| found.trim_matches('"') == value)
    };
    is("ID", "debian") && is("VERSION_CODENAME", OLD_RELEASE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_debian_12_is_old() {
        let debian = "PRETTY_NAME=\"Debian GNU/Linux 12 (bookworm)\"\nVERSION_CODENAME=bookworm\nID=debian\n";
        assert!(is_old_release(debian));
        assert!(is_old_release(&debian.replace("=bookworm", "=\"bookworm\"")));
        for other in ["VERSION_CODENAME=trixie\nID=debian\n", "VERSION_CODENAME=bookworm\nID=other\n", ""] {
            assert!(!is_old_release(other), "{other}");
        }
    }

    #[test]
    fn a_driver_is_installed_where_there_is_none_or_none_that_is_fit() {
        let of = |is_old_release, mesa, has_graphics_card, purpose| {
            let machine = Machine { is_old_release, mesa, has_loader: mesa.is_some(), has_graphics_card };
            plan(&machine, purpose)
        };
        for purpose in [Purpose::Pictures, Purpose::Tests] {
            // Debian 12 without a graphics card.
            assert_eq!(of(true, None, false, purpose), Step::Backport { has_one: false });
            assert_eq!(of(true, Some(22), false, purpose), Step::Backport { has_one: true });
            assert_eq!(of(true, Some(25), false, purpose), Step::Nothing);
            // Elsewhere the distribution's driver, however old.
            assert_eq!(of(false, None, false, purpose), Step::Distributions);
            assert_eq!(of(false, Some(23), false, purpose), Step::Nothing);
            // What drives a graphics card stays as it is.
            assert_eq!(of(true, Some(22), true, purpose), Step::Nothing);
            assert_eq!(of(false, Some(23), true, purpose), Step::Nothing);
        }
        // Another maker's card brings no software driver.
        for is_old_release in [true, false] {
            assert_eq!(of(is_old_release, None, true, Purpose::Pictures), Step::Nothing);
            assert_eq!(of(is_old_release, None, true, Purpose::Tests), Step::Distributions);
        }
        let no_loader = Machine { is_old_release: true, mesa: Some(25), has_loader: false, has_graphics_card: false };
        assert_eq!(plan(&no_loader, Purpose::Pictures), Step::Backport { has_one: false });
    }
}
