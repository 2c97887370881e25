//! Evaluates the results of many queries: tables, plots, gates, comparisons, exports.

mod chance;
mod diff;
#[cfg(feature = "cli")]
mod export;
mod finding;
mod findings;
mod gate;
mod groups;
#[cfg(feature = "cli")]
mod junit;
mod known;
mod mended;
mod metrics;
mod overview;
#[cfg(feature = "cli")]
mod paper;
#[cfg(feature = "cli")]
mod plots;
#[cfg(feature = "cli")]
mod report;
mod results;
mod rivals;
#[cfg(feature = "cli")]
mod sweep;
mod systematic;
#[cfg(feature = "cli")]
mod tables;
#[cfg(feature = "cli")]
mod timings;
mod triage;

pub use crate::relation::Relation;
pub use diff::{
    Change, Difference, Migration, NOTHING_FOUND, RunComparison, migrations, verdict_name,
};
#[cfg(feature = "cli")]
pub use export::{Export, ExportError, ExportedFile, Format, export};
pub use finding::Finding;
pub use findings::{failing_scenes, of_examination};
pub use gate::{Gate, GateResult};
pub use known::{KnownFailures, KnownReport};
pub use metrics::{Group, Measures, RECALL_LIMITS, Spread, measure};
pub use overview::{Bar, Overview, worst_first};
#[cfg(feature = "cli")]
pub use paper::scene as paper_scene;
#[cfg(feature = "cli")]
pub use plots::Plot;
#[cfg(feature = "cli")]
pub use report::{Report, SUMMARY_SCHEMA, StoredSummary, plain};
pub use results::{RunResults, read_rows};
pub use rivals::{Rivalry, Rivals, rivals};
#[cfg(feature = "cli")]
pub use sweep::{SweptRun, write_sweep};
#[cfg(feature = "cli")]
pub use tables::{TableName, rows, tables};
#[cfg(feature = "app")]
pub(crate) use triage::is_equal;
pub use triage::{Condition, ConditionError, Field, Order, Value, select};
