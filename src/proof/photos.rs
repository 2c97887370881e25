//! Proofs of methods that match features: what they matched, and where the map lies on the photos.

use std::sync::Arc;

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Point3};

use super::places::from_above;
use super::{Panel, ProofCase, ProofPicture, Thing};
use crate::camera::Intrinsics;
use crate::diagnosis::true_match_px;
use crate::event::{FeaturesDetected, Side};
use crate::feature_progress::{FeatureProgress, residual_px};
use crate::features::{FeatureState, Keypoint};
use crate::geometry::Pose;
use crate::image::Photo;
use crate::palette::{self, Rgb as Color};
use crate::picture;

/// Lines of one kind at most; more hide each other.
const MAX_LINES: usize = 80;
/// Side of a patch \[px of the photo\], and how much it is enlarged.
const PATCH: u32 = 48;
const ENLARGED: u32 = 6;
/// Patches at most.
const PATCHES: usize = 4;
/// Position of inliers among the states of features.
const INLIER: usize = 4;
/// Matches without a depth.
const NO_DEPTH: Color = [0xFF; 3];
/// A scan is dense that has a point for so few pixels of the photo.
const DENSE: usize = 12;
/// What is drawn but does not count.
const FAINT: Color = [0x70; 3];

/// A kind of line: its colour, its width, and which matches it stands for.
type LineKind = (Color, f32, fn(&Matched<'_>) -> bool);

/// A match as FB left it.
struct Matched<'a> {
    query: &'a Keypoint,
    reference: &'a Keypoint,
    state: FeatureState,
    /// Its point in the reference camera's frame \[m\].
    point: Option<Point3<f64>>,
    /// The depths around it \[m\].
    depth_range_m: Option<(f64, f64)>,
    /// Whether the truth explains it; `None` without a truth or a point.
    is_true: Option<bool>,
}

/// All matches of a run of FB.
struct Matches<'a> {
    states: &'a [FeatureState],
    all: Vec<Matched<'a>>,
}

impl<'a> Matches<'a> {
    fn of(case: &ProofCase<'a>) -> Option<Self> {
        let camera = case.problem.query().intrinsics();
        let inlier_px = case.params.fb.mlesac.inlier_threshold_px;
        let progress = FeatureProgress::of(case.records, Some(camera), inlier_px);
        // Of a photo without keypoints the states are known, but nothing was matched.
        let states = progress.states.filter(|_| !progress.is_unmatched())?;
        let threshold_px = true_match_px(inlier_px);
        let query_from_reference = case.query_from_reference();
        let matched = states.iter().enumerate().filter_map(|(at, &state)| {
            let own = progress.lifted(at);
            let decided = progress.matched(at).map(|one| one.reference);
            let other = own.map(|one| one.reference).or(decided)?;
            let keypoint = progress.query.get(at)?;
            let point = own.and_then(|one| one.point);
            let is_true = query_from_reference.zip(point).map(|(pose, point)| {
                let off_px = residual_px(camera, &pose, &point, keypoint);
                off_px.is_some_and(|off_px| off_px <= threshold_px)
            });
            Some(Matched {
                query: keypoint,
                reference: progress.reference.get(other)?,
                state,
                point,
                depth_range_m: own.and_then(|one| one.depth_range_m),
                is_true,
            })
        });
        Some(Self { states, all: matched.collect() })
    }

    fn inliers(&self) -> impl Iterator<Item = &Matched<'a>> {
        self.all.iter().filter(|one| one.is_inlier())
    }

    fn true_ones(&self) -> impl Iterator<Item = &Matched<'a>> {
        self.all.iter().filter(|one| one.is_true == Some(true))
    }
}

impl Matched<'_> {
    fn is_inlier(&self) -> bool {
        self.state.index() == INLIER
    }
}

impl ProofCase<'_> {
    /// The true pose of the reference camera in the query's frame.
    fn query_from_reference(&self) -> Option<Pose> {
        Some(self.problem.reference_from_query(self.truth?).inverse())
    }
}

/// Both photos with inliers and true matches, and how many features passed each step.
pub(super) fn matches(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let Some(matches) = Matches::of(case) else {
        return keypoints(case);
    };
    let (canvas, top) =
        picture::stacked(case.problem.query().photo(), case.problem.reference().photo());
    let title = if case.truth.is_some() {
        "green: true matches, orange: false inliers"
    } else {
        "the inliers"
    };
    let title = format!("Query above reference {}; {title}", case.problem.reference().name());
    let mut panel = Panel::new(title, canvas.into_rgb8());
    let kinds: [LineKind; 4] = [
        (FAINT, 0.5, |one| one.point.is_some() && !one.is_inlier() && one.is_true != Some(true)),
        (palette::TRUTH, 1.0, |one| one.is_true == Some(true) && !one.is_inlier()),
        (palette::ESTIMATE, 1.5, |one| one.is_true == Some(false) && one.is_inlier()),
        (palette::TRUTH, 2.0, |one| one.is_true != Some(false) && one.is_inlier()),
    ];
    for (color, width, is_kind) in kinds {
        let of_kind: Vec<&Matched<'_>> = matches.all.iter().filter(|one| is_kind(one)).collect();
        let stride = of_kind.len().div_ceil(MAX_LINES).max(1);
        for one in of_kind.into_iter().step_by(stride) {
            let [x, y] = place(one.reference);
            panel.line(color, width, [place(one.query), [x, y + top as f32]]);
        }
    }
    let beside = vec![reference_cloud(case)];
    Some(ProofPicture { large: panel, below: Some(funnel(&matches)), beside })
}

/// Both photos with their keypoints, where nothing was matched.
fn keypoints(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let (canvas, top) =
        picture::stacked(case.problem.query().photo(), case.problem.reference().photo());
    let mut panel = Panel::new("", canvas.into_rgb8());
    let mut counts = [None; 2];
    for event in case.all::<FeaturesDetected>() {
        let (at, down) = match event.side {
            Side::Query => (0, 0.0),
            Side::Reference => (1, top as f32),
        };
        counts[at] = Some(event.features.keypoints.len());
        for keypoint in &event.features.keypoints {
            let [x, y] = place(keypoint);
            panel.mark(Thing::Dot(palette::STATES[1]), [x, y + down], "");
        }
    }
    let [query, reference] = [counts[0]?, counts[1].unwrap_or(0)];
    panel.title = format!("Query above reference: {query} and {reference} keypoints");
    Some(ProofPicture { large: panel, below: None, beside: Vec::new() })
}

/// How many query features passed each step, side by side; what the truth says of them stands apart, in green.
fn funnel(matches: &Matches<'_>) -> Panel {
    const WIDTH: u32 = 720;
    const LONGEST: f32 = 88.0;
    const TOP: [f32; 3] = [8.0, 26.0, 40.0];
    let at_least = |index: usize| {
        let states = matches.states.iter();
        states.filter(|state| state.index() >= index).count()
    };
    const STEP: Color = [0x56, 0xB4, 0xE9];
    let mut steps = vec![
        ("detected", at_least(0), STEP),
        ("distinct", at_least(1), STEP),
        ("unique", at_least(2), STEP),
        ("with a depth", at_least(3), STEP),
        ("inliers", at_least(INLIER), STEP),
    ];
    if matches.all.iter().any(|one| one.is_true.is_some()) {
        let both = matches.inliers().filter(|one| one.is_true == Some(true));
        steps.push(("true matches", matches.true_ones().count(), palette::TRUTH));
        steps.push(("true inliers", both.count(), palette::TRUTH));
    }
    let mut panel = Panel::plain("Features of the query that passed each step", WIDTH, 46);
    let most = steps[0].1.max(1) as f32;
    let column = WIDTH as f32 / steps.len() as f32;
    for (at, (name, count, color)) in steps.into_iter().enumerate() {
        let left = column * at as f32 + 6.0;
        // By the root: the last steps keep so few that they would have no length.
        let length = LONGEST * (count as f32 / most).sqrt();
        panel.line(color, 5.0, [[left, TOP[2]], [left + length.max(1.0), TOP[2]]]);
        panel.mark(Thing::Words, [left, TOP[0]], count.to_string());
        panel.mark(Thing::Words, [left, TOP[1]], name);
    }
    panel
}

/// The depths around the matches whose depths differ most.
pub(super) fn depth_patches(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let matches = Matches::of(case)?;
    let spread = |one: &Matched<'_>| one.depth_range_m.map_or(-1.0, |(near, far)| far - near);
    let doubtful: Vec<&Matched<'_>> = matches
        .all
        .iter()
        .filter(|one| one.is_true != Some(true) && one.state.index() >= 2)
        .collect();
    let scan = ScanPixels::of(case);
    let nearest: Vec<f64> = doubtful.iter().map(|one| scan.nearest_px(one)).collect();
    // Wide ranges of depth first; of matches without a depth, those that a point of the cloud lies next to.
    let mut order: Vec<usize> = (0..doubtful.len()).collect();
    order.sort_by(|&a, &b| {
        let by_spread = spread(doubtful[b]).total_cmp(&spread(doubtful[a]));
        by_spread.then(nearest[a].total_cmp(&nearest[b]))
    });
    let missing = doubtful.iter().filter(|one| one.point.is_none()).count();
    let with_depth = doubtful.len() - missing;
    let judged = match case.truth {
        Some(_) => "false (orange)",
        None => "with a depth (orange)",
    };
    let reference = case.problem.reference();
    let mut large = Panel::new(
        format!(
            "Depths of the cloud. Matches: {with_depth} {judged}, {missing} without a depth (white)"
        ),
        cloud_picture(reference.photo(), [reference.intrinsics(); 2], case, &Pose::identity()).0,
    );
    for one in &doubtful {
        let color = match one.point {
            Some(_) => palette::ESTIMATE,
            None => NO_DEPTH,
        };
        large.mark(Thing::Dot(color), place(one.reference), "");
    }
    let radius_px = case.params.fb.depth_radius_px;
    let beside = order.into_iter().take(PATCHES).map(|at| {
        let one = doubtful[at];
        let title = match one.depth_range_m {
            Some((near, far)) if far - near < 0.05 => format!("{near:.1} m around this match"),
            Some((near, far)) => format!("{near:.1} to {far:.1} m around this match"),
            None => format!("None within {radius_px} px, next at {:.1} px", nearest[at]),
        };
        depth_patch(&large.picture, one, title)
    });
    Some(ProofPicture { beside: beside.collect(), large, below: Some(depth_legend()) })
}

/// Where the reference's photo shows the points of its cloud \[px\].
struct ScanPixels(Vec<Point2<f64>>);

impl ScanPixels {
    fn of(case: &ProofCase<'_>) -> Self {
        let reference = case.problem.reference();
        let camera = reference.intrinsics();
        let points = reference.cloud().points.iter();
        let seen = points.filter_map(|point| camera.project(&point.cast::<f64>()));
        Self(seen.filter(|pixel| camera.contains(pixel)).collect())
    }

    /// How far from a match's keypoint the nearest of them is.
    fn nearest_px(&self, one: &Matched<'_>) -> f64 {
        let at = one.reference.pixel();
        let distances = self.0.iter().map(|seen| (seen - at).norm());
        distances.fold(f64::INFINITY, f64::min)
    }
}

fn depth_patch(photo: &RgbImage, one: &Matched<'_>, title: String) -> Panel {
    let [x, y] = place(one.reference);
    let corner = |at: f32, length: u32| {
        (at as u32).saturating_sub(PATCH / 2).min(length.saturating_sub(PATCH))
    };
    let (left, top) = (corner(x, photo.width()), corner(y, photo.height()));
    let patch = image::imageops::crop_imm(photo, left, top, PATCH, PATCH).to_image();
    let large = image::imageops::resize(
        &patch,
        patch.width() * ENLARGED,
        patch.height() * ENLARGED,
        image::imageops::FilterType::Nearest,
    );
    let mut panel = Panel::new(title, large);
    let at = [x - left as f32, y - top as f32].map(|along| along * ENLARGED as f32);
    for [across, down] in [[1.0, 0.0], [0.0, 1.0]] {
        for side in [-1.0, 1.0] {
            let from = [at[0] + side * across * 6.0, at[1] + side * down * 6.0];
            let to = [at[0] + side * across * 30.0, at[1] + side * down * 30.0];
            panel.line([0xFF; 3], 1.5, [from, to]);
        }
    }
    panel
}

/// The inliers in the photo, and their points from above.
pub(super) fn inlier_spread(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let matches = Matches::of(case)?;
    let title = format!("The {} inliers in the query", matches.inliers().count());
    let mut large = Panel::photo(title, case.problem.query().photo());
    for one in matches.inliers() {
        large.mark(Thing::Dot(palette::TRUTH), place(one.query), "");
    }
    let points: Vec<Point3<f64>> = matches.inliers().filter_map(|one| one.point).collect();
    Some(ProofPicture { large, below: None, beside: vec![from_above(case, &points)] })
}

/// What the truth explains beside what the result explains.
pub(super) fn rival_inliers(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let matches = Matches::of(case)?;
    let panel = |title: String, ones: &mut dyn Iterator<Item = &Matched<'_>>| {
        let mut panel = Panel::photo(title, case.problem.query().photo());
        for one in ones {
            let color = if one.is_true == Some(true) { palette::TRUTH } else { palette::ESTIMATE };
            panel.mark(Thing::Dot(color), place(one.query), "");
        }
        panel
    };
    let (of_truth, of_result) = (matches.true_ones().count(), matches.inliers().count());
    let both = matches.inliers().filter(|one| one.is_true == Some(true));
    let large = panel(format!("The truth explains {of_truth} matches"), &mut matches.true_ones());
    let what = if case.pose().is_some() { "result" } else { "refused pose" };
    let result = panel(
        format!("The {what} explains {of_result} matches, {} of them true (green)", both.count()),
        &mut matches.inliers(),
    );
    Some(ProofPicture { large, below: None, beside: vec![result] })
}

/// The cloud on the reference's photo, and on the query's where its pose is known.
pub(super) fn cloud_on_photo(case: &ProofCase<'_>) -> Option<ProofPicture> {
    if let Some(cameras) = cloud_by_two_cameras(case) {
        return Some(cameras);
    }
    let (query, of_reference) = (case.problem.query(), case.problem.reference().intrinsics());
    let large = reference_cloud(case);
    let on_query = |what: &str, query_from_reference: &Pose| {
        let (picture, points) = cloud_picture(
            query.photo(),
            [query.intrinsics(), of_reference],
            case,
            query_from_reference,
        );
        Panel::new(
            format!("The same points in the query, from the {what}: {points} points"),
            picture,
        )
    };
    let truth = case.query_from_reference().map(|pose| on_query("truth", &pose));
    let found = case.pose().map(|pose| case.problem.reference_from_query(&pose).inverse());
    let result = found.map(|pose| on_query("result", &pose));
    Some(ProofPicture {
        large,
        below: Some(depth_legend()),
        beside: truth.into_iter().chain(result).collect(),
    })
}

/// The cloud on the reference's own photo. Its edges lie on those of the photo. If they do not, the cloud or its place
/// is wrong, no method can work, and all other verdicts follow from that.
pub(super) fn reference_cloud(case: &ProofCase<'_>) -> Panel {
    let reference = case.problem.reference();
    let (photo, points) =
        cloud_picture(reference.photo(), [reference.intrinsics(); 2], case, &Pose::identity());
    Panel::new(format!("Cloud on reference {}: {points} points", reference.name()), photo)
}

/// Where the verdict names another camera, of the query or of both photos: the cloud on the query's photo, seen from the
/// truth as stated and as named.
fn cloud_by_two_cameras(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let query = case.problem.query();
    let evidence = &case.result.diagnosis.first()?.evidence;
    let camera: Intrinsics = serde_json::from_value(evidence.get("camera")?.clone()).ok()?;
    let stated = [query.intrinsics(), case.problem.reference().intrinsics()].map(|camera| *camera);
    let is_of_both = evidence.get("right_depth_otherwise").is_some();
    let named = [camera, if is_of_both { camera } else { stated[1] }];
    let query_from_reference = case.query_from_reference()?;
    let seen_by = |what: &str, [camera, of_reference]: [Intrinsics; 2]| {
        let Intrinsics { fx, cx, cy, .. } = camera;
        let title = format!("{what}: {fx:.0} px, centre ({cx:.0}, {cy:.0})");
        let cameras = [&camera, &of_reference];
        Panel::new(title, cloud_picture(query.photo(), cameras, case, &query_from_reference).0)
    };
    Some(ProofPicture {
        large: seen_by("The cloud on the query at the truth, by the stated camera", stated),
        below: Some(depth_legend()),
        beside: vec![seen_by("The same by a better camera", named)],
    })
}

/// The colours of depths, with some of them in metres.
fn depth_legend() -> Panel {
    const SIZE: (u32, u32) = (560, 44);
    const STEPS: usize = 96;
    const DEPTHS_M: [f64; 6] = [2.0, 5.0, 10.0, 20.0, 40.0, 80.0];
    let (left, length) = (12.0, SIZE.0 as f32 - 60.0);
    let mut panel = Panel::plain("The colours of the depths", SIZE.0, SIZE.1);
    let x = |share: f64| left + length * share as f32;
    for step in 0..STEPS {
        let [from, to] = [step, step + 1].map(|end| end as f64 / STEPS as f64);
        let color = palette::turbo((from + to) / 2.0);
        panel.line(color, 12.0, [[x(from), 12.0], [x(to), 12.0]]);
    }
    for depth_m in DEPTHS_M {
        let at = x(palette::depth_share(depth_m));
        panel.mark(Thing::Words, [at - 6.0, 33.0], format!("{depth_m} m"));
    }
    panel
}

/// A darkened photo with those points of the cloud that the reference's photo shows, in the colours of their depths, near
/// ones above; and how many are in the picture. What the scan holds beside and behind, no method sees.
fn cloud_picture(
    photo: &Arc<Photo>,
    [camera, of_reference]: [&Intrinsics; 2],
    case: &ProofCase<'_>,
    camera_from_reference: &Pose,
) -> (RgbImage, usize) {
    let mut canvas = picture::photo(photo).into_rgb8();
    for pixel in canvas.pixels_mut() {
        pixel.0 = pixel.0.map(|value| value / 2);
    }
    let reference = case.problem.reference();
    let points = reference.cloud().points.iter().map(|point| point.cast::<f64>());
    let shown = points.filter(|point| {
        let pixel = of_reference.project(point);
        pixel.is_some_and(|pixel| of_reference.contains(&pixel))
    });
    let seen = shown.filter_map(|point| {
        let point = camera_from_reference * point;
        let pixel = camera.project(&point)?;
        camera.contains(&pixel).then_some((point.z, pixel))
    });
    let mut seen: Vec<(f64, Point2<f64>)> = seen.collect();
    seen.sort_by(|a, b| b.0.total_cmp(&a.0));
    let count = seen.len();
    // The photo stays visible between the points: a dense scan has smaller ones.
    let side = if count * DENSE < canvas.len() / 3 { 2 } else { 1 };
    for (depth_m, pixel) in seen {
        let (left, top) = (pixel.x.round() as u32, pixel.y.round() as u32);
        for (x, y) in (0..side * side).map(|at| (left + at % side, top + at / side)) {
            if let Some(here) = canvas.get_pixel_mut_checked(x, y) {
                *here = Rgb(palette::depth(depth_m));
            }
        }
    }
    (canvas, count)
}

/// The place of a keypoint in a picture, whose first pixel has its centre at (0.5, 0.5).
fn place(keypoint: &Keypoint) -> [f32; 2] {
    [keypoint.x + 0.5, keypoint.y + 0.5]
}
