//! How a person looks at the runs: what is switched on, and what is selected.

use super::camera::NamedPose;
use super::selection::VerdictChange;

/// Which of two runs is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareMode {
    /// The present run, B.
    #[default]
    Present,
    /// The run that was kept, A.
    Kept,
    /// Both, beside each other.
    SideBySide,
}

/// What is switched on and selected.
#[derive(Clone, Debug)]
pub struct ViewOptions {
    /// Which of the runs is shown.
    pub compare_mode: CompareMode,
    /// Whether the ground truth is shown.
    pub shows_truth: bool,
    /// Whether nothing is shown of what comes behind the cursor.
    pub hides_future: bool,
    /// With the methods beside each other, so many steps into each of them.
    pub lockstep: Option<usize>,
    /// Two poses that are looked at beside each other.
    pub beside: Option<[NamedPose; 2]>,
    /// Which results of queries are looked at, as a condition.
    pub results_filter: String,
    /// What has to have become of the verdicts of results that are looked at.
    pub verdict_change: Option<VerdictChange>,
    /// Whether only what differs is shown.
    pub only_differences: bool,
    /// Whether the cost surface shows every position with every heading.
    pub shows_dense_map: bool,
    /// Whether query and synthetic view are shown in turn.
    pub blinking: bool,
    /// Whether the keyboard is wanted by the filter.
    pub wants_filter: bool,
    /// The query feature that is looked at.
    pub selected_feature: Option<usize>,
}

impl Default for ViewOptions {
    fn default() -> Self {
        Self {
            compare_mode: CompareMode::default(),
            shows_truth: true,
            hides_future: false,
            lockstep: None,
            beside: None,
            results_filter: String::new(),
            verdict_change: None,
            only_differences: false,
            shows_dense_map: false,
            blinking: false,
            wants_filter: false,
            selected_feature: None,
        }
    }
}
