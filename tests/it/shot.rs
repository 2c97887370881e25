//! `posescope view --screenshot` as a process.

use std::path::Path;

use crate::binary::Said;
use crate::small_sequence::SmallSequence;

fn shot(sequence: &SmallSequence, words: &str) -> Said {
    let line = "view sequences/42 --query 5 --reference 4 --method fb,mi --screenshot";
    sequence.run(&format!("{line} {words}"))
}

fn is_skipped(said: &Said) -> bool {
    let is_skipped = said.code == Some(3) && said.err.contains("no graphics adapter");
    if is_skipped {
        println!("skipped: no graphics adapter");
    }
    is_skipped
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
fn the_window_is_painted_without_a_display() {
    let sequence = SmallSequence::write();
    let path = sequence.path().join("pictures/window.png");
    let asked = "pictures/window.png --at mi --window 900x600";
    let said = shot(&sequence, asked);
    if is_skipped(&said) {
        return;
    }
    said.ok();
    let picture = image::open(&path).expect("a picture").into_rgb8();
    assert_eq!(picture.dimensions(), (900, 600));
    assert!(colours(&path) > 100, "the map has many colours");

    // The same again is the same picture; on a light ground it is another one.
    let first = std::fs::read(&path).expect("readable");
    shot(&sequence, asked).ok();
    assert!(std::fs::read(&path).expect("readable") == first);
    shot(&sequence, &format!("{asked} --light")).ok();
    assert!(std::fs::read(&path).expect("readable") != first);
}

#[test]
fn what_is_not_there_is_said_in_one_line() {
    let sequence = SmallSequence::write();
    shot(&sequence, "x.png --window 10x10").fails_with(2, "64 to 8192");
    let said = shot(&sequence, "x.png --at pm");
    if is_skipped(&said) {
        return;
    }
    said.fails_with(2, "add it to --method");
    shot(&sequence, "x.png --at 9999999").fails_with(2, "the run has the steps 0 to");
    shot(&sequence, "/dev/null/x.png").fails_with(3, "/dev/null");
}
