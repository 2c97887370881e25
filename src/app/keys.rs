//! The keys: what each sends, and the list of them.

use egui::{Key, KeyboardShortcut, Modifiers};

use super::arrangement::Arrangement;
use super::camera::{NamedPose, Nudge};
use super::command::{Command, Queue};
use super::save_target::SaveTarget;
use crate::method::Method;

/// What a key is for: the list of keys is in these groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Running and stepping.
    Run,
    /// Another moment or method.
    Look,
    /// Another query.
    Query,
    /// What is shown.
    Show,
    /// Two runs.
    Compare,
    /// The camera in hand.
    Camera,
    /// The lesson that is open.
    Lesson,
    /// What leaves the window, and how it looks.
    Window,
}

impl Task {
    const ALL: [Self; 8] = [
        Self::Run,
        Self::Look,
        Self::Query,
        Self::Show,
        Self::Compare,
        Self::Camera,
        Self::Lesson,
        Self::Window,
    ];

    fn title(self) -> &'static str {
        match self {
            Self::Run => "Run and step",
            Self::Look => "Look back and ahead",
            Self::Query => "Queries",
            Self::Show => "What is shown",
            Self::Compare => "Compare two runs",
            Self::Camera => "Try another pose",
            Self::Lesson => "Lessons",
            Self::Window => "Window and files",
        }
    }

    fn of(command: &Command) -> Self {
        match command {
            Command::RunOrPause
            | Command::Run
            | Command::StepInto
            | Command::StepOver
            | Command::StepOut
            | Command::RunToEnd
            | Command::Restart => Self::Run,
            Command::Forward(_)
            | Command::Back(_)
            | Command::First
            | Command::Last
            | Command::MoveCursor(_)
            | Command::StepTogether(_)
            | Command::GoTogether(_)
            | Command::SelectMethod(_) => Self::Look,
            Command::SelectQuery(_)
            | Command::OpenResult { .. }
            | Command::FilterResults(_)
            | Command::FilterVerdictChange(_)
            | Command::KeepResults
            | Command::ForgetResults
            | Command::NextQuery { .. }
            | Command::NextFailure { .. }
            | Command::Explain
            | Command::RunAllQueries => Self::Query,
            Command::Pin | Command::Unpin | Command::Compare(_) | Command::Flip => Self::Compare,
            Command::TakeCamera(_) | Command::JumpCamera(_) | Command::MoveCamera(_) => {
                Self::Camera
            }
            Command::TurnPage { .. }
            | Command::Answer(_)
            | Command::Guess
            | Command::CloseLesson => Self::Lesson,
            Command::CopyCommandLine
            | Command::AskWhere(_)
            | Command::SavePicture { .. }
            | Command::SwitchTheme
            | Command::Arrange(_)
            | Command::Help => Self::Window,
            _ => Self::Show,
        }
    }
}

/// A key and what it does.
pub struct Shortcut {
    /// The key with its modifiers.
    pub keys: KeyboardShortcut,
    /// The command that the key sends.
    pub command: Command,
    /// What it does, in the words of the list of keys.
    pub help: &'static str,
}

/// Every key. Where two keys do the same, the second follows with the same words.
pub fn shortcuts() -> Vec<Shortcut> {
    const NONE: Modifiers = Modifiers::NONE;
    const SHIFT: Modifiers = Modifiers::SHIFT;
    const ALT: Modifiers = Modifiers::ALT;
    const ALT_SHIFT: Modifiers = Modifiers::ALT.plus(Modifiers::SHIFT);
    let keys = |modifiers, key, command, help| Shortcut {
        keys: KeyboardShortcut::new(modifiers, key),
        command,
        help,
    };
    let mut all = vec![
        keys(NONE, Key::Space, Command::RunOrPause, "Run or pause"),
        keys(NONE, Key::ArrowRight, Command::Forward(1), "One step on"),
        keys(NONE, Key::ArrowLeft, Command::Back(1), "One step back"),
        keys(SHIFT, Key::ArrowRight, Command::Forward(10), "Ten steps on"),
        keys(SHIFT, Key::ArrowLeft, Command::Back(10), "Ten steps back"),
        keys(NONE, Key::Home, Command::First, "To the first step"),
        keys(NONE, Key::End, Command::Last, "To the last step"),
        keys(
            NONE,
            Key::Period,
            Command::GoTogether(1),
            "All methods one step on",
        ),
        keys(
            NONE,
            Key::Comma,
            Command::GoTogether(-1),
            "All methods one step back",
        ),
        keys(
            SHIFT,
            Key::Period,
            Command::GoTogether(50),
            "All methods fifty steps on",
        ),
        keys(
            SHIFT,
            Key::Comma,
            Command::GoTogether(-50),
            "All methods fifty steps back",
        ),
        keys(
            NONE,
            Key::PageDown,
            Command::TurnPage { back: false },
            "Next page",
        ),
        keys(
            NONE,
            Key::PageUp,
            Command::TurnPage { back: true },
            "Previous page",
        ),
        keys(NONE, Key::F5, Command::Run, "Run to the next breakpoint"),
        keys(SHIFT, Key::F5, Command::Restart, "Restart"),
        keys(NONE, Key::F9, Command::RunToEnd, "Run to the end"),
        keys(NONE, Key::F10, Command::StepOver, "Step over the stage"),
        keys(NONE, Key::F11, Command::StepInto, "Step into"),
        keys(NONE, Key::I, Command::StepInto, "Step into"),
        keys(SHIFT, Key::F11, Command::StepOut, "Step out of the stage"),
        keys(SHIFT, Key::I, Command::StepOut, "Step out of the stage"),
        keys(
            NONE,
            Key::J,
            Command::NextQuery { back: false },
            "Next query",
        ),
        keys(
            NONE,
            Key::K,
            Command::NextQuery { back: true },
            "Previous query",
        ),
        keys(NONE, Key::E, Command::Explain, "What would have helped?"),
        keys(
            NONE,
            Key::N,
            Command::NextFailure { back: false },
            "Next failure",
        ),
        keys(
            SHIFT,
            Key::N,
            Command::NextFailure { back: true },
            "Previous failure",
        ),
        keys(
            NONE,
            Key::B,
            Command::Blink,
            "Blink between query and synthetic view",
        ),
        keys(NONE, Key::D, Command::OnlyDifferences, "Differences only"),
        keys(NONE, Key::G, Command::ShowTruth, "Ground truth on or off"),
        keys(
            NONE,
            Key::F,
            Command::ShowDenseMap,
            "Dense map of all positions and headings",
        ),
        keys(NONE, Key::P, Command::Pin, "Keep this run as A"),
        keys(NONE, Key::X, Command::Flip, "Swap A and B"),
        keys(NONE, Key::Slash, Command::Filter, "Filter"),
        keys(
            NONE,
            Key::Num5,
            Command::JumpCamera(NamedPose::Start),
            "Camera to the start",
        ),
        keys(
            NONE,
            Key::Num6,
            Command::JumpCamera(NamedPose::Coarse),
            "Camera to the coarse minimum",
        ),
        keys(
            NONE,
            Key::Num7,
            Command::JumpCamera(NamedPose::Fine),
            "Camera to the fine minimum",
        ),
        keys(
            NONE,
            Key::Num8,
            Command::JumpCamera(NamedPose::Estimate),
            "Camera to the estimate",
        ),
        keys(
            NONE,
            Key::Num9,
            Command::JumpCamera(NamedPose::Truth),
            "Camera to the truth",
        ),
        keys(
            NONE,
            Key::Num0,
            Command::JumpCamera(NamedPose::Last),
            "Camera to where it was before",
        ),
        keys(
            NONE,
            Key::Escape,
            Command::TakeCamera(None),
            "Let the camera go",
        ),
        keys(
            ALT,
            Key::ArrowUp,
            Command::MoveCamera(Nudge::Forward(1.0)),
            "Camera ahead",
        ),
        keys(
            ALT,
            Key::ArrowDown,
            Command::MoveCamera(Nudge::Forward(-1.0)),
            "Camera back",
        ),
        keys(
            ALT,
            Key::ArrowRight,
            Command::MoveCamera(Nudge::Right(1.0)),
            "Camera to the right",
        ),
        keys(
            ALT,
            Key::ArrowLeft,
            Command::MoveCamera(Nudge::Right(-1.0)),
            "Camera to the left",
        ),
        keys(
            ALT_SHIFT,
            Key::ArrowUp,
            Command::MoveCamera(Nudge::Up(1.0)),
            "Camera up",
        ),
        keys(
            ALT_SHIFT,
            Key::ArrowDown,
            Command::MoveCamera(Nudge::Up(-1.0)),
            "Camera down",
        ),
        keys(
            ALT_SHIFT,
            Key::ArrowLeft,
            Command::MoveCamera(Nudge::Yaw(1.0)),
            "Turn the camera left",
        ),
        keys(
            ALT_SHIFT,
            Key::ArrowRight,
            Command::MoveCamera(Nudge::Yaw(-1.0)),
            "Turn the camera right",
        ),
        keys(
            Modifiers::COMMAND,
            Key::C,
            Command::CopyCommandLine,
            "Copy the command line",
        ),
        keys(
            Modifiers::COMMAND,
            Key::P,
            Command::AskWhere(SaveTarget::Picture(None)),
            "Save the window as a picture",
        ),
        keys(
            NONE,
            Key::M,
            Command::Maximize(None),
            "All the room for the view under the pointer",
        ),
        keys(NONE, Key::L, Command::SwitchTheme, "Light or dark"),
        // Named by what it types, wherever it is on the keyboard: the text that comes with it says it twice.
        keys(NONE, Key::Questionmark, Command::Help, "This list"),
        keys(NONE, Key::F1, Command::Help, "This list"),
    ];
    let helps = [
        "Layout: inspect one query",
        "Layout: teach",
        "Layout: batch of results",
    ];
    for ((arrangement, _, key), help) in Arrangement::ALL.into_iter().zip(helps) {
        all.push(keys(NONE, key, Command::Arrange(arrangement), help));
    }
    let numbers = [Key::Num1, Key::Num2, Key::Num3, Key::Num4];
    let methods = Method::PAPER
        .into_iter()
        .zip(numbers)
        .zip(["Show FB", "Show PM", "Show MI", "Show HY"]);
    all.extend(
        methods.map(|((method, number), help)| {
            keys(NONE, number, Command::SelectMethod(method), help)
        }),
    );
    all
}

/// Turns the keys of this frame into commands, unless somebody is typing.
pub(super) fn read_keys(ctx: &egui::Context, queue: &Queue) {
    if ctx.egui_wants_keyboard_input() {
        return;
    }
    let mut shortcuts = shortcuts();
    // A menu that is open takes the key that closes it.
    if egui::Popup::is_any_open(ctx) {
        shortcuts.retain(|shortcut| shortcut.keys.logical_key != Key::Escape);
    }
    // egui takes a key with Shift for one without: those with more modifiers are asked first.
    shortcuts.sort_by_key(|shortcut| {
        let Modifiers {
            alt,
            shift,
            command,
            ..
        } = shortcut.keys.modifiers;
        std::cmp::Reverse(u8::from(alt) + u8::from(shift) + u8::from(command))
    });
    for shortcut in shortcuts {
        while ctx.input_mut(|input| input.consume_shortcut(&shortcut.keys)) {
            queue.send(shortcut.command.clone());
        }
    }
}

/// The list of keys, in two columns that are as high as the window allows.
pub(super) fn help_ui(ctx: &egui::Context, open: &mut bool) {
    /// What the title and the margins take \[points\].
    const AROUND: f32 = 90.0;
    let all = shortcuts();
    // Two keys that do the same share a row.
    let of = |task: Task| {
        let rows = all.chunk_by(|a, b| a.help == b.help);
        rows.filter(move |row| Task::of(&row[0].command) == task)
    };
    // Where the higher of the two columns is lowest; a title takes about a row.
    let rows = |tasks: &[Task]| -> usize { tasks.iter().map(|task| 1 + of(*task).count()).sum() };
    let highest = |split: &usize| {
        let (left, right) = Task::ALL.split_at(*split);
        rows(left).max(rows(right))
    };
    let split = (0..Task::ALL.len()).min_by_key(highest).unwrap_or(0);
    let (left, right) = Task::ALL.split_at(split);
    let columns = [left, right];
    let window = egui::Window::new("Keys").open(open).resizable(false);
    window.show(ctx, |ui| {
        let height = ctx.content_rect().height() - AROUND;
        let area = egui::ScrollArea::vertical().max_height(height);
        area.show(ui, |ui| {
            ui.horizontal_top(|ui| {
                for tasks in columns {
                    ui.vertical(|ui| {
                        for &task in tasks {
                            ui.strong(task.title());
                            egui::Grid::new(task.title()).striped(true).show(ui, |ui| {
                                for row in of(task) {
                                    let keys =
                                        row.iter().map(|one| ui.ctx().format_shortcut(&one.keys));
                                    let keys: Vec<String> = keys.collect();
                                    ui.monospace(keys.join(", "));
                                    ui.label(row[0].help);
                                    ui.end_row();
                                }
                            });
                            ui.add_space(6.0);
                        }
                    });
                    ui.add_space(12.0);
                }
            });
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things() {
        let mut keys: Vec<_> = shortcuts()
            .iter()
            .map(|s| format!("{:?}", s.keys))
            .collect();
        keys.sort();
        let all = keys.len();
        keys.dedup();
        assert_eq!(keys.len(), all);
    }
}
