//! What breaks on the way: disks, viewers, data. One line, what was done is kept, exit code 3.
#![cfg(target_os = "linux")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rerun::external::re_log_encoding::DecoderApp;
use tempfile::TempDir;

use crate::binary::CACHE;
use crate::small_sequence::SmallSequence;

fn posescope() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.env("POSESCOPE_CACHE", CACHE).env_remove("COLUMNS");
    command
}

fn run(sequence: &SmallSequence) -> Command {
    let mut command = posescope();
    command
        .arg("run")
        .arg(sequence.folder())
        .args(["--all", "--reference", "4", "--method", "mi"]);
    command
}

/// One line of error, whose words these are, and exit code 3.
#[track_caller]
fn expect_one_line(output: &Output, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    let errors: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("posescope: "))
        .collect();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert_eq!(errors.len(), 1, "{said}");
    for word in words {
        assert!(errors[0].contains(word), "`{word}` is missing in: {said}");
    }
}

const FULL: &str = "No space left on device";

#[test]
fn a_full_disk_ends_a_run_with_what_was_computed() {
    let sequence = SmallSequence::write();
    let output = run(&sequence).args(["--json", "/dev/full"]).output();
    let output = output.expect("the binary starts");
    expect_one_line(&output, &["/dev/full", FULL]);
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(
        table.contains("000004"),
        "the first result is shown: {table}"
    );
    let full = File::options()
        .write(true)
        .open("/dev/full")
        .expect("is there");
    let output = run(&sequence)
        .stdout(full)
        .output()
        .expect("the binary starts");
    expect_one_line(&output, &["stdout", FULL]);
}

/// A small file system in memory, if we may mount one.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(folder: &Path, size: &str) -> Option<Self> {
        let options = format!("size={size}");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &options, "tmpfs"])
            .arg(folder)
            .stderr(Stdio::null())
            .status();
        let is_mounted = mounted.is_ok_and(|status| status.success());
        if !is_mounted {
            println!("skipped: nothing can be mounted here");
        }
        is_mounted.then(|| Self(folder.to_owned()))
    }

    fn remount(&self, options: &str) {
        let done = Command::new("mount")
            .args(["-o", &format!("remount,{options}")])
            .arg(&self.0)
            .status();
        assert!(done.expect("mount is there").success());
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

fn eval(scene: &Path, out: &Path) -> Command {
    let mut command = posescope();
    command
        .arg("eval")
        .arg(scene)
        .args([
            "--method",
            "mi",
            "--radius",
            "3",
            "--keep-failures",
            "0",
            "-q",
            "--out",
        ])
        .arg(out);
    command
}

fn lines(path: &Path) -> usize {
    fs::read_to_string(path).map_or(0, |text| text.lines().count())
}

#[test]
fn an_evaluation_goes_on_once_a_full_or_locked_disk_is_writable_again() {
    let sequence = SmallSequence::of(&(0..40).collect::<Vec<_>>());
    let folder = TempDir::new().expect("a folder");
    let Some(disk) = SmallDisk::mount(folder.path(), "48k") else {
        return;
    };
    let out = folder.path().join("run");
    let output = eval(&sequence.folder(), &out)
        .output()
        .expect("the binary starts");
    expect_one_line(&output, &[".jsonl", FULL]);
    let results = out.join("results.jsonl");
    let before = lines(&results);
    assert!((1..40).contains(&before), "{before}");
    disk.remount("ro");
    let output = eval(&sequence.folder(), &out).arg("--resume").output();
    expect_one_line(
        &output.expect("the binary starts"),
        &["Read-only file system"],
    );
    disk.remount("rw,size=20m");
    let status = eval(&sequence.folder(), &out).arg("--resume").status();
    assert!(status.expect("the binary starts").success());
    let whole = fs::read(&results).expect("results");
    let other = sequence.path().join("other");
    assert!(
        eval(&sequence.folder(), &other)
            .status()
            .expect("starts")
            .success()
    );
    assert_eq!(
        whole,
        fs::read(other.join("results.jsonl")).expect("results")
    );
    disk.remount("ro");
    let recording = folder.path().join("a.rrd");
    let output = run(&sequence).arg("--save").arg(&recording).output();
    expect_one_line(
        &output.expect("the binary starts"),
        &["a.rrd", "Read-only file system"],
    );
}

#[test]
fn data_that_vanish_end_an_evaluation_with_what_is_done() {
    let sequence = SmallSequence::of(&(0..200).collect::<Vec<_>>());
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("run");
    let child = eval(&sequence.folder(), &out)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let results = out.join("results.jsonl");
    let since = Instant::now();
    while lines(&results) < 3 && since.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(5));
    }
    let moved = sequence.path().join("moved");
    fs::rename(sequence.folder(), &moved).expect("is there");
    let output = child.wait_with_output().expect("it ends");
    expect_one_line(&output, &["sequences/42", "No such file"]);
    let done = lines(&results);
    assert!((3..200).contains(&done), "{done}");
    fs::rename(&moved, sequence.folder()).expect("is there");
    let status = eval(&sequence.folder(), &out).arg("--resume").status();
    assert!(status.expect("the binary starts").success());
    assert_eq!(lines(&results), 200);
}

#[test]
fn a_viewer_that_goes_away_costs_nothing_but_what_it_would_have_shown() {
    let sequence = SmallSequence::write();
    let folder = TempDir::new().expect("a folder");
    let recording = folder.path().join("a.rrd");
    // Somebody who takes one connection and hangs up.
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!(
        "rerun+http://{}/proxy",
        listener.local_addr().expect("bound")
    );
    let hanging_up = thread::spawn(move || drop(listener.accept()));
    let since = Instant::now();
    let output = run(&sequence)
        .args(["--connect", &url, "--save"])
        .arg(&recording)
        .output()
        .expect("the binary starts");
    expect_one_line(&output, &["viewer did not receive"]);
    assert!(since.elapsed() < Duration::from_secs(60));
    let table = String::from_utf8_lossy(&output.stdout);
    for query in ["000004", "000005", "000007"] {
        assert!(table.contains(query), "{table}");
    }
    let bytes = fs::read(&recording).expect("a recording");
    let messages = DecoderApp::decode_lazy(std::io::BufReader::new(bytes.as_slice()));
    let messages: Vec<_> = messages.map(|message| message.expect("whole")).collect();
    assert!(messages.len() > 3);
    assert_eq!(&bytes[bytes.len() - 12..bytes.len() - 4], b"RRF2FOOT");
    drop(hanging_up);
}
