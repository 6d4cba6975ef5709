//! Development tasks, for a machine that only has Rust.

mod audit;
mod budgets;
mod check;
#[cfg(test)]
mod citations;
mod command;
mod demo;
mod dist;
mod driver;
mod faults;
#[cfg(test)]
mod features;
mod files;
mod hardware;
mod images;
#[cfg(test)]
mod imports;
mod interface;
#[cfg(test)]
mod links;
mod program;
mod python;
mod quality;
mod same;
mod shader_stats;
mod test;
mod web;
#[cfg(test)]
mod words;

use std::process::ExitCode;

const HELP: &str = "\
cargo xtask demo [FLAGS]   sets up what is missing, builds, renders a built-in scene with 1,000 lights,
                           says where the image is; FLAGS go to `lanternfish render`
cargo xtask quality [FLAGS]
                           sets up what is missing, builds, compares every technique with a path tracer on a fixed list
                           of shots, writes target/quality/report.{md,json,html}; FLAGS go to `lanternfish-bench quality`
cargo xtask test [FILTER] [--quick | --full]
                           sets up what is missing, then checks every promise once; with FILTER runs all tests whose names
                           contain it;
                           --full runs every test, on all variants of shaders, and in a browser if there is Chromium;
                           --quick runs unit tests that need no adapter, and needs no driver; with cargo-nextest it prints
                           the slowest tests, and keeps every test's time in target/nextest/{default,quick}/junit.xml
cargo xtask python [--quick] [WORDS]
                           builds the Python package's extension module, and runs its tests with pytest, which gets the words;
                           --quick runs those that show whether the wheel works at all
cargo xtask web [--serve]  builds the page of the renderer in a browser in dist/, and shows it on http://localhost:8080
cargo xtask hardware       builds, and packs target/hardware.tar.gz for a bare machine with a graphics card, at most 60 MiB;
                           `bash run.sh` there measures checks, walks and frames within 6 minutes, `bash run.sh papers`
                           the claims of the five papers within 9
cargo xtask same [COMMIT | --write]
                           renders the sixteen images of xtask/src/same.txt, and fails if a linear radiance differs from the stored
                           hash, or from that commit's image; --write stores the hashes
cargo xtask faults [NAME...] [--full]
                           builds the 24 faults of xtask/faults.toml, each behind a switch, and prints which test finds each first, and
                           after how long, also in target/faults.tsv; fails if the fast tests miss more than two; --full runs the
                           other tests, too, where they miss one; needs cargo-nextest
cargo xtask images [NAME...]
                           makes the images of docs/gallery.md and docs/any-file.md again, or those of these names: hours without a
                           graphics card; a test fails once they are 60 days older than the last commit
cargo xtask shader-stats [TEXT | --write | --page MESA]
                           what RADV, Mesa's compiler for AMD's graphics cards, makes of every shader, without a card: prints the rows
                           that differ from docs/measured/shader-stats-*; --write stores the new ones; --page prints those of
                           a version of Mesa; with TEXT, prints the variants whose names contain it
cargo xtask interface [--write]
                           fails if the public items of the product's crates differ from docs/interface.txt; --write stores them
cargo xtask check [--full] lines by folder, format, lints; --full also lints for a browser, documentation, the public interface, and
                           the hot passes of shader-stats
cargo xtask audit          licences, advisories and sources of dependencies (cargo-deny), and changes of the interface since the last
                           release (cargo-semver-checks): installs neither
cargo xtask dist           an archive for x86-64 Linux with glibc 2.28 or newer in target/archive; needs cargo-zigbuild and zig

What is missing may be a Vulkan driver: without a graphics card, on Debian and Ubuntu, Mesa's software one is
installed, as root or through sudo. --no-driver-install, with any of these, leaves the machine as it is.
";

fn main() -> ExitCode {
    if let Some(code) = interface::as_rustdoc() {
        return code;
    }
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let count = words.len();
    words.retain(|word| word != driver::NO_INSTALL);
    let may_install = words.len() == count;
    let task = if words.is_empty() { "help".to_owned() } else { words.remove(0) };
    let result = match task.as_str() {
        "demo" => demo::run(words, may_install),
        "quality" => quality::run(words, may_install),
        "audit" | "dist" if !words.is_empty() => Err(format!("{task} takes no {:?}\n\n{HELP}", words[0])),
        "shader-stats" => shader_stats::run(&words),
        "test" => test::run(&words, may_install),
        "same" => same::run(&words, may_install),
        "faults" => faults::run(&words),
        "images" => images::run(&words, may_install),
        "audit" => audit::run_audit(),
        "check" => check::run(&words),
        "interface" => interface::run(&words),
        "dist" => dist::run_dist(),
        "hardware" => hardware::run(&words),
        "python" => python::run(&words),
        "web" => web::run(&words),
        "help" | "--help" | "-h" => {
            print!("{HELP}");
            Ok(())
        }
        unknown => Err(format!("unknown task {unknown:?}\n\n{HELP}")),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("error: {what}");
            ExitCode::FAILURE
        }
    }
}
