//! One table of all that a key, a button, a menu or the search can do.
//!
//! A new action is one entry. Keys, tooltips, menus, the list of keys and the search all come from the table.

use egui::{Button, Key, KeyboardShortcut, Modifiers, Response, Ui};

use super::App;
use super::camera::{NamedPose, Nudge};
use super::command::Queue;
use super::save::SaveTarget;
use super::state::AppState;
use super::view_context::{Sends, ViewContext};
use super::view_name::ViewName;
use super::view_options::Arrangement;
use super::view_options::{CompareMode, SidePanel, Tab};
use crate::measure::is_equal;
use crate::session::RunMode;

/// What an action is for. The list of keys is in these groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Running and stepping.
    Run,
    /// Another moment, stage or method.
    Look,
    /// Another query.
    Query,
    /// What is shown.
    Show,
    /// Two runs.
    Compare,
    /// Another pose for the camera.
    Camera,
    /// The open lesson.
    Lesson,
    /// Files, pictures and the window itself.
    Window,
}

impl Group {
    /// All groups, in the order of the list of keys.
    pub const ALL: [(Self, &'static str); 8] = [
        (Self::Run, "Run and step"),
        (Self::Look, "Look back and ahead"),
        (Self::Query, "Queries"),
        (Self::Show, "What is shown"),
        (Self::Compare, "Compare two runs"),
        (Self::Camera, "Try another pose"),
        (Self::Lesson, "Lessons"),
        (Self::Window, "Window and files"),
    ];
}

/// Something that a user can do at any time.
pub struct Action {
    /// What it is for.
    pub group: Group,
    /// What it does, in a few words: menus, the search and the list of keys show it.
    pub text: &'static str,
    /// Keys that do it.
    pub keys: &'static [KeyboardShortcut],
    /// Does it.
    pub run: fn(&mut App),
    /// Whether it is switched on; always `false` for what is done once.
    pub is_on: fn(&AppState) -> bool,
}

const fn key(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

const fn shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::SHIFT, key)
}

const fn alt(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::ALT, key)
}

const fn alt_shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::ALT.plus(Modifiers::SHIFT), key)
}

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

const fn once(
    group: Group,
    keys: &'static [KeyboardShortcut],
    text: &'static str,
    run: fn(&mut App),
) -> Action {
    switch(group, keys, text, run, |_| false)
}

const fn switch(
    group: Group,
    keys: &'static [KeyboardShortcut],
    text: &'static str,
    run: fn(&mut App),
    is_on: fn(&AppState) -> bool,
) -> Action {
    Action { group, text, keys, run, is_on }
}

use Group::{Camera, Compare, Lesson, Look, Query, Run, Show, Window};

/// Every action, in the order of the list of keys.
// A line for each: broken up, the table would be four times as long.
#[rustfmt::skip]
pub const ACTIONS: &[Action] = &[
    once(Run, &[key(Key::Space)], "Run or pause", |app| app.state.run_or_pause()),
    once(Run, &[key(Key::F5)], "Run to the next breakpoint", |app| app.state.go_on()),
    once(Run, &[key(Key::F9)], "Run to the end, past all breakpoints", |app| app.state.run_to_end()),
    once(Run, &[shift(Key::F5)], "Restart and wait at the first step", |app| app.state.start_run(RunMode::Paused)),
    once(Run, &[key(Key::I), key(Key::F11)], "Step to the next event", |app| app.state.resume(RunMode::StepInto)),
    once(Run, &[key(Key::F10)], "Step over the stage", |app| app.state.resume(RunMode::StepOver)),
    once(Run, &[shift(Key::I), shift(Key::F11)], "Step out of the stage", |app| app.state.resume(RunMode::StepOut)),
    once(Look, &[key(Key::ArrowRight)], "One step on", |app| app.state.forward(1)),
    once(Look, &[key(Key::ArrowLeft)], "One step back", |app| app.state.back(1)),
    once(Look, &[shift(Key::ArrowRight)], "Ten steps on", |app| app.state.forward(10)),
    once(Look, &[shift(Key::ArrowLeft)], "Ten steps back", |app| app.state.back(10)),
    once(Look, &[key(Key::ArrowDown)], "Next stage", |app| app.state.next_stage(false)),
    once(Look, &[key(Key::ArrowUp)], "Previous stage", |app| app.state.next_stage(true)),
    once(Look, &[key(Key::Home)], "To the first step", |app| app.state.move_cursor(0)),
    once(Look, &[key(Key::End)], "To the last step", |app| app.state.follow()),
    once(Look, &[key(Key::W)], "Why the result is what it is", |app| app.state.options.shows_why ^= true),
    once(Look, &[key(Key::Num1)], "Show method 1", |app| app.state.select_nth(0)),
    once(Look, &[key(Key::Num2)], "Show method 2", |app| app.state.select_nth(1)),
    once(Look, &[key(Key::Num3)], "Show method 3", |app| app.state.select_nth(2)),
    once(Look, &[key(Key::Num4)], "Show method 4", |app| app.state.select_nth(3)),
    once(Look, &[key(Key::Num5)], "Show method 5", |app| app.state.select_nth(4)),
    once(Look, &[key(Key::Num6)], "Show method 6", |app| app.state.select_nth(5)),
    once(Look, &[key(Key::Num7)], "Show method 7", |app| app.state.select_nth(6)),
    once(Look, &[key(Key::Num8)], "Show method 8", |app| app.state.select_nth(7)),
    once(Look, &[key(Key::Period)], "All methods one step on", |app| app.state.go_together(1)),
    once(Look, &[key(Key::Comma)], "All methods one step back", |app| app.state.go_together(-1)),
    once(Look, &[shift(Key::Period)], "All methods fifty steps on", |app| app.state.go_together(50)),
    once(Look, &[shift(Key::Comma)], "All methods fifty steps back", |app| app.state.go_together(-50)),
    once(Query, &[key(Key::J)], "Next query", |app| app.state.next_query(false, |_, _| true)),
    once(Query, &[key(Key::K)], "Previous query", |app| app.state.next_query(true, |_, _| true)),
    once(Query, &[key(Key::N)], "Next failure", |app| app.state.next_failure(false)),
    once(Query, &[shift(Key::N)], "Previous failure", |app| app.state.next_failure(true)),
    switch(Query, &[key(Key::E)], "Try what would have helped", |app| app.state.switch_explaining(), |state| state.setup.task.protocol.explain > 0),
    once(Query, &[key(Key::Slash)], "Filter the queries, the parameters or the results", |app| app.state.focus_filter()),
    once(Query, &[], "Explain all failures", |app| app.state.explain_all()),
    switch(Query, &[], "Run all queries, or stop", |app| app.state.queries.run_all(&app.state.setup), |state| state.queries.progress().is_some()),
    switch(Show, &[key(Key::G)], "Ground truth", |app| app.state.options.shows_truth ^= true, |state| state.options.shows_truth),
    once(Show, &[key(Key::V)], "3-D view and back", |app| app.state.toggle(ViewName::Space)),
    switch(Show, &[key(Key::B)], "Blink between query and synthetic view", |app| app.state.options.blinking ^= true, |state| state.options.blinking),
    switch(Show, &[key(Key::F)], "Dense map of all positions and headings", |app| app.state.options.shows_dense_map ^= true, |state| state.options.shows_dense_map),
    switch(Show, &[key(Key::M)], "The canvas alone", |app| app.state.show_alone(None), |state| state.options.is_alone),
    switch(Show, &[key(Key::Q)], "List of queries", |app| app.state.toggle_side(SidePanel::Queries), |state| state.shows_side(SidePanel::Queries)),
    switch(Show, &[key(Key::T)], "Inspector", |app| app.state.toggle_side(SidePanel::Inspector), |state| state.shows_side(SidePanel::Inspector)),
    once(Show, &[], "Inspector: why", |app| app.state.show_tab(Tab::Why)),
    once(Show, &[], "Inspector: numbers", |app| app.state.show_tab(Tab::Numbers)),
    once(Show, &[], "Inspector: parameters", |app| app.state.show_tab(Tab::Parameters)),
    once(Show, &[], "Inspector: log", |app| app.state.show_tab(Tab::Log)),
    once(Compare, &[key(Key::P)], "Keep this run as A", |app| app.state.keep_run()),
    switch(Compare, &[key(Key::X)], "Flip between the runs A and B", |app| app.state.flip(), |state| state.options.compare_mode == CompareMode::Kept),
    switch(Compare, &[key(Key::D)], "Differences only", |app| app.state.options.only_differences ^= true, |state| state.options.only_differences),
    once(Compare, &[], "Forget run A", |app| app.state.forget_run()),
    once(Compare, &[], "Keep all results as A", |app| app.state.keep_results()),
    once(Compare, &[], "Forget the results A", |app| app.state.set_results_before(None)),
    once(Camera, &[alt(Key::ArrowUp)], "Camera ahead", |app| app.state.move_camera(Nudge::Forward(1.0))),
    once(Camera, &[alt(Key::ArrowDown)], "Camera back", |app| app.state.move_camera(Nudge::Forward(-1.0))),
    once(Camera, &[alt(Key::ArrowRight)], "Camera to the right", |app| app.state.move_camera(Nudge::Right(1.0))),
    once(Camera, &[alt(Key::ArrowLeft)], "Camera to the left", |app| app.state.move_camera(Nudge::Right(-1.0))),
    once(Camera, &[alt_shift(Key::ArrowUp)], "Camera up", |app| app.state.move_camera(Nudge::Up(1.0))),
    once(Camera, &[alt_shift(Key::ArrowDown)], "Camera down", |app| app.state.move_camera(Nudge::Up(-1.0))),
    once(Camera, &[alt_shift(Key::ArrowLeft)], "Turn the camera left", |app| app.state.move_camera(Nudge::Yaw(1.0))),
    once(Camera, &[alt_shift(Key::ArrowRight)], "Turn the camera right", |app| app.state.move_camera(Nudge::Yaw(-1.0))),
    once(Camera, &[alt(Key::Num1)], "Camera to the start", |app| app.state.jump_camera(NamedPose::Start)),
    once(Camera, &[alt(Key::Num2)], "Camera to the coarse minimum", |app| app.state.jump_camera(NamedPose::Coarse)),
    once(Camera, &[alt(Key::Num3)], "Camera to the fine minimum", |app| app.state.jump_camera(NamedPose::Fine)),
    once(Camera, &[alt(Key::Num4)], "Camera to the estimate", |app| app.state.jump_camera(NamedPose::Estimate)),
    once(Camera, &[alt(Key::Num5), key(Key::Num9)], "Camera to the truth", |app| app.state.jump_camera(NamedPose::Truth)),
    once(Camera, &[key(Key::Num0)], "Camera to where it was before", |app| app.state.jump_camera(NamedPose::Last)),
    once(Camera, &[key(Key::Escape)], "Let the camera go", |app| app.state.camera = None),
    once(Lesson, &[key(Key::PageDown)], "Next page", |app| app.turn_page(false)),
    once(Lesson, &[key(Key::PageUp)], "Previous page", |app| app.turn_page(true)),
    once(Lesson, &[], "Close the lesson", App::close_lesson),
    once(Window, &[key(Key::F2)], "Inspect one query", |app| app.arrange(Arrangement::Inspect)),
    once(Window, &[key(Key::F3)], "Lecture", |app| app.arrange(Arrangement::Lecture)),
    once(Window, &[key(Key::F4)], "Batch of results", |app| app.arrange(Arrangement::Batch)),
    once(Window, &[ctrl(Key::O)], "Open a scene, a run or a lesson …", |app| app.ask_where(SaveTarget::Opened)),
    once(Window, &[], "Save a recording …", |app| app.ask_where(SaveTarget::Recording)),
    once(Window, &[], "Stream the run to a Rerun viewer", |app| app.state.stream_recording()),
    once(Window, &[], "Open the run in a new Rerun viewer", |app| app.state.spawn_viewer()),
    once(Window, &[ctrl(Key::P)], "Save a picture of the window …", |app| app.ask_where(SaveTarget::Picture)),
    once(Window, &[], "Save a picture of the canvas …", |app| app.ask_where(SaveTarget::Canvas)),
    once(Window, &[ctrl(Key::C)], "Copy the command line of this run", |app| app.state.copy_command_line()),
    once(Window, &[], "Save the session …", |app| app.ask_where(SaveTarget::Session)),
    once(Window, &[], "Restore a session …", |app| app.ask_where(SaveTarget::Restored)),
    once(Window, &[key(Key::L)], "Light or dark", |app| app.switch_theme()),
    once(Window, &[ctrl(Key::K)], "Search for an action", |app| app.open_search()),
    // Named by what it types, wherever it is on the keyboard.
    once(Window, &[key(Key::Questionmark), key(Key::F1)], "All keys", |app| app.help ^= true),
];

/// The action that has this text.
pub(super) fn of(text: &str) -> Option<&'static Action> {
    ACTIONS.iter().find(|action| action.text == text)
}

impl Action {
    /// The action that has this text. A text that no action has does not compile in a `const`.
    pub(super) const fn named(text: &str) -> &'static Self {
        let mut at = 0;
        while at < ACTIONS.len() {
            if is_equal(ACTIONS[at].text, text) {
                return &ACTIONS[at];
            }
            at += 1;
        }
        panic!("no action has this text")
    }

    /// Its keys as people read them, separated by commas; nothing where it has none.
    pub(super) fn keys_text(&self, ctx: &egui::Context) -> String {
        let keys = self.keys.iter().map(|keys| ctx.format_shortcut(keys));
        keys.collect::<Vec<_>>().join(", ")
    }

    /// What it does, with its keys.
    pub(super) fn tooltip(&self, ctx: &egui::Context) -> String {
        match self.keys_text(ctx) {
            keys if keys.is_empty() => self.text.to_owned(),
            keys => format!("{} ({keys})", self.text),
        }
    }

    /// Its entry in a menu.
    pub(super) fn menu_item(&self, ui: &mut Ui, context: &ViewContext<'_>) {
        let keys = self.keys_text(ui.ctx());
        let button = Button::selectable((self.is_on)(context.state), self.text).shortcut_text(keys);
        if ui.add(button).sends(context, self.run) {
            ui.close();
        }
    }
}

/// A button that does the action; its tooltip comes from the table.
pub(super) fn button(ui: &mut Ui, context: &ViewContext<'_>, name: &str, action: &'static Action) {
    let button = Button::selectable((action.is_on)(context.state), name).frame_when_inactive(true);
    ui.add(button).on_hover_text(action.tooltip(ui.ctx())).sends(context, action.run);
}

/// The same for what is switched on and off, without a frame while it is off.
pub(super) fn toggle(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    name: &str,
    action: &'static Action,
) -> Response {
    let is_on = (action.is_on)(context.state);
    let response = ui.selectable_label(is_on, name).on_hover_text(action.tooltip(ui.ctx()));
    response.sends(context, action.run);
    response
}

/// Sends the commands of the keys of this frame, unless a field has the keyboard.
pub(super) fn read_keys(ctx: &egui::Context, commands: &Queue) {
    if ctx.egui_wants_keyboard_input() {
        return;
    }
    let pairs =
        ACTIONS.iter().flat_map(|action| action.keys.iter().map(move |keys| (keys, action)));
    let mut pairs: Vec<_> = pairs.collect();
    // An open menu takes the key that closes it.
    if egui::Popup::is_any_open(ctx) {
        pairs.retain(|(keys, _)| keys.logical_key != Key::Escape);
    }
    // egui takes a key with Shift for one without: those with more modifiers come first.
    pairs.sort_by_key(|(keys, _)| {
        let Modifiers { alt, shift, command, .. } = keys.modifiers;
        std::cmp::Reverse(u8::from(alt) + u8::from(shift) + u8::from(command))
    });
    for (keys, action) in pairs {
        while ctx.input_mut(|input| input.consume_shortcut(keys)) {
            commands.send(action.run);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things_and_no_text_has_two_entries() {
        let keys = ACTIONS.iter().flat_map(|action| action.keys);
        let mut keys: Vec<_> = keys.map(|keys| format!("{keys:?}")).collect();
        let mut texts: Vec<_> = ACTIONS.iter().map(|action| action.text.to_owned()).collect();
        for names in [&mut keys, &mut texts] {
            names.sort();
            let all = names.len();
            names.dedup();
            assert_eq!(names.len(), all);
        }
    }
}
