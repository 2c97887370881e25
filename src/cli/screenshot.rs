//! `posescope view --screenshot`: a picture of the window, without a window.

use std::path::Path;

use posescope::app::{self, Shot, ShotError};

use super::args::ViewArgs;
use super::failure::CliError;
use super::terminal::Terminal;
use super::view;

pub fn screenshot(args: &ViewArgs, out: &Path, terminal: &Terminal) -> Result<(), CliError> {
    let format = image::ImageFormat::from_path(out).ok();
    if !matches!(format, Some(image::ImageFormat::Png | image::ImageFormat::Jpeg)) {
        return Err(CliError::Usage(format!(
            "--screenshot {}: a file name that ends in .png or .jpg expected",
            out.display()
        )));
    }
    let (setup, results) = view::setup(args)?;
    let options = &args.screenshot;
    let shot = Shot {
        moment: options.at,
        size_px: options.window,
        scale: options.scale,
        theme: if options.light { egui::Theme::Light } else { egui::Theme::Dark },
    };
    let picture = app::shoot(setup, results, &shot).map_err(|error| match error {
        ShotError::Unknown(why) => CliError::Usage(why),
        other => CliError::Unusable(other.to_string()),
    })?;
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
    }
    let saved = picture.save(out);
    saved.map_err(|error| CliError::Unusable(format!("{}: {error}", out.display())))?;
    terminal.say(|| format!("Picture: {}", out.display()));
    Ok(())
}
