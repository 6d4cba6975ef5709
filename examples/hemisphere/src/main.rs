//! The command line with one more technique: `cargo run -p lanternfish-hemisphere -- render demo:cornell --indirect hemisphere`.

use std::process::ExitCode;

fn main() -> ExitCode {
    lanternfish_hemisphere::register();
    lanternfish_cli::main()
}
