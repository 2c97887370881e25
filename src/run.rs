//! Experiments over many queries, and the folders that their results go to.

mod estimates_file;
mod execute;
mod experiment;
mod inputs;
mod preset;
mod protocol;
mod run_file;
mod run_folder;
mod scene_pair;
mod sweep;

pub use estimates_file::EstimatesFile;
pub use execute::{Execution, FailedQuery, RunError, RunObserver, Scenes};
pub use experiment::{
    Defaults, Draw, DrawError, Experiment, PaperProtocol, default_failure_radius_m, defaults,
};
pub use inputs::inputs;
pub use preset::{ByDataSet, Preset};
pub use protocol::Protocol;
pub use run_file::{RUN_SCHEMA, RunFile, RunItem, Shard};
pub use run_folder::{
    FAILURES, FolderError, RunFolder, merge, read_results, read_run, recording_name, result_lines,
};
pub use scene_pair::{QueryCamera, ScenePair, is_called};
pub use sweep::{Sweep, SweepError};
