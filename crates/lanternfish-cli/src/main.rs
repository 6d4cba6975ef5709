//! The command line of Lanternfish: a glTF file in, an image out.

use std::process::ExitCode;

fn main() -> ExitCode {
    lanternfish_cli::main()
}
