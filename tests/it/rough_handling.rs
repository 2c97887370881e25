//! Broken pipes, odd bytes and absurd numbers: one line says what is wrong, and nothing else is lost.

use std::fs;
use std::fs::File;
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::binary::{CACHE, Said, has, refused, run_in, text, write};
use crate::scene_toml;
use crate::small_sequence::SmallSequence;

const RUN: &str = "run sequences/42 --query 5 --reference 4 --method fb,mi";

/// The binary in the folder of a sequence, without the helpers that read its output.
fn plain(sequence: &SmallSequence, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.env("POSESCOPE_CACHE", CACHE).current_dir(sequence.path());
    command.args(shlex::split(line).expect("words"));
    command
}

#[test]
#[cfg(target_os = "linux")]
fn messages_that_nobody_can_read_cost_no_result() {
    let sequence = SmallSequence::write();
    let full = || File::options().write(true).open("/dev/full").expect("is there");
    let said = Said::of(&plain(&sequence, RUN).stderr(full()).output().expect("it starts")).ok();
    has(&said.out, "000005");
    let eval = "eval sequences/42 --method fb --radius 3 --reference nearest:1 --out run";
    let mut child = plain(&sequence, eval)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts");
    drop(child.stderr.take());
    assert!(child.wait().expect("it ends").success());
    assert!(sequence.path().join("run/report.html").is_file());
    // An error has its exit code, too.
    let wrong = plain(&sequence, "run sequences/42 --query 99").stderr(full()).status();
    assert_eq!(wrong.expect("it starts").code(), Some(3));
    let mut child =
        plain(&sequence, "completions bash").stdout(Stdio::piped()).spawn().expect("it starts");
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    let script = sequence.run("completions bash").ok();
    assert!(script.out.lines().count() > 100);
}

#[test]
fn a_damaged_line_in_the_middle_is_named_and_nothing_is_thrown_away() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let eval = "eval sequences/42 --method fb --radius 3 --reference nearest:1 --out run";
    sequence.run(eval).ok();
    let resume = format!("{eval} --resume");
    for file in ["run/results.jsonl", "run/timings.jsonl"] {
        let whole = sequence.text(file);
        let damaged = whole.replacen("\n{", "\n[", 1);
        write(sequence.path().join(file), &damaged);
        sequence.run(&resume).fails(3, &format!("{file}:2: ~ remove this line and all below"));
        assert_eq!(sequence.text(file), damaged);
        // What a killed process wrote last is cut off.
        write(sequence.path().join(file), &whole[..whole.len() - 3]);
        sequence.run(&resume).ok();
        assert_eq!(sequence.text(file).lines().count(), 4);
    }
}

#[test]
fn counts_have_bounds() {
    let sequence = SmallSequence::write();
    refused(
        sequence.path(),
        &format!(
            "
            2 | {RUN} --threads 100000 | --threads 100000: at most
            "
        ),
    );
    let line = "eval sequences/42 --preset multi --reference random:100000000 --out run";
    sequence.run(line).fails_with(2, "random:100000000 ~ from 1 to 1000");
    sequence.run(&format!("{RUN} --threads 4")).ok();
}

#[test]
fn names_that_control_a_terminal_are_refused() {
    let root = TempDir::new().expect("a folder");
    let scene = root.path().join("scene");
    fs::create_dir(&scene).expect("writable");
    scene_toml::write(&scene);
    run_in(root.path(), "run scene --query img1 --reference img0 --method fb").ok();
    let described = text(scene.join("scene.toml"));
    write(scene.join("scene.toml"), format!("name = \"a\\u001b[31m\"\n{described}"));
    let said = run_in(root.path(), "doctor scene").fails(3, "control characters ~ a\\u{1b}[31m");
    assert!(!said.err.contains('\u{1b}'), "{}", said.err);
    // What is not opened is printed without them.
    let said = run_in(root.path(), "doctor 'no\u{1b}[31mscene'");
    assert!(said.code == Some(3) && !said.err.contains('\u{1b}'), "{}", said.err);
}

#[test]
fn a_camera_that_sees_nothing_is_refused() {
    let folder = TempDir::new().expect("a folder");
    scene_toml::write(folder.path());
    let described = text(folder.path().join("scene.toml"));
    let focal = described.lines().find(|line| line.starts_with("fx")).expect("has one");
    for (length, is_refused) in [("1e-300", true), ("1e12", true), ("0.3", true), ("60.0", false)] {
        write(
            folder.path().join("scene.toml"),
            described.replace(focal, &format!("fx = {length}")),
        );
        let said = run_in(folder.path(), "run . --query img1 --reference img0 --method fb");
        if is_refused {
            said.fails(3, "a focal length that suits 160 px expected");
        } else {
            said.ok();
        }
    }
    let photo = "--query photos/img1.png --camera 1e-300,1e-300,80,32";
    write(folder.path().join("scene.toml"), described);
    fs::create_dir(folder.path().join("elsewhere")).expect("writable");
    fs::copy(folder.path().join("photos/img1.png"), folder.path().join("elsewhere/x.png"))
        .expect("is there");
    let photo = photo.replace("photos/img1", "elsewhere/x");
    run_in(folder.path(), &format!("run . {photo} --reference img0 --method fb"))
        .fails(3, "a focal length that suits");
}

#[test]
fn a_run_goes_on_with_the_same_index_only() {
    let sequence = SmallSequence::of(&(0..8).collect::<Vec<_>>());
    let index = "index sequences/42 --set index.words=20 --out an.index";
    sequence.run(index).ok();
    let eval = "eval sequences/42 --method fb --radius 3 --reference retrieve:1 --index an.index \
                --keep-failures 0 --out run";
    sequence.run(eval).ok();
    sequence.run(&format!("{eval} --resume")).ok();
    sequence.run(&format!("{index} --every 2 --force")).ok();
    sequence.run(&format!("{eval} --resume")).fails(2, "other settings ~ index of scene 0");
}
