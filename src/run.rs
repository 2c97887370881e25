//! Experiments over many queries, and the folders that their results go to.

mod execute;
mod experiment;
mod protocol;
mod run_file;
mod run_folder;

pub use execute::{Companion, Execution, FailedQuery, RunError, Scenes};
pub use experiment::{
    Defaults, Draw, DrawError, Experiment, default_failure_radius_m, default_prior_m, defaults,
};
pub use protocol::Protocol;
pub use run_file::{Camera, Item, Pair, RUN_SCHEMA, RunFile, Shard};
pub use run_folder::{FolderError, RunFolder, merge, read_results, read_run};
