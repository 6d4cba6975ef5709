//! Libraries that a bare machine may lack: the Vulkan loader, X libraries that NVIDIA's driver links to, and the compiler's
//! runtime.

use std::{path::Path, process::Command};

use crate::{
    command::{find_program, run},
    files,
};

/// Packages of Debian and Ubuntu.
const PACKAGES: [&str; 9] =
    ["libvulkan1", "libx11-6", "libxext6", "libxcb1", "libxau6", "libxdmcp6", "libbsd0", "libmd0", "libgcc-s1"];

/// Fills the folder `lib` with the libraries, using the empty folder `scratch`. Returns an error that names what is missing.
pub fn gather(scratch: &Path, lib: &Path) -> Result<(), String> {
    if find_program("apt-get").is_none() || find_program("dpkg").is_none() {
        return Err("no apt-get and dpkg here".to_owned());
    }
    // Run as root, apt would warn that its sandbox user cannot write to the folder.
    let download = ["--quiet", "--quiet", "--option=APT::Sandbox::User=root", "download"];
    run(Command::new("apt-get").args(download).args(PACKAGES).current_dir(scratch))?;
    let root = scratch.join("root");
    for package in files::below(scratch)? {
        run(Command::new("dpkg").arg("-x").args([&package, &root]))?;
    }
    for file in files::below(&root)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        if is_linked_by_name(&name) {
            // The name may be a link to a file with more version numbers: copy the content.
            files::copy(&file, &lib.join(&*name))?;
        }
    }
    Ok(())
}

/// True if programs link to a library by this name: one number after `.so`, as in `libX11.so.6`.
fn is_linked_by_name(file: &str) -> bool {
    let version = file.strip_prefix("lib").and_then(|rest| rest.split_once(".so.")).map(|(_, version)| version);
    version.is_some_and(|version| !version.is_empty() && version.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_have_the_name_that_programs_link_to() {
        for name in ["libX11.so.6", "libvulkan.so.1", "libstdc++.so.6"] {
            assert!(is_linked_by_name(name), "{name}");
        }
        for name in ["libX11.so.6.4.0", "libX11.so", "libstdc++.so.6.0.30-gdb.py", "x.so.1", "libm.so."] {
            assert!(!is_linked_by_name(name), "{name}");
        }
    }
}
