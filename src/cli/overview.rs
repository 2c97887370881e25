//! `posescope overview`: scenes at a glance.

use posescope::measure::{self, write_overview};
use posescope::scene::{self, Scene};

use super::args::OverviewArgs;
use super::failure::CliError;
use super::figures;
use super::output;
use super::terminal::Terminal;

/// Runs the command.
pub fn overview(args: &OverviewArgs, terminal: &Terminal) -> Result<(), CliError> {
    let scenes = args
        .scenes
        .iter()
        .map(|scene| scene::open(scene, args.format.as_deref()))
        .collect::<Result<Vec<_>, _>>()?;
    let scenes: Vec<&dyn Scene> = scenes.iter().map(AsRef::as_ref).collect();
    let table = measure::overview(&scenes);
    if let Some(folder) = &args.out {
        write_overview(folder, &scenes, &table)?;
    }
    match terminal.is_quiet() {
        true => Ok(()),
        false => output::print(&figures::text(&table, terminal.width()).trim_end()),
    }
}
