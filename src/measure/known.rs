//! Known failures: a list in the repository, so a CI job fails only for new failures.

use std::path::{Path, PathBuf};

use posescope_core::files;

use crate::diagnosis::Code;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::run::{FolderError, is_called};

/// A list of queries that are known to fail: `QUERY METHOD` or `QUERY METHOD CODE` per line, with comments after `#`.
#[derive(Clone, Debug, Default)]
pub struct KnownFailures {
    path: PathBuf,
    lines: Vec<KnownFailure>,
}

/// A line of the list.
#[derive(Clone, Debug)]
struct KnownFailure {
    /// The line, from 1.
    number: usize,
    query: String,
    method: Method,
    /// With a code, only failures with this primary verdict are known.
    code: Option<Code>,
}

/// The known failures in a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KnownReport {
    /// The number of known failures that still fail.
    pub still: usize,
    /// Entries that no longer fail, one line each.
    pub fixed: Vec<String>,
    /// Entries that failed with another code, one line each.
    pub other: Vec<String>,
}

impl KnownReport {
    /// The report in lines: the number of known failures, and changed entries.
    pub fn lines(&self) -> Vec<String> {
        let still = match self.still {
            0 => None,
            1 => Some("1 known failure is left out of gates".to_owned()),
            still => Some(format!("{still} known failures are left out of gates")),
        };
        let news = self.fixed.iter().chain(&self.other).cloned();
        still.into_iter().chain(news).collect()
    }
}

impl KnownFailures {
    /// Reads the list.
    ///
    /// # Errors
    /// A file that cannot be read, or a malformed line.
    pub fn read(path: &Path) -> Result<Self, FolderError> {
        let text = files::read_text(path, files::DESCRIPTION).map_err(FolderError::io(path))?;
        let mut lines = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let words: Vec<&str> =
                line.split('#').next().unwrap_or_default().split_whitespace().collect();
            let error = |message: String| FolderError::Damaged {
                path: path.to_owned(),
                line: index + 1,
                message,
            };
            let (query, method, code) = match words[..] {
                [] => continue,
                [query, method] => (query, method, None),
                [query, method, code] => (query, method, Some(code)),
                _ => {
                    let count = words.len();
                    let message =
                        format!("QUERY METHOD or QUERY METHOD CODE expected; words found: {count}");
                    return Err(error(message));
                }
            };
            lines.push(KnownFailure {
                number: index + 1,
                query: query.to_owned(),
                method: Method::called(method).map_err(|why| error(why.to_string()))?,
                code: code
                    .map(str::parse::<Code>)
                    .transpose()
                    .map_err(|why| error(why.to_string()))?,
            });
        }
        Ok(Self { path: path.to_owned(), lines })
    }

    /// Whether the result is a known failure.
    pub fn has(&self, row: &QueryResult) -> bool {
        is_wrong(row) && self.lines.iter().any(|line| line.is_about(row) && line.allows(row))
    }

    /// The report on the list for a run.
    pub fn report(&self, rows: &[QueryResult]) -> KnownReport {
        let fails = |row: &&QueryResult| is_wrong(row);
        let known = |row: &&QueryResult| self.has(row);
        let mut report =
            KnownReport { still: rows.iter().filter(known).count(), ..KnownReport::default() };
        for line in &self.lines {
            let of_line: Vec<&QueryResult> = rows.iter().filter(|row| line.is_about(row)).collect();
            let KnownFailure { number, query, method, code } = line;
            let place = format!("{}:{number}", self.path.display());
            if !of_line.is_empty() && !of_line.iter().any(&fails) {
                let was = code.map_or(String::new(), |code| format!(" ({code})"));
                let words = format!("{query} {method}{was} no longer fails; remove {place}");
                report.fixed.push(words);
            }
            let other = of_line.iter().copied().filter(fails);
            let other = other.filter(|row| !known(row));
            let other = other.filter_map(|row| row.diagnosis.first());
            for (found, code) in other.zip(code.iter().cycle()) {
                let words = format!(
                    "{query} {method} fails with {} instead of {code} in {place}",
                    found.code
                );
                report.other.push(words);
            }
        }
        report
    }
}

impl KnownFailure {
    fn is_about(&self, row: &QueryResult) -> bool {
        self.method == row.method && is_called(&row.query, &self.query)
    }

    fn allows(&self, row: &QueryResult) -> bool {
        let primary = row.diagnosis.first().map(|finding| finding.code);
        self.code.is_none_or(|code| primary == Some(code))
    }
}

/// Whether a result is wrong or missing, or has a failure verdict.
fn is_wrong(row: &QueryResult) -> bool {
    let primary = row.diagnosis.first();
    row.grade.is_failure() || primary.is_some_and(|finding| finding.code.is_failure())
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::{finding, row};
    use super::*;

    fn read(text: &str) -> Result<KnownFailures, FolderError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("known.txt");
        std::fs::write(&path, text).expect("writable");
        KnownFailures::read(&path)
    }

    fn with_code(row: QueryResult, code: &str) -> QueryResult {
        QueryResult { diagnosis: vec![finding(code.parse().expect("a code"))], ..row }
    }

    #[test]
    fn a_line_knows_a_failure_by_query_method_and_code() {
        let known = read("# ours\n70 mi D3 # the search\n\n000071 fb\n").expect("a list");
        let far = |query, method| row(query, method, Some(50.0));
        assert!(known.has(&with_code(far("000070", "mi"), "D3")));
        assert!(!known.has(&with_code(far("000070", "mi"), "D2")));
        assert!(!known.has(&far("000070", "fb")));
        assert!(known.has(&with_code(far("71", "fb"), "R3")));
        let near = row("000070", "mi", Some(0.5));
        assert!(known.has(&with_code(near.clone(), "D3")));
        assert!(!known.has(&near));
    }

    #[test]
    fn what_is_right_now_and_what_fails_otherwise_is_said() {
        let known = read("70 mi D3\n71 fb\n72 fb\n").expect("a list");
        let rows = [with_code(row("70", "mi", None), "D2"), row("71", "fb", Some(0.1))];
        let report = known.report(&rows);
        assert_eq!(report.still, 0);
        assert!(report.fixed[0].starts_with("71 fb no longer fails; remove "));
        assert!(report.fixed[0].ends_with("known.txt:2"));
        assert!(report.other[0].starts_with("70 mi fails with D2 instead of D3 in "));
        assert_eq!((report.fixed.len(), report.other.len()), (1, 1));
    }

    #[test]
    fn a_bad_line_is_told_with_its_number() {
        let said = |text: &str| read(text).expect_err(text).to_string();
        assert!(said("70 mi\n71\n").contains("known.txt:2: QUERY METHOD"));
        assert!(said("70 m!\n").contains("known.txt:1: "));
        assert!(said("70 mi D99\n").contains("D99"));
        assert!(said("70 mi D3 because\n").contains("words found: 4"));
    }
}
