//! How a user looks at the runs: what is switched on, and what is selected.

use serde::{Deserialize, Serialize};

use super::selection::ResultRow;
use super::view_name::ViewName;
use crate::event::Stage;
use crate::measure::{Migration, Order};

/// What the window is arranged for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arrangement {
    /// One query: why it failed.
    #[default]
    Inspect,
    /// One large picture and one sentence for each stage, and nothing of what is still to come.
    Lecture,
    /// A run over many queries.
    Batch,
}

impl Arrangement {
    /// All arrangements, with their titles.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Inspect, "Inspect"), (Self::Lecture, "Lecture"), (Self::Batch, "Batch")];
}

/// Which of two runs is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareMode {
    /// The present run, B.
    #[default]
    Present,
    /// The run that was kept, A.
    Kept,
}

/// A panel beside the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SidePanel {
    /// The list of queries.
    Queries,
    /// The inspector.
    Inspector,
}

/// A tab of the inspector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    /// Why the result is what it is, and what helps.
    #[default]
    Why,
    /// All numbers of the result.
    Numbers,
    /// The parameters of the run.
    Parameters,
    /// Every decision in words.
    Log,
}

impl Tab {
    /// All tabs with their titles.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Why, "Why"),
        (Self::Numbers, "Numbers"),
        (Self::Parameters, "Parameters"),
        (Self::Log, "Log"),
    ];
}

/// What is switched on and selected; nothing by default.
#[derive(Clone, Debug, Default)]
pub struct ViewOptions {
    /// What the window is arranged for.
    pub layout: Arrangement,
    /// Whether the canvas shows why the selected result is what it is, in place of its stage.
    pub shows_why: bool,
    /// A view that was made large at a stage.
    pub large: Option<(Option<Stage>, ViewName)>,
    /// Views that a page of a lesson shows, in place of those of the stage.
    pub presented: Option<Vec<ViewName>>,
    /// Whether the canvas has all the room.
    pub is_alone: bool,
    /// The view that has all the room; without one the canvas as it is.
    pub alone: Option<ViewName>,
    /// Whether the list of queries is shown.
    pub shows_queries: bool,
    /// Whether the inspector is shown.
    pub shows_inspector: bool,
    /// The panel that is shown where there is room for one beside the canvas.
    pub narrow: Option<SidePanel>,
    /// The tab of the inspector.
    pub tab: Tab,
    /// Which of the runs is shown.
    pub compare_mode: CompareMode,
    /// Whether the ground truth is shown.
    pub shows_truth: bool,
    /// Whether nothing is shown of what comes after the cursor.
    pub hides_future: bool,
    /// With the methods side by side, so many steps into each of them.
    pub lockstep: Option<usize>,
    /// Which results of queries are shown, as a condition.
    pub results_filter: String,
    /// The order of the table of results.
    pub results_order: Option<Order>,
    /// The row of that table that was opened last.
    pub selected_row: Option<ResultRow>,
    /// What the verdicts of the shown results have changed to.
    pub verdict_change: Option<Migration>,
    /// Whether only what differs is shown.
    pub only_differences: bool,
    /// Whether the cost surface shows every position with every heading.
    pub shows_dense_map: bool,
    /// Whether query and synthetic view are shown in turn.
    pub blinking: bool,
    /// Whether the filter takes the keyboard.
    pub wants_filter: bool,
    /// The selected query feature.
    pub selected_feature: Option<usize>,
}

impl ViewOptions {
    /// Whether a panel is shown. Without room for both, only the one that was asked for is.
    pub(super) fn shows_side(&self, panel: SidePanel, has_room: bool) -> bool {
        match panel {
            _ if !has_room => self.narrow == Some(panel),
            SidePanel::Queries => self.shows_queries,
            SidePanel::Inspector => self.shows_inspector,
        }
    }

    /// Shows a panel, or hides it.
    pub(super) fn set_side(&mut self, panel: SidePanel, has_room: bool, is_shown: bool) {
        match panel {
            _ if !has_room => self.narrow = is_shown.then_some(panel),
            SidePanel::Queries => self.shows_queries = is_shown,
            SidePanel::Inspector => self.shows_inspector = is_shown,
        }
    }
}
