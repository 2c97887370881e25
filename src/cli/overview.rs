//! `posescope overview`: scenes at a glance.

use posescope::scene;
use posescope::table::Table;

use super::args::OverviewArgs;
use super::failure::CliError;
use super::output;
use super::table::figures;
use super::terminal::Terminal;

/// Runs the command.
pub fn overview(args: &OverviewArgs, terminal: &Terminal) -> Result<(), CliError> {
    if args.out.is_some() {
        return Err(CliError::Usage(
            "--out: posescope doctor --picture draws the route".to_owned(),
        ));
    }
    let mut table = Table::new("scenes", "Scenes", ["scene", "images", "with a cloud"]);
    for name in &args.scenes {
        let scene = scene::open(name, args.format.as_deref())?;
        let frames = scene.frames().len();
        let clouds = (0..frames).filter(|&frame| scene.has_cloud(frame)).count();
        table.push([
            scene.name().to_owned(),
            frames.to_string(),
            clouds.to_string(),
        ]);
    }
    match terminal.is_quiet() {
        true => Ok(()),
        false => output::print(&figures(&table, terminal.width()).trim_end()),
    }
}
