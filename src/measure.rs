//! Measures of many results: tables, plots, gates, comparisons, exports.

mod chance;
mod diff;
#[cfg(feature = "cli")]
mod export;
mod gate;
#[cfg(feature = "cli")]
mod junit;
mod known;
mod metrics;
mod migration;
#[cfg(feature = "cli")]
mod overview;
mod paper;
#[cfg(feature = "cli")]
mod plots;
#[cfg(feature = "cli")]
mod report;
#[cfg(feature = "cli")]
mod sweep;
#[cfg(feature = "cli")]
mod table;
#[cfg(feature = "cli")]
mod tables;
#[cfg(feature = "cli")]
mod timings;
mod triage;

pub use crate::relation::Relation;
pub use diff::{Change, Difference, RunComparison};
#[cfg(feature = "cli")]
pub use export::{Export, ExportError, ExportedFile, Format, ResultChoice, export};
pub use gate::{Gate, GateResult};
pub use known::{KnownError, KnownFailures, KnownReport};
pub use metrics::{Group, Measures, RECALL_LIMITS, Row, Spread, measure};
pub use migration::{Migration, migrations, verdict_name};
#[cfg(feature = "cli")]
pub use overview::{Route, overview, write_overview};
pub use paper::{FigureKey, figure as paper_figure};
#[cfg(feature = "cli")]
pub use plots::{Plot, method_color, plots, verdict_color};
#[cfg(feature = "cli")]
pub use report::{Report, SUMMARY_SCHEMA, read_gate_results, read_rows, write_report};
#[cfg(feature = "cli")]
pub use sweep::{SweptRun, write_sweep};
#[cfg(feature = "cli")]
pub use table::Table;
#[cfg(feature = "cli")]
pub use tables::tables;
pub use triage::{Condition, ConditionError, Field, Order, Value, select};
