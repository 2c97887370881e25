//! Ctrl-C ends what can be ended well: a run with a whole recording, an evaluation with the line that goes
//! on.
#![cfg(unix)]

use std::path::Path;
use std::process::Child;
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

use crate::binary::{Said, background_in, has, lines};
use crate::hardening::expect_whole_recording;

/// Starts the binary in a folder, presses Ctrl-C once a file there has a line, and waits.
fn interrupted(folder: &Path, line: &str, file: &str) -> Said {
    interrupted_at(background_in(folder, line), &folder.join(file))
}

/// Presses Ctrl-C once a file has a line, and waits.
fn interrupted_at(child: Child, file: &Path) -> Said {
    let since = Instant::now();
    while lines(file) == 0 && since.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(50));
    }
    kill_process(Pid::from_child(&child), Signal::INT).expect("it runs still");
    Said::of(&child.wait_with_output().expect("it ends"))
}

#[test]
fn a_run_ends_with_a_whole_recording_and_what_is_done() {
    let folder = TempDir::new().expect("a folder");
    let line = "run street --all --reference nearest:1 --method mi --save a.rrd --json a.json";
    let said = interrupted(folder.path(), line, "a.json");
    assert_eq!(said.code, Some(130), "{}", said.err);
    has(&said.err, "stopped by Ctrl-C");
    has(&said.out, "000000");
    expect_whole_recording(&folder.path().join("a.rrd"));
}

/// An argument may be any bytes, of which a line shows what it can.
#[test]
fn an_evaluation_in_a_folder_of_any_name_can_be_interrupted() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    use std::process::{Command, Stdio};

    let folder = TempDir::new().expect("a folder");
    let out = OsStr::from_bytes(b"run\xff");
    let mut command = Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.current_dir(folder.path()).args(["eval", "street", "--limit", "40", "--method", "mi"]);
    command.arg("--out").arg(out).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("it starts");
    let said = interrupted_at(child, &folder.path().join(out).join("results.jsonl"));
    assert_eq!(said.code, Some(130), "{}", said.err);
    has(&said.err, "posescope eval street ~ --resume");
}

#[test]
fn an_evaluation_says_how_it_goes_on() {
    let folder = TempDir::new().expect("a folder");
    let line = "eval street --limit 40 --method mi --out run";
    let said = interrupted(folder.path(), line, "run/results.jsonl");
    assert_eq!(said.code, Some(130), "{}", said.err);
    has(&said.err, &format!("posescope {line} --resume"));
    assert!((1..40).contains(&lines(folder.path().join("run/results.jsonl"))));
}
