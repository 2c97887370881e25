//! The bare command: all four estimators on the built-in street.

use super::args::{RecordingArgs, RunArgs, TaskArgs};
use super::demo_settings::{Settings, settings};
use super::failure::CliError;
use super::run;
use super::terminal::Terminal;
#[cfg(feature = "app")]
use posescope::session::RunMode;

/// Runs the demonstration and saves its recording.
pub fn demo(terminal: &Terminal) -> Result<(), CliError> {
    let Settings {
        scene,
        query,
        reference,
        recording,
    } = settings();
    if let Some(folder) = recording.parent() {
        std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
    }
    run::run(
        &RunArgs {
            scene: scene.clone(),
            query: vec![query.clone()],
            all: false,
            task: TaskArgs {
                reference: vec![reference.clone()],
                ..TaskArgs::default()
            },
            recording: RecordingArgs {
                save: Some(recording.clone()),
                ..RecordingArgs::default()
            },
            export_matches: None,
            events: None,
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
