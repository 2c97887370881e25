//! The results of a run with their figures, for tables and plots.

use std::path::Path;

use super::metrics::{Measures, measure};
use crate::localize::QueryResult;
use crate::run::{FolderError, read_results, read_run};
use crate::scale::LengthUnit;

/// The results of a run with their figures.
#[derive(Clone, Debug)]
pub struct RunResults {
    /// Every result, in the order of the run.
    pub results: Vec<QueryResult>,
    /// The figures by group and method.
    pub measures: Vec<Measures>,
    /// The translation error from which a pose counts as a failure \[m\].
    pub failure_radius_m: f64,
}

impl RunResults {
    /// The unit of lengths.
    pub fn unit(&self) -> LengthUnit {
        self.results.first().map(|result| result.unit).unwrap_or_default()
    }

    /// Measures results.
    pub fn of(results: Vec<QueryResult>, failure_radius_m: f64) -> Self {
        Self { measures: measure(&results, failure_radius_m), results, failure_radius_m }
    }

    /// Reads and measures the results of a run folder.
    ///
    /// # Errors
    /// A folder without a run, or a line that is not a result.
    pub fn read(folder: &Path) -> Result<Self, FolderError> {
        let run = read_run(folder)?;
        Ok(Self::of(read_results(folder, &run)?, run.failure_radius_m()))
    }
}

/// Reads the results of a folder.
///
/// # Errors
/// A folder without a run, or a line that is not its result.
pub fn read_rows(folder: &Path) -> Result<Vec<QueryResult>, FolderError> {
    read_results(folder, &read_run(folder)?)
}
