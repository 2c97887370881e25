//! A lesson that is open: its page, what was answered, and the panel that shows both.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Key, Modifiers, ProgressBar, RichText, ScrollArea, Ui};
use egui_commonmark::{CommonMarkCache, CommonMarkViewer};

use super::App;
use super::action::{Action, button};
use super::command::Queue;
use super::memo::Memo;
use super::setup::Setup;
use super::state::Opened;
use super::theme;
use super::view_context::{Sends, ViewContext};
use crate::geometry::Pose;
use crate::grid::Offset;
use crate::lesson::{Answer, Lesson, Moment, Page, Question, Results, named_scenes};
use crate::method::Method;
use crate::scene::Scene;
use crate::session::{Job, Part, Run, RunState};

/// Width of the panel \[points\].
pub(super) const WIDTH: f32 = 330.0;

/// A lesson that somebody goes through.
pub(super) struct OpenLesson {
    lesson: Lesson,
    page: usize,
    /// What was answered, by page.
    given: BTreeMap<usize, Given>,
    /// What is localised at present, by its name in the lesson.
    variant: String,
    /// Scenes by the names that the lesson calls them.
    scenes: BTreeMap<String, Arc<dyn Scene>>,
    /// What was shown of each variant.
    results: Results,
    /// A page by its position, with the numbers of these results.
    filled: Memo<usize, Page>,
    words: CommonMarkCache,
}

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Given {
    /// Position of the choice.
    Choice(usize),
    /// Where the camera was put (`world_from_camera`).
    Place(Pose),
}

impl OpenLesson {
    /// A lesson at its first page, of which `setup` is what is localised there.
    pub(super) fn new(lesson: Lesson, setup: &Setup) -> Self {
        let mut open = Self {
            variant: lesson.pages[0].variant.clone(),
            lesson,
            page: 0,
            given: BTreeMap::new(),
            scenes: BTreeMap::new(),
            results: Results::new(),
            filled: Memo::default(),
            words: CommonMarkCache::default(),
        };
        open.remember(setup);
        open
    }

    fn remember(&mut self, setup: &Setup) {
        let named = named_scenes(&setup.task, &setup.references, &setup.queries);
        self.scenes.extend(named);
    }

    /// The present page.
    pub(super) fn page(&self) -> &Page {
        &self.lesson.pages[self.page]
    }

    /// Goes on by a page, or back; whether there is one.
    pub(super) fn turn(&mut self, back: bool) -> bool {
        let next = if back {
            self.page.checked_sub(1)
        } else {
            Some(self.page + 1).filter(|page| *page < self.lesson.pages.len())
        };
        if let Some(page) = next {
            self.page = page;
        }
        next.is_some()
    }

    /// The moment that the run is to be shown at: that of the answer once it is given.
    pub(super) fn moment(&self) -> &Moment {
        let page = self.page();
        match &page.question {
            Some(question) if self.given.contains_key(&self.page) => &question.reveal,
            _ => &page.at,
        }
    }

    /// What opens the scenes of the present page, where that localises something else than before.
    pub(super) fn other_setup(
        &self,
        setup: &Setup,
    ) -> Option<impl FnOnce() -> Opened + Send + 'static> {
        let wanted = self.page().variant.clone();
        if wanted == self.variant {
            return None;
        }
        let (setting, scenes) = (self.lesson.setting(&wanted).clone(), self.scenes.clone());
        let (frames, folder) = (Arc::clone(&setup.frames), setup.folder.clone());
        Some(move || {
            let job = setting.open(&|name| scenes.get(name).cloned());
            let setup = job.map(|job| Setup::of_lesson(Job { frames, ..job }, folder));
            Opened::Page(wanted, setup)
        })
    }

    /// Remembers the scenes that were opened for a page; whether the present page waits for them.
    pub(super) fn take(&mut self, variant: String, setup: &Setup) -> bool {
        self.remember(setup);
        let is_wanted = variant == self.page().variant;
        if is_wanted {
            self.variant = variant;
        }
        is_wanted
    }

    /// The question that waits for an answer.
    pub(super) fn asked(&self) -> Option<&Question> {
        let question = self.page().question.as_ref()?;
        (!self.given.contains_key(&self.page)).then_some(question)
    }

    /// Answers what is asked, if this can be an answer to it; whether it can.
    pub(super) fn answer(&mut self, given: Given) -> bool {
        let fits = self.asked().is_some_and(|question| match (&question.answer, given) {
            (Answer::Choice { choices, .. }, Given::Choice(choice)) => choice < choices.len(),
            (Answer::Place(_), Given::Place(_)) => true,
            _ => false,
        });
        if fits {
            self.given.insert(self.page, given);
        }
        fits
    }

    /// Takes the keys that answer what is asked; others keep their meaning.
    pub(super) fn read_keys(&self, ctx: &egui::Context, commands: &Queue) {
        const DIGITS: [Key; 6] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6];
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let Some(question) = self.asked() else { return };
        let taken = |key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        match &question.answer {
            Answer::Choice { choices, .. } => {
                for (choice, key) in DIGITS.into_iter().take(choices.len()).enumerate() {
                    if taken(key) {
                        commands.send(move |app| app.answer(Given::Choice(choice)));
                    }
                }
            }
            Answer::Place(_) => {
                if taken(Key::Enter) {
                    commands.send(App::guess);
                }
            }
        }
    }

    /// Takes the results of the run that is shown, whose numbers the page says.
    fn take_results(&mut self, run: &Run) {
        let known = self.results.entry(self.variant.clone()).or_default();
        if !run.results().eq(known.iter()) {
            *known = run.results().cloned().collect();
            self.filled = Memo::default();
        }
    }

    /// Draws the page.
    pub(super) fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        self.take_results(context.run);
        let (number, pages) = (self.page + 1, self.lesson.pages.len());
        ui.add_space(4.0);
        ui.horizontal_wrapped(|ui| {
            ui.weak(format!("Lesson: {}", self.lesson.title));
            let close = ui
                .small_button("Close")
                .on_hover_text("Back to the window as it is without a lesson");
            let close = close.accessible_name("Close the lesson");
            close.sends(context, App::close_lesson);
        });
        let progress = ProgressBar::new(number as f32 / pages as f32).desired_height(6.0);
        ui.add(progress);
        ui.horizontal(|ui| {
            let turn = |ui: &mut Ui, is_on: bool, name: &str, action: &'static Action| {
                ui.add_enabled_ui(is_on, |ui| button(ui, context, name, action));
            };
            turn(ui, number > 1, "◀ Back", const { Action::named("Previous page") });
            ui.label(format!("page {number} of {pages}"));
            turn(ui, number < pages, "Next ▶", const { Action::named("Next page") });
            let is_running =
                matches!(context.state.run_state(), RunState::Loading | RunState::Running);
            if is_running || context.state.is_opening() {
                ui.spinner();
            }
        });
        ui.separator();
        larger(ui);
        ScrollArea::vertical().id_salt(("page", self.page)).auto_shrink(false).show(ui, |ui| {
            ui.heading(self.lesson.pages[self.page].title.clone());
            let page =
                self.filled.get(self.page, || self.lesson.pages[self.page].filled(&self.results).0);
            CommonMarkViewer::new().show(ui, &mut self.words, &page.text);
            if let Some(question) = &page.question {
                ui.separator();
                let given = self.given.get(&self.page).copied();
                asked_ui(ui, context, question, given);
                if given.is_some() {
                    CommonMarkViewer::new().show(ui, &mut self.words, &question.because);
                }
            }
        });
    }
}

/// Words to be read, not to be looked up.
fn larger(ui: &mut Ui) {
    const FACTOR: f32 = 1.15;
    let strong = ui.visuals().strong_text_color();
    let usual = ui.visuals().text_color();
    ui.visuals_mut().override_text_color = Some(usual.lerp_to_gamma(strong, 0.5));
    for font in ui.style_mut().text_styles.values_mut() {
        font.size *= FACTOR;
    }
}

fn asked_ui(ui: &mut Ui, context: &ViewContext<'_>, question: &Question, given: Option<Given>) {
    ui.label(RichText::new(&question.ask).strong());
    match (&question.answer, given) {
        (Answer::Choice { choices, right }, given) => {
            for (index, choice) in choices.iter().enumerate() {
                let text = format!("{}  {choice}", index + 1);
                let Some(given) = given else {
                    let size = [ui.available_width(), 0.0];
                    let button = egui::Button::new(text).wrap().min_size(size.into());
                    ui.add(button).sends(context, move |app| app.answer(Given::Choice(index)));
                    continue;
                };
                ui.label(match (index == *right, given == Given::Choice(index)) {
                    (true, _) => RichText::new(format!("{text}  ● right"))
                        .color(theme::text(ui.visuals(), theme::TRUTH))
                        .strong(),
                    (false, true) => RichText::new(format!("{text}  ▲ wrong"))
                        .color(theme::text(ui.visuals(), theme::ESTIMATE))
                        .strong(),
                    (false, false) => RichText::new(text).weak(),
                });
            }
        }
        (Answer::Place(_), None) => {
            ui.weak("Click on the map, or move the camera with Alt and the arrows");
            let words = context.state.camera.and_then(|camera| place(context, &camera));
            let is_placed = words.is_some();
            let words = words.map(|words| context.in_unit(&words));
            ui.label(words.unwrap_or_else(|| "Nothing is chosen yet".to_owned()));
            let button = ui.add_enabled(is_placed, egui::Button::new("This is my guess (Enter)"));
            button.sends(context, App::guess);
        }
        (Answer::Place(method), Some(Given::Place(guess))) => {
            for words in outcome(context, *method, &guess) {
                ui.label(RichText::new(context.in_unit(&words)).strong());
            }
        }
        (Answer::Place(_), Some(Given::Choice(_))) => {}
    }
}

/// Where a camera is, seen from the reference.
fn place(context: &ViewContext<'_>, camera: &Pose) -> Option<String> {
    let run = context.state.run();
    let problem = run.problems().first()?;
    let offset = Offset::of(&problem.reference_from_query(camera));
    let side = if offset.right_m < 0.0 { "left" } else { "right" };
    Some(format!(
        "Your guess: {:.1} m ahead of the reference, {:.1} m to the {side}",
        offset.forward_m,
        offset.right_m.abs()
    ))
}

/// How good a guess was, once the method's pose is shown.
fn outcome(context: &ViewContext<'_>, method: Method, guess: &Pose) -> Vec<String> {
    let run = context.state.run();
    let apart = |pose: &Pose| (guess.translation.vector - pose.translation.vector).norm();
    let span = run.span_of(Part::Reference(method, 0));
    let span = span.filter(|span| context.state.is_finished_at_cursor(span));
    let pose = span.and_then(|span| span.result.as_ref()?.pose.as_ref()?.to_pose());
    let mut words: Vec<String> = place(context, guess).into_iter().collect();
    match pose {
        Some(pose) => {
            words.push(format!("{} puts it {:.2} m from there", method.label(), apart(&pose)));
        }
        None => words.push(format!("{} is at work", method.label())),
    }
    let truth = run.truth();
    words.extend(truth.map(|truth| format!("The truth is {:.2} m from your guess", apart(truth))));
    words
}
