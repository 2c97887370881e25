//! Experiments over many queries, and the folders that their results go to.

mod execute;
mod experiment;
mod pair;
mod protocol;
mod run_file;
mod run_folder;

pub use execute::{Companion, Execution, FailedQuery, RunError, Scenes};
pub use experiment::{
    Defaults, Draw, DrawError, Experiment, default_failure_radius_m, default_prior_m, defaults,
};
pub use pair::{Camera, Pair};
pub use protocol::Protocol;
pub use run_file::{Item, RUN_SCHEMA, RunFile, Shard};
pub use run_folder::{FolderError, RunFolder, merge, read_results, read_run};
