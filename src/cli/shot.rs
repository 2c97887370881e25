//! `posescope shot`: a picture of the window, or of one of its views, or a view as SVG, without a window.

use posescope::app::{self, Shot, ShotError};
use posescope::session::RunMode;

use super::args::ShotArgs;
use super::failure::CliError;
use super::terminal::Terminal;
use super::{run, view};

/// Runs the query to its end, paints the view and writes the picture.
pub fn shot(args: &ShotArgs, terminal: &Terminal) -> Result<(), CliError> {
    run::use_threads(args.view_args.task.protocol.threads)?;
    let (setup, results) = view::setup(&args.view_args, RunMode::Running)?;
    let shot = Shot {
        view: args.view.clone(),
        arrangement: args.layout,
        moment: args.at,
        lockstep: args.lockstep,
        camera: args.pose,
        is_dense: args.dense,
        size_px: args.size,
        scale: args.scale,
        theme: match args.light {
            true => egui::Theme::Light,
            false => egui::Theme::Dark,
        },
    };
    let failed = |error| match error {
        ShotError::Unknown(why) => CliError::Usage(why),
        other => CliError::Picture(other.to_string()),
    };
    let folder = || match args.out.parent() {
        Some(folder) => std::fs::create_dir_all(folder).map_err(CliError::io(folder)),
        None => Ok(()),
    };
    if args.out.extension().is_some_and(|ending| ending == "svg") {
        let drawn = app::draw(setup, results, &shot).map_err(failed)?;
        folder()?;
        std::fs::write(&args.out, drawn).map_err(CliError::io(&args.out))?;
    } else {
        let picture = app::shoot(setup, results, &shot).map_err(failed)?;
        folder()?;
        let said = |error| CliError::Picture(format!("{}: {error}", args.out.display()));
        picture.save(&args.out).map_err(said)?;
    }
    if !terminal.is_quiet() {
        eprintln!("Picture: {}", args.out.display());
    }
    Ok(())
}
