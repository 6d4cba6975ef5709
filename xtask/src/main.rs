//! The project's chores, on a machine that has Rust and nothing else.

#[cfg(test)]
mod citations;
mod command;
mod demo;
mod driver;
mod quality;
mod release;
mod test;

use std::process::ExitCode;

const HELP: &str = "\
cargo xtask demo [FLAGS]   sets up what is missing, builds, renders a built-in scene with 1,000 lights,
                           says where the picture is; FLAGS go to `lanternfish render`
cargo xtask quality [FLAGS]
                           sets up what is missing, builds, compares every technique with a path tracer on a fixed list
                           of shots, writes target/quality/report.{md,json,html}; FLAGS go to `lanternfish bench quality`
cargo xtask test           sets up what is missing, then everything the project checks itself with
";

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let result = match words.next().as_deref() {
        Some("demo") => demo::run(words.collect()),
        Some("quality") => quality::run(words.collect()),
        Some("test") => test::run(),
        None | Some("help" | "--help" | "-h") => {
            print!("{HELP}");
            Ok(())
        }
        Some(unknown) => Err(format!("unknown task {unknown:?}\n\n{HELP}")),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("error: {what}");
            ExitCode::FAILURE
        }
    }
}
