//! A program that runs a command within itself.

use indicatif::ProgressBar;

use super::interrupt::Interrupt;

/// How another program follows a command, and stops it. The command prints nothing and handles no signal.
#[derive(Clone, Debug)]
pub struct Host {
    pub(super) interrupt: Interrupt,
    pub(super) bar: ProgressBar,
}

impl Default for Host {
    fn default() -> Self {
        Self { interrupt: Interrupt::silent(), bar: ProgressBar::hidden() }
    }
}

impl Host {
    /// Stops the command as Ctrl-C does.
    pub fn stop(&self) {
        self.interrupt.raise();
    }

    /// How many queries are done, and of how many; 0 before their number is known.
    pub fn progress(&self) -> (u64, u64) {
        (self.bar.position(), self.bar.length().unwrap_or(0))
    }
}
