//! What a worker has to say, on its way to the session.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::run::{Run, RunState};
use crate::trace::Cancelled;

/// What the worker says: a change to what the session knows of the run.
pub(super) type Message = Box<dyn FnOnce(&mut Run) + Send>;

/// The way from the worker to the session.
#[derive(Clone)]
pub(super) struct Outbox {
    pub(super) messages: Sender<Message>,
    /// Called behind every message.
    pub(super) wake: Arc<dyn Fn() + Send + Sync>,
}

impl Outbox {
    /// Changes what the session knows of the run.
    ///
    /// # Errors
    /// [`Cancelled`] where the session is gone. Who goes on all the same finds out at the next event.
    pub(super) fn change(
        &self,
        change: impl FnOnce(&mut Run) + Send + 'static,
    ) -> Result<(), Cancelled> {
        self.messages
            .send(Box::new(change))
            .map_err(|_| Cancelled)?;
        (self.wake)();
        Ok(())
    }

    /// Says which state the run is in.
    ///
    /// # Errors
    /// [`Cancelled`] where the session is gone.
    pub(super) fn state(&self, state: RunState) -> Result<(), Cancelled> {
        self.change(|run| run.state = state)
    }
}
