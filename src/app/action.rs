//! One table of all that a key, a button, a menu or the search can do.
//!
//! A new action is one entry. Keys, tooltips, menus, the list of keys and the search all come from the table.

use egui::{Button, Key, KeyboardShortcut, Modifiers, Ui};

use super::arrangement::Arrangement;
use super::camera::{NamedPose, Nudge};
use super::command::{Command, Queue};
use super::save_target::SaveTarget;
use super::state::AppState;
use super::view_options::{CompareMode, Tab};

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
    /// The command that it sends.
    pub command: Command,
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
    command: Command,
) -> Action {
    switch(group, keys, text, command, |_| false)
}

const fn switch(
    group: Group,
    keys: &'static [KeyboardShortcut],
    text: &'static str,
    command: Command,
    is_on: fn(&AppState) -> bool,
) -> Action {
    Action { group, text, keys, command, is_on }
}

use Group::{Camera, Compare, Lesson, Look, Query, Run, Show, Window};

/// Every action, in the order of the list of keys.
// A line for each: broken up, the table would be four times as long.
#[rustfmt::skip]
pub static ACTIONS: &[Action] = &[
    once(Run, &[key(Key::Space)], "Run or pause", Command::RunOrPause),
    once(Run, &[key(Key::F5)], "Run to the next breakpoint", Command::Run),
    once(Run, &[key(Key::F9)], "Run to the end, past all breakpoints", Command::RunToEnd),
    once(Run, &[shift(Key::F5)], "Restart and wait at the first step", Command::Restart),
    once(Run, &[key(Key::I), key(Key::F11)], "Step to the next event", Command::StepInto),
    once(Run, &[key(Key::F10)], "Step over the stage", Command::StepOver),
    once(Run, &[shift(Key::I), shift(Key::F11)], "Step out of the stage", Command::StepOut),
    once(Look, &[key(Key::ArrowRight)], "One step on", Command::Forward(1)),
    once(Look, &[key(Key::ArrowLeft)], "One step back", Command::Back(1)),
    once(Look, &[shift(Key::ArrowRight)], "Ten steps on", Command::Forward(10)),
    once(Look, &[shift(Key::ArrowLeft)], "Ten steps back", Command::Back(10)),
    once(Look, &[key(Key::ArrowDown)], "Next stage", Command::NextStage { back: false }),
    once(Look, &[key(Key::ArrowUp)], "Previous stage", Command::NextStage { back: true }),
    once(Look, &[key(Key::Home)], "To the first step", Command::First),
    once(Look, &[key(Key::End)], "To the last step", Command::Last),
    once(Look, &[key(Key::W)], "Why the result is what it is", Command::Why),
    once(Look, &[key(Key::Num1)], "Show method 1", Command::SelectNth(0)),
    once(Look, &[key(Key::Num2)], "Show method 2", Command::SelectNth(1)),
    once(Look, &[key(Key::Num3)], "Show method 3", Command::SelectNth(2)),
    once(Look, &[key(Key::Num4)], "Show method 4", Command::SelectNth(3)),
    once(Look, &[key(Key::Num5)], "Show method 5", Command::SelectNth(4)),
    once(Look, &[key(Key::Num6)], "Show method 6", Command::SelectNth(5)),
    once(Look, &[key(Key::Num7)], "Show method 7", Command::SelectNth(6)),
    once(Look, &[key(Key::Num8)], "Show method 8", Command::SelectNth(7)),
    once(Look, &[key(Key::Period)], "All methods one step on", Command::GoTogether(1)),
    once(Look, &[key(Key::Comma)], "All methods one step back", Command::GoTogether(-1)),
    once(Look, &[shift(Key::Period)], "All methods fifty steps on", Command::GoTogether(50)),
    once(Look, &[shift(Key::Comma)], "All methods fifty steps back", Command::GoTogether(-50)),
    once(Query, &[key(Key::J)], "Next query", Command::NextQuery { back: false }),
    once(Query, &[key(Key::K)], "Previous query", Command::NextQuery { back: true }),
    once(Query, &[key(Key::N)], "Next failure", Command::NextFailure { back: false }),
    once(Query, &[shift(Key::N)], "Previous failure", Command::NextFailure { back: true }),
    switch(Query, &[key(Key::E)], "Try what would have helped", Command::Explain, |state| state.setup.task.protocol.explain > 0),
    once(Query, &[key(Key::Slash)], "Filter the queries, the parameters or the results", Command::Filter),
    switch(Query, &[], "Run all queries, or stop", Command::RunAllQueries, |state| state.queries.progress().is_some()),
    switch(Show, &[key(Key::G)], "Ground truth", Command::ShowTruth, |state| state.options.shows_truth),
    once(Show, &[key(Key::V)], "3-D view and back", Command::Toggle3d),
    switch(Show, &[key(Key::B)], "Blink between query and synthetic view", Command::Blink, |state| state.options.blinking),
    switch(Show, &[key(Key::F)], "Dense map of all positions and headings", Command::ShowDenseMap, |state| state.options.shows_dense_map),
    switch(Show, &[key(Key::M)], "The canvas alone", Command::Maximize(None), |state| state.options.is_alone),
    switch(Show, &[key(Key::Q)], "List of queries", Command::ToggleQueries, |state| state.options.shows_queries),
    switch(Show, &[key(Key::T)], "Inspector", Command::ToggleInspector, |state| state.options.shows_inspector),
    once(Show, &[], "Inspector: why", Command::ShowTab(Tab::Why)),
    once(Show, &[], "Inspector: numbers", Command::ShowTab(Tab::Numbers)),
    once(Show, &[], "Inspector: parameters", Command::ShowTab(Tab::Parameters)),
    once(Show, &[], "Inspector: log", Command::ShowTab(Tab::Log)),
    once(Compare, &[key(Key::P)], "Keep this run as A", Command::Pin),
    switch(Compare, &[key(Key::X)], "Flip between the runs A and B", Command::Flip, |state| state.options.compare_mode == CompareMode::Kept),
    switch(Compare, &[key(Key::D)], "Differences only", Command::OnlyDifferences, |state| state.options.only_differences),
    once(Compare, &[], "Forget run A", Command::Unpin),
    once(Compare, &[], "Keep all results as A", Command::KeepResults),
    once(Compare, &[], "Forget the results A", Command::ForgetResults),
    once(Camera, &[alt(Key::ArrowUp)], "Camera ahead", Command::MoveCamera(Nudge::Forward(1.0))),
    once(Camera, &[alt(Key::ArrowDown)], "Camera back", Command::MoveCamera(Nudge::Forward(-1.0))),
    once(Camera, &[alt(Key::ArrowRight)], "Camera to the right", Command::MoveCamera(Nudge::Right(1.0))),
    once(Camera, &[alt(Key::ArrowLeft)], "Camera to the left", Command::MoveCamera(Nudge::Right(-1.0))),
    once(Camera, &[alt_shift(Key::ArrowUp)], "Camera up", Command::MoveCamera(Nudge::Up(1.0))),
    once(Camera, &[alt_shift(Key::ArrowDown)], "Camera down", Command::MoveCamera(Nudge::Up(-1.0))),
    once(Camera, &[alt_shift(Key::ArrowLeft)], "Turn the camera left", Command::MoveCamera(Nudge::Yaw(1.0))),
    once(Camera, &[alt_shift(Key::ArrowRight)], "Turn the camera right", Command::MoveCamera(Nudge::Yaw(-1.0))),
    once(Camera, &[alt(Key::Num1)], "Camera to the start", Command::JumpCamera(NamedPose::Start)),
    once(Camera, &[alt(Key::Num2)], "Camera to the coarse minimum", Command::JumpCamera(NamedPose::Coarse)),
    once(Camera, &[alt(Key::Num3)], "Camera to the fine minimum", Command::JumpCamera(NamedPose::Fine)),
    once(Camera, &[alt(Key::Num4)], "Camera to the estimate", Command::JumpCamera(NamedPose::Estimate)),
    once(Camera, &[alt(Key::Num5), key(Key::Num9)], "Camera to the truth", Command::JumpCamera(NamedPose::Truth)),
    once(Camera, &[key(Key::Num0)], "Camera to where it was before", Command::JumpCamera(NamedPose::Last)),
    once(Camera, &[key(Key::Escape)], "Let the camera go", Command::TakeCamera(None)),
    once(Lesson, &[key(Key::PageDown)], "Next page", Command::TurnPage { back: false }),
    once(Lesson, &[key(Key::PageUp)], "Previous page", Command::TurnPage { back: true }),
    once(Lesson, &[], "Close the lesson", Command::CloseLesson),
    once(Window, &[key(Key::F2)], "Inspect one query", Command::Arrange(Arrangement::Inspect)),
    once(Window, &[key(Key::F3)], "Lecture", Command::Arrange(Arrangement::Lecture)),
    once(Window, &[key(Key::F4)], "Batch of results", Command::Arrange(Arrangement::Batch)),
    once(Window, &[], "Save a recording …", Command::AskWhere(SaveTarget::Recording)),
    once(Window, &[], "Stream the run to a Rerun viewer", Command::StreamRecording),
    once(Window, &[], "Open the run in a new Rerun viewer", Command::SpawnViewer),
    once(Window, &[ctrl(Key::P)], "Save a picture of the window …", Command::AskWhere(SaveTarget::Picture)),
    once(Window, &[], "Save a picture of the canvas …", Command::AskWhere(SaveTarget::Canvas)),
    once(Window, &[ctrl(Key::C)], "Copy the command line of this run", Command::CopyCommandLine),
    once(Window, &[], "Save the session …", Command::AskWhere(SaveTarget::Session)),
    once(Window, &[], "Restore a session …", Command::AskWhere(SaveTarget::Restored)),
    once(Window, &[key(Key::L)], "Light or dark", Command::SwitchTheme),
    once(Window, &[ctrl(Key::K)], "Search for an action", Command::Search),
    // Named by what it types, wherever it is on the keyboard.
    once(Window, &[key(Key::Questionmark), key(Key::F1)], "All keys", Command::Help),
];

/// The action that sends a command.
pub(super) fn of(command: &Command) -> Option<&'static Action> {
    ACTIONS.iter().find(|action| action.command == *command)
}

impl Action {
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
    pub(super) fn menu_item(&self, ui: &mut Ui, state: &AppState, commands: &Queue) {
        let keys = self.keys_text(ui.ctx());
        let button = Button::selectable((self.is_on)(state), self.text).shortcut_text(keys);
        if ui.add(button).clicked() {
            commands.send(self.command.clone());
            ui.close();
        }
    }
}

/// A button that sends a command; its tooltip comes from the table.
pub(super) fn button(
    ui: &mut Ui,
    state: &AppState,
    commands: &Queue,
    text: &str,
    command: Command,
) {
    let action = of(&command);
    let is_on = action.is_some_and(|action| (action.is_on)(state));
    let response = ui.add(Button::selectable(is_on, text).frame_when_inactive(true));
    let response = match action {
        Some(action) => response.on_hover_text(action.tooltip(ui.ctx())),
        None => response,
    };
    if response.clicked() {
        commands.send(command);
    }
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
            commands.send(action.command.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things_and_no_command_has_two_entries() {
        let keys = ACTIONS.iter().flat_map(|action| action.keys);
        let mut keys: Vec<_> = keys.map(|keys| format!("{keys:?}")).collect();
        let mut commands: Vec<_> =
            ACTIONS.iter().map(|action| format!("{:?}", action.command)).collect();
        for names in [&mut keys, &mut commands] {
            names.sort();
            let all = names.len();
            names.dedup();
            assert_eq!(names.len(), all);
        }
    }
}
