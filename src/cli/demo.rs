//! The bare command: all four estimators on the built-in street.

use std::path::PathBuf;

use super::args::{ConfigArgs, RecordingArgs, RunArgs};
use super::failure::CliError;
use super::run;
use super::terminal::Terminal;
use posescope::evaluate::Selection;
use posescope::event::Method;

/// A place on the street where parked cars hide part of what the reference saw.
const QUERY: &str = "000070";
const REFERENCE: &str = "000062";
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
            format: None,
            queries: None,
            query: vec![QUERY.to_owned()],
            all: false,
            reference: vec![REFERENCE.to_owned()],
            references: Selection::Random(1),
            radius: 15.0,
            method: Method::ALL.to_vec(),
            fusion: None,
            seed: 0,
            config: ConfigArgs::default(),
            threads: None,
            recording: RecordingArgs {
                save: Some(recording),
                ..RecordingArgs::default()
            },
            json: None,
        },
        terminal,
    )
}
