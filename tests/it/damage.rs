//! Damaged scenes: what a reader says of each damage, as a table `(file, damage, words)`.

use std::fs;
use std::path::Path;

use image::GrayImage;
use posescope::scene;
use tempfile::TempDir;

/// What is done to a file.
#[derive(Clone, Copy, Debug)]
pub enum Damage {
    /// It has this text and no other.
    Text(&'static str),
    /// The first text is there no more, but the second.
    Swap(&'static str, &'static str),
    /// These bytes stand at a place.
    Bytes(usize, &'static [u8]),
    /// So many bytes are missing at the end.
    Cut(usize),
    /// An image of this size.
    Image(u32, u32),
    /// There is no such file.
    Gone,
}

impl Damage {
    fn apply(self, path: &Path) {
        let read = || fs::read(path).expect("was written");
        let bytes = match self {
            Self::Text(text) => text.into(),
            Self::Swap(from, to) => {
                let text = String::from_utf8(read()).expect("is text");
                assert!(text.contains(from), "{from}");
                text.replacen(from, to, 1).into_bytes()
            }
            Self::Bytes(at, new) => {
                let mut bytes = read();
                bytes[at..at + new.len()].copy_from_slice(new);
                bytes
            }
            Self::Cut(count) => {
                let mut bytes = read();
                bytes.truncate(bytes.len() - count);
                bytes
            }
            Self::Image(width, height) => {
                return GrayImage::new(width, height).save(path).expect("writable");
            }
            Self::Gone => return fs::remove_file(path).expect("was written"),
        };
        fs::write(path, bytes).expect("writable");
    }
}

/// Writes a scene below a folder for each row of a table, damages it, and expects one line with all words
/// of the row. `write` says what the scene's argument is.
#[track_caller]
pub fn expect(write: impl Fn(&Path) -> String, table: &[(&str, Damage, &[&str])]) {
    for (file, damage, words) in table {
        let root = TempDir::new().expect("a folder");
        let argument = write(root.path());
        damage.apply(&root.path().join(file));
        let error = first_error(&argument);
        let error = error.unwrap_or_else(|| panic!("{file} {damage:?}: no error"));
        expect_words(&error, words);
    }
}

/// One line that has all of the words.
#[track_caller]
pub fn expect_words(error: &str, words: &[&str]) {
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    for word in words {
        assert!(error.contains(word), "`{word}` is missing in: {error}");
    }
}

/// What is said of a scene, or of the first frame that cannot be used.
fn first_error(argument: &str) -> Option<String> {
    let scene = match scene::open(argument, None) {
        Ok(scene) => scene,
        Err(error) => return Some(error.to_string()),
    };
    let of_frame = |frame| scene.query(frame).err().or(scene.reference(frame).err());
    let mut frames = 0..scene.frames().len();
    frames.find_map(of_frame).map(|error| error.to_string())
}
