//! What a window is opened on, and what opens more of it.

use std::sync::Arc;

use super::selection::KnownResults;
use super::setup::Setup;
use crate::lesson::Lesson;

/// What the window shows.
pub struct Opening {
    /// What is run.
    pub setup: Setup,
    /// Results that are known already.
    pub results: KnownResults,
    /// The lesson, of which the setup is what its first page localises.
    pub lesson: Option<Lesson>,
}

/// Opens what has this name: a scene, a run folder or a lesson.
pub type Opener = Arc<dyn Fn(&str) -> Result<Opening, String> + Send + Sync>;
