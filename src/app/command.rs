//! Everything that a person can ask for.

use std::cell::RefCell;

use super::arrangement::Arrangement;
use super::camera::{NamedPose, Nudge};
use super::save_target::SaveTarget;
use super::scoring::{CostLine, DenseAsk};
use super::selection::VerdictChange;
use super::setup::ReferencePick;
use super::view_options::{CompareMode, Tab};
use crate::event::Stage;
use crate::fusion::Fusion;
use crate::geometry::Pose;
use crate::image::Degradation;
use crate::method::Method;
use crate::session::Part;

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
    /// Move the cursor to the next stage of the selected part, or to the one before.
    NextStage {
        /// Whether the one before is meant.
        back: bool,
    },
    /// Move the cursor to the last record of a method.
    SelectMethod(Method),
    /// Show what the nth method came to, counted from 0.
    SelectNth(usize),
    /// Show what a part of the run came to: why it failed, or its end.
    ShowPart(Part),
    /// Show why the result of a part of the run is what it is.
    ShowWhy(Part),
    /// Show why the selected result is what it is, or its stage again.
    Why,
    /// Make a view large for as long as the cursor is in this stage.
    Enlarge(Option<Stage>, &'static str),
    /// Show the 3-D view, or what was there before.
    Toggle3d,
    /// Show or hide the list of queries.
    ToggleQueries,
    /// Show or hide the inspector.
    ToggleInspector,
    /// Show a tab of the inspector.
    ShowTab(Tab),
    /// Search for an action by its words.
    Search,
    /// Show the selected result in the layout that explains one query.
    OpenSelected,
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
    /// Work out the cost along a line between two poses.
    TraceLine(CostLine),
    /// Show or hide the map of every position with every heading.
    ShowDenseMap,
    /// Have that map filled, as long as this is sent in each frame.
    FillDenseMap(DenseAsk),
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
        /// Whether only the canvas is saved.
        of_canvas: bool,
        /// The file, a PNG.
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
