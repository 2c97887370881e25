//! The canvas: one large picture that the selected stage chooses, and small ones beside it.

use egui::{Rect, RichText, Sense, Ui, UiBuilder, vec2};

use super::{Panes, proof, stage};
use crate::app::theme;
use crate::app::views;
use crate::app::{Sends, ViewContext, ViewName};

/// Share of the width that the large picture takes where others stand beside it.
const LARGE: f32 = 0.66;
const GAP: f32 = 8.0;
/// Height of the name above a small picture \[points\].
const TITLE: f32 = 18.0;

/// The views on the canvas: the large one first.
pub(crate) fn scene(context: &ViewContext<'_>) -> Vec<ViewName> {
    let here = context.state.shown_stage();
    let of_stage = stage::scene(here);
    let mut views: Vec<ViewName> = match &context.options.presented {
        Some(presented) => presented.clone(),
        None => of_stage.to_vec(),
    };
    if let Some((at, large)) = context.options.large
        && at == here
    {
        views.retain(|view| *view != large);
        views.insert(0, large);
        views.truncate(of_stage.len().max(2));
    }
    views
}

pub(crate) fn ui(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes, most: usize) {
    if context.options.shows_why && context.options.presented.is_none() {
        why(ui, context, panes);
        return;
    }
    let mut views = scene(context);
    views.truncate(most);
    let area = ui.available_rect_before_wrap();
    let (large, beside) = match views.as_slice() {
        [] | [_] => (area, Rect::NOTHING),
        _ => {
            let width = area.width() * LARGE;
            let (large, beside) = area.split_left_right_at_x(area.left() + width);
            (large, beside.with_min_x(beside.left() + GAP))
        }
    };
    if let Some(first) = views.first() {
        inside(ui, large, |ui| panes.show(ui, *first, context));
    }
    let others = views.get(1..).unwrap_or_default();
    let height = (beside.height() - GAP * others.len().saturating_sub(1) as f32)
        / others.len().max(1) as f32;
    for (index, name) in others.iter().enumerate() {
        let corner = beside.min + vec2(0.0, index as f32 * (height + GAP));
        let rect = Rect::from_min_size(corner, vec2(beside.width(), height));
        let (title, rest) = rect.split_top_bottom_at_y(rect.top() + TITLE);
        small_title(ui, context, *name, title);
        inside(ui, rest, |ui| panes.show(ui, *name, context));
    }
    ui.advance_cursor_after_rect(area);
}

/// Draws something into a part of the canvas, and nothing outside of it.
fn inside(ui: &mut Ui, rect: Rect, draw: impl FnOnce(&mut Ui)) {
    ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
        ui.shrink_clip_rect(rect);
        draw(ui);
    });
}

/// The name above a small picture; a click makes it the large one.
fn small_title(ui: &mut Ui, context: &ViewContext<'_>, name: ViewName, rect: Rect) {
    let title = views::entry_of(name).title;
    let response = ui.interact(rect, ui.scope_id().with(("small", name.word())), Sense::click());
    let spoken = format!("Show {title} large");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &spoken));
    let color = if response.hovered() || response.has_focus() {
        theme::accent(ui.visuals())
    } else {
        ui.visuals().weak_text_color()
    };
    let galley = ui.painter().layout_no_wrap(title.to_owned(), theme::CAPTION, color);
    ui.painter().galley(rect.min + vec2(2.0, 2.0), galley, color);
    if response.on_hover_text(spoken).clicked() {
        let large = Some((context.state.shown_stage(), name));
        context.send(move |app| app.state.options.large = large);
    }
}

/// The proof picture of what is selected.
pub(super) fn why(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    let part = context.span().map(|span| span.part);
    let Some(part) = part else {
        proof::empty(ui, "Nothing has run yet. Space runs the query.");
        return;
    };
    match context.state.shown_pictures().proof(part) {
        Some(picture) => {
            let swapped = panes.swapped.filter(|(of, _)| *of == part).map(|(_, small)| small);
            let swapped = proof::ui(ui, &context.state.textures, picture, swapped);
            panes.swapped = swapped.map(|small| (part, small));
        }
        None if context.state.is_proving() => proof::empty(ui, "The picture is being made."),
        None => proof::empty(ui, "This method left nothing that a picture could show."),
    }
}

/// A view alone, with a way back.
pub(crate) fn alone(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    ui.horizontal(|ui| {
        let button = ui.button(RichText::new("All panels").small());
        button
            .on_hover_text("Back to the window with all its parts (M)")
            .sends(context, |app| app.state.show_alone(None));
    });
    match context.options.alone {
        Some(view) => panes.show(ui, view, context),
        None => self::ui(ui, context, panes, usize::MAX),
    }
}
