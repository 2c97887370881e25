//! Fixed sizes of the parts of the window.

/// How large the parts around the canvas are \[points\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::app) struct Sizes {
    /// Height of the toolbar.
    pub(in crate::app) toolbar: f32,
    /// Height of the verdict bar.
    pub(in crate::app) verdicts: f32,
    /// Height of the storyboard.
    pub(in crate::app) storyboard: f32,
    /// Width of the list of queries.
    pub(in crate::app) queries: f32,
    /// Width of the inspector.
    pub(in crate::app) inspector: f32,
    /// Height of the sentence of a lecture.
    pub(in crate::app) sentence: f32,
    /// Whether the window is wide enough for the panels at the sides.
    pub(in crate::app) has_sides: bool,
}

impl Sizes {
    /// The sizes for a window of this size \[points\].
    pub(in crate::app) fn of(window: egui::Vec2) -> Self {
        let is_large = window.x >= 1400.0 && window.y >= 860.0;
        Self {
            toolbar: if is_large { 42.0 } else { 38.0 },
            verdicts: 66.0,
            storyboard: if is_large { 214.0 } else { 176.0 },
            queries: if is_large { 168.0 } else { 132.0 },
            inspector: if is_large { 300.0 } else { 248.0 },
            sentence: if is_large { 124.0 } else { 96.0 },
            has_sides: window.x >= 1200.0,
        }
    }
}
