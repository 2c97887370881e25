//! Pictures that prove a verdict, as data.
//!
//! The window draws them; [`ProofPicture::raster`] paints them on the processor for reports and recordings.
//! Every kind of [`Proof`] is matched here, so that a kind without a picture does not compile.

mod layout;
mod maps;
mod photos;
mod places;
mod raster;

use std::sync::Arc;

use image::RgbImage;

use crate::diagnosis::{Diagnosis, MapOverlay, Proof};
use crate::estimator::{self, Entry};
use crate::event::{DebugEvent, Kind, KindSet};
use crate::geometry::Pose;
use crate::image::Photo;
use crate::localize::{PoseReport, QueryResult};
use crate::method::Method;
use crate::palette::{self, Rgb};
use crate::params::Params;
use crate::picture;
use crate::problem::Problem;
use crate::scale::LengthUnit;
use crate::trace::Record;

pub use layout::{MARK, Place, free_corner, label_place, title_end};
#[cfg(feature = "app")]
pub(crate) use maps::between;

/// The kinds of event that proofs are made from.
pub const KINDS: KindSet = KindSet::of(&[
    Kind::FeaturesDetected,
    Kind::MatchesDecided,
    Kind::DepthsLifted,
    Kind::MatchesGuided,
    Kind::PoseRefined,
    Kind::FeaturesClassified,
    Kind::PhaseSearched,
    Kind::ReferencesFused,
    Kind::ReferencesRanked,
]);

/// Panels that prove one sentence: a large one, perhaps one below it, and small ones beside it.
#[derive(Clone, Debug)]
pub struct ProofPicture {
    /// The panel that decides.
    pub large: Panel,
    /// A strip below it, as wide.
    pub below: Option<Panel>,
    /// Small panels beside it, from the top.
    pub beside: Vec<Panel>,
}

/// A picture with what is drawn on it. Places are pixels of the picture; (0, 0) is the corner of the first pixel.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What it shows, in a few words.
    pub title: String,
    /// The picture below all marks.
    pub picture: Arc<RgbImage>,
    /// Whether its pixels are cells, to be drawn as squares.
    pub has_cells: bool,
    /// Whether it is a plain ground that is never enlarged.
    pub is_plain: bool,
    /// Lines, from the lowest to the uppermost.
    pub lines: Vec<Line>,
    /// Marks above all lines.
    pub marks: Vec<Mark>,
    /// What its colours mean.
    pub scale: Option<ColorScale>,
}

/// A line through points.
#[derive(Clone, Debug)]
pub struct Line {
    /// Its points.
    pub points: Vec<[f32; 2]>,
    /// Its colour.
    pub color: Rgb,
    /// Its width where it is drawn \[px\].
    pub width: f32,
}

/// A mark with its label.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Where it is.
    pub at: [f32; 2],
    /// What it stands for.
    pub thing: Thing,
    /// Words beside it, often none.
    pub label: String,
}

/// What a mark stands for. Each has one shape and one colour everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thing {
    /// A reference: a white ring.
    Reference,
    /// The truth: a green plus.
    Truth,
    /// A result: a diamond in the colour of its grade.
    Result(Rgb),
    /// A keypoint or another point: a dot of this colour.
    Dot(Rgb),
    /// Nothing but the label.
    Words,
}

/// The ends of a gradient from dark blue over green to yellow.
#[derive(Clone, Debug)]
pub struct ColorScale {
    /// The number at the dark end.
    pub dark: String,
    /// The number at the bright end.
    pub bright: String,
}

/// What a proof is made from.
#[derive(Clone, Copy)]
pub struct ProofCase<'a> {
    /// The query and the reference.
    pub problem: &'a Problem,
    /// What the method told, in order.
    pub records: &'a [Record],
    /// What it found.
    pub result: &'a QueryResult,
    /// Where the query camera was, if that is known and not hidden (`world_from_camera`).
    pub truth: Option<&'a Pose>,
    /// The parameters of the run.
    pub params: &'a Params,
}

impl ProofPicture {
    /// The picture that proves the primary verdict. Where there is none, or the method told nothing of what that picture
    /// shows, the stage that decided, or the cloud on the photos.
    pub fn of(case: &ProofCase<'_>) -> Option<Self> {
        // Another system's pose has no search, and a failure early on nothing of what its verdict is about.
        let picture = Self::in_metres(case).or_else(|| case.deciding_stage())?;
        Some(picture.in_words_of(case.params.scale.unit()))
    }

    fn in_metres(case: &ProofCase<'_>) -> Option<Self> {
        match kind(case.result) {
            Proof::CostMap(overlay) => maps::cost_map(case, overlay),
            Proof::FreedViews => maps::freed_views(case),
            Proof::Matches => photos::matches(case),
            Proof::DepthPatch => photos::depth_patches(case),
            Proof::InlierSpread => photos::inlier_spread(case),
            Proof::RivalInliers => photos::rival_inliers(case),
            Proof::CloudOnPhoto => photos::cloud_on_photo(case),
            Proof::PoseMap => Some(places::pose_map(case)),
            Proof::Ranking => places::ranking(case),
            Proof::BothPoses => maps::both_poses(case),
            Proof::DecidingStage => case.deciding_stage(),
        }
    }

    /// Says in the unit what titles and marks say in metres.
    fn in_words_of(mut self, unit: LengthUnit) -> Self {
        for panel in [&mut self.large].into_iter().chain(&mut self.below).chain(&mut self.beside) {
            panel.title = unit.words(&panel.title);
            for mark in &mut panel.marks {
                mark.label = unit.words(&mark.label);
            }
        }
        self
    }

    /// The same with a small panel, counted from 0, in the place of the large one.
    #[must_use]
    pub fn swapped(&self, small: usize) -> Self {
        let mut swapped = self.clone();
        if let Some(panel) = swapped.beside.get_mut(small) {
            std::mem::swap(&mut swapped.large, panel);
        }
        swapped
    }

    /// All panels: the large one, that below it, those beside it.
    pub fn panels(&self) -> impl Iterator<Item = &Panel> {
        [&self.large].into_iter().chain(&self.below).chain(&self.beside)
    }
}

/// The kind of picture that proves what is known of a result.
pub fn kind(result: &QueryResult) -> Proof {
    let primary = result.diagnosis.first();
    primary.map_or(Proof::DecidingStage, Diagnosis::proof)
}

/// The problem that a proof shows, of those of a result's references: the one that the verdict names, else the first.
pub(crate) fn problem_of<'a>(result: &QueryResult, problems: &'a [Problem]) -> Option<&'a Problem> {
    let named =
        result.diagnosis.first().and_then(|found| found.evidence.get("reference")?.as_str());
    let is_named = |problem: &&Problem| named == Some(problem.reference().name());
    problems.iter().find(is_named).or(problems.first())
}

/// The estimator that a result comes from: of a hybrid the part that it took.
pub(crate) fn responsible(result: &QueryResult) -> Option<Method> {
    let entry = estimator::find(result.method)?;
    Some(match entry.hybrid() {
        Some(parts) if result.cost.is_some() => parts.second,
        Some(parts) => parts.first,
        None => result.method,
    })
}

impl<'a> ProofCase<'a> {
    /// The latest event of a type.
    fn latest<E: DebugEvent + 'static>(&self) -> Option<&'a E> {
        let mut latest_first = self.records.iter().rev();
        latest_first.find_map(|record| E::from_event(&record.event))
    }

    fn all<E: DebugEvent + 'static>(&self) -> impl DoubleEndedIterator<Item = &'a E> {
        let records = self.records.iter();
        records.filter_map(|record| E::from_event(&record.event))
    }

    /// The pose that was found (`world_from_camera`).
    fn pose(&self) -> Option<Pose> {
        self.result.pose.as_ref().and_then(PoseReport::to_pose)
    }

    /// The picture of the stage that decided: costs where a cost was minimised, else matches.
    fn deciding_stage(&self) -> Option<ProofPicture> {
        let method = responsible(self.result);
        let entry = method.and_then(estimator::find);
        if entry.and_then(Entry::cost).is_some() {
            let map = maps::cost_map(self, MapOverlay::Ranks);
            map.or_else(|| photos::matches(self)).or_else(|| photos::cloud_on_photo(self))
        } else {
            photos::matches(self).or_else(|| photos::cloud_on_photo(self))
        }
    }

    /// The mark of the result, in the colour of its grade.
    fn result_mark(&self, at: [f32; 2], label: impl Into<String>) -> Mark {
        let color = palette::grade(self.result.grade);
        Mark::new(Thing::Result(color), at, label)
    }
}

impl Panel {
    pub(crate) fn new(title: impl Into<String>, picture: RgbImage) -> Self {
        Self {
            title: title.into(),
            picture: Arc::new(picture),
            has_cells: false,
            is_plain: false,
            lines: Vec::new(),
            marks: Vec::new(),
            scale: None,
        }
    }

    /// A photo as it is.
    fn photo(title: impl Into<String>, photo: &Photo) -> Self {
        Self::new(title, picture::photo(photo).into_rgb8())
    }

    /// A plain ground for lines and marks.
    fn plain(title: impl Into<String>, width: u32, height: u32) -> Self {
        let ground = RgbImage::from_pixel(width, height, image::Rgb(palette::NOTHING));
        Self { is_plain: true, ..Self::new(title, ground) }
    }

    fn mark(&mut self, thing: Thing, at: [f32; 2], label: impl Into<String>) {
        self.marks.push(Mark::new(thing, at, label));
    }

    fn line(&mut self, color: Rgb, width: f32, points: impl IntoIterator<Item = [f32; 2]>) {
        self.lines.push(Line { points: points.into_iter().collect(), color, width });
    }

    /// Width over height.
    fn aspect(&self) -> f32 {
        self.picture.width() as f32 / self.picture.height().max(1) as f32
    }
}

/// Whether two places are at most this far from each other.
fn is_near(one: [f32; 2], other: [f32; 2], within: f32) -> bool {
    (one[0] - other[0]).hypot(one[1] - other[1]) <= within
}

impl Mark {
    fn new(thing: Thing, at: [f32; 2], label: impl Into<String>) -> Self {
        Self { at, thing, label: label.into() }
    }
}

impl Thing {
    /// Its colour.
    pub fn color(self) -> Rgb {
        match self {
            Self::Reference | Self::Words => [0xFF; 3],
            Self::Truth => palette::TRUTH,
            Self::Result(color) | Self::Dot(color) => color,
        }
    }
}

#[cfg(test)]
mod tests;
