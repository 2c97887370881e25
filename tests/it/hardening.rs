//! Bad input and what breaks on the way (disks, viewers, data): one line, what was done is kept, exit
//! code 3, never a panic.
#![cfg(target_os = "linux")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rerun::external::re_log_encoding::DecoderApp;
use tempfile::TempDir;

use crate::binary::{Said, background_in, has, lines, refused, run_in, with_files_up_to, write};
use crate::small_sequence::SmallSequence;

const RUN: &str = "run sequences/42 --all --reference 4 --method mi";
const FULL: &str = "No space left on device";

#[test]
fn what_is_missing_damaged_or_cannot_be_written_is_named() {
    let sequence = SmallSequence::write();
    write(sequence.scan("000007"), "");
    write(sequence.path().join("tuned.toml"), "[fb]\nratio = 3\n");
    refused(
        sequence.path(),
        "
        3 | run sequences/77 --query 5 --reference 4 | sequences/77 ~ no such
        3 | run . --query 5 --reference 4 | not recognised ~ kitti ~ sequences/42` inside it is a scene
        3 | run sequences/42/velodyne --query 5 | not recognised ~ scene.toml ~ --format
        3 | run sequences/42 --query 5 --reference nearest | no frame `nearest` ~ `nearest:1` chooses
        3 | run sequences/42 --query 99 --reference 4 | `99` ~ 000004 … 000007 ~ 3 in all
        3 | run sequences/42 --query 5 --reference 7 --method mi | velodyne/000007.bin ~ empty
        3 | run sequences/42 --query 5 --reference 4 --config none.toml | none.toml
        3 | run sequences/42 --query 5 --reference 4 --config tuned.toml | tuned.toml ~ `fb.ratio` takes
        3 | run sequences/42 --query 5 --reference 4 --json no/such/folder/out | no/such/folder/out
        3 | run sequences/42 --query 5 --reference 4 --save no/such/folder/out | no/such/folder/out
        ",
    );
}

#[test]
fn a_full_disk_ends_a_run_with_what_was_computed() {
    let sequence = SmallSequence::write();
    let words = format!("/dev/full ~ {FULL}");
    let [said, _] = ["--json", "--save"].map(|option| {
        let said = sequence.run(&format!("{RUN} {option} /dev/full"));
        said.fails(3, &words)
    });
    has(&said.out, "000004");
    let full = File::options().write(true).open("/dev/full");
    let mut command = Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.current_dir(sequence.path()).args(RUN.split(' '));
    command.stdout(full.expect("is there"));
    let output = command.output().expect("the binary starts");
    Said::of(&output).fails(3, &format!("stdout ~ {FULL}"));
}

/// A limit on the size of files stands in for a disk that fills while the recording is written.
#[test]
fn a_recording_that_breaks_off_costs_no_result() {
    let sequence = SmallSequence::write();
    let line = "run sequences/42 --query 5 --reference 4 --save cut.rrd";
    let Some(mut command) = with_files_up_to(40, line) else {
        return;
    };
    command.current_dir(sequence.path());
    let said = Said::by(&mut command);
    let said = said.fails_in_one_line(3, "cut.rrd ~ incomplete ~ File too large");
    has(&said.out, "fb ~ pm ~ mi ~ hy");
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
        let done =
            Command::new("mount").args(["-o", &format!("remount,{options}")]).arg(&self.0).status();
        assert!(done.expect("mount is there").success());
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

fn eval(out: &Path) -> String {
    let out = out.display();
    format!("eval sequences/42 --method mi --radius 3 --keep-failures 0 -q --out '{out}'")
}

#[test]
fn an_evaluation_goes_on_once_a_full_or_locked_disk_is_writable_again() {
    let sequence = SmallSequence::of(&(0..40).collect::<Vec<_>>());
    let folder = TempDir::new().expect("a folder");
    let Some(disk) = SmallDisk::mount(folder.path(), "48k") else {
        return;
    };
    let out = folder.path().join("run");
    let line = eval(&out);
    let results = out.join("results.jsonl");
    sequence.run(&line).fails(3, &format!(".jsonl ~ {FULL}"));
    let before = lines(&results);
    assert!((1..40).contains(&before), "{before}");
    let line = line + " --resume";
    disk.remount("ro");
    sequence.run(&line).fails(3, "Read-only file system");
    disk.remount("rw,size=20m");
    sequence.run(&line).ok();
    let whole = fs::read(&results).expect("results");
    sequence.run(&eval(Path::new("other"))).ok();
    let other = fs::read(sequence.path().join("other/results.jsonl"));
    assert!(whole == other.expect("results"));
    disk.remount("ro");
    let recording = folder.path().join("a.rrd");
    let said = sequence.run(&format!("{RUN} --save '{}'", recording.display()));
    said.fails(3, "a.rrd ~ Read-only file system");
}

#[test]
fn queries_whose_data_vanish_are_localised_once_the_data_are_back() {
    let sequence = SmallSequence::of(&(0..200).collect::<Vec<_>>());
    let line = eval(Path::new("run"));
    let child = background_in(sequence.path(), &line);
    let results = sequence.path().join("run/results.jsonl");
    let since = Instant::now();
    while lines(&results) < 3 && since.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(5));
    }
    let moved = sequence.path().join("moved");
    fs::rename(sequence.folder(), &moved).expect("is there");
    let said = Said::of(&child.wait_with_output().expect("it ends"));
    said.fails(3, "queries were not localised ~ sequences/42 ~ No such file ~ --resume");
    assert_eq!(lines(&results), 200);
    fs::rename(&moved, sequence.folder()).expect("is there");
    sequence.run(&(line + " --resume")).ok();
    sequence.run(&eval(Path::new("whole"))).ok();
    assert!(sequence.text("run/results.jsonl") == sequence.text("whole/results.jsonl"));
}

/// A whole recording ends with a footer, and that with its magic and a number.
pub fn expect_whole_recording(path: &Path) {
    let bytes = fs::read(path).expect("a recording");
    let messages = DecoderApp::decode_lazy(std::io::BufReader::new(bytes.as_slice()));
    let messages: Vec<_> = messages.map(|message| message.expect("whole")).collect();
    assert!(messages.len() > 3);
    assert_eq!(&bytes[bytes.len() - 12..bytes.len() - 4], b"RRF2FOOT");
}

#[test]
fn a_viewer_that_goes_away_costs_nothing_but_what_it_would_have_shown() {
    let sequence = SmallSequence::write();
    // Somebody who takes one connection and hangs up.
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound");
    let hanging_up = thread::spawn(move || drop(listener.accept()));
    let since = Instant::now();
    let line = format!("{RUN} --connect rerun+http://{address}/proxy --save a.rrd");
    let said = run_in(sequence.path(), &line).fails(3, "viewer did not receive");
    assert!(since.elapsed() < Duration::from_secs(60));
    has(&said.out, "000004 ~ 000005 ~ 000007");
    expect_whole_recording(&sequence.path().join("a.rrd"));
    drop(hanging_up);
}

#[test]
fn files_that_are_something_else_are_kept() {
    let sequence = SmallSequence::write();
    let line = "run sequences/42 --query 5 --reference 4 --method mi";
    for file in ["old.json", "old.rrd", "notes.txt", "sequences/42/times.json"] {
        write(sequence.path().join(file), "0.0\n0.1\n");
    }
    refused(
        sequence.path(),
        &format!(
            "
            2 | {line} --json old.json --save old.rrd --export-matches m | --method fb
            2 | {line} --save sequences/42/calib.txt | --save sequences/42/calib.txt ~ file of the scene
            2 | {line} --json sequences/42/times.json | --json sequences/42/times.json ~ file of the scene
            2 | {line} --events notes.txt | --events notes.txt ~ another kind
            2 | doctor sequences/42 --picture sequences/42/image_0/000004.png | --picture ~ file of the scene
            2 | eval sequences/42 --method mi --out r --events sequences/42/times.json | file of the scene
            2 | eval sequences/42 --method mi --out r --events ./r/x/../e.jsonl | outside the run folder
            "
        ),
    );
    for file in ["old.json", "old.rrd", "notes.txt", "sequences/42/times.json"] {
        assert_eq!(sequence.text(file), "0.0\n0.1\n", "{file}");
    }
    // Files of ours are replaced.
    sequence
        .run(&format!("{line} --json old.json --save old.rrd --events sequences/42/e.jsonl"))
        .ok();
    assert!(sequence.text("old.json").starts_with('{'));
}
