//! The bare command: all four estimators on the built-in street.

use std::path::PathBuf;

use super::args::{DEMO_QUERY, DEMO_REFERENCE, RecordingArgs, RunArgs, TaskArgs};
use super::failure::CliError;
use super::run;
use super::terminal::Terminal;
#[cfg(feature = "app")]
use posescope::session::RunMode;

const RECORDING: &str = "recordings/demo.rrd";

/// Runs the demonstration and saves its recording.
pub fn demo(terminal: &Terminal) -> Result<(), CliError> {
    let recording = PathBuf::from(RECORDING);
    if let Some(folder) = recording.parent() {
        std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
    }
    run::run(
        &RunArgs {
            scene: "street".to_owned(),
            query: vec![DEMO_QUERY.to_owned()],
            all: false,
            task: TaskArgs {
                reference: vec![DEMO_REFERENCE.to_owned()],
                ..TaskArgs::default()
            },
            recording: RecordingArgs {
                save: Some(recording),
                ..RecordingArgs::default()
            },
            json: None,
        },
        terminal,
    )?;
    view_where_there_is_a_display(terminal)
}

/// Opens the window on the same query.
#[cfg(feature = "app")]
fn view_where_there_is_a_display(terminal: &Terminal) -> Result<(), CliError> {
    if !posescope::app::has_display() {
        return Ok(());
    }
    super::view::view(&super::args::ViewArgs::demo(), RunMode::Running, terminal)
}

/// Without a window there is the recording.
#[cfg(not(feature = "app"))]
fn view_where_there_is_a_display(_terminal: &Terminal) -> Result<(), CliError> {
    Ok(())
}
