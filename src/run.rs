//! Runs over many queries: protocols, presets and run folders.

#[cfg(feature = "cli")]
mod arguments;
mod config;
mod draw;
mod estimates_file;
mod evaluate;
mod inputs;
#[cfg(feature = "rerun")]
mod judge;
mod limit;
mod map_check;
mod outputs;
mod plan;
mod preset;
mod protocol;
#[cfg(feature = "rerun")]
mod publish;
mod reference;
mod run_file;
mod run_folder;
mod scene_pair;
mod scene_paths;
mod scenes;
mod survey_file;
mod sweep;

#[cfg(feature = "cli")]
pub use arguments::{degradations, method, positive, probability};
pub use config::{ConfigError, with_config};
pub use draw::{Draw, DrawError};
pub use estimates_file::EstimatesFile;
pub use evaluate::{Evaluation, FailedQuery, RunError, RunObserver};
pub use inputs::{content, inputs};
#[cfg(feature = "rerun")]
pub use judge::{Judgement, examine, warn_of_unseen_map};
pub use limit::Limit;
pub use map_check::{MapFit, fit_of_map, frame_pairs_line, mistake_line};
pub use outputs::{JSON_LINES, OutputError, refuse_in_folder, refuse_to_replace};
pub use plan::{EvaluationRequest, Judging, Plan, PlanError, Refusal, failed_queries};
pub use preset::{Preset, default_failure_radius_m};
pub use protocol::{Protocol, ProtocolError, defaults, known};
#[cfg(feature = "rerun")]
pub use publish::{append_step_summary, publish, step_summary};
pub use reference::Reference;
pub use run_file::{RUN_SCHEMA, RunFile, RunItem, Shard};
pub use run_folder::{
    FAILURES, FolderError, RecordingNames, RunFolder, merge, read_results, read_run, result_lines,
    results_of_pair,
};
pub use scene_pair::{QueryCamera, ScenePair, is_called};
pub use scene_paths::{is_same, labels};
pub use scenes::Scenes;
pub use survey_file::{Poses, SurveyError, SurveyFile, SurveyFrom, survey_line, survey_of};
pub use sweep::{Sweep, SweepError};
