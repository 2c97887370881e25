//! Ctrl-C: the first ends a command cleanly, the second kills it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use posescope::trace::Cancelled;
use signal_hook::consts::SIGINT;
use signal_hook::flag;

/// Whether Ctrl-C was pressed.
#[derive(Clone, Debug)]
pub struct Interrupt {
    raised: Arc<AtomicBool>,
    /// Lowered by a trace once it has checked.
    attention: Arc<AtomicBool>,
}

impl Interrupt {
    /// Handles Ctrl-C from now on. If the system refuses the handler, Ctrl-C kills the process as usual.
    pub fn listen() -> Self {
        let [raised, attention] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
        let heard = flag::register_conditional_default(SIGINT, Arc::clone(&raised))
            .and_then(|_| flag::register(SIGINT, Arc::clone(&raised)))
            .and_then(|_| flag::register(SIGINT, Arc::clone(&attention)));
        if let Err(error) = heard {
            log::info!("Ctrl-C kills the process: {error}");
        }
        Self { raised, attention }
    }

    pub fn is_raised(&self) -> bool {
        self.raised.load(Ordering::Relaxed)
    }

    /// The next Ctrl-C kills the process: there is nothing left to end cleanly.
    pub fn release(&self) {
        self.raised.store(true, Ordering::Relaxed);
    }

    /// The flag that a trace checks between its steps.
    pub fn attention(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.attention)
    }

    /// Cancels the caller once Ctrl-C was pressed.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_raised() { Err(Cancelled) } else { Ok(()) }
    }
}
