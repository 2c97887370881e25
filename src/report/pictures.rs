//! Photos and pictures of a run as data URIs: thumbnails of its queries, matches and costs of failures.

use std::io::Cursor;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageFormat};
use maud::{Markup, html};

use crate::chart::hex;
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
/// Positions of these states among [`palette::STATES`].
const OUTLIER: usize = 3;
const INLIER: usize = 4;

/// A small copy of a photo.
pub(super) fn thumbnail(photo: &Photo) -> Option<String> {
    jpeg(&picture::photo(photo), THUMBNAIL_WIDTH, 55)
}

/// A picture in at most this width, as a data URI; `None` for one without pixels.
fn jpeg(picture: &DynamicImage, width: u32, quality: u8) -> Option<String> {
    if picture.width() == 0 || picture.height() == 0 {
        return None;
    }
    let small = if picture.width() > width {
        picture.thumbnail(width, u32::MAX)
    } else {
        picture.clone()
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

/// Pictures of a failure.
#[derive(Clone, Debug, Default)]
pub(super) struct FailurePictures {
    pub(super) matches: Option<Markup>,
    pub(super) surface: Option<Markup>,
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
    fn matches(&self, problem: &Problem) -> Option<Markup> {
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
        let (width, height) = (canvas.width(), canvas.height());
        let photos = jpeg(&canvas, CANVAS_WIDTH, 60)?;
        let of_state = |wanted: usize| {
            let decided = states.iter().zip(decisions.iter());
            let decided = decided.filter(move |(state, _)| state.index() == wanted);
            decided.filter_map(|(state, decision)| {
                let found = (*decision)?;
                let from = query.keypoints.get(found.query)?;
                Some((state, from, reference.keypoints.get(found.reference)?))
            })
        };
        let name = format!(
            "{} inliers and {} outliers between the query above and the reference below",
            of_state(INLIER).count(),
            of_state(OUTLIER).count()
        );
        Some(html! {
            svg viewBox={ "0 0 " (width) " " (height) } width=(CANVAS_WIDTH.min(width)) role="img" aria-label=(name) {
                image href=(photos) width=(width) height=(height) {}
                // Inliers come last: no outlier may hide one.
                @for (wanted, dashes) in [(OUTLIER, Some("4 3")), (INLIER, None)] {
                    g stroke=(hex(palette::STATES[wanted])) stroke-dasharray=[dashes] {
                        @for (state, from, to) in of_state(wanted).take(MOST_LINES) {
                            line x1=(from.x) y1=(from.y) x2=(to.x) y2=(to.y + top as f32)
                                vector-effect="non-scaling-stroke" { title { (told(state)) } }
                        }
                    }
                }
            }
        })
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

/// The costs of all positions around the reference, with marks.
fn surface(
    surface: &ScoredLattice,
    truth: Option<Offset>,
    result: Option<Offset>,
) -> Option<Markup> {
    let mut png = Vec::new();
    let cells = DynamicImage::ImageRgb8(picture::surface(surface));
    cells
        .write_to(&mut Cursor::new(&mut png), ImageFormat::Png)
        .ok()?;
    let cells = format!("data:image/png;base64,{}", STANDARD.encode(png));
    let ring = (
        "the reference",
        "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0",
        palette::REFERENCE_ON_COSTS,
    );
    let diamond = ("the result", "M0 -7l7 7l-7 7l-7 -7z", palette::ESTIMATE);
    let plus = ("the truth", "M-7 0h14M0 -7v14", palette::TRUTH);
    let marks = [
        (Some(Offset::default()), ring),
        (result, diamond),
        (truth, plus),
    ];
    let marks = marks
        .into_iter()
        .filter_map(|(offset, mark)| Some((offset?, mark)));
    Some(html! {
        svg viewBox={ "0 0 " (SURFACE_SIDE) " " (SURFACE_SIDE) } width=(SURFACE_SIDE) role="img"
            aria-label="costs of positions around the reference: yellow the least, dark blue the greatest" {
            image href=(cells) width=(SURFACE_SIDE) height=(SURFACE_SIDE) preserveAspectRatio="none"
                style="image-rendering:pixelated" {}
            @for (offset, (name, shape, color)) in marks {
                @let (x, y) = place(&surface.lattice, &offset);
                path d=(shape) transform=(format!("translate({x:.1} {y:.1})")) fill="none" stroke=(hex(color))
                    stroke-width="3" { title { (name) } }
            }
        }
    })
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
