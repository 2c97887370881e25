//! A synthetic view that is shown, and why.

use std::sync::Arc;

use crate::event::Moment;
use crate::geometry::Pose;
use crate::render::Comparison;

/// A synthetic view beside the query, and where it comes from.
#[derive(Clone)]
pub struct ShownView {
    /// View, cost, and what made the cost.
    pub comparison: Arc<Comparison>,
    /// Where the camera is (`world_from_camera`).
    pub pose: Pose,
    /// Why it is shown.
    pub reason: ShownReason,
}

/// Why a synthetic view is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShownReason {
    /// The pointer is over this pose.
    Pointer,
    /// The trial camera is there.
    Camera,
    /// The estimator rendered it.
    Event(Moment),
}

impl ShownReason {
    /// The reason in words, as a caption.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pointer => "under the pointer",
            Self::Camera => "trial camera",
            Self::Event(Moment::Start) => "at the reference",
            Self::Event(Moment::NewBest) => "new best",
            Self::Event(Moment::End) => "result",
        }
    }
}
