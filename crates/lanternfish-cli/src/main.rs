//! The command line of Lanternfish: a glTF file in, a picture out.

use std::process::ExitCode;

fn main() -> ExitCode {
    lanternfish_cli::main()
}
