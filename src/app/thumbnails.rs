//! Small pictures of the stages of a run.

use egui::ColorImage;
use image::{DynamicImage, Rgb, RgbImage, imageops::FilterType};

use super::textures::color_image;
use crate::event::{Event, FeaturesDetected, Side};
use crate::features::{Keypoint, MatchVerdict};
use crate::palette;
use crate::picture;
use crate::problem::Problem;
use crate::session::Run;

/// Their largest size \[px\]: twice what they take on the screen.
const SIZE: (u32, u32) = (236, 76);

/// What a small picture is made from: a record and what it is about.
pub(super) struct Drawn {
    event: Event,
    keypoints: Option<FeaturesDetected>,
    problem: Problem,
}

impl Drawn {
    /// What there is to draw of a record, for a part of the run that begins at `start`.
    pub(super) fn of(run: &Run, start: usize, record: usize) -> Option<Self> {
        let problem = run.loaded.as_deref()?.problems.get(run.reference_at(record))?;
        let records = run.records().get(start..=record)?;
        let keypoints = records.iter().rev().find_map(|record| match &record.event {
            Event::FeaturesDetected(event) if event.side == Side::Query => Some(event.clone()),
            _ => None,
        });
        let event = records.last()?.event.clone();
        Some(Self { event, keypoints, problem: problem.clone() })
    }

    /// The small picture.
    pub(super) fn picture(&self) -> ColorImage {
        color_image(&picture_of(self).resize(SIZE.0, SIZE.1, FilterType::Triangle))
    }
}

/// Whether there is a picture of an event.
pub(super) fn is_drawn(event: &Event) -> bool {
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
