//! The retrieval index of a scene, opened on first use.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use super::task::Task;
use crate::params::Params;
use crate::scene::{NoIndex, Retriever, Scene};

/// The index of a scene. Opening it checks every byte, so it is opened on first use, and again only if the
/// parameters change.
#[derive(Default)]
pub struct IndexFile {
    argument: String,
    file: Option<PathBuf>,
    opened: Mutex<Option<Arc<Retriever>>>,
}

impl IndexFile {
    /// The index of the scene `argument`: this file, or the default one.
    pub fn new(argument: impl Into<String>, file: Option<PathBuf>) -> Self {
        Self { argument: argument.into(), file, opened: Mutex::default() }
    }

    /// The index of a task.
    pub fn of(task: &Task) -> Self {
        Self::new(&task.scene, task.protocol.index.first().cloned())
    }

    /// The file, if one is named.
    pub fn file(&self) -> Option<&PathBuf> {
        self.file.as_ref()
    }

    /// The index.
    ///
    /// # Errors
    /// The errors of [`Retriever::find`].
    pub fn open(&self, scene: &dyn Scene, params: &Params) -> Result<Arc<Retriever>, NoIndex> {
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = opened.as_ref().filter(|known| known.is_for(params)) {
            return Ok(Arc::clone(known));
        }
        let file = self.file.as_deref();
        let retriever = Arc::new(Retriever::find(file, scene, &self.argument, params)?);
        *opened = Some(Arc::clone(&retriever));
        Ok(retriever)
    }
}
