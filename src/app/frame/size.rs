//! Fixed sizes of the parts of the window.

/// How large the parts around the canvas are \[points\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sizes {
    /// Height of the toolbar.
    pub(crate) toolbar: f32,
    /// Height of the verdict bar.
    pub(crate) verdicts: f32,
    /// Height of the storyboard.
    pub(crate) storyboard: f32,
    /// Width of the list of queries.
    pub(crate) queries: f32,
    /// Width of the inspector.
    pub(crate) inspector: f32,
    /// Height of the sentence of a lecture.
    pub(crate) sentence: f32,
    /// Whether the window is wide enough for the panels at the sides.
    pub(crate) has_sides: bool,
}

impl Sizes {
    /// The sizes for a window of this size \[points\].
    pub(crate) fn of(window: egui::Vec2) -> Self {
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
