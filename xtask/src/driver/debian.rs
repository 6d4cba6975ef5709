//! Packages to install on Debian and Ubuntu.

use std::{fs, path::Path, process::Command};

use super::{
    Purpose,
    sources::{self, Source},
};
use crate::{
    apt::{self, NO_INSTALL, as_root},
    command::{run, run_with_input},
};

/// Mesa's drivers, including the software one, and the Vulkan loader that wgpu opens.
pub const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];
/// The first version of Mesa whose software driver supports everything that the renderer and its tests use.
const WANTED_MESA: u32 = 25;
/// The release with an older Mesa, 22.3.6, whose backports have a newer one.
const OLD_RELEASE: &str = "bookworm";
const BACKPORTS: &str = "bookworm-backports";
/// Other names of that release in the sources of a machine.
const OLD_RELEASE_ALIASES: [&str; 2] = ["oldstable", "stable"];
/// The file that adds the backports to apt's sources. The name is unique to this project.
const BACKPORTS_FILE: &str = "/etc/apt/sources.list.d/lanternfish-bookworm-backports.sources";

/// The state of the machine on which the plan depends.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// True for the release whose Mesa is too old.
    pub is_old_release: bool,
    /// The major version of the installed Mesa.
    pub mesa: Option<u32>,
    /// True if the Vulkan loader is installed.
    pub has_loader: bool,
    /// True if a graphics card's driver works.
    pub has_graphics_card: bool,
    /// True if there may be a card that this user's list of adapters lacks, e.g. for a user outside the group `render`.
    pub may_have_graphics_card: bool,
}

/// The installation to perform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    Nothing,
    /// Install the distribution's packages.
    Distributions,
    /// Install from the backports. If that fails, continue with the older driver: the installed one if `has_one`, or the
    /// distribution's.
    Backport {
        has_one: bool,
    },
}

impl Machine {
    pub fn look(has_graphics_card: bool, may_have_graphics_card: bool) -> Self {
        let mesa = installed_version(PACKAGES[0]);
        Self {
            is_old_release: is_old_release(&fs::read_to_string("/etc/os-release").unwrap_or_default()),
            mesa: mesa.and_then(|version| version.split('.').next()?.parse().ok()),
            has_loader: installed_version(PACKAGES[1]).is_some(),
            has_graphics_card,
            may_have_graphics_card,
        }
    }
}

/// If there may be a graphics card, no driver is replaced, because it may be the card's own. Beside a working card, only tests
/// get a software driver, from the distribution, if there is none.
pub fn plan(machine: &Machine, purpose: Purpose) -> Step {
    let has_one = machine.mesa.is_some() && machine.has_loader;
    let is_fit = has_one && machine.mesa >= Some(WANTED_MESA);
    let may_replace = !machine.may_have_graphics_card || machine.mesa.is_none();
    match machine.has_graphics_card {
        true if purpose == Purpose::RenderedImages => Step::Nothing,
        false if machine.is_old_release && !is_fit && may_replace => Step::Backport { has_one },
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
            backport_or_older(has_one, install_backport, || apt::install(&[], &PACKAGES))
        }
    }
}

/// Installs the newer driver. If that fails, keeps the installed older one, or installs the distribution's.
fn backport_or_older(
    has_one: bool,
    backport: impl FnOnce() -> Result<(), String>,
    distributions: impl FnOnce() -> Result<(), String>,
) -> Result<(), String> {
    match backport() {
        Ok(()) => Ok(()),
        Err(error) if has_one => {
            eprintln!("warning: {error}; continuing with the installed driver");
            Ok(())
        }
        Err(error) => {
            eprintln!("warning: {error}; installing Debian 12's own driver, which is slow, and wrong with many lights");
            distributions()
        }
    }
}

fn install_backport() -> Result<(), String> {
    let sources = sources::read(Path::new("/etc/apt"));
    let is_added = !sources.iter().any(|source| source.offers(BACKPORTS));
    if is_added {
        let source = mirror(&sources).ok_or("apt's sources name no mirror of bookworm to take backports from")?;
        run_with_input(&mut as_root(&["tee", BACKPORTS_FILE])?, &source.stanza(BACKPORTS))?;
    }
    let installed = apt::install(&["--target-release", BACKPORTS], &PACKAGES);
    if installed.is_err() && is_added {
        // A mirror without backports would make every later update fail.
        if let Err(error) = as_root(&["rm", "--force", BACKPORTS_FILE]).and_then(|mut rm| run(&mut rm)) {
            eprintln!("warning: {error}; {BACKPORTS_FILE} stays");
        }
    }
    installed
}

/// Debian's own source or one of its mirrors; else the first source with a release of this name.
fn mirror(sources: &[Source]) -> Option<&Source> {
    let has_release =
        |source: &&Source| source.offers(OLD_RELEASE) || OLD_RELEASE_ALIASES.iter().any(|alias| source.offers(alias));
    sources.iter().filter(has_release).min_by_key(|source| source.strangeness())
}

/// The version of an installed package.
fn installed_version(package: &str) -> Option<String> {
    let mut query = Command::new("dpkg-query");
    let output = query.args(["--show", "--showformat=${db:Status-Status} ${Version}\\n", package]).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().find_map(|line| line.strip_prefix("installed ")).map(str::to_owned)
}

/// True if `/etc/os-release` describes the release whose Mesa is too old.
fn is_old_release(os_release: &str) -> bool {
    let is = |name: &str, value: &str| {
        let actual = os_release.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        actual.is_some_and(|actual| actual.trim_matches('"') == value)
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
    fn a_driver_is_installed_if_none_is_suitable() {
        let of = |is_old_release, mesa: Option<u32>, has_graphics_card, purpose| {
            let has_loader = mesa.is_some();
            let may_have_graphics_card = has_graphics_card;
            let machine = Machine { is_old_release, mesa, has_loader, has_graphics_card, may_have_graphics_card };
            plan(&machine, purpose)
        };
        for purpose in [Purpose::RenderedImages, Purpose::Tests] {
            // Debian 12 without a graphics card.
            assert_eq!(of(true, None, false, purpose), Step::Backport { has_one: false });
            assert_eq!(of(true, Some(22), false, purpose), Step::Backport { has_one: true });
            assert_eq!(of(true, Some(25), false, purpose), Step::Nothing);
            // Elsewhere the distribution's driver, of any version.
            assert_eq!(of(false, None, false, purpose), Step::Distributions);
            assert_eq!(of(false, Some(23), false, purpose), Step::Nothing);
            // A graphics card's driver is not changed.
            assert_eq!(of(true, Some(22), true, purpose), Step::Nothing);
            assert_eq!(of(false, Some(23), true, purpose), Step::Nothing);
        }
        // The driver of another vendor's card includes no software driver.
        for is_old_release in [true, false] {
            assert_eq!(of(is_old_release, None, true, Purpose::RenderedImages), Step::Nothing);
            assert_eq!(of(is_old_release, None, true, Purpose::Tests), Step::Distributions);
        }
        let no_loader = Machine {
            is_old_release: true,
            mesa: Some(25),
            has_loader: false,
            has_graphics_card: false,
            may_have_graphics_card: false,
        };
        assert_eq!(plan(&no_loader, Purpose::RenderedImages), Step::Backport { has_one: false });
        // A card that the list lacks, as for a user outside the group `render`: its driver is kept.
        let hidden = Machine { mesa: Some(22), has_loader: true, may_have_graphics_card: true, ..no_loader };
        for purpose in [Purpose::RenderedImages, Purpose::Tests] {
            assert_eq!(plan(&hidden, purpose), Step::Nothing);
            assert_eq!(plan(&Machine { has_loader: false, ..hidden }, purpose), Step::Distributions);
            assert_eq!(plan(&Machine { mesa: None, ..hidden }, purpose), Step::Backport { has_one: false });
        }
    }

    #[test]
    fn without_backports_the_older_driver_is_used() {
        let fails = || Err("no backports here".to_owned());
        let never = || panic!("the installed driver suffices");
        assert_eq!(backport_or_older(true, fails, never), Ok(()));
        assert_eq!(backport_or_older(false, || Ok(()), never), Ok(()));
        assert_eq!(backport_or_older(false, fails, || Ok(())), Ok(()));
        assert_eq!(backport_or_older(false, fails, || Err("nor this".to_owned())), Err("nor this".to_owned()));
    }

    #[test]
    fn backports_come_from_debian_and_not_from_third_parties() {
        let source = |uri: &str, suite: &str, components: &str, signed_by: &str| Source {
            uris: uri.to_owned(),
            suites: vec![suite.to_owned()],
            components: components.to_owned(),
            signed_by: signed_by.to_owned(),
            options: Vec::new(),
        };
        let adoptium = source("https://packages.adoptium.net/artifactory/deb", "bookworm", "main", "/k/adoptium.gpg");
        let docker = source("https://download.docker.com/linux/debian", "bookworm", "stable", "/k/docker.asc");
        let debian = source("http://mirror.example/debian/", "bookworm", "main contrib", "");
        let signed =
            source("http://cache.local/d", "oldstable", "main", "/usr/share/keyrings/debian-archive-keyring.gpg");
        let updates = source("http://mirror.example/debian", "bookworm-updates", "main", "");
        let chosen = |sources: &[&Source]| mirror(&sources.iter().copied().cloned().collect::<Vec<_>>()).cloned();
        assert_eq!(chosen(&[&adoptium, &docker, &debian, &updates]), Some(debian.clone()));
        assert_eq!(chosen(&[&adoptium, &docker, &debian, &signed]), Some(signed.clone()));
        assert_eq!(chosen(&[&docker, &adoptium]), Some(adoptium));
        assert_eq!(chosen(&[&updates]), None);
        for alias in ["oldstable", "stable"] {
            let source = Source { suites: vec![alias.to_owned()], ..debian.clone() };
            assert_eq!(chosen(&[&source]), Some(source.clone()));
        }
    }
}
