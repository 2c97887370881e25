//! Tables of a run for a terminal: as they are where they fit its width, otherwise a line per figure.

use posescope::measure::Table;

use super::columns::wrapped;

/// The table with its caption, in lines of at most `width` characters. Without a width, for a pipe, it is
/// Markdown, as in the run's folder.
pub fn text(table: &Table, width: Option<usize>) -> String {
    let Some(width) = width else {
        return table.markdown();
    };
    let caption = wrapped(&table.caption, width, "");
    let lines = aligned(table);
    match lines.iter().all(|line| line.chars().count() <= width) {
        true => format!("{caption}\n{}\n", lines.join("\n")),
        false => format!("{caption}\n{}", turned(table, width)),
    }
}

/// The first column to the left, the others to the right.
fn aligned(table: &Table) -> Vec<String> {
    let all = || table.rows.iter().chain([&table.header]);
    let widths: Vec<usize> = (0..table.header.len())
        .map(|at| all().map(|row| length(row, at)).max().unwrap_or(0))
        .collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(at, (cell, width))| padded(cell, *width, at > 0));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    [&table.header]
        .into_iter()
        .chain(&table.rows)
        .map(line)
        .collect()
}

/// A line per column, and beside each other as many rows as fit. Rows of several methods stand below what
/// they have in common.
fn turned(table: &Table, width: usize) -> String {
    let is_by_method = table.header.get(1).is_some_and(|name| name == "method");
    let key = usize::from(is_by_method);
    let labels = table.header.iter().skip(key + 1);
    let label_width = labels.map(|label| label.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let groups = table
        .rows
        .chunk_by(|a, b| !is_by_method || a.first() == b.first());
    for group in groups {
        if let (true, Some(first)) = (is_by_method, group.first()) {
            text += &format!("{}\n", first[0]);
        }
        let mut rest = group;
        while !rest.is_empty() {
            let widths: Vec<usize> = rest
                .iter()
                .map(|row| {
                    (key..row.len())
                        .map(|at| length(row, at))
                        .max()
                        .unwrap_or(0)
                })
                .collect();
            let mut taken = 2 + label_width;
            let fits = widths.iter().take_while(|width_of_row| {
                taken += 2 + **width_of_row;
                taken <= width
            });
            let count = fits.count().max(1);
            let (now, later) = rest.split_at(count);
            for at in key..table.header.len() {
                // The names of rows need none themselves.
                let label = if at == key { "" } else { &table.header[at] };
                let cells = now.iter().zip(&widths);
                let cells = cells.map(|(row, width)| padded(&row[at], *width, true));
                let cells: Vec<String> = cells.collect();
                text += format!(
                    "  {}  {}",
                    padded(label, label_width, false),
                    cells.join("  ")
                )
                .trim_end();
                text.push('\n');
            }
            text.push('\n');
            rest = later;
        }
    }
    text
}

fn length(row: &[String], at: usize) -> usize {
    row.get(at).map_or(0, |cell| cell.chars().count())
}

fn padded(cell: &str, width: usize, is_number: bool) -> String {
    let blank = " ".repeat(width.saturating_sub(cell.chars().count()));
    match is_number {
        true => blank + cell,
        false => cell.to_owned() + &blank,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_turned_where_it_is_too_wide_and_markdown_in_a_pipe() {
        let mut table = Table::new(
            "t",
            "How well it went",
            ["", "method", "queries", "success (%)"],
        );
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
        assert_eq!(text(&table, Some(80)), wide);
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
        assert_eq!(text(&table, Some(30)), narrow);
        assert_eq!(text(&table, None), table.markdown());
    }
}
