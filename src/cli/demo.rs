//! The bare command: all four estimators on the built-in street.

use std::path::PathBuf;
use std::sync::LazyLock;

use super::args::{JobArgs, RecordingArgs, RunArgs};
use super::failure::CliError;
use super::run;
use super::terminal::Terminal;
#[cfg(feature = "app")]
use posescope::session::RunMode;

/// What the demonstration runs, and where its recording goes.
#[derive(serde::Deserialize)]
pub struct Settings {
    pub scene: String,
    pub query: String,
    pub reference: String,
    pub recording: PathBuf,
}

/// Those of `assets/demo.toml`.
pub fn settings() -> &'static Settings {
    static SETTINGS: LazyLock<Settings> = LazyLock::new(|| {
        let settings = toml::from_str(include_str!("../../assets/demo.toml"));
        settings.unwrap_or_else(|error| unreachable!("a test reads it: {error}"))
    });
    &SETTINGS
}

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
            job: JobArgs {
                reference: vec![reference.clone()],
                ..JobArgs::default()
            },
            recording: RecordingArgs {
                save: Some(recording.clone()),
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

#[cfg(test)]
mod tests {
    use super::settings;

    #[test]
    fn the_settings_are_read() {
        assert_eq!(settings().scene, "street");
    }
}
