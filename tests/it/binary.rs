//! The binary under test.

use assert_cmd::Command;

/// The binary, with its cache below the build folder: the user's own is none of a test's business.
pub fn posescope() -> Command {
    let mut command = Command::cargo_bin("posescope").expect("the binary is built");
    command.env("POSESCOPE_CACHE", CACHE);
    command
}

/// Shared by the tests that do not test it.
pub const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache");
