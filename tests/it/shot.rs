//! `posescope view --screenshot` as a process.

use std::path::Path;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

/// What a run of the command said, and its exit code.
fn shot(sequence: &SmallSequence, more: &[&str]) -> (Option<i32>, String) {
    let output = posescope()
        .arg("view")
        .arg(sequence.folder())
        .args(["--query", "5", "--reference", "4", "--method", "fb,mi"])
        .args(more)
        .output()
        .expect("the binary starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), said)
}

/// Colours of a picture.
fn colours(path: &Path) -> usize {
    let picture = image::open(path).expect("a picture").into_rgb8();
    let mut colours: Vec<_> = picture.pixels().map(|pixel| pixel.0).collect();
    colours.sort_unstable();
    colours.dedup();
    colours.len()
}

#[test]
fn a_view_is_painted_without_a_window() {
    let sequence = SmallSequence::write();
    let path = sequence.path().join("pictures/surface.png");
    let file = path.to_string_lossy().into_owned();
    let surface = ["--view", "surface", "--at", "mi", "--window", "640x400"];
    let (code, said) = shot(
        &sequence,
        &[&surface[..], &["--screenshot", &file]].concat(),
    );
    if said.contains("no graphics adapter") {
        assert_eq!(code, Some(3), "{said}");
        println!("skipped: no graphics adapter");
        return;
    }
    assert_eq!(code, Some(0), "{said}");
    let picture = image::open(&path).expect("a picture").into_rgb8();
    assert_eq!(picture.dimensions(), (640, 400));
    assert!(colours(&path) > 100, "the map has many colours");

    // The same again is the same picture; on a light ground it is another one.
    let first = std::fs::read(&path).expect("readable");
    let (code, said) = shot(
        &sequence,
        &[&surface[..], &["--screenshot", &file]].concat(),
    );
    assert_eq!(code, Some(0), "{said}");
    assert!(std::fs::read(&path).expect("readable") == first);
    let (code, said) = shot(
        &sequence,
        &[&surface[..], &["--light", "--screenshot", &file]].concat(),
    );
    assert_eq!(code, Some(0), "{said}");
    assert!(std::fs::read(&path).expect("readable") != first);
}

#[test]
fn what_is_not_there_is_said_in_one_line() {
    let sequence = SmallSequence::write();
    let out = sequence.path().join("x.png").to_string_lossy().into_owned();
    let with_out = |more: &[&'static str]| -> (Option<i32>, String) {
        let more: Vec<&str> = more.iter().copied().chain(["--screenshot", &out]).collect();
        shot(&sequence, &more)
    };
    let (code, said) = with_out(&["--view", "surfaces"]);
    assert_eq!(code, Some(2), "{said}");
    let (code, said) = with_out(&["--window", "10x10"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("64 to 8192"), "{said}");
    let (code, said) = with_out(&["--at", "pm"]);
    if said.contains("no graphics adapter") {
        println!("skipped: no graphics adapter");
        return;
    }
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("add it to --method"), "{said}");
    let (code, said) = with_out(&["--at", "9999999"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("the run has the steps 0 to"), "{said}");
    let (code, said) = shot(&sequence, &["--screenshot", "/dev/null/x.png"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("/dev/null"), "{said}");
}
