//! Photos and pictures of a run as data URIs: thumbnails of its queries, matches and costs of failures.

use std::fmt::Write as _;
use std::io::Cursor;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageFormat, RgbaImage};

use crate::event::{
    FeaturesClassified, FeaturesDetected, Kind, KindSet, MatchesDecided, PhaseSearched, Side,
};
use crate::features::FeatureState;
use crate::geometry::Pose;
use crate::grid::{Lattice, Offset, Phase, ScoredLattice};
use crate::history::History;
use crate::image::Photo;
use crate::localize::{LocalizeObserver, PoseReport};
use crate::palette;
use crate::picture;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink};

/// Width of a thumbnail \[px\].
const THUMBNAIL_WIDTH: u32 = 120;
/// Width of a canvas of matches \[px\].
const CANVAS_WIDTH: u32 = 560;
/// Side of a picture of costs \[px\].
const SURFACE_SIDE: f64 = 300.0;
/// Lines of one state in a canvas; more hide each other.
const MOST_LINES: usize = 200;

/// A small copy of a photo.
pub(super) fn thumbnail(photo: &Photo) -> Option<String> {
    jpeg(&picture::photo(photo), THUMBNAIL_WIDTH, 55)
}

/// A picture in at most this width, as a data URI; `None` for one without pixels.
fn jpeg(picture: &DynamicImage, width: u32, quality: u8) -> Option<String> {
    if picture.width() == 0 || picture.height() == 0 {
        return None;
    }
    let small = match picture.width() > width {
        true => picture.thumbnail(width, u32::MAX),
        false => picture.clone(),
    };
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    small.into_rgb8().write_with_encoder(encoder).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes)))
}

/// Hears what the pictures of a failure need.
#[derive(Default)]
pub(super) struct Witness {
    history: History,
    problems: Vec<Problem>,
}

impl Sink for Witness {
    fn wanted(&self) -> KindSet {
        KindSet::of(&[
            Kind::FeaturesDetected,
            Kind::MatchesDecided,
            Kind::FeaturesClassified,
            Kind::PhaseSearched,
        ])
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.history.accept(record)
    }
}

impl LocalizeObserver for Witness {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], _truth: Option<&Pose>) {
        self.problems = problems.to_vec();
    }
}

/// Pictures of a failure as SVG, each with what it shows.
#[derive(Clone, Debug, Default)]
pub(super) struct FailurePictures {
    pub(super) matches: Option<String>,
    pub(super) surface: Option<String>,
}

impl Witness {
    /// Draws what was told: matches, and the coarse costs with the truth and the result.
    pub(super) fn pictures(
        &self,
        truth: Option<&Pose>,
        result: Option<&PoseReport>,
    ) -> FailurePictures {
        let Some(problem) = self.problems.first() else {
            return FailurePictures::default();
        };
        let place =
            |world_from_query: &Pose| Offset::of(&problem.reference_from_query(world_from_query));
        let result = result.and_then(PoseReport::to_pose);
        let coarse = self.history.all::<PhaseSearched>().map(|(_, event)| event);
        let coarse = coarse
            .filter(|event| event.surface.lattice.phase == Phase::PositionCoarse)
            .last();
        FailurePictures {
            matches: self.matches(problem),
            surface: coarse.and_then(|event| {
                surface(&event.surface, truth.map(place), result.as_ref().map(place))
            }),
        }
    }

    /// The query above the reference, with a line for each match that came as far as a depth.
    fn matches(&self, problem: &Problem) -> Option<String> {
        let of_side = |side: Side| {
            let mut detected = self.history.all::<FeaturesDetected>();
            detected
                .find(|(_, event)| event.side == side)
                .map(|(_, event)| Arc::clone(&event.features))
        };
        let (query, reference) = (of_side(Side::Query)?, of_side(Side::Reference)?);
        let decisions = &self.history.last::<MatchesDecided>()?.decisions;
        let states = &self.history.last::<FeaturesClassified>()?.states;
        let (canvas, top) = picture::stacked(&problem.query.photo, &problem.reference.photo);
        let scale = f64::from(CANVAS_WIDTH.min(canvas.width())) / f64::from(canvas.width());
        let (width, height) = (
            f64::from(canvas.width()) * scale,
            f64::from(canvas.height()) * scale,
        );
        let photos = jpeg(&canvas, CANVAS_WIDTH, 60)?;
        let mut svg = String::new();
        let mut counts = [0; FeatureState::NAMES.len()];
        // Inliers come last, so that no outlier hides one.
        for wanted in [3, 4] {
            for (state, decision) in states.iter().zip(decisions.iter()) {
                let Some(found) = decision.filter(|_| state.index() == wanted) else {
                    continue;
                };
                counts[wanted] += 1;
                if counts[wanted] > MOST_LINES {
                    continue;
                }
                let (from, to) = (
                    query.keypoints.get(found.query)?,
                    reference.keypoints.get(found.reference)?,
                );
                let [r, g, b] = palette::STATES[wanted];
                let dashes = if wanted == 3 {
                    " stroke-dasharray=\"4 3\""
                } else {
                    ""
                };
                // Writing to a string cannot fail.
                let _ = write!(
                    svg,
                    "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" \
                     stroke=\"rgb({r},{g},{b})\"{dashes}><title>{}</title></line>",
                    f64::from(from.x) * scale,
                    f64::from(from.y) * scale,
                    f64::from(to.x) * scale,
                    (f64::from(to.y) + f64::from(top)) * scale,
                    told(state),
                );
            }
        }
        let name = format!(
            "{} inliers and {} outliers between the query above and the reference below",
            counts[4], counts[3]
        );
        Some(format!(
            "<svg viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" role=\"img\" \
             aria-label=\"{name}\"><image href=\"{photos}\" width=\"{width:.0}\" \
             height=\"{height:.0}\"/>{svg}</svg>"
        ))
    }
}

fn told(state: &FeatureState) -> String {
    match state {
        FeatureState::Outlier { residual_px } if residual_px.is_infinite() => "match".to_owned(),
        FeatureState::Outlier { residual_px } => format!("outlier, {residual_px:.1} px"),
        FeatureState::Inlier { residual_px } => format!("inlier, {residual_px:.1} px"),
        other => other.name().to_owned(),
    }
}

/// The costs of all positions around the reference, the least bright, the front up; cells without a say
/// are grey.
fn surface(
    surface: &ScoredLattice,
    truth: Option<Offset>,
    result: Option<Offset>,
) -> Option<String> {
    let lattice = &surface.lattice;
    let costs = || (0..surface.scores.len()).filter_map(|cell| surface.eligible_cost(cell));
    let (least, greatest) = (
        costs().fold(f64::INFINITY, f64::min),
        costs().fold(f64::NEG_INFINITY, f64::max),
    );
    let cells = RgbaImage::from_fn(lattice.columns as u32, lattice.rows as u32, |x, y| {
        let row = lattice.rows - 1 - y as usize;
        let cell = row * lattice.columns + x as usize;
        let [r, g, b] = match (surface.scores[cell], surface.eligible_cost(cell)) {
            (None, _) => return image::Rgba([0; 4]),
            (Some(_), None) => [128; 3],
            (Some(_), Some(cost)) => {
                palette::viridis((greatest - cost) / (greatest - least).max(1e-12))
            }
        };
        image::Rgba([r, g, b, 255])
    });
    let mut png = Vec::new();
    let written =
        DynamicImage::ImageRgba8(cells).write_to(&mut Cursor::new(&mut png), ImageFormat::Png);
    written.ok()?;
    let place = |offset: &Offset| place(lattice, offset);
    let mut marks = String::new();
    let (x, y) = place(&Offset::default());
    let _ = write!(
        marks,
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"none\" stroke=\"#fff\" stroke-width=\"2\">\
         <title>the reference</title></circle>"
    );
    if let Some((x, y)) = result.as_ref().map(place) {
        let (left, up) = (x - 6.0, y - 6.0);
        let _ = write!(
            marks,
            "<rect x=\"{left:.1}\" y=\"{up:.1}\" width=\"12\" height=\"12\" fill=\"none\" \
             stroke=\"#ff7a1a\" stroke-width=\"3\"><title>the result</title></rect>"
        );
    }
    if let Some((x, y)) = truth.as_ref().map(place) {
        let _ = write!(
            marks,
            "<path d=\"M{:.1} {:.1}l12 12m0 -12l-12 12\" stroke=\"#ff2bd6\" stroke-width=\"3\">\
             <title>the truth</title></path>",
            x - 6.0,
            y - 6.0
        );
    }
    let name = format!(
        "costs from {least:.4}, bright, to {greatest:.4}, dark, of {} positions around the reference",
        costs().count()
    );
    Some(format!(
        "<svg viewBox=\"0 0 {SURFACE_SIDE} {SURFACE_SIDE}\" width=\"{SURFACE_SIDE}\" role=\"img\" \
         aria-label=\"{name}\"><image href=\"data:image/png;base64,{}\" width=\"{SURFACE_SIDE}\" \
         height=\"{SURFACE_SIDE}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:pixelated\"/>{marks}</svg>",
        STANDARD.encode(png)
    ))
}

/// Where an offset is in the picture; what lies outside stays at its border.
fn place(lattice: &Lattice, offset: &Offset) -> (f64, f64) {
    let along = |metres: f64, centre: f64, count: usize| {
        let cells = (metres - centre) / lattice.step + count as f64 / 2.0;
        (cells / count as f64 * SURFACE_SIDE).clamp(0.0, SURFACE_SIDE)
    };
    let x = along(offset.right_m, lattice.centre.right_m, lattice.columns);
    let y = along(offset.forward_m, lattice.centre.forward_m, lattice.rows);
    (x, SURFACE_SIDE - y)
}
