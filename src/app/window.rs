//! Opening the window.

use egui::ViewportBuilder;

use super::App;
use super::adapter;
use super::opening::Opener;
use super::selection::KnownResults;
use super::setup::Setup;
use super::view_options::Arrangement;
use crate::lesson::Lesson;

/// Why no window could be opened, and what would help.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// There is no display.
    #[error("no window: no display is set (DISPLAY or WAYLAND_DISPLAY)")]
    NoDisplay,
    /// There is a display, but nothing to draw with.
    #[error(
        "no window: no graphics adapter ({0}); Mesa's software Vulkan is one: install the package \
         mesa-vulkan-drivers (Debian, Ubuntu) or vulkan-swrast (Arch), or mesa-vulkan-drivers (Fedora)"
    )]
    NoAdapter(String),
    /// Any other error of eframe.
    #[error("no window: {0}")]
    Failed(String),
}

/// Whether a window may be opened at all, judged by the environment.
pub fn has_display() -> bool {
    if cfg!(any(target_os = "macos", target_os = "windows")) {
        return true;
    }
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// The picture of the window in the task bar.
fn icon() -> egui::IconData {
    let png = include_bytes!("../../assets/posescope.png");
    // A window without a picture is a window all the same; a test reads it.
    eframe::icon_data::from_png_bytes(png).unwrap_or_default()
}

/// Width and height of a window at first \[points\].
const SIZE: [u32; 2] = [1500, 950];

/// How a window of this size \[points\] is opened and painted.
fn window_options([width, height]: [u32; 2]) -> eframe::NativeOptions {
    eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_app_id("posescope")
            .with_icon(icon())
            .with_inner_size([width as f32, height as f32]),
        // There are no wide gradients, and it costs time for every pixel on a software adapter.
        dithering: false,
        wgpu_options: adapter::configuration(wgpu::Backends::all()),
        ..eframe::NativeOptions::default()
    }
}

/// Opens a window of this size \[points\] with the results that are known already, in a table where there are any,
/// and returns when it is closed.
///
/// # Errors
/// [`WindowError`] when there is no display, or nothing to draw with.
pub fn open(
    setup: Setup,
    results: KnownResults,
    size: [u32; 2],
    opener: Opener,
) -> Result<(), WindowError> {
    open_with(setup, size, move |app| {
        let has_results = !results.now.is_empty();
        let mut app = app.with_opener(opener).with_results(results);
        if has_results {
            app.arrange(Arrangement::Batch);
        }
        app
    })
}

/// Opens the window with a lesson, of which `setup` is what its first page localises.
///
/// # Errors
/// [`WindowError`] when there is no display, or nothing to draw with.
pub fn open_lesson(setup: Setup, lesson: Lesson, opener: Opener) -> Result<(), WindowError> {
    open_with(setup, SIZE, move |app| app.with_opener(opener).with_lesson(lesson))
}

fn open_with(
    setup: Setup,
    size: [u32; 2],
    with: impl FnOnce(App) -> App,
) -> Result<(), WindowError> {
    if !has_display() {
        return Err(WindowError::NoDisplay);
    }
    let mut options = window_options(size);
    options.viewport = options.viewport.with_title(setup.title());
    eframe::run_native(
        "posescope",
        options,
        Box::new(|creation| Ok(Box::new(with(App::new(creation, setup))))),
    )
    .map_err(|error| match error {
        eframe::Error::Wgpu(why) => WindowError::NoAdapter(one_line(&why.to_string())),
        other => WindowError::Failed(one_line(&other.to_string())),
    })
}

pub(super) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::icon;

    #[test]
    fn the_window_has_its_picture() {
        let icon = icon();
        assert_eq!((icon.width, icon.height), (256, 256));
    }
}
