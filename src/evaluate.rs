//! Measuring outcomes, of one query and of thousands. The only place that sees ground truth.

mod diff;
mod execute;
mod experiment;
#[cfg(feature = "cli")]
mod export;
mod gate;
#[cfg(feature = "cli")]
mod junit;
mod localize;
mod metrics;
mod paper;
#[cfg(feature = "cli")]
mod plots;
#[cfg(feature = "cli")]
mod report;
mod result;
mod run_file;
mod run_folder;
mod select;
#[cfg(feature = "cli")]
mod table;
#[cfg(feature = "cli")]
mod tables;
mod timing;
mod verdict;
mod watch;

pub use diff::{Change, Comparison, Difference, Tolerance};
pub use execute::{Companion, Execution, FailedQuery, RunError, Scenes};
pub use experiment::{
    Defaults, Draw, DrawError, Experiment, default_failure_radius_m, default_prior_m, defaults,
};
#[cfg(feature = "cli")]
pub use export::{Choice, Export, ExportError, ExportedFile, Format, export};
pub use gate::{Gate, Passage};
pub(crate) use localize::words_of;
pub use localize::{LocalizeError, Localizer, Request};
pub use metrics::{Group, Measures, RECALL_LIMITS, Row, Spread, measure};
pub use paper::{Sought, figure as paper_figure};
#[cfg(feature = "cli")]
pub use report::{Report, SUMMARY_SCHEMA, read_rows, write_report};
pub use result::{
    CostReport, Diagnosis, PoseReport, QueryResult, Reason, SCHEMA, Setting, Status, evaluate,
};
pub use run_file::{Camera, Item, Pair, RUN_SCHEMA, RunFile, Shard};
pub use run_folder::{FolderError, RunFolder, merge, read_results, read_run};
pub use select::{
    ByMatches, ChoiceError, Chooser, Ranking, References, Selection, draw, frames_within,
    tell_ranking,
};
#[cfg(feature = "cli")]
pub use table::Table;
pub use timing::{StageTimes, StageTimings};
pub use verdict::Verdict;
pub use watch::{Unwatched, Watch};
