//! Runs over many queries: protocols, presets and run folders.

#[cfg(feature = "cli")]
mod arguments;
mod draw;
mod estimates_file;
mod evaluate;
mod inputs;
mod limit;
mod preset;
mod protocol;
mod reference;
mod run_file;
mod run_folder;
mod scene_pair;
mod scene_paths;
mod scenes;
mod sweep;

#[cfg(feature = "cli")]
pub use arguments::{degradations, method, positive, probability};
pub use draw::{Draw, DrawError};
pub use estimates_file::EstimatesFile;
pub use evaluate::{Execution, FailedQuery, RunError, RunObserver};
pub use inputs::{content, inputs};
pub use limit::Limit;
pub use preset::{Preset, default_failure_radius_m};
pub use protocol::{Protocol, ProtocolError, defaults, known};
pub use reference::Reference;
pub use run_file::{RUN_SCHEMA, RunFile, RunItem, Shard};
pub use run_folder::{
    FAILURES, FolderError, RunFolder, merge, read_results, read_run, recording_name, result_lines,
    results_of_pair,
};
pub use scene_pair::{QueryCamera, ScenePair, is_called};
pub use scene_paths::{is_same, labels};
pub use scenes::Scenes;
pub use sweep::{Sweep, SweepError};
