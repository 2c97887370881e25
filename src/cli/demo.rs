//! The bare command: all four estimators on the built-in street.

use super::args::RunArgs;
use super::defaults::{FOLDER, QUERY, REFERENCE, SCENE};
use super::failure::CliError;
use super::run;
use super::terminal::Terminal;

/// How to read the table, and what to type next. PM gets the query at night wrong.
const NEXT: &str = "\
The column `grade` says whether a pose is within 1 m and 5° of the truth (● right, ▲ wrong, × no pose).
Next:
  posescope run street --query-scene street:night --query 361 --reference nearest:1 --method pm   see why a pose is wrong
  posescope lesson                                                                               learn how the methods work
  posescope doctor PATH                                                                          check your own scene";

/// Runs the demonstration and saves its recording.
pub fn demo(terminal: &Terminal) -> Result<(), CliError> {
    std::fs::create_dir_all(FOLDER).map_err(CliError::io(FOLDER))?;
    let recording = format!("{FOLDER}/demo.rrd");
    let line =
        format!("posescope run {SCENE} --query {QUERY} --reference {REFERENCE} --save {recording}");
    let args = RunArgs::parse(line.split(' ').map(str::to_owned))?;
    run::run(&args, terminal)?;
    terminal.say(|| NEXT.to_owned());
    view_where_there_is_a_display(terminal)
}

#[cfg(feature = "app")]
fn view_where_there_is_a_display(terminal: &Terminal) -> Result<(), CliError> {
    if !posescope::app::has_display() {
        return Ok(());
    }
    use clap::Parser as _;

    use super::args::{Arguments, Command};

    match Arguments::parse_from(["posescope", "view", SCENE]).command {
        Some(Command::View(args)) => super::view::view(&args, terminal, super::opener::opener()),
        _ => unreachable!("the words begin with `view`"),
    }
}

#[cfg(not(feature = "app"))]
fn view_where_there_is_a_display(_terminal: &Terminal) -> Result<(), CliError> {
    Ok(())
}
