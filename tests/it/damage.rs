//! Damaged scenes: what a reader says of each damage, as a table `file | damage | words`.

use std::fs;
use std::path::Path;

use image::GrayImage;
use posescope::scene;
use tempfile::TempDir;

use crate::binary::{arg, cells, has};

/// Writes a scene below a folder for each row of a table, damages it, and expects one line with all words
/// of the row. `write` says what the scene's argument is.
///
/// A damage is `text WORDS` (a file has these alone), `WORDS -> OTHERS` (the first are there no more but the
/// second), `cut N` (bytes at the end), `at N WORDS` (they stand at that byte), `image WxH` or `gone`; `\n`
/// and `\xNN` are what they are in Rust.
#[track_caller]
pub fn expect(write: impl Fn(&Path) -> String, table: &str) {
    for row in table.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let [file, damage, words] = cells(row);
        let root = TempDir::new().expect("a folder");
        let argument = write(root.path());
        apply(damage, &root.path().join(file));
        let error = first_error(&argument).unwrap_or_else(|| panic!("no error: {row}"));
        expect_words(&error, words);
    }
}

fn apply(damage: &str, path: &Path) {
    let whole = || fs::read(path).expect("was written");
    let bytes = if let Some((from, to)) = damage.split_once("->") {
        let text = String::from_utf8(whole()).expect("is text");
        let (from, to) = (unescaped(from.trim()), unescaped(to.trim()));
        let [from, to] = [from, to].map(|words| String::from_utf8(words).expect("is text"));
        assert!(text.contains(&from), "{from}");
        text.replacen(&from, &to, 1).into_bytes()
    } else {
        let (what, more) = damage.split_once(' ').unwrap_or((damage, ""));
        let number = |word: &str| word.parse::<usize>().expect("a number");
        match what {
            "text" => unescaped(more),
            "cut" => {
                let bytes = whole();
                bytes[..bytes.len() - number(more)].to_vec()
            }
            "at" => {
                let (at, new) = more.split_once(' ').expect("a place and bytes");
                let (mut bytes, at, new) = (whole(), number(at), unescaped(new));
                bytes[at..at + new.len()].copy_from_slice(&new);
                bytes
            }
            "image" => {
                let (width, height) = more.split_once('x').expect("a size");
                let image = GrayImage::new(number(width) as u32, number(height) as u32);
                return image.save(path).expect("writable");
            }
            "gone" => return fs::remove_file(path).expect("was written"),
            _ => panic!("`{damage}` is no damage"),
        }
    };
    fs::write(path, bytes).expect("writable");
}

fn unescaped(words: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = words;
    while let Some((before, after)) = rest.split_once('\\') {
        bytes.extend(before.bytes());
        let (kind, after) = after.split_at(1);
        let (byte, length) = match kind {
            "n" => (b'\n', 0),
            _ => (u8::from_str_radix(&after[..2], 16).expect("two digits"), 2),
        };
        bytes.push(byte);
        rest = &after[length..];
    }
    bytes.extend(rest.bytes());
    bytes
}

/// One line that has all of the words.
#[track_caller]
pub fn expect_words(error: &str, words: &str) {
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    has(error, words);
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

/// Opens a scene.
#[track_caller]
pub fn open(argument: impl AsRef<Path>) -> Box<dyn scene::Scene> {
    scene::open(arg(argument.as_ref()), None).unwrap_or_else(|error| panic!("{error}"))
}
