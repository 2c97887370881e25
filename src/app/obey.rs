//! Doing what was asked for.

use std::path::Path;

use super::App;
use super::camera::Place;
use super::command::Command;
use super::desk::{Comparing, Desk, Kept};
use super::saved::SavedSession;
use super::setup::ReferencePick;
use crate::event::PhaseSearched;
use crate::geometry::Pose;
use crate::grid::Phase;
use crate::localize::References;
use crate::method::Method;
use crate::session::{Breakpoint, Breakpoints, Part, RunMode, State};
use crate::sink::rerun::Targets;

impl App {
    /// Does one thing. What cannot be done is said, not ignored.
    pub(super) fn obey(&mut self, command: Command, ctx: &egui::Context) {
        let desk = &mut self.desk;
        match command {
            Command::RunOrPause => match desk.state() {
                State::Running | State::Loading => desk.session.set_mode(RunMode::Paused),
                State::Paused { .. } => desk.go(RunMode::Running),
                _ => desk.begin(RunMode::Running),
            },
            Command::Run => match desk.state() {
                State::Paused { .. } | State::Running | State::Loading => desk.go(RunMode::Running),
                _ => desk.begin(RunMode::Running),
            },
            Command::StepInto => desk.go(RunMode::StepInto),
            Command::StepOver => desk.go(RunMode::StepOver),
            Command::StepOut => desk.go(RunMode::StepOut),
            Command::RunToEnd => {
                desk.session.set_breakpoints(Breakpoints::default());
                desk.go(RunMode::Running);
            }
            Command::Restart => desk.begin(RunMode::Paused),
            Command::Forward(steps) => desk.forward(steps),
            Command::Back(steps) => desk.move_cursor(desk.cursor.saturating_sub(steps)),
            Command::First => desk.move_cursor(0),
            Command::Last => {
                desk.move_cursor(desk.run().len());
                desk.follows = true;
            }
            Command::MoveCursor(cursor) => desk.move_cursor(cursor),
            Command::SelectMethod(method) => desk.select_method(method),
            Command::SelectQuery(query) => desk.select_query(query),
            Command::NextQuery { back } => desk.next_query(back, |_, _| true),
            Command::NextFailure { back } => desk.next_failure(back),
            Command::RunAllQueries => desk.queries.run_all(&desk.setup),
            Command::PickReferences(pick) => desk.pick_references(pick),
            Command::SetReferences(frames) => desk.set_references(frames),
            Command::SetFusions(fusions) => {
                desk.setup.task.protocol.fusions = fusions;
                desk.begin_again();
            }
            Command::SetRadius(radius_m) => {
                desk.setup.task.radius_m = radius_m;
                desk.setup.go_to(desk.setup.query);
                desk.begin_again();
            }
            Command::SetSeed(seed) => {
                desk.setup.task.protocol.seed = seed;
                desk.setup.go_to(desk.setup.query);
                desk.begin_again();
            }
            Command::SetParam { key, value } => match desk.setup.task.params.set(&key, &value) {
                Ok(()) if desk.setup.task.params != *desk.params => desk.begin_again(),
                Ok(()) => {}
                Err(error) => desk.note(error.to_string(), true),
            },
            Command::ResetParams => {
                desk.setup.task.params = crate::params::Params::default();
                desk.begin_again();
            }
            Command::SetBreakpoints(texts) => desk.set_breakpoints(texts),
            Command::Pin => {
                desk.kept = Some(Kept {
                    run: desk.run().clone(),
                    cursor: desk.cursor,
                });
                desk.note(
                    "This run is kept as A; change a parameter to compare",
                    false,
                );
            }
            Command::Unpin => {
                desk.kept = None;
                desk.comparing = Comparing::Present;
            }
            Command::Compare(_) | Command::Flip if desk.kept.is_none() => {
                desk.note("There is no run A; keep one first (P)", true);
            }
            Command::Compare(comparing) => desk.comparing = comparing,
            Command::Flip => {
                desk.comparing = match desk.comparing {
                    Comparing::Kept => Comparing::Present,
                    Comparing::Present | Comparing::SideBySide => Comparing::Kept,
                }
            }
            Command::Blink => desk.blinking = !desk.blinking,
            Command::OnlyDifferences => desk.only_differences = !desk.only_differences,
            Command::ShowTruth => desk.shows_truth = !desk.shows_truth,
            Command::Filter => {
                desk.wants_filter = true;
                self.layout.show(super::views::PARAMETERS);
            }
            Command::SelectFeature(feature) => desk.selected_feature = feature,
            Command::Hover(pose) => desk.hovered = pose,
            Command::TakeCamera(pose) => desk.camera = pose,
            Command::JumpCamera(place) => desk.jump_camera(place),
            Command::MoveCamera(nudge) => match desk.camera.or_else(|| desk.place(Place::Start)) {
                Some(pose) => desk.camera = Some(nudge.apply(&pose)),
                None => desk.note("There is no camera before the query is loaded", true),
            },
            Command::CopyCommandLine => {
                ctx.copy_text(desk.setup.command_line());
                desk.note("The command line is on the clipboard", false);
            }
            Command::ShowView(name) => self.layout.show(name),
            Command::Maximize(view) => {
                let pointer = ctx.input(|input| input.pointer.hover_pos());
                self.layout.maximize(view, pointer);
            }
            Command::ResetLayout => self.layout.reset(),
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
                if note < desk.notes.len() {
                    desk.notes.remove(note);
                }
            }
            Command::SaveRecording(path) => {
                let done = format!("Recording: {}", path.display());
                let save = Some(path);
                desk.record_to(
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
                desk.record_to(
                    &Targets {
                        connect,
                        ..Targets::default()
                    },
                    done,
                );
            }
            Command::SpawnViewer => {
                let done = "A Rerun viewer shows the run".to_owned();
                desk.record_to(
                    &Targets {
                        spawn: true,
                        ..Targets::default()
                    },
                    done,
                );
            }
            Command::SavePicture(view) => {
                let part = view.and_then(|view| self.layout.place_of(view));
                let name = view.unwrap_or("window");
                if view.is_some() && part.is_none() {
                    desk.note(format!("The view {name} is not in sight"), true);
                    return;
                }
                let path = desk.setup.folder.join(format!("{name}.png"));
                self.pictures.ask(ctx, path, part);
            }
            Command::SaveSession(path) => self.save_session(&path),
            Command::RestoreSession(path) => self.restore_session(&path),
        }
    }
}

impl App {
    fn save_session(&mut self, path: &Path) {
        let layout = match self.layout.to_json() {
            Ok(layout) => layout,
            Err(error) => return self.desk.note(error.to_string(), true),
        };
        let saved = SavedSession::new(&self.desk.setup, self.desk.cursor, layout);
        match saved.write(path) {
            Ok(()) => self
                .desk
                .note(format!("Session: {}", path.display()), false),
            Err(why) => self.desk.note(why, true),
        }
    }

    fn restore_session(&mut self, path: &Path) {
        let restored = SavedSession::read(path).and_then(|saved| {
            let setup = saved.setup(&self.desk.setup)?;
            let layout = saved.layout.clone();
            self.layout
                .restore(layout)
                .map_err(|error| error.to_string())?;
            Ok((setup, saved.cursor))
        });
        match restored {
            Ok((setup, cursor)) => self.desk.restore(setup, cursor),
            Err(why) => self.desk.note(why, true),
        }
    }
}

impl Desk {
    /// Goes on from where the run stands.
    fn go(&mut self, mode: RunMode) {
        if !self.session.is_alive() {
            self.note("The run is over; restart it (Shift+F5)", false);
            return;
        }
        self.follows = true;
        self.session.set_mode(mode);
    }

    fn forward(&mut self, steps: usize) {
        let last = self.run().len().saturating_sub(1);
        if self.cursor < last {
            self.move_cursor(self.cursor + steps);
        } else if matches!(self.state(), State::Paused { .. }) {
            self.go(RunMode::StepInto);
        }
    }

    fn move_cursor(&mut self, cursor: usize) {
        self.cursor = cursor.min(self.run().len().saturating_sub(1));
        self.follows = false;
        self.anchor = None;
    }

    fn select_method(&mut self, method: Method) {
        let run = self.run();
        let here = run.span_at(self.cursor).map(|span| span.part);
        let part = match here {
            // From fusion to fusion, and from a reference to the same one.
            Some(Part::Fusion(_)) => Part::Fusion(method),
            _ => Part::Reference(method, run.reference_at(self.cursor)),
        };
        let span = run.span_of(part);
        match span.and_then(|span| span.records.end.checked_sub(1)) {
            Some(last) => self.move_cursor(last),
            None => {
                let name = method.name().to_uppercase();
                self.note(format!("{name} has not begun yet"), false);
            }
        }
    }

    fn select_query(&mut self, query: usize) {
        self.setup.go_to(query);
        self.camera = None;
        self.begin(RunMode::Running);
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

    /// Whether a method is known to fail on a query.
    pub(super) fn has_failed(&self, query: usize) -> bool {
        let results = self.results.get(&query).map_or(&[][..], Vec::as_slice);
        let failure_radius_m = self.setup.failure_radius_m;
        let mut results = results.iter();
        results.any(|result| !result.is_success(failure_radius_m))
    }

    fn next_failure(&mut self, back: bool) {
        if self.results.keys().any(|query| self.has_failed(*query)) {
            self.next_query(back, Self::has_failed);
        } else {
            self.note("No query is known to fail; run all of them first", false);
        }
    }

    fn pick_references(&mut self, pick: ReferencePick) {
        self.stop_queries();
        self.setup.task.by_hand = pick == ReferencePick::ByHand;
        if let ReferencePick::By(selection) = pick {
            self.setup.task.protocol.references = selection;
            self.setup.chosen = References::default();
            self.begin(RunMode::Running);
        }
    }

    fn set_references(&mut self, frames: Vec<usize>) {
        if frames.is_empty() {
            self.note("A query needs at least one reference", true);
            return;
        }
        self.stop_queries();
        self.setup.task.by_hand = true;
        self.setup.chosen = frames.into();
        self.begin(RunMode::Running);
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

    fn jump_camera(&mut self, place: Place) {
        let Some(pose) = self.place(place) else {
            let name = place.name().to_lowercase();
            self.note(format!("There is no pose for {name} here"), false);
            return;
        };
        self.camera_before = self.camera.or_else(|| self.place(Place::Start));
        self.camera = Some(pose);
    }

    /// The pose of a place of the search (`world_from_camera`).
    pub(super) fn place(&self, place: Place) -> Option<Pose> {
        let run = self.run();
        let loaded = run.loaded.as_deref()?;
        let span = run.span_at(self.cursor);
        let problem = loaded.problems.get(run.reference_at(self.cursor))?;
        let minimum = |wanted: Phase| {
            let events = run.all_until::<PhaseSearched>(self.cursor);
            let mut latest = events.rev();
            let best = latest
                .find(|(_, event)| event.surface.lattice.phase == wanted)?
                .1
                .best?;
            Some(problem.world_from_query(&best.reference_from_camera()))
        };
        match place {
            Place::Start => Some(problem.reference.world_from_camera),
            Place::Coarse => minimum(Phase::PositionCoarse),
            Place::Fine => minimum(Phase::PositionFine),
            Place::Estimate => span?.result.as_ref()?.pose.as_ref()?.to_pose(),
            Place::Truth => loaded.truth,
            Place::Last => self.camera_before,
        }
    }
}
