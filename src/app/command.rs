//! What is done between two frames.

use std::cell::RefCell;

use super::App;

/// Something to be done between two frames.
pub(super) type Command = Box<dyn FnOnce(&mut App)>;

/// Commands that wait for the end of the frame.
#[derive(Default)]
pub struct Queue(RefCell<Vec<Command>>);

impl Queue {
    /// Adds a command.
    pub fn send(&self, command: impl FnOnce(&mut App) + 'static) {
        self.0.borrow_mut().push(Box::new(command));
    }

    pub(super) fn take(&self) -> Vec<Command> {
        self.0.take()
    }
}
