//! Ctrl-C ends what can be ended well: a run with a whole recording, an evaluation with the line that goes
//! on.
#![cfg(unix)]

use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rerun::external::re_log_encoding::DecoderApp;
use tempfile::TempDir;

use crate::binary::CACHE;

/// Starts the binary, presses Ctrl-C once `is_begun`, and waits.
fn interrupted(arguments: &[&str], is_begun: &dyn Fn() -> bool) -> Output {
    let child = Command::new(env!("CARGO_BIN_EXE_posescope"))
        .args(arguments)
        .env("POSESCOPE_CACHE", CACHE)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let since = Instant::now();
    while !is_begun() && since.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(50));
    }
    press(&child);
    child.wait_with_output().expect("it ends")
}

fn press(child: &Child) {
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.expect("kill is there").success());
}

#[test]
fn a_run_ends_with_a_whole_recording_and_what_is_done() {
    let folder = TempDir::new().expect("a folder");
    let (recording, json) = (folder.path().join("a.rrd"), folder.path().join("a.json"));
    let lines = || std::fs::read_to_string(&json).map_or(0, |text| text.lines().count());
    let output = interrupted(
        &[
            "run",
            "street",
            "--all",
            "--reference",
            "nearest:1",
            "--method",
            "mi",
            "--save",
            recording.to_str().expect("a plain path"),
            "--json",
            json.to_str().expect("a plain path"),
        ],
        &|| lines() > 0,
    );
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert!(message.contains("stopped by Ctrl-C"), "{message}");
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("000000"), "{table}");
    let bytes = std::fs::read(&recording).expect("a recording");
    let messages = DecoderApp::decode_lazy(std::io::BufReader::new(bytes.as_slice()));
    let messages: Vec<_> = messages.map(|message| message.expect("whole")).collect();
    assert!(messages.len() > 3);
    // A whole file ends with a footer, and that with its magic and a number.
    assert_eq!(&bytes[bytes.len() - 12..bytes.len() - 4], b"RRF2FOOT");
}

#[test]
fn an_evaluation_says_how_it_goes_on() {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("run");
    let results = out.join("results.jsonl");
    let lines = || std::fs::read_to_string(&results).map_or(0, |text| text.lines().count());
    let out = out.to_str().expect("a plain path");
    let arguments = [
        "eval", "street", "--limit", "40", "--method", "mi", "--out", out,
    ];
    let output = interrupted(&arguments, &|| lines() > 0);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{message}");
    let command = format!("posescope {} --resume", arguments.join(" "));
    assert!(message.contains(&command), "{message}");
    assert!((1..40).contains(&lines()));
}
