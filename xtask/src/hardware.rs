//! `cargo xtask hardware`: packs a kit for a bare machine with a graphics card (without Rust, repository or possibly Vulkan
//! loader).
//!
//! Contents of `target/hardware.tar.gz`, a folder `hardware`:
//! - `run.sh`, see `run.sh --help`, and the `commit` of the sources;
//! - the command line and the benches, built for release, without symbols;
//! - `sources/docs`: shots and tracks, and `shared`: their scenes, where their relative paths lead;
//! - `lib`: libraries that `run.sh` lends to a machine that lacks them.

use std::{env, fs, path::PathBuf, process::Command};

use crate::{
    command::{cargo, commit, run as step, workspace},
    files::{self, at, make_empty},
    program,
};

/// Largest size of a kit, bytes.
const MOST_BYTES: u64 = 60 << 20;

const SCRIPT: &str = include_str!("hardware/run.sh");

/// Scenes, below the shared folder.
const SCENES: [&str; 2] = ["assets/sponza/Sponza.glb", "assets/bistro/bistro-exterior.glb"];

/// Fills the current folder from packages of Debian and Ubuntu: the Vulkan loader, X libraries that NVIDIA's driver links to, and
/// the compiler's runtime, by the names that programs link to, as `libX11.so.6`. Run as root, apt would warn that its sandbox user
/// cannot write to the folder.
const GATHER_LIBRARIES: &str = r"set -e
apt-get --quiet --quiet --option=APT::Sandbox::User=root download \
    libvulkan1 libx11-6 libxext6 libxcb1 libxau6 libxdmcp6 libbsd0 libmd0 libgcc-s1
for package in *.deb; do dpkg -x $package packages; done
find packages -regex '.*/lib[^/]*\.so\.[0-9]+' -exec cp --dereference {} . \;
rm -r packages *.deb
";

/// Builds, and packs the kit.
pub fn run(words: &[String]) -> Result<(), String> {
    if !words.is_empty() {
        return Err(format!("hardware takes no {words:?}: every kit has all parts, also `bash run.sh papers`"));
    }
    let packages = ["--package", "lanternfish-cli", "--package", "lanternfish-bench"];
    let built = program::build(&mut cargo(["build", "--release"].iter().chain(&packages)))?;
    let kit = workspace().join("target/hardware");
    make_empty(&kit)?;
    for name in ["lanternfish", "lanternfish-bench"] {
        // Without binutils the error names `strip`.
        step(Command::new("strip").arg("-o").args([kit.join(name), program::find(&built, name)?]))?;
    }
    for file in ["docs/shots", "docs/tracks"].map(|folder| files::below(&workspace().join(folder))) {
        for file in file? {
            files::copy(&file, &kit.join("sources").join(file.strip_prefix(workspace()).expect("it is below")))?;
        }
    }
    let shared = env::var_os("LANTERNFISH_SHARED").map_or_else(|| workspace().join("../shared"), PathBuf::from);
    for scene in SCENES {
        if let Err(what) = files::copy(&shared.join(scene), &kit.join("shared").join(scene)) {
            eprintln!("==> Left out: {what}");
        }
    }
    let libraries = kit.join("lib");
    make_empty(&libraries)?;
    if let Err(what) = step(Command::new("sh").args(["-c", GATHER_LIBRARIES]).current_dir(&libraries)) {
        eprintln!("==> Left out: libraries ({what})");
        make_empty(&libraries)?;
    }
    files::write(&kit.join("commit"), commit().unwrap_or_default())?;
    files::write(&kit.join("run.sh"), SCRIPT)?;
    let archive = kit.with_extension("tar.gz");
    let tar = ["--owner=0", "--group=0", "--use-compress-program=gzip -9", "-cf"];
    step(Command::new("tar").args(tar).arg(&archive).arg("-C").arg(workspace().join("target")).arg("hardware"))?;
    let size = at(&archive, fs::metadata(&archive))?.len();
    if size > MOST_BYTES {
        return Err(format!("{}: {size} bytes, more than {MOST_BYTES}", archive.display()));
    }
    println!("{} ({:.1} MB)", archive.display(), size as f64 / 1e6);
    Ok(())
}

/// Runs the script with fake programs.
#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::{os::unix::fs::PermissionsExt, process::Output};

    use serde_json::{Value, json};

    use super::*;

    /// Adapters as `lanternfish info --adapters` lists them.
    const SOFTWARE: &str = "adapter      Some software\n  kind       Cpu, through vulkan\n  driver     x\n";
    const CARD: &str = "adapter      Some card\n  kind       DiscreteGpu, through vulkan\n  driver     x\n";

    /// Calls `check` with a result of the script and the folder of its results; `fault` is the first word that both programs
    /// fail at, and `slow` the one that takes a minute.
    fn run_kit(
        name: &str,
        adapters: &str,
        [fault, slow]: [&str; 2],
        words: &[&str],
        check: impl FnOnce(&Output, &Value),
    ) {
        let kit = env::temp_dir().join(format!("lanternfish-kit-{name}-{}", std::process::id()));
        // Each writes its words as JSON to the file after --json or --report, or into the folder after -o.
        let program = format!(
            "#!/bin/bash\ncase $1 in --version) echo fake; exit ;; info) printf '{adapters}'; exit ;; esac\n\
             words=$*\nfirst=$1\n\
             while (($# > 0)); do case $1 in --json | --report) file=$2 ;; -o) folder=$2 ;; esac; shift; done\n\
             [[ $file ]] || {{ mkdir $folder; file=$folder/report.json; [[ $first = papers ]] && file=$folder/papers.json; }}\n\
             printf '\"%s\"' \"$words\" >$file\n\
             [[ $first = {slow} ]] && sleep 60\n\
             [[ $first = {fault} ]] && {{ echo the reason; exit 7; }}\n\
             exit 0\n"
        );
        for (file, text) in
            [("run.sh", SCRIPT), ("commit", "abc"), ("lanternfish", &program), ("lanternfish-bench", &program)]
        {
            files::write(&kit.join(file), text).expect("it can be written");
            fs::set_permissions(kit.join(file), fs::Permissions::from_mode(0o755)).expect("it is there");
        }
        let mut bash = Command::new("bash");
        let output = bash.arg(kit.join("run.sh")).args(words).arg("--out").arg(kit.join("out")).output();
        let output = output.expect("bash is there");
        let figures = fs::read_to_string(kit.join("out/figures.json")).unwrap_or_else(|_| "null".to_owned());
        fs::remove_dir_all(&kit).expect("it is there");
        let figures = serde_json::from_str(&figures).unwrap_or_else(|error| panic!("{error}: {figures}"));
        check(&output, &figures);
    }

    /// Names and exit statuses of parts.
    fn outcomes(figures: &Value) -> Vec<(&str, u64)> {
        let parts = figures["parts"].as_array().into_iter().flatten();
        parts.map(|part| (part["name"].as_str().unwrap_or(""), part["status"].as_u64().unwrap_or(999))).collect()
    }

    #[test]
    fn a_software_adapter_alone_ends_the_run() {
        run_kit("software", SOFTWARE, ["none", "none"], &[], |output, figures| {
            let text = String::from_utf8_lossy(&output.stderr);
            assert_eq!((output.status.code(), figures), (Some(3), &Value::Null), "{text}");
            assert!(text.contains("ONLY SOFTWARE OR NO ADAPTER WAS FOUND") && text.contains("Some software"), "{text}");
        });
    }

    #[test]
    fn all_figures_are_in_one_file_and_a_failing_part_fails_the_run() {
        run_kit("card", CARD, ["walks", "none"], &["checks", "walks", "frames", "papers"], |output, figures| {
            let text = String::from_utf8_lossy(&output.stdout);
            assert_eq!(output.status.code(), Some(1), "{text}");
            assert_eq!(outcomes(figures), [("checks", 0), ("walks", 7), ("atrium", 0), ("papers", 0)], "{text}");
            assert!(text.contains("the reason"), "{text}");
            assert_eq!(figures["commit"], "abc");
            let words = |part: usize| figures["parts"][part]["figures"].as_str().unwrap_or_default();
            for (part, start) in
                ["doctor --only checks ", "walks ", "render demo:atrium ", "papers --card "].iter().enumerate()
            {
                assert!(words(part).starts_with(start) && words(part).contains("--adapter gpu"), "{figures}");
            }
        });
    }

    #[test]
    fn a_part_beyond_its_deadline_is_ended_and_keeps_its_figures() {
        run_kit("slow", SOFTWARE, ["none", "walks"], &["walks=1", "frames", "--allow-software"], |output, figures| {
            assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stdout));
            assert_eq!(outcomes(figures), [("walks", 124), ("atrium", 0)]);
            assert_ne!(figures["parts"][0]["figures"], json!(null));
        });
    }
}
