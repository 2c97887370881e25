//! The binary under test.

use assert_cmd::Command;

/// The binary, with its cache below the build folder: the user's own is none of a test's business.
pub fn posescope() -> Command {
    let mut command = Command::cargo_bin("posescope").expect("the binary is built");
    command.env("POSESCOPE_CACHE", CACHE);
    command
}

/// Runs the binary: its exit code, and what it prints on stdout and stderr.
pub fn said(command: &mut Command) -> (Option<i32>, String, String) {
    let output = command.output().expect("the binary starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// Shared by the tests that do not test it.
pub const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache");
