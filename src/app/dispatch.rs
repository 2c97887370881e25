//! Doing what was asked for.

use std::path::Path;

use super::App;
use super::arrangement::Arrangement;
use super::camera::NamedPose;
use super::command::Command;
use super::frame::help::ActionSearch;
use super::navigation::Navigation;
use super::save::Asking;
use super::saved::SavedSession;
use super::view_options::{CompareMode, Tab};
use crate::session::{Breakpoints, RunMode, RunState};
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
                state.note("This run is kept as A; change a parameter to compare", false);
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
                let was_lecture = state.options.layout == Arrangement::Lecture;
                let options = &mut state.options;
                options.layout = arrangement;
                options.hides_future = is_lecture;
                options.is_alone = false;
                options.presented = None;
                if is_lecture {
                    options.shows_why = false;
                    self.show_page();
                } else if was_lecture {
                    state.show_why_at_end();
                }
            }
            Command::SwitchTheme => {
                let is_dark = ctx.global_style().visuals.dark_mode;
                ctx.set_theme(if is_dark { egui::Theme::Light } else { egui::Theme::Dark });
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
                state.record_to(&Targets { save, ..Targets::default() }, done);
            }
            Command::StreamRecording => {
                let connect = Some(String::new());
                let done = "The run was sent to the Rerun viewer".to_owned();
                state.record_to(&Targets { connect, ..Targets::default() }, done);
            }
            Command::SpawnViewer => {
                let done = "A Rerun viewer shows the run".to_owned();
                state.record_to(&Targets { spawn: true, ..Targets::default() }, done);
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
        let named = page.show.iter().filter_map(|name| super::views::name_of(name));
        let named: Vec<_> = named.collect();
        self.state.options.presented = Some(named).filter(|named| !named.is_empty());
    }

    fn save_session(&mut self, path: &Path) {
        let layout = self.state.options.layout;
        let saved = SavedSession::new(&self.state.setup, self.state.cursor(), layout);
        match saved.write(path) {
            Ok(()) => self.state.note(format!("Session: {}", path.display()), false),
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
