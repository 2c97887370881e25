//! The frame of the window: what stands where around the canvas.

pub(super) mod batch;
pub(super) mod canvas;
pub(super) mod help;
pub(super) mod inspector;
pub(super) mod proof;
pub(super) mod stage;
pub(super) mod storyboard;
pub(super) mod toolbar;
pub(super) mod verdicts;

use egui::{RichText, Ui};

use super::theme;
use super::view_context::{Sends, ViewContext};
use super::view_name::ViewName;
use super::views::{self, View};
use crate::session::Part;

/// The views with what they remember: a zoom, a filter. Both runs that are compared share it.
pub(super) struct Panes {
    /// In the order of [`views::ALL`].
    views: Vec<Box<dyn View>>,
    /// The part whose proof has a small panel that was made large, and that panel.
    swapped: Option<(Part, usize)>,
}

impl Panes {
    pub(super) fn new() -> Self {
        let views = views::ALL.iter();
        Self { views: views.map(|entry| (entry.new)()).collect(), swapped: None }
    }

    /// Draws a view of the run that is shown.
    pub(super) fn show(&mut self, ui: &mut Ui, name: ViewName, context: &ViewContext<'_>) {
        let view = &mut self.views[name as usize];
        ui.push_id(name.word(), |ui| view.ui(ui, context));
    }
}

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

/// Draws the notes in the lower right corner.
pub(crate) fn notes(ctx: &egui::Context, context: &ViewContext<'_>) {
    if context.state.notes.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("notes"))
        .order(egui::Order::Foreground)
        .anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -76.0]);
    area.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(520.0);
            for (index, note) in context.state.notes.iter().enumerate() {
                ui.horizontal_wrapped(|ui| {
                    ui.small_button("×")
                        .on_hover_text("Dismiss")
                        .sends(context, move |app| app.state.dismiss(index));
                    let text = RichText::new(&note.text);
                    ui.label(if note.is_error {
                        text.color(theme::text(ui.visuals(), theme::ESTIMATE)).strong()
                    } else {
                        text
                    });
                });
            }
        });
    });
}
