//! What a worker has to say, on its way to the session.

use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;

use super::loaded::Loaded;
use super::run::Part;
use crate::localize::{QueryResult, References, StageTimes};
use crate::method::Method;
use crate::trace::{Cancelled, Record};

/// The way from the worker to the session.
#[derive(Clone)]
pub(super) struct Outbox {
    pub(super) messages: Sender<Message>,
    /// Called behind every message.
    pub(super) wake: Arc<dyn Fn() + Send + Sync>,
}

impl Outbox {
    /// Sends to the session. A session that is gone has cancelled.
    pub(super) fn send(&self, message: Message) -> Result<(), Cancelled> {
        self.messages.send(message).map_err(|_| Cancelled)?;
        (self.wake)();
        Ok(())
    }
}

/// What the worker says to the session.
pub(super) enum Message {
    Chosen(References),
    /// So many of the candidates for references were looked at.
    Ranking {
        looked_at: usize,
        candidates: usize,
    },
    Loaded(Arc<Loaded>),
    Began(Part),
    /// An event, and how long the run had worked when it was told.
    Told(Box<Record>, Duration),
    Waits {
        breakpoint: Option<String>,
    },
    Goes,
    Ended {
        result: Box<QueryResult>,
        times: Option<StageTimes>,
    },
    /// Remedies are being tried on a result.
    Explaining {
        method: Method,
        tried: usize,
        remedies: usize,
    },
    /// A result that was told before, explained.
    Explained(Box<QueryResult>),
    Finished,
    Cancelled,
    Broke(String),
}
