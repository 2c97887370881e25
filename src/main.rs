//! The program `posescope`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(posescope::cli::run(std::env::args_os().collect()))
}
