//! The bar of buttons: run, step, which of two runs, and what is switched on.

use egui::{Button, RichText, Ui};

use super::arrangement::Arrangement;
use super::command::{Command, Queue};
use super::setup::ReferencePick;
use super::state::AppState;
use super::theme;
use super::view_options::CompareMode;
use crate::event::Side;
use crate::localize::Selection;
use crate::method::Method;
use crate::session::RunState;

pub(super) fn ui(ui: &mut Ui, state: &AppState, commands: &Queue) {
    ui.horizontal_wrapped(|ui| {
        run_buttons(ui, state, commands);
        ui.separator();
        query(ui, state, commands);
        ui.separator();
        methods(ui, state, commands);
        ui.separator();
        switches(ui, state, commands);
        compared(ui, state, commands);
        menus(ui, commands);
    });
}

fn button(ui: &mut Ui, commands: &Queue, text: &str, help: &str, command: Command) {
    if ui.add(Button::new(text)).on_hover_text(help).clicked() {
        commands.send(command);
    }
}

fn run_buttons(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let is_running = matches!(state.run_state(), RunState::Running | RunState::Loading);
    let (text, help) = if is_running {
        ("Pause", "Pause behind the next event (Space)")
    } else {
        ("▶ Run", "Run to the next breakpoint or the end (Space, F5)")
    };
    button(ui, commands, text, help, Command::RunOrPause);
    let is_paused = matches!(state.run_state(), RunState::Paused { .. });
    ui.add_enabled_ui(is_paused || is_running, |ui| {
        button(
            ui,
            commands,
            "Into",
            "To the next event (F11, I)",
            Command::StepInto,
        );
        let help = "Behind the stage that begins here (F10)";
        button(ui, commands, "Over", help, Command::StepOver);
        let help = "To the end of the stage around this (Shift+F11)";
        button(ui, commands, "Out", help, Command::StepOut);
        let help = "Run to the end, past all breakpoints (F9)";
        button(ui, commands, "To end", help, Command::RunToEnd);
    });
    let help = "Begin again and wait at the first step (Shift+F5)";
    button(ui, commands, "Restart", help, Command::Restart);
    match state.run_state() {
        RunState::Loading => {
            ui.spinner();
            ui.label(match state.run().ranking {
                Some([looked_at, candidates]) => {
                    format!("Choosing references: {looked_at} of {candidates} frames")
                }
                None => "Loading".to_owned(),
            });
        }
        RunState::Running => {
            ui.spinner();
            ui.label(match &state.run().explaining {
                Some(explaining) => explaining.to_string(),
                None => "Running".to_owned(),
            });
        }
        RunState::Paused { breakpoint: None } => {
            ui.label("Paused");
        }
        RunState::Paused {
            breakpoint: Some(text),
        } => {
            ui.label(
                RichText::new(format!("● {text}"))
                    .color(theme::text(ui.visuals(), theme::ESTIMATE)),
            )
            .on_hover_text("The breakpoint that stopped the run");
        }
        RunState::Finished => {
            ui.label("Finished");
        }
        RunState::Cancelled => {
            ui.label("Cancelled");
        }
        RunState::Broken(why) => {
            ui.label(RichText::new("Stopped").color(theme::text(ui.visuals(), theme::ESTIMATE)))
                .on_hover_text(why);
        }
    }
}

fn query(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let setup = &state.setup;
    button(
        ui,
        commands,
        "◀",
        "Previous query (K)",
        Command::NextQuery { back: true },
    );
    ui.label(setup.label(Side::Query, setup.query))
        .on_hover_text("The query");
    button(
        ui,
        commands,
        "▶",
        "Next query (J)",
        Command::NextQuery { back: false },
    );
    ui.label("←");
    let names: Vec<_> = setup
        .chosen
        .frames
        .iter()
        .map(|&reference| setup.label(Side::Reference, reference))
        .collect();
    // A label without text would send what follows it back to the left edge.
    let text = match names.as_slice() {
        [] => RichText::new("not chosen").weak(),
        names => RichText::new(names.join(", ")).color(theme::text(ui.visuals(), theme::REFERENCE)),
    };
    ui.label(text).on_hover_text("The references");
    ui.menu_button("References", |ui| {
        for pick in [
            ReferencePick::By(Selection::Random(1)),
            ReferencePick::By(Selection::Random(3)),
            ReferencePick::By(Selection::Nearest(1)),
            ReferencePick::By(Selection::Nearest(3)),
            ReferencePick::By(Selection::Matched(1)),
            ReferencePick::ByHand,
        ] {
            if ui.radio(setup.pick() == pick, pick.to_string()).clicked() {
                commands.send(Command::PickReferences(pick));
            }
        }
        ui.separator();
        let mut radius = setup.task.radius_m();
        let label = ui.label("Radius");
        let drag = egui::DragValue::new(&mut radius)
            .range(1.0..=500.0)
            .suffix(" m")
            .update_while_editing(false);
        let response = ui.add(drag).labelled_by(label.id);
        if (response.drag_stopped() || response.lost_focus()) && radius != setup.task.radius_m() {
            commands.send(Command::SetRadius(radius));
        }
        let mut seed = setup.task.protocol.seed;
        let label = ui.label("Seed");
        let drag = egui::DragValue::new(&mut seed).update_while_editing(false);
        let response = ui.add(drag).labelled_by(label.id);
        if (response.drag_stopped() || response.lost_focus()) && seed != setup.task.protocol.seed {
            commands.send(Command::SetSeed(seed));
        }
    });
}

fn methods(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let here = state
        .run()
        .span_at(state.cursor())
        .and_then(|span| span.part.method());
    let asked = state.setup.task.protocol.methods.iter().copied();
    let others = asked.filter(|method| !Method::PAPER.contains(method));
    for method in Method::PAPER.into_iter().chain(others) {
        let is_here = here == Some(method);
        let response = ui.selectable_label(is_here, method.label());
        // The paper's have keys.
        let key = Method::PAPER.iter().position(|known| *known == method);
        let help = match key {
            Some(place) => format!("Show what it did ({})", place + 1),
            None => "Show what it did".to_owned(),
        };
        if response.on_hover_text(help).clicked() {
            commands.send(Command::SelectMethod(method));
        }
    }
}

fn switches(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let switch = |ui: &mut Ui, is_on: bool, text: &str, help: &str, command: Command| {
        let mut state = is_on;
        if ui
            .toggle_value(&mut state, text)
            .on_hover_text(help)
            .clicked()
        {
            commands.send(command);
        }
    };
    let help = "Show the ground truth (G)";
    switch(
        ui,
        state.options.shows_truth,
        "Truth",
        help,
        Command::ShowTruth,
    );
    let help = "Show only what differs (D)";
    switch(
        ui,
        state.options.only_differences,
        "Differences",
        help,
        Command::OnlyDifferences,
    );
    let help = "Blink between query and synthetic view (B)";
    switch(ui, state.options.blinking, "Blink", help, Command::Blink);
}

/// The buttons are there without a run A too, lest the bar jump when one is kept.
fn compared(ui: &mut Ui, state: &AppState, commands: &Queue) {
    ui.separator();
    let help = "Keep this run to compare with (P)";
    button(ui, commands, "Keep A", help, Command::Pin);
    let has_kept = state.kept.is_some();
    for (compare_mode, text, help) in [
        (CompareMode::Kept, "A", "Show the run that was kept (X)"),
        (CompareMode::Present, "B", "Show the present run (X)"),
        (
            CompareMode::SideBySide,
            "A | B",
            "Show both beside each other",
        ),
    ] {
        let is_on = has_kept && state.options.compare_mode == compare_mode;
        let response = ui.add_enabled(has_kept, Button::selectable(is_on, text));
        if response.on_hover_text(help).clicked() {
            commands.send(Command::Compare(compare_mode));
        }
    }
    let forget = ui.add_enabled(has_kept, Button::new("Forget"));
    if forget
        .on_hover_text("Forget the run that was kept")
        .clicked()
    {
        commands.send(Command::Unpin);
    }
}

fn menus(ui: &mut Ui, commands: &Queue) {
    ui.separator();
    ui.menu_button("Views", |ui| {
        for entry in super::views::ALL {
            if ui.button(entry.title).on_hover_text(entry.about).clicked() {
                commands.send(Command::ShowView(entry.name));
            }
        }
        ui.separator();
        for (arrangement, title, key) in Arrangement::ALL {
            let words = format!("Layout: {title} ({})", key.name());
            if ui.button(words).clicked() {
                commands.send(Command::Arrange(arrangement));
            }
        }
    });
    super::save::menu(ui, commands);
    button(
        ui,
        commands,
        "Theme",
        "Light or dark (L)",
        Command::SwitchTheme,
    );
    button(ui, commands, "?", "All keys (?)", Command::Help);
}

/// What there is to say, above what is drawn: nothing moves for it.
pub(super) fn notes(ctx: &egui::Context, state: &AppState, commands: &Queue) {
    if state.notes.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("notes"))
        .order(egui::Order::Foreground)
        .anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -76.0]);
    area.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(520.0);
            for (index, note) in state.notes.iter().enumerate() {
                ui.horizontal_wrapped(|ui| {
                    if ui.small_button("×").on_hover_text("Dismiss").clicked() {
                        commands.send(Command::Dismiss(index));
                    }
                    let text = RichText::new(&note.text);
                    ui.label(if note.is_error {
                        text.color(theme::text(ui.visuals(), theme::ESTIMATE))
                            .strong()
                    } else {
                        text
                    });
                });
            }
        });
    });
}
