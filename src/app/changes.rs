//! How commands change the state: the run, the cursor, the query, its references, the camera.

use super::camera::{NamedPose, Nudge};
use super::frame::Sizes;
use super::navigation::{Anchor, Navigation};
use super::queries::Queries;
use super::run_pictures::RunPictures;
use super::selection::{ResultRow, Results};
use super::state::{AppState, KeptRun};
use super::view_name::ViewName;
use super::view_options::Arrangement;
use super::view_options::{CompareMode, SidePanel, Tab};
use crate::diagnosis::DecidedAt;
use crate::event::{PhaseSearched, Stage, ViewRendered};
use crate::fusion::Fusion;
use crate::geometry::Pose;
use crate::grid::Phase;
use crate::image::Degradation;
use crate::lesson::Moment;
use crate::localize::{QueryResult, References, Selection};
use crate::method::Method;
use crate::run::Protocol;
use crate::session::{Breakpoint, Breakpoints, Part, RunMode, RunState};

impl AppState {
    /// Goes on from where the run stands.
    pub(super) fn resume(&mut self, mode: RunMode) {
        if !self.session.is_alive() {
            self.note("The run is over; restart it (Shift+F5)", false);
            return;
        }
        self.navigation.follow();
        self.session.set_mode(mode);
    }

    /// Runs, or pauses what runs.
    pub(super) fn run_or_pause(&mut self) {
        match self.run_state() {
            RunState::Running | RunState::Loading => self.session.set_mode(RunMode::Paused),
            _ => self.go_on(),
        }
    }

    /// Runs from where the run stands; a run that is over begins again.
    pub(super) fn go_on(&mut self) {
        if self.session.is_alive() {
            self.resume(RunMode::Running);
        } else {
            self.start_run(RunMode::Running);
        }
    }

    /// Runs to the end, past all breakpoints.
    pub(super) fn run_to_end(&mut self) {
        self.session.set_breakpoints(Breakpoints::default());
        self.resume(RunMode::Running);
    }

    /// Moves the cursor ahead; at the last record of a paused run, steps.
    pub fn forward(&mut self, steps: usize) {
        let last = self.run().len().saturating_sub(1);
        if self.cursor() < last {
            self.move_cursor(self.cursor() + steps);
        } else if matches!(self.run_state(), RunState::Paused { .. }) {
            self.resume(RunMode::StepInto);
        }
    }

    pub(super) fn back(&mut self, steps: usize) {
        self.move_cursor(self.cursor().saturating_sub(steps));
    }

    /// Moves the cursor to the last record, and keeps it there as more come in.
    pub(super) fn follow(&mut self) {
        self.move_cursor(self.run().len());
        self.navigation.follow();
    }

    /// Moves all methods by that many of their steps, once lock-step is on.
    pub(super) fn go_together(&mut self, steps: isize) {
        // Without it the keys would hide the card and the estimates, and nothing would say why.
        let Some(here) = self.options.lockstep else {
            return;
        };
        let longest = self.run().spans().iter().map(|span| span.records.len());
        let last = longest.max().unwrap_or(0).saturating_sub(1);
        let here = here.min(last);
        self.options.lockstep = Some(here.saturating_add_signed(steps).min(last));
    }

    /// Moves the cursor to a record.
    pub fn move_cursor(&mut self, cursor: usize) {
        self.options.shows_why = false;
        // The user looks elsewhere by now.
        self.opens_at_cause = false;
        self.navigation.move_to(cursor, self.session.run());
    }

    /// At the end of a part, shows the picture that proves its result, as the storyboard does.
    pub(super) fn show_why_at_end(&mut self) {
        let cursor = self.shown_cursor();
        let at_end = self.shown_span().filter(|span| span.records.end == cursor + 1);
        self.options.shows_why = at_end.is_some_and(|span| self.needs_why(span.part));
    }

    /// Goes to the end of the next stage of the selected part, or of the one before; after the last stage comes
    /// why the result is what it is.
    pub(super) fn next_stage(&mut self, back: bool) {
        let Some(span) = self.shown_span() else {
            return;
        };
        let (part, cursor) = (span.part, self.shown_cursor());
        let ends: Vec<usize> =
            self.stages_of(span).iter().map(|bar| self.stage_end(span, bar)).collect();
        let next = if back {
            let before = ends.iter().rev().find(|end| **end < cursor).copied();
            // From the picture of the cause to the last stage.
            ends.last().copied().filter(|_| self.options.shows_why).or(before)
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
    pub fn show_view(&mut self, name: ViewName) {
        match name {
            ViewName::Parameters => self.show_tab(Tab::Parameters),
            ViewName::Log => self.show_tab(Tab::Log),
            _ => {
                self.options.shows_why = false;
                self.options.large = Some((self.shown_stage(), name));
            }
        }
    }

    /// Shows a tab of the inspector.
    pub fn show_tab(&mut self, tab: Tab) {
        self.options.tab = tab;
        self.options.set_side(SidePanel::Inspector, self.has_room(), true);
    }

    /// Whether a panel beside the canvas is shown.
    pub(super) fn shows_side(&self, panel: SidePanel) -> bool {
        self.options.shows_side(panel, self.has_room())
    }

    /// Shows a panel beside the canvas, or hides it.
    pub(super) fn toggle_side(&mut self, panel: SidePanel) {
        let is_shown = !self.shows_side(panel);
        self.options.set_side(panel, self.has_room(), is_shown);
    }

    /// Whether the window has room for both panels.
    fn has_room(&self) -> bool {
        Sizes::of(self.ctx.content_rect().size()).has_sides
    }

    /// Gives all the room to a view; without one to the canvas, or back to all parts of the window.
    pub fn show_alone(&mut self, view: Option<ViewName>) {
        self.options.is_alone = view.is_some() || !self.options.is_alone;
        self.options.alone = view;
    }

    /// Puts the keyboard into the filter of what is shown.
    pub(super) fn focus_filter(&mut self) {
        self.options.wants_filter = true;
        if self.options.layout == Arrangement::Inspect {
            self.show_tab(Tab::Parameters);
        }
    }

    /// Shows a view on the canvas, or what was there before.
    pub(super) fn toggle(&mut self, name: ViewName) {
        let here = (self.shown_stage(), name);
        if self.options.large == Some(here) {
            self.options.large = None;
        } else {
            self.show_view(name);
        }
    }

    /// Shows what the nth method came to, counted from 0.
    pub(super) fn select_nth(&mut self, nth: usize) {
        if let Some(&method) = self.setup.task.protocol.methods.get(nth) {
            self.select_method(method);
        }
    }

    /// Moves the cursor to the last record of a method.
    pub fn select_method(&mut self, method: Method) {
        let run = self.run();
        let here = run.span_at(self.cursor()).map(|span| span.part);
        let part = match here {
            // From fusion to fusion, and from a reference to the same one.
            Some(Part::Fusion(_)) => Part::Fusion(method),
            _ => Part::Reference(method, run.reference_at(self.cursor())),
        };
        let why = self.options.shows_why && self.needs_why(part);
        self.show_part(part, why);
    }

    /// Localises another query.
    pub fn select_query(&mut self, query: usize) {
        self.setup.go_to(query);
        self.camera = None;
        self.start_run(RunMode::Running);
    }

    /// Localises a query and goes to the step that decided what became of one of its results.
    pub fn open_result(&mut self, query: usize, result: usize) {
        let known = self.results.get(&query).and_then(|known| known.get(result));
        let moment = known.map(deciding);
        self.options.selected_row = Some(ResultRow { query, place: result });
        self.select_query(query);
        if let Some(moment) = moment {
            self.navigation = Navigation::towards(Anchor::Moment(moment));
        }
    }

    /// Opens the next row of the table of results, or the one before.
    pub(super) fn next_row(&mut self, back: bool) {
        let Ok(rows) = self.selected_results() else { return };
        let rows = self.results.sorted(&rows, self.options.results_order);
        let here = self.options.selected_row;
        let here = rows.iter().position(|row| Some(*row) == here);
        let next = match (here, back) {
            (Some(here), false) => (here + 1).min(rows.len().saturating_sub(1)),
            (Some(here), true) => here.saturating_sub(1),
            (None, _) => 0,
        };
        if let Some(row) = rows.get(next) {
            self.open_result(row.query, row.place);
        }
    }

    /// The next query in the list that is `wanted`, round the end.
    pub(super) fn next_query(&mut self, back: bool, wanted: impl Fn(&Self, usize) -> bool) {
        let offered = &self.setup.offered;
        let here = offered.iter().position(|query| *query == self.setup.query).unwrap_or(0);
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
    pub(super) fn first_failure(&self, query: usize) -> Option<usize> {
        let mut known = self.results.get(&query)?.iter();
        known.position(QueryResult::is_suspect)
    }

    /// Whether a query has failed by the truth, and nobody has tried yet what would help.
    pub(super) fn is_unexplained(&self, query: usize) -> bool {
        let known = self.results.get(&query).into_iter().flatten();
        let is_unexplained = |one: &QueryResult| {
            one.grade.is_failure() && one.initial_error.is_some() && one.explanation.is_none()
        };
        known.into_iter().any(is_unexplained)
    }

    /// Runs each failed query again, to see what would have helped.
    pub(super) fn explain_all(&mut self) {
        let mut setup = self.setup.clone();
        setup.offered.retain(|query| self.is_unexplained(*query));
        if setup.offered.is_empty() {
            self.note("No failure is left to explain; Run all finds them", false);
        } else if self.queries.progress().is_none() {
            setup.task.protocol.explain = Protocol::EXPLAINING_RUNS;
            self.queries.run_all(&setup);
        }
    }

    pub(super) fn next_failure(&mut self, back: bool) {
        // In the table, only what the filter shows.
        let is_filtered = self.options.layout == Arrangement::Batch;
        let rows = self.selected_results().ok().filter(|_| is_filtered);
        let of_rows = |state: &Self, query: usize| {
            let rows = rows.iter().flat_map(|rows| rows.iter());
            let mut places = rows.filter(|row| row.query == query);
            let is_suspect =
                |row: &&ResultRow| state.results.result(**row).is_some_and(QueryResult::is_suspect);
            places.find(is_suspect).map(|row| row.place)
        };
        let failure = |state: &Self, query: usize| match rows {
            Some(_) => of_rows(state, query),
            None => state.first_failure(query),
        };
        if self.results.keys().any(|query| failure(self, *query).is_some()) {
            self.next_query(back, |state, query| failure(state, query).is_some());
            if let Some(result) = failure(self, self.setup.query) {
                self.open_result(self.setup.query, result);
            }
        } else if is_filtered && self.results.keys().any(|query| self.has_failed(*query)) {
            self.note("No result that the filter shows is known to be wrong", false);
        } else {
            self.note("No query is known to fail; run all of them first", false);
        }
    }

    /// Chooses the references in another way; `None` by hand.
    pub fn pick_references(&mut self, pick: Option<Selection>) {
        self.stop_queries();
        match pick {
            None => {
                let chosen = self.setup.chosen.frames.clone();
                self.setup.choose_by_hand(chosen);
            }
            Some(selection) => {
                self.setup.task.protocol.select(selection);
                self.setup.chosen = References::default();
                self.start_run(RunMode::Running);
            }
        }
    }

    /// Uses other reference frames.
    pub fn set_references(&mut self, frames: Vec<usize>) {
        if frames.is_empty() {
            self.note("A query needs at least one reference", true);
            return;
        }
        self.stop_queries();
        self.setup.choose_by_hand(frames);
        self.start_run(RunMode::Running);
    }

    /// Fuses what several references give, in these ways, and runs again.
    pub fn set_fusions(&mut self, fusions: Vec<Fusion>) {
        self.setup.task.protocol.fusions = fusions;
        self.restart_run();
    }

    /// Changes the uncertainty radius \[m\] and runs again.
    pub(super) fn set_radius(&mut self, radius_m: f64) {
        self.setup.task.protocol.radii_m = vec![radius_m];
        self.choose_anew();
        self.restart_run();
    }

    /// Forgets references that are not chosen by hand: new ones are needed.
    fn choose_anew(&mut self) {
        let query = self.setup.query;
        self.setup.go_to(query);
    }

    /// Changes the seed and runs again.
    pub fn set_seed(&mut self, seed: u64) {
        self.setup.set_seed(seed);
        self.choose_anew();
        self.restart_run();
    }

    /// Sets a parameter, named `group.name`, and runs again what depends on it.
    pub fn set_param(&mut self, key: &str, value: &str) {
        match self.setup.task.params.set(key, value) {
            Ok(()) if self.setup.task.params != self.run().params => self.restart_run(),
            Ok(()) => {}
            Err(error) => self.note(error.to_string(), true),
        }
    }

    /// Sets all parameters to their defaults.
    pub fn reset_params(&mut self) {
        self.setup.task.params = self.setup.task.params.defaults();
        self.restart_run();
    }

    /// Degrades the photos of queries this way and runs again.
    pub fn degrade(&mut self, degradation: Degradation) {
        if degradation == self.setup.task.protocol.degrade {
            return;
        }
        self.setup.degrade(degradation);
        self.restart_run();
        // Thumbnails show what is localised.
        self.queries = Queries::new(self.ctx.clone());
    }

    /// Keeps the present run as A, to compare the following ones with.
    pub(super) fn keep_run(&mut self) {
        self.keep();
        self.note("This run is kept as A; change a parameter to compare", false);
    }

    /// Forgets the run A.
    pub(super) fn forget_run(&mut self) {
        self.kept = None;
        self.options.compare_mode = CompareMode::Present;
    }

    /// Shows A instead of B, or the other way round.
    pub(super) fn flip(&mut self) {
        if self.kept.is_none() {
            self.note("There is no run A; keep one first (P)", true);
            return;
        }
        self.options.compare_mode = match self.options.compare_mode {
            CompareMode::Kept => CompareMode::Present,
            CompareMode::Present => CompareMode::Kept,
        }
    }

    /// Keeps all results that are known as A, to compare those that follow with.
    pub(super) fn keep_results(&mut self) {
        self.set_results_before(Some(Results::clone(&self.results)));
        self.note("These results are kept as A; change a setting and run all again", false);
    }

    fn keep(&mut self) {
        self.kept = Some(KeptRun {
            run: self.run().clone(),
            cursor: self.cursor(),
            pictures: RunPictures::new(&self.ctx),
        });
    }

    /// Localises with what helped; the run in which it was missing is A.
    pub fn try_again(&mut self, args: &[String]) {
        let mut setup = self.setup.clone();
        if let Err(why) = setup.change(args) {
            self.note(why, true);
            return;
        }
        self.keep();
        self.setup = setup;
        self.restart_run();
        self.note(format!("Localised with {}; X shows the run before", args.join(" ")), false);
    }

    /// Replaces the breakpoints.
    pub fn set_breakpoints(&mut self, texts: Vec<String>) {
        let parsed: Result<Vec<Breakpoint>, _> = texts.iter().map(|text| text.parse()).collect();
        match parsed {
            Ok(breakpoints) => {
                self.session.set_breakpoints(Breakpoints::new(breakpoints.iter().cloned()));
                self.setup.task.breakpoints = breakpoints;
            }
            Err(error) => self.note(error.to_string(), true),
        }
    }

    /// Moves the trial camera, in its own frame.
    pub(super) fn move_camera(&mut self, nudge: Nudge) {
        match self.camera.or_else(|| self.pose_in_view()) {
            Some(pose) => self.camera = Some(nudge.apply(&pose)),
            None => self.note("There is no camera before the query is loaded", true),
        }
    }

    /// The pose that is shown: of the latest synthetic view, of the result, or the start.
    fn pose_in_view(&self) -> Option<Pose> {
        let run = self.run();
        let rendered = || {
            let view = run.latest::<ViewRendered>(self.cursor())?;
            let problem = run.problem_at(self.cursor())?;
            Some(problem.world_from_query(&view.offset.reference_from_camera()))
        };
        let shown = self.named_pose(NamedPose::Estimate).or_else(rendered);
        shown.or_else(|| self.named_pose(NamedPose::Start))
    }

    /// Takes the camera to a place of the search.
    pub fn jump_camera(&mut self, target: NamedPose) {
        let Some(pose) = self.named_pose(target) else {
            self.note(format!("There is no pose for {} here", target.name()), false);
            return;
        };
        self.camera_before = self.camera.or_else(|| self.named_pose(NamedPose::Start));
        self.camera = Some(pose);
    }

    /// The pose of a place of the search (`world_from_camera`).
    pub(super) fn named_pose(&self, target: NamedPose) -> Option<Pose> {
        let run = self.run();
        let span = run.span_at(self.cursor());
        let problem = run.problem_at(self.cursor())?;
        let minimum = |wanted: Phase| {
            let events = run.all_until::<PhaseSearched>(self.cursor());
            let mut latest = events.rev();
            let best = latest.find(|(_, event)| event.surface.lattice.phase == wanted)?.1.best?;
            Some(problem.world_from_query(&best.reference_from_camera()))
        };
        match target {
            NamedPose::Start => Some(*problem.reference().world_from_camera()),
            NamedPose::Coarse => minimum(Phase::PositionCoarse),
            NamedPose::Fine => minimum(Phase::PositionFine),
            NamedPose::Estimate => {
                let span = span.filter(|span| self.is_finished_at_cursor(span))?;
                span.result.as_ref()?.pose.as_ref()?.to_pose()
            }
            NamedPose::Truth => run.truth().copied().filter(|_| self.options.shows_truth),
            NamedPose::Last => self.camera_before,
        }
    }
}

/// The moment that shows why a result is what it is: the end of the stage that its primary verdict is
/// about, where there is one, else the end of the method.
fn deciding(result: &QueryResult) -> Moment {
    let code = result.diagnosis.first().map(|finding| finding.code);
    let stage = code.and_then(|code| match code.rule().decided_at {
        DecidedAt::Stage(stage) => Some(stage),
        DecidedAt::End => None,
    });
    let of_a_method = |method: Method, stage: Stage| Moment::After {
        // Choosing and fusing belong to no method.
        method: (!Breakpoint::is_outside(stage.name())).then_some(method),
        stage: stage.name(),
    };
    match stage {
        Some(stage) => of_a_method(result.method, stage),
        None => Moment::After { method: None, stage: result.method.name() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::RULES;
    use crate::event::Stage;

    #[test]
    fn every_verdict_leads_to_a_stage_that_breakpoints_know() {
        for rule in RULES {
            if let DecidedAt::Stage(stage) = rule.decided_at {
                let name = stage.name();
                assert!(Breakpoint::stages().contains(&name), "{}: {name}", rule.code);
            }
        }
        assert!(Breakpoint::is_outside(Stage::Fuse.name()));
        assert!(!Breakpoint::is_outside(Stage::Match.name()));
    }
}
