//! Results as JSON, written one by one: a killed run keeps its finished results.

use std::fmt::Display;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use posescope::localize::QueryResult;

use super::failure::CliError;
use super::stderr::plain;

/// One object per line, to a file or to stdout.
pub struct JsonLines {
    path: PathBuf,
    writer: Box<dyn Write>,
}

impl JsonLines {
    /// Opens the output before anything is computed: a wrong path fails at once.
    pub fn create(path: &Path) -> Result<Self, CliError> {
        let writer: Box<dyn Write> = if is_stdout(path) {
            Box::new(io::stdout())
        } else {
            Box::new(File::create(path).map_err(CliError::io(path))?)
        };
        Ok(Self { path: path.to_owned(), writer })
    }

    /// Writes one result and flushes it.
    pub fn write(&mut self, result: &QueryResult) -> Result<(), CliError> {
        let line = serde_json::to_string(result)
            .map_err(|error| CliError::io(&self.path)(error.into()))?;
        self.write_line(&line)
    }

    /// Writes one object that is serialised already.
    pub fn write_line(&mut self, line: &str) -> Result<(), CliError> {
        if is_stdout(&self.path) && line.chars().any(|c| c.is_control()) {
            // JSON may have them as numbers, too, which no terminal obeys.
            let escaped = |c: char| match c {
                c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
                c => c.to_string(),
            };
            let line: String = line.chars().map(escaped).collect();
            return print_to(&mut self.writer, &line, &self.path);
        }
        print_to(&mut self.writer, &line, &self.path)
    }
}

/// Prints a table or a list on stdout.
pub fn print(text: &dyn Display) -> Result<(), CliError> {
    print_to(&mut io::stdout().lock(), &plain(&text.to_string()), Path::new("stdout"))
}

fn print_to(writer: &mut dyn Write, text: &dyn Display, path: &Path) -> Result<(), CliError> {
    writeln!(writer, "{text}").and_then(|()| writer.flush()).map_err(|error| match error.kind() {
        io::ErrorKind::BrokenPipe => CliError::ReaderGone,
        _ => CliError::io(path)(error),
    })
}

/// Whether `-` was given.
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}
