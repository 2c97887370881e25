//! Messages.

use std::io::{self, Write as _};

/// Prints a line on stderr. Where nobody reads it, the command goes on.
pub fn tell(line: &str) {
    writeln!(io::stderr(), "{}", plain(line)).ok();
}

/// A text without characters that control a terminal, such as those in the name of a file.
pub fn plain(text: &str) -> String {
    let is_plain = |c: char| !c.is_control() || c == '\n' || c == '\t';
    text.chars().map(|c| if is_plain(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}
