//! Text tables, for terminals of any width, pipes, Markdown, CSV and LaTeX.

use unicode_width::UnicodeWidthStr as _;

use crate::scale::LengthUnit;

/// The alignment of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
    /// Sentences, which wrap below their row in a narrow terminal.
    Note,
}

/// Cells of text under a header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// A name for file names.
    pub name: String,
    /// The caption.
    pub caption: String,
    /// One cell per column.
    pub header: Vec<String>,
    /// The rows, each with as many cells as the header.
    pub rows: Vec<Vec<String>>,
    /// One per column. Only the last can be [`Align::Note`].
    pub align: Vec<Align>,
    /// How many leading cells consecutive rows share.
    pub shared: usize,
}

impl Table {
    /// Says in the unit what names and cells say in metres.
    #[must_use]
    pub fn in_words_of(mut self, unit: LengthUnit) -> Self {
        let cells = self.header.iter_mut().chain(self.rows.iter_mut().flatten());
        for text in cells.chain([&mut self.caption]) {
            *text = unit.words(text);
        }
        self
    }

    /// A table without rows: the first column is text, the others are numbers.
    pub fn new(
        name: impl Into<String>,
        caption: impl Into<String>,
        header: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        let header: Vec<String> = header.into_iter().map(Into::into).collect();
        let align = (0..header.len()).map(|at| match at {
            0 => Align::Left,
            _ => Align::Right,
        });
        Self {
            name: name.into(),
            caption: caption.into(),
            align: align.collect(),
            header,
            rows: Vec::new(),
            shared: 0,
        }
    }

    /// A table without name and caption. Columns in `right` are numbers, the last one is sentences, the others are
    /// text.
    pub fn with_notes<const N: usize>(header: [&str; N], right: &[usize], shared: usize) -> Self {
        let align = (0..N).map(|at| match at {
            at if at + 1 == N => Align::Note,
            at if right.contains(&at) => Align::Right,
            _ => Align::Left,
        });
        Self { align: align.collect(), shared, ..Self::new("", "", header) }
    }

    /// Adds a row; missing cells are empty.
    pub fn push(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        let mut row: Vec<String> = cells.into_iter().map(Into::into).collect();
        row.resize(self.header.len(), String::new());
        self.rows.push(row);
    }

    /// The table for a terminal of this width, or for a pipe, where lines may have any length.
    ///
    /// If a row does not fit, the layout changes: sentences wrap below their rows, and shared cells are above
    /// them. A table without sentences is transposed.
    pub fn to_text(&self, width: Option<usize>) -> String {
        if self.all().flatten().any(|cell| cell.contains(is_line_end)) {
            let one_line = |cell: &String| cell.replace(is_line_end, " ");
            let line = |row: &Vec<String>| row.iter().map(one_line).collect();
            let rows = self.rows.iter().map(line).collect();
            return Self { header: line(&self.header), rows, ..self.clone() }.to_text(width);
        }
        let limit = width.unwrap_or(usize::MAX);
        let caption = match self.caption.as_str() {
            "" => String::new(),
            caption => wrapped(caption, limit, "") + "\n",
        };
        let all: Vec<&[String]> = self.all().collect();
        let lines = aligned(&all, &self.align);
        let body = match lines.iter().all(|line| length(line) <= limit) {
            true => lines.iter().map(|line| line.clone() + "\n").collect(),
            false if self.align.last() == Some(&Align::Note) => self.with_notes_below(limit),
            false => self.turned(limit),
        };
        caption + &body
    }

    /// The header and the rows.
    fn all(&self) -> impl Iterator<Item = &[String]> {
        [&self.header].into_iter().chain(&self.rows).map(Vec::as_slice)
    }

    fn with_notes_below(&self, width: usize) -> String {
        let (from, to) = (self.shared, self.header.len() - 1);
        let inner: Vec<&[String]> = self.all().map(|row| &row[from..to]).collect();
        let mut lines = aligned(&inner, &self.align[from..to]).into_iter();
        let head = format!("  {}\n", lines.next().unwrap_or_default());
        let mut text = String::new();
        let mut last: Option<&[String]> = None;
        for (row, line) in self.rows.iter().zip(lines) {
            let shared = &row[..from];
            if last != Some(shared) {
                if last.is_some() {
                    text.push('\n');
                }
                let parts = self.header.iter().zip(shared);
                let parts = parts.filter(|(_, cell)| !cell.is_empty());
                let parts: Vec<String> =
                    parts.map(|(name, cell)| format!("{name} {cell}")).collect();
                if !parts.is_empty() {
                    text += &wrapped(&parts.join(", "), width, "");
                }
                text += &head;
            }
            last = Some(shared);
            text += &format!("  {line}\n");
            if !row[to].is_empty() {
                text += &wrapped(&format!("    {}", row[to]), width, "    ");
            }
        }
        text
    }

    /// The transposed table: a line per column, in blocks of as many rows as fit, below their shared cells.
    fn turned(&self, width: usize) -> String {
        let from = self.shared;
        let labels = self.header.iter().skip(from).enumerate();
        // The first column has the names of the rows and needs no label.
        let labels: Vec<&str> =
            labels.map(|(at, label)| if at == 0 { "" } else { label.as_str() }).collect();
        let label_width = labels.iter().map(|label| length(label)).max().unwrap_or(0);
        let mut text = String::new();
        for group in self.rows.chunk_by(|a, b| from == 0 || a[..from] == b[..from]) {
            if let (true, Some(first)) = (from > 0, group.first()) {
                text += &format!("{}\n", first[..from].join(", "));
            }
            let mut rest = group;
            while !rest.is_empty() {
                let mut taken = 2 + label_width;
                let fits = rest.iter().take_while(|row| {
                    let cells = row.iter().skip(from);
                    taken += 2 + cells.map(|cell| length(cell)).max().unwrap_or(0);
                    taken <= width
                });
                let (now, later) = rest.split_at(fits.count().max(1));
                let lines: Vec<Vec<String>> = (labels.iter().enumerate())
                    .map(|(at, label)| {
                        let cells = now.iter().map(|row| row[from + at].clone());
                        [(*label).to_owned()].into_iter().chain(cells).collect()
                    })
                    .collect();
                let lines: Vec<&[String]> = lines.iter().map(Vec::as_slice).collect();
                let mut align = vec![Align::Right; now.len() + 1];
                align[0] = Align::Left;
                for line in aligned(&lines, &align) {
                    text += &format!("  {line}\n");
                }
                text.push('\n');
                rest = later;
            }
        }
        text
    }

    /// As Markdown, with the caption above.
    pub fn to_markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell_of(cell)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = self.align.iter().map(|align| match align {
            Align::Right => "--:|",
            Align::Left | Align::Note => ":--|",
        });
        let caption = match self.caption.as_str() {
            "" => String::new(),
            caption => format!("{caption}\n\n"),
        };
        let rule: String = rule.collect();
        let mut text = format!("{caption}{}|{rule}\n", line(&self.header));
        for row in &self.rows {
            text += &line(row);
        }
        text
    }

    /// As CSV, with the header as first record.
    pub fn to_csv(&self) -> String {
        let record = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| quoted(cell)).collect();
            cells.join(",") + "\n"
        };
        self.all().map(record).collect()
    }

    /// As LaTeX: a `table` environment with `booktabs` rules.
    pub fn to_latex(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| escaped(cell)).collect();
            format!("    {} \\\\\n", cells.join(" & "))
        };
        let columns = self.align.iter().map(|align| match align {
            Align::Right => 'r',
            Align::Left | Align::Note => 'l',
        });
        let columns: String = columns.collect();
        let mut text = format!(
            "% needs \\usepackage{{booktabs}}\n\\begin{{table}}\n  \\centering\n  \\caption{{{}}}\n  \
             \\begin{{tabular}}{{{columns}}}\n    \\toprule\n",
            escaped(&self.caption)
        );
        text += &line(&self.header);
        text += "    \\midrule\n";
        for row in &self.rows {
            text += &line(row);
        }
        text + "    \\bottomrule\n  \\end{tabular}\n\\end{table}\n"
    }
}

/// The aligned lines of rows. Sentences are not padded.
fn aligned(rows: &[&[String]], align: &[Align]) -> Vec<String> {
    let width = |at: usize| rows.iter().map(|row| length(&row[at])).max().unwrap_or(0);
    let widths: Vec<usize> = (0..align.len()).map(width).collect();
    let space = |cell: &String, width: usize| " ".repeat(width - length(cell));
    let line = |row: &&[String]| {
        let cells = row.iter().zip(&widths).zip(align);
        let cells = cells.map(|((cell, &width), align)| match align {
            Align::Left => format!("{cell}{}", space(cell, width)),
            Align::Right => format!("{}{cell}", space(cell, width)),
            Align::Note => cell.clone(),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// Wraps a paragraph at this many characters. The first line keeps its indentation, the others start with
/// `indent`. Words longer than a line are not split.
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

/// The columns of a terminal that a text takes.
fn length(text: &str) -> usize {
    text.width()
}

fn is_line_end(c: char) -> bool {
    c == '\n' || c == '\r'
}

/// A cell of a Markdown table. What would be a tag or a link is text.
fn cell_of(text: &str) -> String {
    let text = text.replace('|', "\\|").replace(is_line_end, " ").replace("](", "]\\(");
    let mut escaped = String::with_capacity(text.len());
    let mut rest = text.as_str();
    while let Some((before, after)) = rest.split_once('<') {
        let is_tag = after.starts_with(|c: char| c.is_alphabetic() || "/!?".contains(c));
        escaped += before;
        escaped += if is_tag { "&lt;" } else { "<" };
        rest = after;
    }
    escaped + rest
}

/// Whether a spreadsheet would compute a cell instead of showing it.
fn is_formula(cell: &str) -> bool {
    match cell.strip_prefix(['+', '-']) {
        Some(_) if cell.parse::<f64>().is_ok() => false,
        // Numbers with a unit.
        Some(rest) => !rest.chars().all(|c| c.is_alphanumeric() || " .,%°²/–".contains(c)),
        None => cell.starts_with(['=', '@', '\t', '\r']),
    }
}

/// A CSV field, quoted as in RFC 4180. What a spreadsheet would take for a formula begins with `'`.
fn quoted(cell: &str) -> String {
    if is_formula(cell) {
        return format!("\"'{}\"", cell.replace('"', "\"\""));
    }
    if cell.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// Text escaped for LaTeX.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '%' | '&' | '#' | '_' | '$' | '{' | '}' => {
                escaped.push('\\');
                escaped.push(character);
            }
            '\\' => escaped.push_str("\\textbackslash{}"),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '°' => escaped.push_str("\\textdegree{}"),
            '≥' => escaped.push_str("$\\ge$"),
            '≤' => escaped.push_str("$\\le$"),
            '→' => escaped.push_str("$\\rightarrow$"),
            '\n' | '\r' => escaped.push(' '),
            '←' => escaped.push_str("$\\leftarrow$"),
            '–' => escaped.push_str("--"),
            _ => escaped.push(character),
        }
    }
    escaped
}

/// A number with its thousands marked.
pub(crate) fn grouped(number: f64, digits: usize) -> String {
    let text = format!("{:.digits$}", number.abs());
    let whole = text.split('.').next().unwrap_or_default();
    let mut words = String::new();
    for (at, digit) in text.char_indices() {
        if at > 0 && at < whole.len() && (whole.len() - at) % 3 == 0 {
            words.push(',');
        }
        words.push(digit);
    }
    let sign = if number < 0.0 { "-" } else { "" };
    format!("{sign}{words}")
}

/// A number with three digits that count.
pub(crate) fn three_digits(number: f64) -> String {
    match number.abs() {
        100.0.. => format!("{number:.0}"),
        10.0.. => format!("{number:.1}"),
        1.0.. => format!("{number:.2}"),
        _ => format!("{number:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_form_holds_what_would_break_it() {
        let mut table = Table::new("t", "100 % of a_b", ["method", "RMSE (m)"]);
        table.push(["a|b, \"c\"", "1.0"]);
        table.push(["only"]);
        table.push(["two\nlines", "a → b ≤ c"]);
        let markdown = "100 % of a_b\n\n| method | RMSE (m) |\n|:--|--:|\n\
                        | a\\|b, \"c\" | 1.0 |\n| only |  |\n| two lines | a → b ≤ c |\n";
        assert_eq!(table.to_markdown(), markdown);
        assert_eq!(
            table.to_csv(),
            "method,RMSE (m)\n\"a|b, \"\"c\"\"\",1.0\nonly,\n\"two\nlines\",a → b ≤ c\n"
        );
        let latex = table.to_latex();
        assert!(latex.contains("\\caption{100 \\% of a\\_b}"), "{latex}");
        assert!(latex.contains("\\begin{tabular}{lr}"), "{latex}");
        assert!(latex.contains("    only &  \\\\\n"), "{latex}");
        assert!(latex.contains("two lines & a $\\rightarrow$ b $\\le$ c"), "{latex}");
    }

    #[test]
    fn no_cell_is_a_formula_a_tag_or_a_second_line() {
        let mut table = Table::new("t", "", ["query", "x"]);
        for cell in [
            "=cmd|' /C calc'!A0",
            "@SUM(A1)",
            "-2+3+cmd|'x'!A0",
            "<img src=x>",
            "[a](http://b)",
            "c\nd",
        ] {
            table.push([cell, "-1.5"]);
        }
        let csv = table.to_csv();
        for cell in ["\"'=cmd", "\"'@SUM", "\"'-2+3", "\n<img", ",-1.5\n"] {
            assert!(csv.contains(cell), "{cell}: {csv}");
        }
        let markdown = table.to_markdown();
        assert!(markdown.contains("&lt;img") && markdown.contains("[a]\\(http"), "{markdown}");
        assert_eq!(table.to_text(None).lines().count(), 7);
        // Figures, and what is less than others, stay as they are.
        for cell in ["-1e-5", "-0.3 m", "+5.0 %", "-", "a < b", "000070"] {
            assert_eq!((quoted(cell), cell_of(cell)), (cell.to_owned(), cell.to_owned()));
        }
    }

    fn with_notes() -> Table {
        let mut table = Table::with_notes(["query", "method", "error", "evidence"], &[2], 1);
        for row in [
            ["000070", "fb", "0.1 m", "20 inliers of 61 matches with depth"],
            ["000070", "mi", "12.5 m", "D3 the search missed a cheaper pose near the truth"],
            ["000071", "fb", "", ""],
        ] {
            table.push(row);
        }
        table
    }

    #[test]
    fn a_row_is_a_line_where_everything_fits() {
        let expected = "\
query   method   error  evidence
000070  fb       0.1 m  20 inliers of 61 matches with depth
000070  mi      12.5 m  D3 the search missed a cheaper pose near the truth
000071  fb
";
        assert_eq!(with_notes().to_text(None), expected);
        assert_eq!(with_notes().to_text(Some(80)), expected);
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
        assert_eq!(with_notes().to_text(Some(40)), expected);
    }

    #[test]
    fn a_table_of_figures_is_turned_where_it_is_too_wide() {
        let mut table =
            Table::new("t", "How well it went", ["", "method", "queries", "success (%)"]);
        table.shared = 1;
        table.push(["street, 15 m", "FB", "3", "66.7"]);
        table.push(["street, 15 m", "MI", "3", "100.0"]);
        table.push(["town, 15 m", "FB", "4", "25.0"]);
        let wide = "\
How well it went

              method  queries  success (%)
street, 15 m      FB        3         66.7
street, 15 m      MI        3        100.0
town, 15 m        FB        4         25.0
";
        assert_eq!(table.to_text(Some(80)), wide);
        let narrow = "\
How well it went

street, 15 m
                 FB     MI
  queries         3      3
  success (%)  66.7  100.0

town, 15 m
                 FB
  queries         4
  success (%)  25.0

";
        assert_eq!(table.to_text(Some(30)), narrow);
    }

    #[test]
    fn wide_letters_take_two_columns() {
        let mut table = Table::new("t", "", ["scene", "n"]);
        table.push(["日本", "1"]);
        table.push(["rome", "2"]);
        assert_eq!(table.to_text(Some(80)), "scene  n\n日本   1\nrome   2\n");
    }

    #[test]
    fn words_stay_whole() {
        assert_eq!(wrapped("  a bc def", 6, "__"), "  a bc\n__def\n");
        assert_eq!(wrapped("incomprehensible a", 6, ""), "incomprehensible\na\n");
        assert_eq!(wrapped("", 6, ""), "\n");
    }
}
