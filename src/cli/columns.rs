//! Results in columns, for terminals of any width and for pipes: no rules, and no word is broken.

/// Rows with a few short cells and a note each.
///
/// Where everything fits, a row is a line. Where it does not, rows whose first cells are the same stand
/// below these, and each note below its row.
pub struct Columns<const CELLS: usize> {
    header: [&'static str; CELLS],
    /// What the notes are called.
    note: &'static str,
    /// How many cells at the front are the same for several rows.
    shared: usize,
    /// Columns of numbers, which stand to the right.
    right: &'static [usize],
    rows: Vec<([String; CELLS], String)>,
}

impl<const CELLS: usize> Columns<CELLS> {
    /// Columns without rows.
    pub fn new(
        header: [&'static str; CELLS],
        note: &'static str,
        shared: usize,
        right: &'static [usize],
    ) -> Self {
        Self {
            header,
            note,
            shared,
            right,
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn push(&mut self, cells: [String; CELLS], note: String) {
        self.rows.push((cells, note));
    }

    /// The text for lines of at most so many characters; of any length in a pipe.
    pub fn text(&self, width: Option<usize>) -> String {
        let header = self.header.map(str::to_owned);
        let lines: Vec<String> = self.lines(&header, self.note, 0);
        match width {
            Some(width) if lines.iter().any(|line| length(line) > width) => self.narrow(width),
            _ => lines.iter().map(|line| line.clone() + "\n").collect(),
        }
    }

    /// The header and each row as one line, from this column on.
    fn lines(&self, header: &[String; CELLS], note: &str, from: usize) -> Vec<String> {
        let all = || self.rows.iter().map(|(cells, _)| cells).chain([header]);
        let widths: Vec<usize> = (from..CELLS)
            .map(|at| all().map(|cells| length(&cells[at])).max().unwrap_or(0))
            .collect();
        let line = |cells: &[String; CELLS], note: &str| {
            let mut line = String::new();
            for (at, width) in (from..CELLS).zip(&widths) {
                let cell = &cells[at];
                let blank = " ".repeat(width.saturating_sub(length(cell)));
                line += &match self.right.contains(&at) {
                    true => format!("{blank}{cell}  "),
                    false => format!("{cell}{blank}  "),
                };
            }
            (line + note).trim_end().to_owned()
        };
        let rows = self.rows.iter().map(|(cells, about)| match note {
            "" => line(cells, ""),
            _ => line(cells, about),
        });
        [line(header, note)].into_iter().chain(rows).collect()
    }

    fn narrow(&self, width: usize) -> String {
        let header = self.header.map(str::to_owned);
        let lines = self.lines(&header, "", self.shared);
        let (head, lines) = lines
            .split_first()
            .map_or(("", &[][..]), |(head, lines)| (head.as_str(), lines));
        let mut text = String::new();
        let mut last = None;
        for ((cells, note), line) in self.rows.iter().zip(lines) {
            let shared = &cells[..self.shared];
            if last.is_none() && shared.is_empty() {
                text += &format!("  {head}\n");
            } else if last != Some(shared) {
                if last.is_some() {
                    text.push('\n');
                }
                let parts = self.header.iter().zip(shared);
                let parts = parts.filter(|(_, cell)| !cell.is_empty());
                let parts: Vec<String> =
                    parts.map(|(name, cell)| format!("{name} {cell}")).collect();
                text += &wrapped(&parts.join(", "), width, "");
                text += &format!("  {head}\n");
            }
            last = Some(shared);
            text += &format!("  {line}\n");
            if !note.is_empty() {
                text += &wrapped(&format!("    {note}"), width, "    ");
            }
        }
        text
    }
}

/// A paragraph in lines of at most so many characters, those behind the first with this before them. The
/// first keeps its own blanks at the front; a word that is longer than a line has one for itself.
pub fn wrapped(paragraph: &str, width: usize, indent: &str) -> String {
    let words = paragraph.trim_start();
    let mut line = paragraph[..paragraph.len() - words.len()].to_owned();
    let mut text = String::new();
    let mut is_empty = true;
    for word in words.split_whitespace() {
        if !is_empty && length(&line) + 1 + length(word) > width {
            text += &line;
            text.push('\n');
            line = indent.to_owned();
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line += word;
        is_empty = false;
    }
    text + &line + "\n"
}

/// What something is called, and a paragraph about it beside that.
pub fn beside(label: &str, paragraph: &str, width: Option<usize>) -> String {
    let indent = " ".repeat(length(label));
    let width = width.map_or(usize::MAX, |width| width.saturating_sub(indent.len()));
    let lines = wrapped(paragraph, width, "");
    let mut text = String::new();
    for (number, line) in lines.lines().enumerate() {
        text += if number == 0 { label } else { &indent };
        text += line;
        text.push('\n');
    }
    text
}

fn length(text: &str) -> usize {
    text.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Columns<3> {
        let mut columns = Columns::new(["query", "method", "error"], "evidence", 1, &[2]);
        for (query, method, error, note) in [
            (
                "000070",
                "fb",
                "0.1 m",
                "20 inliers of 61 matches with depth",
            ),
            (
                "000070",
                "mi",
                "12.5 m",
                "D3 the search missed a cheaper pose near the truth",
            ),
            ("000071", "fb", "", ""),
        ] {
            columns.push([query, method, error].map(str::to_owned), note.to_owned());
        }
        columns
    }

    #[test]
    fn a_row_is_a_line_where_everything_fits() {
        let expected = "\
query   method   error  evidence
000070  fb       0.1 m  20 inliers of 61 matches with depth
000070  mi      12.5 m  D3 the search missed a cheaper pose near the truth
000071  fb
";
        assert_eq!(columns().text(None), expected);
        assert_eq!(columns().text(Some(80)), expected);
    }

    #[test]
    fn where_it_does_not_fit_what_is_shared_stands_above_and_notes_below() {
        let expected = "\
query 000070
  method   error
  fb       0.1 m
    20 inliers of 61 matches with depth
  mi      12.5 m
    D3 the search missed a cheaper pose
    near the truth

query 000071
  method   error
  fb
";
        assert_eq!(columns().text(Some(40)), expected);
    }

    #[test]
    fn words_stay_whole() {
        assert_eq!(wrapped("  a bc def", 6, "__"), "  a bc\n__def\n");
        assert_eq!(
            wrapped("incomprehensible a", 6, ""),
            "incomprehensible\na\n"
        );
        assert_eq!(wrapped("", 6, ""), "\n");
        assert_eq!(beside("odd  ", "one two", Some(9)), "odd  one\n     two\n");
    }
}
