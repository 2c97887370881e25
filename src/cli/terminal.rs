//! The terminal: progress and messages on stderr, results on stdout.

use std::collections::HashSet;
use std::io::Write as _;
use std::sync::Mutex;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use indicatif_log_bridge::LogWrapper;
use log::{Level, LevelFilter};

use super::args::Everywhere;
use super::stderr::{message, tell};

pub struct Terminal {
    bars: MultiProgress,
    /// Whether only errors and requested results are printed.
    pub is_quiet: bool,
}

impl Terminal {
    /// Sets up logging such that messages do not break progress bars.
    pub fn new(everywhere: &Everywhere) -> Self {
        let (own, foreign) = match (everywhere.quiet, everywhere.verbose) {
            (true, _) => (LevelFilter::Error, LevelFilter::Off),
            (false, 0) => (LevelFilter::Warn, LevelFilter::Error),
            (false, 1) => (LevelFilter::Info, LevelFilter::Warn),
            (false, _) => (LevelFilter::Debug, LevelFilter::Info),
        };
        let quieter = match foreign {
            LevelFilter::Error => LevelFilter::Off,
            level => level,
        };
        // A file that is read twice has nothing new to say.
        let said = Mutex::new(HashSet::new());
        let logger = env_logger::Builder::new()
            .format(move |buffer, record| match record.level() {
                Level::Error | Level::Warn => {
                    let is_error = record.level() == Level::Error;
                    let word = if is_error { "error" } else { "warning" };
                    let text = message(&record.args().to_string());
                    let is_new = said.lock().is_ok_and(|mut said| said.insert(text.clone()));
                    if is_new { writeln!(buffer, "posescope: {word}: {text}") } else { Ok(()) }
                }
                level => {
                    let text = message(&record.args().to_string());
                    writeln!(buffer, "{level} {}: {text}", record.target())
                }
            })
            .filter_level(foreign)
            .filter_module("posescope", own)
            // They log errors if a driver is missing, which the window reports in one line.
            .filter_module("wgpu_hal::vulkan::instance", quieter)
            .filter_module("wgpu_hal::gles::egl", quieter)
            .parse_default_env()
            .build();
        let level = logger.filter();
        let bars = MultiProgress::new();
        // Fails only if the caller has set a logger already.
        if LogWrapper::new(bars.clone(), logger).try_init().is_ok() {
            log::set_max_level(level);
        }
        Self { bars, is_quiet: everywhere.quiet }
    }

    /// Prints a message on stderr unless `--quiet` is given.
    pub fn say(&self, message: impl FnOnce() -> String) {
        if !self.is_quiet {
            tell(&message());
        }
    }

    /// The width of a line of results in characters: `COLUMNS`, or that of the terminal; `None` in a pipe.
    pub fn width(&self) -> Option<usize> {
        /// Narrower lines are unreadable.
        const MIN: usize = 40;
        let columns = std::env::var("COLUMNS").ok();
        let requested = columns.and_then(|columns| columns.parse::<usize>().ok());
        let terminal = || terminal_size::terminal_size_of(std::io::stdout());
        let width = requested.or_else(|| Some(usize::from(terminal()?.0.0)));
        width.map(|width| width.max(MIN))
    }

    /// A progress bar over `steps` steps, hidden if stderr is not a terminal.
    pub fn bar(&self, steps: u64) -> ProgressBar {
        if self.is_quiet {
            return ProgressBar::hidden();
        }
        let template = "{bar:30} {pos}/{len} {elapsed} {wide_msg}";
        let style =
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = self.bars.add(ProgressBar::new(steps).with_style(style));
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}
