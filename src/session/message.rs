//! Messages from the worker to the session.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::run::{Run, RunState};
use crate::trace::Cancelled;

/// A message: a change to the session's copy of the run.
pub(super) type Message = Box<dyn FnOnce(&mut Run) + Send>;

/// The channel from the worker to the session.
#[derive(Clone)]
pub(super) struct Outbox {
    pub(super) messages: Sender<Message>,
    /// Called after every message.
    pub(super) wake: Arc<dyn Fn() + Send + Sync>,
}

impl Outbox {
    /// Changes the session's copy of the run.
    ///
    /// # Errors
    /// [`Cancelled`] if the session is gone.
    pub(super) fn change(
        &self,
        change: impl FnOnce(&mut Run) + Send + 'static,
    ) -> Result<(), Cancelled> {
        self.messages.send(Box::new(change)).map_err(|_| Cancelled)?;
        (self.wake)();
        Ok(())
    }

    /// Sets the state of the run.
    ///
    /// # Errors
    /// [`Cancelled`] if the session is gone. This may be ignored: the next event fails too.
    pub(super) fn state(&self, state: RunState) -> Result<(), Cancelled> {
        self.change(|run| run.state = state)
    }
}
