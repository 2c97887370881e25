//! The frame of the window: what stands where around the canvas.

pub(super) mod batch;
pub(super) mod canvas;
pub(super) mod help;
pub(super) mod inspector;
pub(super) mod notes;
pub(super) mod proof;
pub(super) mod size;
pub(super) mod stage;
pub(super) mod storyboard;
pub(super) mod toolbar;
pub(super) mod verdicts;

use std::collections::BTreeMap;

use egui::Ui;

use super::command::Queue;
use super::state::AppState;
use super::view_context::ViewContext;
use super::views::{self, View};
use crate::session::Part;

/// The views with what they remember: a zoom, a filter. Both runs that are compared share it.
pub(super) struct Panes {
    views: BTreeMap<&'static str, Box<dyn View>>,
    /// The small panel of the proof that was made large, and the part that the proof is about.
    swapped: Option<usize>,
    proof_of: Option<Part>,
}

impl Panes {
    pub(super) fn new() -> Self {
        let views = views::ALL.iter();
        Self {
            views: views.map(|entry| (entry.name, (entry.new)())).collect(),
            swapped: None,
            proof_of: None,
        }
    }

    /// Draws a view of the run that is shown.
    pub(super) fn show(&mut self, ui: &mut Ui, name: &str, state: &AppState, commands: &Queue) {
        let Some(view) = self.views.get_mut(name) else {
            ui.weak(format!("There is no view `{name}`"));
            return;
        };
        let context = ViewContext::new(state, commands);
        ui.push_id(name.to_owned(), |ui| view.ui(ui, &context));
    }
}
