//! `posescope view` as a process: what it does with a display and without.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Child, Command as Process, Stdio};
use std::time::{Duration, Instant};

use crate::binary::{CACHE, Said, command_in, has};
use crate::small_sequence::SmallSequence;

fn view(sequence: &SmallSequence, words: &str) -> Said {
    let mut command = command_in(sequence.path(), &format!("view {words}"));
    Said::by(command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY"))
}

#[test]
fn without_a_display_it_records_instead() {
    let sequence = SmallSequence::write();
    let said = view(&sequence, "sequences/42 --query 5 --reference 4 --method fb").ok();
    has(&said.err, "no display is set ~ instead");
    has(&said.out, "000005");
    assert!(sequence.path().join("recordings/000005.rrd").is_file());
}

#[test]
fn the_options_beside_the_folder_of_a_run_are_obeyed_or_refused() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let line = "eval sequences/42 --method fb,mi --radius 2 --keep-failures 0 --out run";
    sequence.run(line).ok();
    let view = |words: &str| view(&sequence, &format!("run {words}"));
    let methods = |words: &str| {
        let table = view(words).ok().out;
        let is_method = |word: &&str| ["fb", "pm", "mi", "hy"].contains(word);
        let rows = table.lines().filter(|line| line.starts_with("00000"));
        let words = rows.filter_map(|line| line.split_whitespace().find(is_method));
        words.map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(methods(""), ["fb", "mi"]);
    assert_eq!(methods("--method pm"), ["pm"]);
    let said = view("--query 0 --method mi --right 0.000001m,1deg");
    has(&said.out, "▲ wrong");
    has(&view("--query 0 --reference 3 --method fb").out, "000003");
    for (option, value) in [("--query-scene", "street"), ("--camera", "1,1,1,1"), ("--limit", "3")]
    {
        view(&format!("--query 0 {option} {value}")).fails_with(2, option);
    }
}

/// A process that ends with the test.
struct KilledOnDrop(Child);

impl Drop for KilledOnDrop {
    fn drop(&mut self) {
        // One that is over already is just as well.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A display of its own, and its number; none where there is no Xvfb. It stays as it is when a client leaves: while
/// it started anew it would refuse the next one.
fn virtual_display() -> Option<(KilledOnDrop, String)> {
    let mut server = Process::new("Xvfb")
        .args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"])
        .args(["-screen", "0", "1600x1000x24"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let mut number = String::new();
    let mut words = BufReader::new(server.stdout.take()?);
    let server = KilledOnDrop(server);
    words.read_line(&mut number).ok()?;
    let number = number.trim();
    (!number.is_empty()).then(|| (server, format!(":{number}")))
}

/// The window's title as the display's server knows it; none without somebody who can ask.
fn is_shown(display: &str, title: &str) -> Option<bool> {
    let found = Process::new("xdotool")
        .args(["search", "--name", title])
        .env("DISPLAY", display)
        .stderr(Stdio::null())
        .output()
        .ok()?;
    Some(found.status.success())
}

#[test]
fn on_a_display_it_opens_a_window_that_stays() {
    let Some((_server, display)) = virtual_display() else {
        println!("skipped: no Xvfb");
        return;
    };
    if is_shown(&display, "posescope").is_none() {
        println!("skipped: no xdotool");
        return;
    }
    let sequence = SmallSequence::write();
    let child = Process::new(env!("CARGO_BIN_EXE_posescope"))
        .current_dir(sequence.path())
        .env("POSESCOPE_CACHE", CACHE)
        .env("DISPLAY", &display)
        .env_remove("WAYLAND_DISPLAY")
        .arg("view")
        .arg(sequence.folder())
        .args(["--query", "5", "--reference", "4", "--method", "fb"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let mut child = KilledOnDrop(child);
    let begun = Instant::now();
    while is_shown(&display, "posescope") != Some(true) {
        if let Some(status) = child.0.try_wait().expect("it is ours") {
            let mut said = String::new();
            let stderr = child.0.stderr.as_mut();
            stderr.map(|stderr| stderr.read_to_string(&mut said));
            if said.contains("no graphics adapter") {
                println!("skipped: no graphics adapter");
                return;
            }
            panic!("{status}: {said}");
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "no window");
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(child.0.try_wait().expect("it is ours").is_none());
    assert!(!sequence.path().join("recordings").exists());
}
