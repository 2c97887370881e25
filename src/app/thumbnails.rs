//! Small pictures of the stages of a run, made beside the window's thread.

use std::collections::HashMap;
use std::ops::Range;

use egui::{ColorImage, TextureHandle, TextureOptions};
use image::{DynamicImage, Rgb, RgbImage, imageops::FilterType};

use super::textures::color_image;
use super::worker::Worker;
use crate::event::{Event, FeaturesDetected, Side};
use crate::features::{Keypoint, MatchVerdict};
use crate::palette;
use crate::picture;
use crate::problem::Problem;
use crate::session::Run;

/// Their largest size \[px\]: twice what they take on the screen.
const SIZE: (u32, u32) = (236, 76);

/// The thumbnails of the present run, by the record that each shows.
pub(super) struct Thumbnails {
    ctx: egui::Context,
    worker: Worker<Question, (usize, ColorImage)>,
    /// `None` while it is made.
    made: HashMap<usize, Option<TextureHandle>>,
    /// The record that shows a range of records best.
    shows: HashMap<(usize, usize), Option<usize>>,
}

/// A picture to be made of one record.
struct Question {
    record: usize,
    event: Event,
    keypoints: Option<FeaturesDetected>,
    problem: Problem,
}

impl Thumbnails {
    pub(super) fn new(ctx: egui::Context) -> Self {
        let worker = Worker::new("stages", ctx.clone(), |question: Question| {
            let picture = picture_of(&question);
            let small = picture.resize(SIZE.0, SIZE.1, FilterType::Triangle);
            (question.record, color_image(&small))
        });
        Self { ctx, worker, made: HashMap::new(), shows: HashMap::new() }
    }

    /// Drops everything: the run is another one.
    pub(super) fn forget(&mut self) {
        self.worker.forget();
        self.made.clear();
        self.shows.clear();
    }

    /// Takes in the pictures that are ready.
    pub(super) fn poll(&mut self) {
        for (record, image) in self.worker.poll().into_iter().flatten() {
            let options =
                if image.size[0] < 64 { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
            let texture = self.ctx.load_texture("stage", image, options);
            self.made.insert(record, Some(texture));
        }
    }

    /// Whether pictures are still being made.
    pub(super) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }

    /// The picture of a stage: of the last record in it, or before it in its part, that can be drawn. Asking for it
    /// has it made.
    pub(super) fn of(
        &mut self,
        run: &Run,
        part: Range<usize>,
        stage: Range<usize>,
    ) -> Option<TextureHandle> {
        let key = (part.start, stage.end);
        let shown = *self.shows.entry(key).or_insert_with(|| {
            let records = &run.records()[part.start..stage.end];
            let last = records.iter().rposition(|record| is_drawn(&record.event))?;
            Some(part.start + last)
        });
        let record = shown?;
        if let Some(made) = self.made.get(&record) {
            return made.clone();
        }
        let loaded = run.loaded.as_deref()?;
        let problem = loaded.problems.get(run.reference_at(record))?;
        let keypoints = run.records()[part.start..=record].iter().rev().find_map(|record| {
            match &record.event {
                Event::FeaturesDetected(event) if event.side == Side::Query => Some(event.clone()),
                _ => None,
            }
        });
        self.made.insert(record, None);
        self.worker.ask(Question {
            record,
            event: run.records()[record].event.clone(),
            keypoints,
            problem: problem.clone(),
        });
        None
    }
}

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

fn picture_of(question: &Question) -> DynamicImage {
    let problem = &question.problem;
    let dots = |colors: Vec<Option<palette::Rgb>>| {
        let keypoints = question.keypoints.as_ref();
        let keypoints = keypoints.map_or(&[][..], |event| &event.features.keypoints);
        dotted(&picture::photo(&problem.query.photo), keypoints, &colors)
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
                || picture::photo(&problem.reference.photo),
                |photo| picture::photo(photo),
            )
        }
        _ => picture::photo(&problem.query.photo),
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
