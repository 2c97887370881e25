//! The pictures of a run that are made beside the window's thread: a small one for each stage, a proof for each result.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use egui::{ColorImage, TextureHandle, TextureOptions};
use image::{DynamicImage, Rgb, RgbImage, imageops::FilterType};

use super::textures::color_image;
use super::worker::Answers;
use crate::event::{Event, FeaturesDetected, Side};
use crate::features::{Keypoint, MatchVerdict};
use crate::palette;
use crate::picture;
use crate::problem::Problem;
use crate::proof::{self, ProofCase, ProofPicture};
use crate::session::{Part, Run};
use crate::trace::Record;

/// The pictures of one run.
pub(super) struct RunPictures {
    ctx: egui::Context,
    stages: RefCell<Stages>,
    /// `None` where nothing can be drawn.
    proofs: Answers<Part, Option<Arc<ProofPicture>>>,
    shows_truth: bool,
}

/// The small pictures, by the record that each shows.
struct Stages {
    pictures: Answers<usize, TextureHandle>,
    /// The record that shows a range of records best.
    shows: HashMap<(usize, usize), Option<usize>>,
}

impl RunPictures {
    pub(super) fn new(ctx: &egui::Context) -> Self {
        let stages = Stages { pictures: Answers::new("stages", ctx), shows: HashMap::new() };
        Self {
            ctx: ctx.clone(),
            stages: RefCell::new(stages),
            proofs: Answers::new("proofs", ctx),
            shows_truth: true,
        }
    }

    /// Takes in what is ready, and asks for the proof of each part that has a result.
    pub(super) fn update(&mut self, run: &Run, shows_truth: bool) {
        self.stages.get_mut().pictures.poll();
        if shows_truth != self.shows_truth {
            self.proofs.forget();
            self.shows_truth = shows_truth;
        }
        self.proofs.poll();
        for span in run.spans() {
            let Some(result) = &span.result else { continue };
            self.proofs.ask(span.part, || {
                let problem = match span.part.reference() {
                    Some(reference) => run.problems().get(reference)?,
                    None => proof::problem_of(result, run.problems())?,
                };
                // The ranking of the references belongs to no method, and proves that the right one was not found.
                let ranking = run.span_of(Part::Retrieval).map(|span| span.records.clone());
                let records = ranking.into_iter().chain([span.records.clone()]);
                let records = records.flat_map(|records| &run.records()[records]);
                let records = records.filter(|record| proof::KINDS.contains(record.event.kind()));
                let records: Vec<Record> = records.cloned().collect();
                let (problem, params) = (problem.clone(), run.params.clone());
                let result = result.shown(shows_truth);
                let truth = run.truth().copied().filter(|_| shows_truth);
                Some(move || {
                    let (problem, records, result) = (&problem, &*records, &result);
                    let (truth, params) = (truth.as_ref(), &params);
                    let case = ProofCase { problem, records, result, truth, params };
                    ProofPicture::of(&case).map(Arc::new)
                })
            });
        }
    }

    /// Drops everything: the run is another one.
    pub(super) fn forget(&mut self) {
        let stages = self.stages.get_mut();
        stages.pictures.forget();
        stages.shows.clear();
        self.proofs.forget();
    }

    /// The picture of a stage: of the last record in it, or before it in its part, that can be drawn. Asking for it
    /// has it made.
    pub(super) fn stage(
        &self,
        run: &Run,
        part: &Range<usize>,
        stage: &Range<usize>,
    ) -> Option<TextureHandle> {
        let Stages { pictures, shows } = &mut *self.stages.borrow_mut();
        let shown = *shows.entry((part.start, stage.end)).or_insert_with(|| {
            let records = &run.records()[part.start..stage.end];
            let last = records.iter().rposition(|record| is_drawn(&record.event))?;
            Some(part.start + last)
        });
        let record = shown?;
        pictures.ask(record, || {
            let (drawn, ctx) = (Drawn::of(run, part.start, record)?, self.ctx.clone());
            Some(move || {
                let image = drawn.picture();
                // A few cells of a map stay squares.
                let is_map = image.size[0] < 64;
                let options = if is_map { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
                ctx.load_texture("stage", image, options)
            })
        });
        pictures.get(&record).cloned()
    }

    /// The proof of a part's result, once it is made.
    pub(super) fn proof(&self, part: Part) -> Option<&Arc<ProofPicture>> {
        self.proofs.get(&part)?.as_ref()
    }

    /// Whether proofs are being made.
    pub(super) fn is_proving(&self) -> bool {
        self.proofs.is_busy()
    }

    /// Whether any picture is being made.
    pub(super) fn is_busy(&self) -> bool {
        self.is_proving() || self.stages.borrow().pictures.is_busy()
    }
}

/// The largest size of a small picture \[px\]: twice what they take on the screen.
const SIZE: (u32, u32) = (236, 76);

/// What a small picture is made from: a record and what it is about.
struct Drawn {
    event: Event,
    keypoints: Option<FeaturesDetected>,
    problem: Problem,
}

impl Drawn {
    /// What there is to draw of a record, for a part of the run that begins at `start`.
    fn of(run: &Run, start: usize, record: usize) -> Option<Self> {
        let problem = run.problem_at(record)?;
        let records = run.records().get(start..=record)?;
        let keypoints = records.iter().rev().find_map(|record| match &record.event {
            Event::FeaturesDetected(event) if event.side == Side::Query => Some(event.clone()),
            _ => None,
        });
        let event = records.last()?.event.clone();
        Some(Self { event, keypoints, problem: problem.clone() })
    }

    /// The small picture.
    fn picture(&self) -> ColorImage {
        color_image(&picture_of(self).resize(SIZE.0, SIZE.1, FilterType::Triangle))
    }
}

/// Whether there is a picture of an event.
fn is_drawn(event: &Event) -> bool {
    matches!(
        event,
        Event::FeaturesDetected(FeaturesDetected { side: Side::Query, .. })
            | Event::MatchesDecided(_)
            | Event::DepthsLifted(_)
            | Event::FeaturesClassified(_)
            | Event::ViewRendered(_)
            | Event::PhaseSearched(_)
            | Event::ReferencesRanked(_)
    )
}

fn picture_of(question: &Drawn) -> DynamicImage {
    let problem = &question.problem;
    let dots = |colors: Vec<Option<palette::Rgb>>| {
        let keypoints = question.keypoints.as_ref();
        let keypoints = keypoints.map_or(&[][..], |event| &event.features.keypoints);
        dotted(&picture::photo(problem.query().photo()), keypoints, &colors)
    };
    match &question.event {
        Event::FeaturesDetected(event) => {
            dots(vec![Some(palette::STATES[1]); event.features.keypoints.len()])
        }
        Event::MatchesDecided(event) => dots(
            event
                .decisions
                .iter()
                .map(|found| {
                    let is_match =
                        found.is_some_and(|found| found.verdict == MatchVerdict::Candidate);
                    is_match.then_some(palette::UNDECIDED)
                })
                .collect(),
        ),
        Event::DepthsLifted(event) => {
            let last = event.matches.iter().map(|one| one.query).max();
            let mut colors = vec![None; last.map_or(0, |last| last + 1)];
            for one in event.matches.iter() {
                let has_depth = one.point.is_some();
                colors[one.query] =
                    Some(if has_depth { palette::UNDECIDED } else { palette::STATES[2] });
            }
            dots(colors)
        }
        Event::FeaturesClassified(event) => dots(
            event
                .states
                .iter()
                .map(|state| (state.index() >= 3).then_some(palette::STATES[state.index()]))
                .collect(),
        ),
        Event::ViewRendered(event) => picture::synthetic(&event.comparison.view).into(),
        Event::PhaseSearched(event) => picture::surface(&event.surface).into(),
        Event::ReferencesRanked(event) => {
            let first = event.photos.iter().flatten().next();
            first.map_or_else(
                || picture::photo(problem.reference().photo()),
                |photo| picture::photo(photo),
            )
        }
        _ => picture::photo(problem.query().photo()),
    }
}

/// A small copy of a photo with a dot for each keypoint that has a colour.
fn dotted(
    photo: &DynamicImage,
    keypoints: &[Keypoint],
    colors: &[Option<palette::Rgb>],
) -> DynamicImage {
    let small = photo.thumbnail(SIZE.0, SIZE.1).into_rgb8();
    let scale = small.width() as f32 / photo.width().max(1) as f32;
    let mut small: RgbImage = small;
    for pixel in small.pixels_mut() {
        pixel.0 = pixel.0.map(|value| value / 2 + value / 8);
    }
    for (keypoint, color) in keypoints.iter().zip(colors) {
        let Some(color) = color else { continue };
        let (x, y) = (keypoint.x * scale, keypoint.y * scale);
        for (right, down) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            if let Some(pixel) = small.get_pixel_mut_checked((x + right) as u32, (y + down) as u32)
            {
                *pixel = Rgb(*color);
            }
        }
    }
    small.into()
}
