//! The progress of choosing references by their appearance.

use posescope::event::KindSet;
use posescope::localize::{LocalizeObserver, NoObserver};
use posescope::trace::{Cancelled, Record, Sink};

use super::interrupt::Interrupt;
use super::terminal::Terminal;

/// From this number of candidates, an index is worth building.
const MANY: usize = 100;

/// A progress bar over the candidates. With many candidates it also recommends an index, once.
pub struct ChoiceProgress<'a> {
    terminal: &'a Terminal,
    interrupt: &'a Interrupt,
    /// The scene whose photos are compared one by one, for which an index would be quicker.
    index_for: Option<&'a str>,
    bar: Option<indicatif::ProgressBar>,
    has_advised: bool,
}

impl<'a> ChoiceProgress<'a> {
    pub fn new(
        terminal: &'a Terminal,
        interrupt: &'a Interrupt,
        index_for: Option<&'a str>,
    ) -> Self {
        Self { terminal, interrupt, index_for, bar: None, has_advised: false }
    }
}

impl Sink for ChoiceProgress<'_> {
    fn wanted(&self) -> KindSet {
        NoObserver.wanted()
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.interrupt.check()
    }
}

impl LocalizeObserver for ChoiceProgress<'_> {
    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        let is_many = candidates >= MANY && !self.terminal.is_quiet();
        if let Some(scene) = self.index_for.filter(|_| is_many)
            && !std::mem::replace(&mut self.has_advised, true)
        {
            eprintln!(
                "Comparing the query with {candidates} photos. An index is faster: run `posescope index {scene}`, then use \
                 --reference retrieve:1"
            );
        }
        let terminal = self.terminal;
        let bar = self.bar.get_or_insert_with(|| {
            let bar = terminal.bar(candidates as u64);
            bar.set_message("choosing references");
            bar
        });
        bar.set_position(looked_at as u64);
        if looked_at == candidates
            && let Some(bar) = self.bar.take()
        {
            bar.finish_and_clear();
        }
    }

    fn attention(&self) -> Option<std::sync::Arc<std::sync::atomic::AtomicBool>> {
        Some(self.interrupt.attention())
    }
}

impl Drop for ChoiceProgress<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
