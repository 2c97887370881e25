//! Ctrl-C: the first ends a command where it can be ended well, the second at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use posescope::trace::Cancelled;
use signal_hook::consts::SIGINT;
use signal_hook::flag;

/// Whether somebody pressed Ctrl-C.
#[derive(Clone, Debug)]
pub struct Interrupt {
    raised: Arc<AtomicBool>,
    /// Lowered by a trace once it has looked up.
    attention: Arc<AtomicBool>,
}

impl Interrupt {
    /// From here on Ctrl-C is a wish. Where the system does not let us hear of it, it ends the process as
    /// it would otherwise.
    pub fn listen() -> Self {
        let [raised, attention] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
        let heard = flag::register_conditional_default(SIGINT, Arc::clone(&raised))
            .and_then(|_| flag::register(SIGINT, Arc::clone(&raised)))
            .and_then(|_| flag::register(SIGINT, Arc::clone(&attention)));
        if let Err(error) = heard {
            log::info!("Ctrl-C ends the process at once: {error}");
        }
        Self { raised, attention }
    }

    pub fn is_raised(&self) -> bool {
        self.raised.load(Ordering::Relaxed)
    }

    /// The next one ends the process: there is nothing left that a wish could end.
    pub fn release(&self) {
        self.raised.store(true, Ordering::Relaxed);
    }

    /// What a trace looks at between its steps.
    pub fn attention(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.attention)
    }

    /// Ends what looks up, once it was pressed.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_raised() {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }
}
