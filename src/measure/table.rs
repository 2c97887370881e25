//! Tables as Markdown, CSV and LaTeX.

/// Cells of text under a header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// The name of its files.
    pub name: String,
    /// What the table shows.
    pub caption: String,
    /// One cell per column.
    pub header: Vec<String>,
    /// The rows, each with as many cells as the header.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new(
        name: impl Into<String>,
        caption: impl Into<String>,
        header: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        Self {
            name: name.into(),
            caption: caption.into(),
            header: header.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; cells that are missing stay empty.
    pub fn push(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        let mut row: Vec<String> = cells.into_iter().map(Into::into).collect();
        row.resize(self.header.len(), String::new());
        self.rows.push(row);
    }

    /// With the caption above; the first column to the left, the others to the right.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = "--:|".repeat(self.header.len().saturating_sub(1));
        let mut text = format!("{}\n\n{}|:--|{rule}\n", self.caption, line(&self.header));
        for row in &self.rows {
            text += &line(row);
        }
        text
    }

    /// With the header as first record.
    ///
    /// # Errors
    /// Never: it is written to memory. The writer has to be asked all the same.
    pub fn csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.header)?;
        for row in &self.rows {
            writer.write_record(row)?;
        }
        writer
            .into_inner()
            .map_err(|error| csv::Error::from(error.into_error()))
    }

    /// A `table` environment with rules of `booktabs`.
    pub fn latex(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| escaped(cell)).collect();
            format!("    {} \\\\\n", cells.join(" & "))
        };
        let columns = "r".repeat(self.header.len().saturating_sub(1));
        let mut text = format!(
            "% needs \\usepackage{{booktabs}}\n\\begin{{table}}\n  \\centering\n  \\caption{{{}}}\n  \
             \\begin{{tabular}}{{l{columns}}}\n    \\toprule\n",
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
            '←' => escaped.push_str("$\\leftarrow$"),
            '–' => escaped.push_str("--"),
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_form_holds_what_would_break_it() {
        let mut table = Table::new("t", "100 % of a_b", ["method", "RMSE (m)"]);
        table.push(["a|b, \"c\"", "1.0"]);
        table.push(["only"]);
        let markdown = "100 % of a_b\n\n| method | RMSE (m) |\n|:--|--:|\n\
                        | a\\|b, \"c\" | 1.0 |\n| only |  |\n";
        assert_eq!(table.markdown(), markdown);
        let csv = String::from_utf8(table.csv().expect("in memory")).expect("text");
        assert_eq!(csv, "method,RMSE (m)\n\"a|b, \"\"c\"\"\",1.0\nonly,\n");
        let latex = table.latex();
        assert!(latex.contains("\\caption{100 \\% of a\\_b}"), "{latex}");
        assert!(latex.contains("\\begin{tabular}{lr}"), "{latex}");
        assert!(latex.contains("    only &  \\\\\n"), "{latex}");
    }
}
