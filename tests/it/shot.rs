//! `posescope shot` as a process.

use std::path::Path;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

/// What a run of the command said, and its exit code.
fn shot(sequence: &SmallSequence, more: &[&str]) -> (Option<i32>, String) {
    let output = posescope()
        .arg("shot")
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
    let surface = ["--view", "surface", "--at", "mi", "--size", "640x400"];
    let (code, said) = shot(&sequence, &[&surface[..], &["--out", &file]].concat());
    if said.contains("no graphics adapter") {
        assert_eq!(code, Some(3), "{said}");
        println!("skipped: no graphics adapter");
        return;
    }
    assert_eq!(code, Some(0), "{said}");
    let picture = image::open(&path).expect("a picture").into_rgb8();
    assert_eq!(picture.dimensions(), (640, 400));
    assert!(colours(&path) > 100, "the map has many colours");

    // The same again is the same picture; at the truth the view is another one.
    let first = std::fs::read(&path).expect("readable");
    let (code, said) = shot(&sequence, &[&surface[..], &["--out", &file]].concat());
    assert_eq!(code, Some(0), "{said}");
    assert!(std::fs::read(&path).expect("readable") == first);
    let (code, said) = shot(
        &sequence,
        &[&surface[..], &["--pose", "truth", "--out", &file]].concat(),
    );
    assert_eq!(code, Some(0), "{said}");
    assert!(std::fs::read(&path).expect("readable") != first);
}

#[test]
fn what_is_not_there_is_said_in_one_line() {
    let sequence = SmallSequence::write();
    let out = sequence.path().join("x.png").to_string_lossy().into_owned();
    let with_out = |more: &[&'static str]| -> (Option<i32>, String) {
        let more: Vec<&str> = more.iter().copied().chain(["--out", &out]).collect();
        shot(&sequence, &more)
    };
    let (code, said) = with_out(&["--view", "surfaces"]);
    assert_eq!(code, Some(2), "{said}");
    let (code, said) = with_out(&["--size", "10x10"]);
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
    let (code, said) = shot(&sequence, &["--out", "/dev/null/x.png"]);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("/dev/null"), "{said}");
}

/// A drawing needs no graphics adapter.
#[test]
fn a_view_is_drawn_as_shapes_and_words() {
    let sequence = SmallSequence::write();
    let path = sequence.path().join("pictures/surface.svg");
    let file = path.to_string_lossy().into_owned();
    let surface = ["--view", "surface", "--at", "mi", "--size", "760x900"];
    let (code, said) = shot(&sequence, &[&surface[..], &["--out", &file]].concat());
    assert_eq!(code, Some(0), "{said}");
    let text = std::fs::read_to_string(&path).expect("written");
    assert!(text.starts_with("<svg ") && text.contains("viewBox=\"0 0 760 900\""));
    // Words are words, the map is a picture, marks and curves are shapes.
    for part in [
        ">coarse minimum (",
        ">truth (",
        "<image ",
        "<polyline ",
        "<circle ",
        ">Cost 0.",
    ] {
        assert!(text.contains(part), "{part} in {}", &text[..400]);
    }
    let parsed = elements_of(&text);
    assert!(parsed > 100, "{parsed} elements");

    // The same again is the same drawing.
    let (code, _) = shot(&sequence, &[&surface[..], &["--out", &file]].concat());
    assert_eq!(code, Some(0));
    assert!(std::fs::read_to_string(&path).expect("written") == text);
    for (more, words) in [
        (&["--view", "space"][..], "only its pixels are known"),
        (&[][..], "name one of its views"),
    ] {
        let (code, said) = shot(&sequence, &[more, &["--out", &file]].concat());
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(words), "{said}");
    }
}

/// Counts the elements of a document whose tags are closed in the order in which they were opened.
fn elements_of(text: &str) -> usize {
    let mut open: Vec<&str> = Vec::new();
    let mut count = 0;
    for tag in text.split('<').skip(1) {
        let (tag, rest) = tag.split_once('>').expect("every tag ends");
        assert!(!rest.contains('>'), "{rest}");
        match tag.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name)),
            None => {
                count += 1;
                if !tag.ends_with('/') {
                    open.push(tag.split_whitespace().next().expect("a name"));
                }
            }
        }
    }
    assert!(open.is_empty(), "{open:?}");
    count
}
