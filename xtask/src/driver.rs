//! Installs Mesa's software driver if there is no suitable graphics driver.
//!
//! Only Linux can lack one: macOS and Windows include Metal and Direct3D. Drivers of graphics cards are never changed.

mod debian;
mod sources;

use std::{path::Path, process::Command};

use crate::apt;

/// The purpose of a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Purpose {
    /// Images: any adapter suffices.
    RenderedImages,
    /// Tests, which run on a software adapter even if there is a graphics card.
    Tests,
}

/// The driver's set-up, which installs a driver at most once.
#[derive(Debug)]
pub struct Driver {
    purpose: Purpose,
    may_install: bool,
}

impl Driver {
    pub fn new(purpose: Purpose, may_install: bool) -> Self {
        Self { purpose, may_install: may_install && cfg!(target_os = "linux") }
    }

    /// Installs missing packages if this machine certainly has no graphics card. This happens before the build, while the user
    /// is still present to enter a password.
    pub fn before_build(&mut self) -> Result<(), String> {
        if may_have_graphics_card() { Ok(()) } else { self.install(false) }
    }

    /// Completes the set-up, now that `list_adapters` (a built `lanternfish info --adapters`) can list adapters. Returns an
    /// error if there is no adapter.
    pub fn after_build(&mut self, mut list_adapters: impl FnMut() -> Command) -> Result<(), String> {
        let mut list = || list_adapters().output().ok().filter(|output| output.status.success());
        let hardware = list().is_some_and(|output| has_graphics_card(&String::from_utf8_lossy(&output.stdout)));
        self.install(hardware)?;
        if list().is_some() { Ok(()) } else { Err(self.no_adapter()) }
    }

    fn install(&mut self, hardware: bool) -> Result<(), String> {
        if !self.may_install || !apt::is_there() {
            return Ok(());
        }
        let step = debian::plan(&debian::Machine::look(hardware, may_have_graphics_card()), self.purpose);
        // A failed installation is not repeated after the build.
        self.may_install &= step == debian::Step::Nothing;
        debian::install(step)
    }

    fn no_adapter(&self) -> String {
        let packages = debian::PACKAGES.join(" ");
        format!(
            "no graphics adapter found. Mesa's software driver and the Vulkan loader are enough, by your system's own means \
             (Debian, Ubuntu: {packages}; Fedora: mesa-vulkan-drivers vulkan-loader; Arch: vulkan-swrast vulkan-icd-loader; \
             Alpine: mesa-vulkan-swrast vulkan-loader); then try again. `vulkaninfo --summary` may say more"
        )
    }
}

/// True if the kernel shows a device that a graphics card's driver may use. A virtual machine may show one without a driver.
fn may_have_graphics_card() -> bool {
    let render_nodes = std::fs::read_dir("/dev/dri").into_iter().flatten().flatten();
    let mut render_nodes = render_nodes.filter(|entry| entry.file_name().to_string_lossy().starts_with("renderD"));
    // NVIDIA's own driver, and graphics cards in the Windows Subsystem for Linux.
    render_nodes.next().is_some() || ["/dev/nvidiactl", "/dev/dxg"].iter().any(|path| Path::new(path).exists())
}

/// True if `lanternfish info --adapters` lists an adapter other than software.
fn has_graphics_card(adapters: &str) -> bool {
    let mut kinds = adapters.lines().filter_map(|line| line.trim_start().strip_prefix("kind"));
    kinds.any(|kind| !kind.trim_start().starts_with("Cpu,"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn graphics_cards_are_distinguished_from_software() {
        let software =
            "adapter      llvmpipe (LLVM 15.0.6, 256 bits)\n  kind       Cpu, through vulkan\n  driver     llvmpipe\n";
        let card = "adapter      Some card\n  kind       DiscreteGpu, through vulkan\n";
        assert!(!has_graphics_card(software) && !has_graphics_card(""));
        assert!(has_graphics_card(card) && has_graphics_card(&format!("{software}{card}")));
    }

    #[test]
    fn without_an_adapter_the_error_names_the_packages() {
        let mut driver = Driver::new(Purpose::Tests, false);
        let nothing = || Command::new("no-such-program-at-all");
        assert!(driver.after_build(nothing).unwrap_err().contains("mesa-vulkan-drivers libvulkan1"));
    }
}
