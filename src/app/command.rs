//! Everything that a person can ask for, and the keys for it.

use std::cell::RefCell;

use egui::{Key, KeyboardShortcut, Modifiers};

use super::arrangement::Arrangement;
use super::camera::{NamedPose, Nudge};
use super::cost_line::CostLine;
use super::save_target::SaveTarget;
use super::selection::VerdictChange;
use super::setup::ReferencePick;
use super::view_options::CompareMode;
use crate::fusion::Fusion;
use crate::geometry::Pose;
use crate::image::Degradation;
use crate::method::Method;

/// Something to be done between two frames.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Run, or pause a running run.
    RunOrPause,
    /// Run, whatever stands still.
    Run,
    /// Go to the next event.
    StepInto,
    /// Go behind the stage that begins here.
    StepOver,
    /// Go to the end of the stage around this.
    StepOut,
    /// Run to the end, past all breakpoints.
    RunToEnd,
    /// Begin again and wait at the first step.
    Restart,
    /// Move the cursor ahead; at the last record of a paused run, step.
    Forward(usize),
    /// Move the cursor back.
    Back(usize),
    /// Move the cursor to the first record.
    First,
    /// Move the cursor to the last record, and keep it there as more come in.
    Last,
    /// Move the cursor to this record.
    MoveCursor(usize),
    /// Move the cursor to the last record that an estimator has told.
    SelectMethod(Method),
    /// Localise another query.
    SelectQuery(usize),
    /// Localise a query and go to the step that decided what became of a method's answer.
    OpenResult {
        /// The query.
        query: usize,
        /// Its position among the query's results that are known.
        result: usize,
    },
    /// Look at results that meet this condition.
    FilterResults(String),
    /// Look at results whose verdict became this; for none, at whatever became of it.
    FilterVerdictChange(Option<VerdictChange>),
    /// Keep all results that are known as A, to hold those that follow against.
    KeepResults,
    /// Forget the results A.
    ForgetResults,
    /// Look at two poses beside each other.
    LookBeside([NamedPose; 2]),
    /// Work out the cost along a line between two poses.
    TraceLine(CostLine),
    /// Localise the next query, or the one before.
    NextQuery {
        /// Whether the one before is meant.
        back: bool,
    },
    /// Localise the next query with a failed method.
    NextFailure {
        /// Whether to look backwards.
        back: bool,
    },
    /// Look for what would have helped the results that are wrong, or look no more.
    Explain,
    /// Keep this run as A and localise again with the arguments of something that helped.
    Try(Vec<String>),
    /// Localise all queries, without stepping, to know which fail.
    RunAllQueries,
    /// Take all methods to this step of theirs, beside each other; without one, back to the cursor.
    StepTogether(Option<usize>),
    /// Take all methods on by so many steps, or back.
    GoTogether(isize),
    /// The next page of the lesson, or the one before.
    TurnPage {
        /// Whether the one before is meant.
        back: bool,
    },
    /// Answer the lesson's question by a choice, counted from 0.
    Answer(usize),
    /// Answer it by where the camera in hand is.
    Guess,
    /// Close the lesson.
    CloseLesson,
    /// Choose the references in another way.
    PickReferences(ReferencePick),
    /// Use other reference frames.
    SetReferences(Vec<usize>),
    /// Fuse what several references give, in these ways, and run again.
    SetFusions(Vec<Fusion>),
    /// Change the uncertainty radius \[m\] and run again.
    SetRadius(f64),
    /// Change the seed and run again.
    SetSeed(u64),
    /// Set a parameter and run again what depends on it.
    SetParam {
        /// `group.name`.
        key: String,
        /// The value as text.
        value: String,
    },
    /// Degrade the photos of queries this way and run again.
    Degrade(Degradation),
    /// Set all parameters to their defaults.
    ResetParams,
    /// Replace the breakpoints.
    SetBreakpoints(Vec<String>),
    /// Keep the present run as A, to compare the following ones with.
    Pin,
    /// Forget A.
    Unpin,
    /// Show another of the two runs.
    Compare(CompareMode),
    /// Show A instead of B, or the other way round.
    Flip,
    /// Blink between query and synthetic view.
    Blink,
    /// Show only what differs.
    OnlyDifferences,
    /// Show or hide the ground truth.
    ShowTruth,
    /// Put the keyboard into the filter.
    Filter,
    /// The filter has the keyboard.
    FilterFocused,
    /// Look at one query feature.
    SelectFeature(Option<usize>),
    /// Look at a pose as long as the pointer is there (`world_from_camera`).
    Hover(Option<Pose>),
    /// Take the camera in hand at a pose (`world_from_camera`), or let it go.
    TakeCamera(Option<Pose>),
    /// Take the camera to a place of the search.
    JumpCamera(NamedPose),
    /// Move the camera in hand, in its own frame \[m, rad\].
    MoveCamera(Nudge),
    /// Save the run as a recording.
    SaveRecording(std::path::PathBuf),
    /// Send the run to a running Rerun viewer.
    StreamRecording,
    /// Start a Rerun viewer and send the run to it.
    SpawnViewer,
    /// Put the command line that repeats this run on the clipboard.
    CopyCommandLine,
    /// Ask for the file that something is to be saved in.
    AskWhere(SaveTarget),
    /// Save a view, or the whole window, as a picture.
    SavePicture {
        /// The view; the whole window without.
        view: Option<&'static str>,
        /// The file, PNG or SVG by its ending.
        path: std::path::PathBuf,
    },
    /// Save scene, query, settings and layout.
    SaveSession(std::path::PathBuf),
    /// Go back to a saved session.
    RestoreSession(std::path::PathBuf),
    /// Bring a view to the front.
    ShowView(&'static str),
    /// Give all the room to a view; for none, for that under the pointer, or back to all views.
    Maximize(Option<&'static str>),
    /// Arrange the window for something, with every view at its first place.
    Arrange(Arrangement),
    /// Change from dark to light or back.
    SwitchTheme,
    /// Show or hide the list of keys.
    Help,
    /// Take a message away.
    Dismiss(usize),
}

/// Commands that wait for the end of the frame.
#[derive(Debug, Default)]
pub struct Queue(RefCell<Vec<Command>>);

impl Queue {
    /// Adds a command.
    pub fn send(&self, command: Command) {
        self.0.borrow_mut().push(command);
    }

    pub(super) fn take(&self) -> Vec<Command> {
        self.0.take()
    }
}

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

/// The list of keys.
pub(super) fn help_ui(ctx: &egui::Context, open: &mut bool) {
    egui::Window::new("Keys").open(open).show(ctx, |ui| {
        egui::ScrollArea::vertical()
            .max_height(520.0)
            .show(ui, |ui| {
                for task in Task::ALL {
                    ui.strong(task.title());
                    egui::Grid::new(task.title()).striped(true).show(ui, |ui| {
                        let all = shortcuts();
                        let own = all.iter().filter(|one| Task::of(&one.command) == task);
                        for shortcut in own {
                            ui.monospace(ui.ctx().format_shortcut(&shortcut.keys));
                            ui.label(shortcut.help);
                            ui.end_row();
                        }
                    });
                    ui.add_space(6.0);
                }
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
