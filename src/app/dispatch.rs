//! Doing what was asked for.

use std::path::Path;

use super::App;
use super::arrangement::Arrangement;
use super::camera::NamedPose;
use super::command::Command;
use super::deciding::deciding;
use super::frame::help::ActionSearch;
use super::frame::storyboard::stages_of;
use super::navigation::Navigation;
use super::queries::Queries;
use super::run_pictures::RunPictures;
use super::save::Asking;
use super::saved::SavedSession;
use super::setup::ReferencePick;
use super::state::{AppState, KeptRun};
use super::view_options::{CompareMode, Tab};
use crate::event::PhaseSearched;
use crate::geometry::Pose;
use crate::grid::Phase;
use crate::image::Degradation;
use crate::localize::References;
use crate::method::Method;
use crate::session::{Breakpoint, Breakpoints, Part, RunMode, RunState};
use crate::sink::rerun::Targets;

impl App {
    /// Does one thing. What cannot be done is said, not ignored.
    pub(super) fn dispatch(&mut self, command: Command, ctx: &egui::Context) {
        let state = &mut self.state;
        match command {
            Command::RunOrPause => match state.run_state() {
                RunState::Running | RunState::Loading => state.session.set_mode(RunMode::Paused),
                RunState::Paused { .. } => state.resume(RunMode::Running),
                _ => state.start_run(RunMode::Running),
            },
            Command::Run => match state.run_state() {
                RunState::Paused { .. } | RunState::Running | RunState::Loading => {
                    state.resume(RunMode::Running);
                }
                _ => state.start_run(RunMode::Running),
            },
            Command::StepInto => state.resume(RunMode::StepInto),
            Command::StepOver => state.resume(RunMode::StepOver),
            Command::StepOut => state.resume(RunMode::StepOut),
            Command::RunToEnd => {
                state.session.set_breakpoints(Breakpoints::default());
                state.resume(RunMode::Running);
            }
            Command::Restart => state.start_run(RunMode::Paused),
            Command::Forward(steps) => state.forward(steps),
            Command::Back(steps) => state.move_cursor(state.cursor().saturating_sub(steps)),
            Command::First => state.move_cursor(0),
            Command::Last => {
                state.move_cursor(state.run().len());
                state.navigation.follow();
            }
            Command::MoveCursor(cursor) => state.move_cursor(cursor),
            Command::NextStage { back } => state.next_stage(back),
            Command::SelectMethod(method) => state.select_method(method),
            Command::SelectNth(nth) => {
                let method = state.setup.task.protocol.methods.get(nth).copied();
                if let Some(method) = method {
                    state.select_method(method);
                }
            }
            Command::ShowPart(part) => state.show_part(part, state.needs_why(part)),
            Command::ShowWhy(part) => state.show_part(part, true),
            Command::Why => state.options.shows_why = !state.options.shows_why,
            Command::Enlarge(stage, view) => state.options.large = Some((stage, view)),
            Command::Toggle3d => state.toggle("space"),
            Command::ToggleQueries => {
                state.options.shows_queries = !state.options.shows_queries;
            }
            Command::ToggleInspector => {
                state.options.shows_inspector = !state.options.shows_inspector;
            }
            Command::ShowTab(tab) => {
                state.options.tab = tab;
                state.options.shows_inspector = true;
            }
            Command::Search => self.search = Some(ActionSearch::default()),
            Command::OpenSelected => {
                let part = state.shown_span().map(|span| span.part);
                self.send(Command::Arrange(Arrangement::Inspect));
                if let Some(part) = part {
                    self.send(Command::ShowPart(part));
                }
            }
            Command::OpenResult { query, result } => state.open_result(query, result),
            Command::FilterResults(filter) => state.options.results_filter = filter,
            Command::FilterVerdictChange(change) => state.options.verdict_change = change,
            Command::KeepResults => {
                state.set_results_before(Some(state.results.clone()));
                let words = "These results are kept as A; change a setting and run all again";
                state.note(words, false);
            }
            Command::ForgetResults => state.set_results_before(None),
            Command::TraceLine(line) => state.trace_line(line),
            Command::ShowDenseMap => {
                state.options.shows_dense_map = !state.options.shows_dense_map;
            }
            Command::FillDenseMap(ask) => state.fill_dense_map(ask),
            Command::SelectQuery(query) => state.select_query(query),
            Command::NextQuery { back } => state.next_query(back, |_, _| true),
            Command::NextFailure { back } => state.next_failure(back),
            Command::Explain => state.switch_explaining(),
            Command::Try(args) => state.try_again(&args),
            Command::StepTogether(step) => state.options.lockstep = step,
            Command::GoTogether(steps) => state.go_together(steps),
            Command::TurnPage { back } => self.turn_page(back),
            Command::Answer(choice) => {
                let open = self.lesson.as_mut();
                if open.is_some_and(|open| open.choose(choice)) {
                    self.show_page();
                }
            }
            Command::Guess => {
                let open = self.lesson.as_mut();
                if open.is_some_and(|open| open.guess(state.camera)) {
                    self.show_page();
                }
            }
            Command::CloseLesson => {
                self.lesson = None;
                state.options.lockstep = None;
                state.options.presented = None;
                self.send(Command::Arrange(Arrangement::default()));
            }
            Command::RunAllQueries => state.queries.run_all(&state.setup),
            Command::PickReferences(pick) => state.pick_references(pick),
            Command::SetReferences(frames) => state.set_references(frames),
            Command::SetFusions(fusions) => {
                state.setup.task.protocol.fusions = fusions;
                state.restart_run();
            }
            Command::SetRadius(radius_m) => {
                state.setup.task.protocol.radii_m = vec![radius_m];
                state.setup.go_to(state.setup.query);
                state.restart_run();
            }
            Command::SetSeed(seed) => {
                state.setup.set_seed(seed);
                state.setup.go_to(state.setup.query);
                state.restart_run();
            }
            Command::SetParam { key, value } => match state.setup.task.params.set(&key, &value) {
                Ok(()) if state.setup.task.params != *state.params => state.restart_run(),
                Ok(()) => {}
                Err(error) => state.note(error.to_string(), true),
            },
            Command::Degrade(degradation) => state.degrade(degradation),
            Command::ResetParams => {
                state.setup.task.params = crate::params::Params::default();
                state.restart_run();
            }
            Command::SetBreakpoints(texts) => state.set_breakpoints(texts),
            Command::Pin => {
                state.keep();
                state.note(
                    "This run is kept as A; change a parameter to compare",
                    false,
                );
            }
            Command::Unpin => {
                state.kept = None;
                state.options.compare_mode = CompareMode::Present;
            }
            Command::Compare(_) | Command::Flip if state.kept.is_none() => {
                state.note("There is no run A; keep one first (P)", true);
            }
            Command::Compare(compare_mode) => state.options.compare_mode = compare_mode,
            Command::Flip => {
                state.options.compare_mode = match state.options.compare_mode {
                    CompareMode::Kept => CompareMode::Present,
                    CompareMode::Present => CompareMode::Kept,
                }
            }
            Command::Blink => state.options.blinking = !state.options.blinking,
            Command::OnlyDifferences => {
                state.options.only_differences = !state.options.only_differences;
            }
            Command::ShowTruth => state.options.shows_truth = !state.options.shows_truth,
            Command::Filter => {
                state.options.wants_filter = true;
                if state.options.layout == Arrangement::Inspect {
                    state.options.tab = Tab::Parameters;
                    state.options.shows_inspector = true;
                }
            }
            Command::FilterFocused => state.options.wants_filter = false,
            Command::SelectFeature(feature) => state.options.selected_feature = feature,
            Command::Hover(pose) => state.hovered = pose,
            Command::TakeCamera(pose) => state.camera = pose,
            Command::JumpCamera(target) => state.jump_camera(target),
            Command::MoveCamera(nudge) => {
                match state.camera.or_else(|| state.named_pose(NamedPose::Start)) {
                    Some(pose) => state.camera = Some(nudge.apply(&pose)),
                    None => state.note("There is no camera before the query is loaded", true),
                }
            }
            Command::CopyCommandLine => {
                ctx.copy_text(state.setup.command_line());
                state.note("The command line is on the clipboard", false);
            }
            Command::ShowView(name) => state.show_view(name),
            Command::Maximize(Some(view)) => {
                state.options.is_alone = true;
                state.options.alone = Some(view);
            }
            Command::Maximize(None) => {
                state.options.is_alone = !state.options.is_alone;
                state.options.alone = None;
            }
            Command::Arrange(arrangement) => {
                let is_lecture = arrangement == Arrangement::Lecture;
                let options = &mut state.options;
                options.layout = arrangement;
                options.hides_future = is_lecture;
                options.is_alone = false;
                options.presented = None;
                if is_lecture {
                    options.shows_why = false;
                    self.show_page();
                }
            }
            Command::SwitchTheme => {
                let is_dark = ctx.global_style().visuals.dark_mode;
                ctx.set_theme(if is_dark {
                    egui::Theme::Light
                } else {
                    egui::Theme::Dark
                });
            }
            Command::Help => self.help = !self.help,
            Command::Dismiss(note) => {
                if note < state.notes.len() {
                    state.notes.remove(note);
                }
            }
            Command::SaveRecording(path) => {
                let done = format!("Recording: {}", path.display());
                let save = Some(path);
                state.record_to(
                    &Targets {
                        save,
                        ..Targets::default()
                    },
                    done,
                );
            }
            Command::StreamRecording => {
                let connect = Some(String::new());
                let done = "The run was sent to the Rerun viewer".to_owned();
                state.record_to(
                    &Targets {
                        connect,
                        ..Targets::default()
                    },
                    done,
                );
            }
            Command::SpawnViewer => {
                let done = "A Rerun viewer shows the run".to_owned();
                state.record_to(
                    &Targets {
                        spawn: true,
                        ..Targets::default()
                    },
                    done,
                );
            }
            Command::AskWhere(target) => self.asking = Some(Asking::new(target, &state.setup)),
            Command::SavePicture { of_canvas, path } => {
                let part = of_canvas.then_some(self.canvas);
                self.pictures.ask(ctx, path, part);
            }
            Command::SaveSession(path) => self.save_session(&path),
            Command::RestoreSession(path) => self.restore_session(&path),
        }
    }
}

impl App {
    fn turn_page(&mut self, back: bool) {
        match self.lesson.as_mut().map(|open| open.turn(back)) {
            Some(true) => self.show_page(),
            Some(false) => {}
            None => {
                let words = "No lesson is open; `posescope lesson` lists them";
                self.state.note(words, false);
            }
        }
    }

    /// Shows what the present page of the lesson is about.
    pub(super) fn show_page(&mut self) {
        let Some(open) = &mut self.lesson else { return };
        match open.other_setup(&self.state.setup) {
            Ok(Some(setup)) => {
                let navigation = Navigation::towards_moment(open.moment().clone());
                self.state.change_setup(setup, navigation);
            }
            Ok(None) => self.state.seek(open.moment().clone()),
            Err(error) => self.state.note(error.to_string(), true),
        }
        // The truth would be an answer.
        self.state.options.shows_truth = open.asked().is_none();
        let page = open.page();
        self.state.options.lockstep = page.lockstep;
        let named = page
            .show
            .iter()
            .filter_map(|name| super::views::name_of(name));
        let named: Vec<_> = named.collect();
        self.state.options.presented = Some(named).filter(|named| !named.is_empty());
    }

    fn save_session(&mut self, path: &Path) {
        let layout = self.state.options.layout;
        let saved = SavedSession::new(&self.state.setup, self.state.cursor(), layout);
        match saved.write(path) {
            Ok(()) => self
                .state
                .note(format!("Session: {}", path.display()), false),
            Err(why) => self.state.note(why, true),
        }
    }

    fn restore_session(&mut self, path: &Path) {
        let restored = SavedSession::read(path).and_then(|saved| {
            let setup = saved.setup(&self.state.setup)?;
            Ok((setup, saved.cursor, saved.layout))
        });
        match restored {
            Ok((setup, cursor, layout)) => {
                self.state.restore(setup, cursor);
                self.send(Command::Arrange(layout));
            }
            Err(why) => self.state.note(why, true),
        }
    }
}

impl AppState {
    /// Goes on from where the run stands.
    fn resume(&mut self, mode: RunMode) {
        if !self.session.is_alive() {
            self.note("The run is over; restart it (Shift+F5)", false);
            return;
        }
        self.navigation.follow();
        self.session.set_mode(mode);
    }

    fn forward(&mut self, steps: usize) {
        let last = self.run().len().saturating_sub(1);
        if self.cursor() < last {
            self.move_cursor(self.cursor() + steps);
        } else if matches!(self.run_state(), RunState::Paused { .. }) {
            self.resume(RunMode::StepInto);
        }
    }

    /// Moves all methods by that many of their steps, once lock-step is on.
    fn go_together(&mut self, steps: isize) {
        // Without it the keys would hide the card and the estimates, and nothing would say why.
        let Some(here) = self.options.lockstep else {
            return;
        };
        let longest = self.run().spans().iter().map(|span| span.records.len());
        let last = longest.max().unwrap_or(0).saturating_sub(1);
        let here = here.min(last);
        self.options.lockstep = Some(here.saturating_add_signed(steps).min(last));
    }

    pub(super) fn move_cursor(&mut self, cursor: usize) {
        self.options.shows_why = false;
        // The user looks elsewhere by now.
        self.opens_at_cause = false;
        self.navigation.move_to(cursor, self.session.run());
    }

    /// Goes to the end of the next stage of the selected part, or of the one before; after the last stage comes
    /// why the result is what it is.
    fn next_stage(&mut self, back: bool) {
        let Some(span) = self.shown_span() else {
            return;
        };
        let (part, cursor) = (span.part, self.shown_cursor());
        let ends: Vec<usize> = stages_of(self, span)
            .iter()
            .map(|bar| bar.records.end - 1)
            .collect();
        let next = if back {
            let before = ends.iter().rev().find(|end| **end < cursor).copied();
            // From the picture of the cause to the last stage.
            ends.last()
                .copied()
                .filter(|_| self.options.shows_why)
                .or(before)
        } else {
            ends.into_iter().find(|end| *end > cursor)
        };
        match next {
            Some(end) => self.move_cursor(end),
            None if !back && self.options.hides_future => self.forward(1),
            None if !back && self.needs_why(part) => self.show_part(part, true),
            None => {}
        }
    }

    /// Shows a view on the canvas, in the inspector or alone, wherever its place is.
    fn show_view(&mut self, name: &'static str) {
        let tab = match name {
            super::views::PARAMETERS => Some(Tab::Parameters),
            "log" => Some(Tab::Log),
            _ => None,
        };
        match tab {
            Some(tab) => {
                self.options.tab = tab;
                self.options.shows_inspector = true;
            }
            None => {
                self.options.shows_why = false;
                self.options.large = Some((self.shown_stage(), name));
            }
        }
    }

    /// Shows a view on the canvas, or what was there before.
    fn toggle(&mut self, name: &'static str) {
        let here = (self.shown_stage(), name);
        if self.options.large == Some(here) {
            self.options.large = None;
        } else {
            self.show_view(name);
        }
    }

    fn select_method(&mut self, method: Method) {
        let run = self.run();
        let here = run.span_at(self.cursor()).map(|span| span.part);
        let part = match here {
            // From fusion to fusion, and from a reference to the same one.
            Some(Part::Fusion(_)) => Part::Fusion(method),
            _ => Part::Reference(method, run.reference_at(self.cursor())),
        };
        let span = run.span_of(part);
        match span.and_then(|span| span.records.end.checked_sub(1)) {
            Some(last) => {
                let why = self.options.shows_why && self.needs_why(part);
                self.move_cursor(last);
                self.options.shows_why = why;
            }
            None => {
                let name = method.name().to_uppercase();
                self.note(format!("{name} has not begun yet"), false);
            }
        }
    }

    fn select_query(&mut self, query: usize) {
        self.setup.go_to(query);
        self.camera = None;
        self.start_run(RunMode::Running);
    }

    /// Localises a query and goes to the step that decided what became of one of its results.
    fn open_result(&mut self, query: usize, result: usize) {
        let known = self.results.get(&query).and_then(|known| known.get(result));
        let moment = known.map(deciding);
        self.select_query(query);
        if let Some(moment) = moment {
            self.navigation = Navigation::towards_moment(moment);
        }
    }

    /// The next query in the list that is `wanted`, round the end.
    fn next_query(&mut self, back: bool, wanted: impl Fn(&Self, usize) -> bool) {
        let offered = &self.setup.offered;
        let here = offered
            .iter()
            .position(|query| *query == self.setup.query)
            .unwrap_or(0);
        let count = offered.len();
        let next = (1..=count)
            .map(|step| if back { count - step } else { step })
            .map(|step| offered[(here + step) % count])
            .find(|query| wanted(self, *query));
        if let Some(query) = next {
            self.select_query(query);
        }
    }

    /// Whether the answer of a method is known to be wrong or missing on a query.
    pub(super) fn has_failed(&self, query: usize) -> bool {
        self.first_failure(query).is_some()
    }

    /// The first wrong or missing answer of a query, by its position among the query's results.
    fn first_failure(&self, query: usize) -> Option<usize> {
        let mut known = self.results.get(&query)?.iter();
        known.position(|result| result.grade.is_failure())
    }

    fn next_failure(&mut self, back: bool) {
        if self.results.keys().any(|query| self.has_failed(*query)) {
            self.next_query(back, Self::has_failed);
            let failed = self.first_failure(self.setup.query);
            if let Some(result) = failed {
                self.open_result(self.setup.query, result);
            }
        } else {
            self.note("No query is known to fail; run all of them first", false);
        }
    }

    fn pick_references(&mut self, pick: ReferencePick) {
        self.stop_queries();
        match pick {
            ReferencePick::ByHand => {
                let chosen = self.setup.chosen.frames.clone();
                self.setup.choose_by_hand(chosen);
            }
            ReferencePick::By(selection) => {
                self.setup.task.protocol.select(selection);
                self.setup.chosen = References::default();
                self.start_run(RunMode::Running);
            }
        }
    }

    fn set_references(&mut self, frames: Vec<usize>) {
        if frames.is_empty() {
            self.note("A query needs at least one reference", true);
            return;
        }
        self.stop_queries();
        self.setup.choose_by_hand(frames);
        self.start_run(RunMode::Running);
    }

    fn degrade(&mut self, degradation: Degradation) {
        if degradation == self.setup.task.protocol.degrade {
            return;
        }
        self.setup.degrade(degradation);
        self.restart_run();
        // Thumbnails show what is localised.
        self.queries = Queries::new(self.ctx.clone());
    }

    /// Keeps the present run as A.
    fn keep(&mut self) {
        self.kept = Some(KeptRun {
            run: self.run().clone(),
            cursor: self.cursor(),
            pictures: RunPictures::new(&self.ctx),
        });
    }

    /// Localises with what helped; the run in which it was missing is A.
    fn try_again(&mut self, args: &[String]) {
        let mut setup = self.setup.clone();
        if let Err(why) = setup.change(args) {
            self.note(why, true);
            return;
        }
        self.keep();
        self.setup = setup;
        self.restart_run();
        self.note(
            format!("Localised with {}; X shows the run before", args.join(" ")),
            false,
        );
    }

    fn set_breakpoints(&mut self, texts: Vec<String>) {
        let parsed: Result<Vec<Breakpoint>, _> = texts.iter().map(|text| text.parse()).collect();
        match parsed {
            Ok(breakpoints) => {
                self.session
                    .set_breakpoints(Breakpoints::new(breakpoints.iter().cloned()));
                self.setup.task.breakpoints = breakpoints;
            }
            Err(error) => self.note(error.to_string(), true),
        }
    }

    fn jump_camera(&mut self, target: NamedPose) {
        let Some(pose) = self.named_pose(target) else {
            let name = target.name().to_lowercase();
            self.note(format!("There is no pose for {name} here"), false);
            return;
        };
        self.camera_before = self.camera.or_else(|| self.named_pose(NamedPose::Start));
        self.camera = Some(pose);
    }

    /// The pose of a place of the search (`world_from_camera`).
    pub(super) fn named_pose(&self, target: NamedPose) -> Option<Pose> {
        let run = self.run();
        let loaded = run.loaded.as_deref()?;
        let span = run.span_at(self.cursor());
        let problem = loaded.problems.get(run.reference_at(self.cursor()))?;
        let minimum = |wanted: Phase| {
            let events = run.all_until::<PhaseSearched>(self.cursor());
            let mut latest = events.rev();
            let best = latest
                .find(|(_, event)| event.surface.lattice.phase == wanted)?
                .1
                .best?;
            Some(problem.world_from_query(&best.reference_from_camera()))
        };
        match target {
            NamedPose::Start => Some(problem.reference.world_from_camera),
            NamedPose::Coarse => minimum(Phase::PositionCoarse),
            NamedPose::Fine => minimum(Phase::PositionFine),
            NamedPose::Estimate => {
                let span = span.filter(|span| self.has_come(span))?;
                span.result.as_ref()?.pose.as_ref()?.to_pose()
            }
            NamedPose::Truth => loaded.truth.filter(|_| self.options.shows_truth),
            NamedPose::Last => self.camera_before,
        }
    }
}
