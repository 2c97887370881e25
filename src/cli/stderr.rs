//! Messages.

use std::io::{self, Write as _};

/// The longest line of a message \[characters\]: what a file says may be as long as the file.
const LONGEST: usize = 2000;

/// Prints a line on stderr. Where nobody reads it, the command goes on.
pub fn tell(line: &str) {
    writeln!(io::stderr(), "{}", message(line)).ok();
}

/// A message with lines of readable length, without what controls a terminal.
pub fn message(text: &str) -> String {
    let cut = |line: &str| match line.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line.to_owned(),
    };
    plain(&text.split('\n').map(cut).collect::<Vec<_>>().join("\n"))
}

/// A text without characters that control a terminal or turn the direction of what follows, such as those in the name
/// of a file.
pub fn plain(text: &str) -> String {
    let is_plain = |c: char| match c {
        '\n' | '\t' => true,
        // Line separators, and marks that turn the direction.
        '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => false,
        c => !c.is_control(),
    };
    text.chars().map(|c| if is_plain(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_controls_a_terminal_is_shown_and_a_long_line_is_cut() {
        assert_eq!(plain("a\u{1b}[2J\u{9b}m\u{202e}b\r"), "a\u{fffd}[2J\u{fffd}m\u{fffd}b\u{fffd}");
        assert_eq!(plain("Zürich\t→ 東京\n"), "Zürich\t→ 東京\n");
        let long = message(&format!("first\n{}", "é".repeat(LONGEST + 1)));
        assert_eq!(long.lines().map(|line| line.chars().count()).max(), Some(LONGEST + 1));
        assert_eq!(message(&"é".repeat(LONGEST)), "é".repeat(LONGEST));
    }
}
