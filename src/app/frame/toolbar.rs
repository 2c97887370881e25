//! The toolbar: one line with the scene, the query, its references, running and what is shown.

use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Align, Button, Label, Layout, PopupCloseBehavior, Response, RichText, Ui};

use super::Panes;
use crate::app::Arrangement;
use crate::app::action::{ACTIONS, Action, Group, button};
use crate::app::theme;
use crate::app::{Sends, ViewContext, ViewName};
use crate::event::Side;
use crate::lesson::Lesson;
use crate::session::RunState;

/// Room of the buttons at the right, and of those in the middle \[points\].
const RIGHT: f32 = 440.0;
const MIDDLE: f32 = 232.0;

pub(crate) fn ui(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    ui.horizontal_centered(|ui| {
        menu(ui, context);
        let room = ui.available_width() - RIGHT - MIDDLE;
        part(ui, room.max(200.0), |ui| query(ui, context, panes));
        part(ui, MIDDLE, |ui| running(ui, context, panes));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            shown(ui, context);
        });
    });
}

/// Draws something in a fixed width.
fn part(ui: &mut Ui, width: f32, draw: impl FnOnce(&mut Ui)) {
    let size = egui::vec2(width, ui.available_height());
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(width);
        draw(ui);
    });
}

/// What is seldom needed.
fn menu(ui: &mut Ui, context: &ViewContext<'_>) {
    let response = ui.menu_button("Menu", |ui| {
        for (group, title) in Group::ALL {
            ui.menu_button(title, |ui| {
                for action in ACTIONS.iter().filter(|action| action.group == group) {
                    action.menu_item(ui, context);
                }
            });
        }
        ui.menu_button("Open a lesson", |ui| {
            for lesson in Lesson::all().unwrap_or_default() {
                let button = ui.button(&lesson.title).on_hover_text(&lesson.about);
                let name = lesson.name;
                if button.sends(context, move |app| app.open_named(&name)) {
                    ui.close();
                }
            }
        });
        ui.menu_button("Views", |ui| {
            for entry in crate::app::views::ALL {
                let button = ui.button(entry.title).on_hover_text(entry.about);
                if button.sends(context, |app| app.state.show_view(entry.name)) {
                    ui.close();
                }
            }
        });
    });
    response.response.on_hover_text("All actions");
}

fn query(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    let setup = &context.setup;
    let scene = RichText::new(setup.queries.name()).strong();
    ui.add(Label::new(scene).truncate()).on_hover_text("The scene of the query");
    ui.weak("›");
    button(ui, context, "◀", const { Action::named("Previous query") });
    ui.label(RichText::new(setup.query_name()).strong()).on_hover_text("The query");
    button(ui, context, "▶", const { Action::named("Next query") });
    // The names of the references are worth more than the word before them.
    if ui.available_width() > 170.0 {
        ui.weak("against");
    }
    let names: Vec<String> = setup
        .chosen
        .frames
        .iter()
        .map(|&reference| setup.label(Side::Reference, reference))
        .collect();
    let text = match names.as_slice() {
        [] => "no reference yet".to_owned(),
        [one] => one.clone(),
        [first, others @ ..] => format!("{first} and {} more", others.len()),
    };
    let chip = Button::new(format!("{text} ▾")).truncate();
    let show = |ui: &mut Ui| panes.show(ui, ViewName::References, context);
    let response = popup(ui, chip, [380.0, 420.0], show);
    let all = names.join(", ");
    let spoken = format!("References: {all}");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &spoken));
    response.on_hover_text(format!("The references: {all}. Click to choose others"));
}

fn running(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    let is_running = matches!(context.state.run_state(), RunState::Running | RunState::Loading);
    let is_paused = matches!(context.state.run_state(), RunState::Paused { .. });
    let text = if is_running { "Pause" } else { "▶ Run" };
    let run = ui.add_sized([64.0, 26.0], Button::new(text));
    run.on_hover_text(const { Action::named("Run or pause") }.tooltip(ui.ctx()))
        .sends(context, |app| app.state.run_or_pause());
    ui.add_enabled_ui(is_paused || is_running, |ui| {
        button(ui, context, "Stage", const { Action::named("Step over the stage") });
        button(ui, context, "Step", const { Action::named("Step to the next event") });
    });
    let count = context.setup.task.breakpoints.len();
    let text = if count == 0 { "Break".to_owned() } else { format!("Break ({count})") };
    let show = |ui: &mut Ui| panes.show(ui, ViewName::Breakpoints, context);
    let response = popup(ui, Button::new(text), [320.0, 260.0], show);
    response.on_hover_text("Where the run stops");
}

/// A button that opens something of a fixed size below it, until a click beside it.
fn popup(ui: &mut Ui, button: Button<'_>, size: [f32; 2], show: impl FnOnce(&mut Ui)) -> Response {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let (response, _) = MenuButton::from_button(button).config(config).ui(ui, |ui| {
        ui.set_min_size(size.into());
        ui.set_max_size(size.into());
        show(ui);
    });
    response
}

/// What is shown, and the layouts; from the right.
fn shown(ui: &mut Ui, context: &ViewContext<'_>) {
    button(ui, context, "?", const { Action::named("All keys") });
    button(ui, context, "Search", const { Action::named("Search for an action") });
    ui.separator();
    for (layout, title) in Arrangement::ALL.into_iter().rev() {
        let action = match layout {
            Arrangement::Inspect => const { Action::named("Inspect one query") },
            Arrangement::Lecture => const { Action::named("Lecture") },
            Arrangement::Batch => const { Action::named("Batch of results") },
        };
        let response = ui.add(Button::selectable(context.options.layout == layout, title));
        response.on_hover_text(action.tooltip(ui.ctx())).sends(context, action.run);
    }
    ui.separator();
    compare(ui, context);
    let is_known = context.run.truth().is_some() || context.run.loaded.is_none();
    ui.add_enabled_ui(is_known, |ui| {
        button(ui, context, "Truth", const { Action::named("Ground truth") });
    })
    .response
    .on_disabled_hover_text("The true pose of this query is not known");
}

fn compare(ui: &mut Ui, context: &ViewContext<'_>) {
    let text = match (context.state.kept.is_some(), context.state.is_showing_kept()) {
        (false, _) => RichText::new("Compare"),
        (true, true) => RichText::new("Run A").color(theme::accent(ui.visuals())),
        (true, false) => RichText::new("Run B").color(theme::accent(ui.visuals())),
    };
    let button = Button::new(text).min_size(egui::vec2(72.0, 0.0));
    let (response, _) = MenuButton::from_button(button).ui(ui, |ui| {
        for action in ACTIONS.iter().filter(|action| action.group == Group::Compare) {
            action.menu_item(ui, context);
        }
    });
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Compare"));
    response.on_hover_text("Keep a run as A and compare later ones with it");
}
