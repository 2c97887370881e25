//! The binary under test, as its user drives it.

use std::fs;
use std::path::Path;
use std::process::{Child, Command as Process, Stdio};

use assert_cmd::Command;
use posescope::localize::QueryResult;
use serde::de::DeserializeOwned;

/// The binary, with its cache below the build folder: the user's own is none of a test's business.
pub fn posescope() -> Command {
    let mut command = Command::cargo_bin("posescope").expect("the binary is built");
    command.env("POSESCOPE_CACHE", CACHE).env_remove("COLUMNS");
    command
}

/// Shared by the tests that do not test it.
pub const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache");

/// The binary with the arguments of a line, as a shell takes them, to be started in a folder.
pub fn command_in(folder: &Path, line: &str) -> Command {
    let mut command = posescope();
    let words = shlex::split(line).expect("words");
    command.current_dir(folder).args(words);
    command
}

/// The same, at work while the test goes on.
pub fn background_in(folder: &Path, line: &str) -> Child {
    let mut command = Process::new(assert_cmd::cargo::cargo_bin!("posescope"));
    command.env("POSESCOPE_CACHE", CACHE).current_dir(folder);
    command.args(shlex::split(line).expect("words"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the binary starts")
}

/// Runs the binary in a folder with the arguments of a line, as a shell takes them.
pub fn run_in(folder: &Path, line: &str) -> Said {
    Said::by(&mut command_in(folder, line))
}

/// What a program said, and how it ended.
pub struct Said {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Said {
    pub fn by(command: &mut Command) -> Self {
        Self::of(&command.output().expect("the binary starts"))
    }

    pub fn of(output: &std::process::Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (code, out, err) = (output.status.code(), &output.stdout, &output.stderr);
        let (out, err) = (text(out), text(err));
        Self { code, out, err }
    }

    /// It ended well.
    #[track_caller]
    pub fn ok(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.err);
        self
    }

    /// It ended with an exit code and these words on stderr; see [`has`].
    #[track_caller]
    pub fn fails_with(self, code: i32, words: &str) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.err);
        has(&self.err, words);
        self
    }

    /// It ended with an exit code, and the last line on stderr has all the words.
    #[track_caller]
    pub fn fails(self, code: i32, words: &str) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.err);
        has(self.err.trim_end().lines().last().unwrap_or(""), words);
        self
    }

    /// The same, and the line is the only one.
    #[track_caller]
    pub fn fails_in_one_line(self, code: i32, words: &str) -> Self {
        assert_eq!(self.err.trim_end().lines().count(), 1, "{}", self.err);
        self.fails(code, words)
    }

    /// The results that it printed, each on a line, after it ended well.
    #[track_caller]
    pub fn results(self) -> Vec<QueryResult> {
        objects(&self.ok().out)
    }
}

/// The lines of a text, each a JSON object.
#[track_caller]
pub fn objects<T: DeserializeOwned>(text: &str) -> Vec<T> {
    let read = |line| serde_json::from_str(line).expect("an object per line");
    text.lines().map(read).collect()
}

/// A text has all of these words, which ` ~ ` separates.
#[track_caller]
pub fn has(text: &str, words: &str) {
    for word in words.split(" ~ ") {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

/// Runs every line of a table `exit code | arguments | words`, and expects one line with the words.
#[track_caller]
pub fn refused(folder: &Path, table: &str) {
    for row in table.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let [code, line, words] = cells(row);
        run_in(folder, line).fails(code.parse().expect("a code"), words);
    }
}

/// The cells of a row, which ` | ` separates.
#[track_caller]
pub fn cells<const N: usize>(row: &str) -> [&str; N] {
    let cells: Vec<&str> = row.split(" | ").map(str::trim).collect();
    cells.try_into().unwrap_or_else(|_| panic!("{N} cells: {row}"))
}

/// What a file says.
#[track_caller]
pub fn text(path: impl AsRef<Path>) -> String {
    let path = path.as_ref();
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Writes a file.
#[track_caller]
pub fn write(path: impl AsRef<Path>, content: impl AsRef<[u8]>) {
    let path = path.as_ref();
    fs::write(path, content).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

/// Whole lines in a file that may not be there yet.
pub fn lines(path: impl AsRef<Path>) -> usize {
    let bytes = fs::read(path).unwrap_or_default();
    bytes.iter().filter(|byte| **byte == b'\n').count()
}

/// A path as an argument.
pub fn arg(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// A command line of the binary that can write no file of more than this size \[kB\], if there is a shell that limits
/// it.
pub fn with_files_up_to(size_kb: u32, line: &str) -> Option<Command> {
    let is_there = Process::new("bash").arg("--version").output().is_ok();
    if !is_there {
        println!("skipped: no bash");
        return None;
    }
    let binary = assert_cmd::cargo::cargo_bin!("posescope").display();
    let mut command = Command::new("bash");
    command.args(["-c", &format!("trap '' XFSZ; ulimit -f {size_kb}; exec '{binary}' {line}")]);
    Some(command)
}

/// Where a text first gives a length in metres, with the words before it.
pub fn first_metre(text: &str) -> Option<String> {
    let after_number = text.match_indices(" m").filter(|&(at, _)| {
        let is_after_number = text[..at].ends_with(|c: char| c.is_ascii_digit() || c == ')');
        let is_word = text[at + 2..].starts_with(|c: char| c.is_alphanumeric() || c == '²');
        is_after_number && !is_word
    });
    let in_brackets = ["(m)", "[m]"].into_iter().flat_map(|unit| text.match_indices(unit));
    let (at, found) = after_number.chain(in_brackets).min_by_key(|&(at, _)| at)?;
    let around: Vec<char> = text[..at + found.len()].chars().collect();
    Some(around[around.len().saturating_sub(80)..].iter().collect())
}
