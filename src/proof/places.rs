//! Proofs on a map: where cameras are, and which references were ranked.

use nalgebra::Point3;

use super::{Panel, ProofCase, ProofPicture, Thing, is_near};
use crate::event::{PoseRefined, ReferencesFused, ReferencesRanked};
use crate::geometry::Pose;
use crate::palette;
use crate::retrieval::ReferenceRanking;

/// Side of a map \[px\], and what is left free at its border.
const SIDE: u32 = 560;
const BORDER: f64 = 40.0;
/// Half of what a map shows at least \[m\].
const MIN_REACH_M: f64 = 2.0;
/// What is nearer to the reference than this has one label with it \[px\].
const SAME_PX: f32 = 8.0;
/// Ranked frames that are shown.
const RANKED: usize = 4;

/// A map from above in the frame of the reference, its front upwards.
struct Map {
    panel: Panel,
    centre_m: [f64; 2],
    px_per_m: f64,
}

impl Map {
    /// A map on which all these places are: metres to the right of the reference and ahead of it.
    fn around(title: &str, places: &[[f64; 2]]) -> Self {
        let ends = |axis: usize| {
            let values = || places.iter().map(|place| place[axis]);
            (values().fold(0.0, f64::min), values().fold(0.0, f64::max))
        };
        let (across, along) = (ends(0), ends(1));
        let reach_m = f64::max(across.1 - across.0, along.1 - along.0) / 2.0;
        let px_per_m = (f64::from(SIDE) / 2.0 - BORDER) / reach_m.max(MIN_REACH_M);
        let mut map = Self {
            panel: Panel::plain("", SIDE, SIDE),
            centre_m: [(across.0 + across.1) / 2.0, (along.0 + along.1) / 2.0],
            px_per_m,
        };
        let step_m = map.draw_grid();
        map.panel.title = format!("{title}, a square is {step_m} m");
        map
    }

    /// Lines at round distances; returns the distance \[m\].
    fn draw_grid(&mut self) -> f64 {
        let shown_m = f64::from(SIDE) / self.px_per_m;
        let steps = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
        let step_m = steps.into_iter().find(|step| shown_m / step <= 12.0).unwrap_or(1000.0);
        let count = (shown_m / step_m).ceil() as i32 + 1;
        let side = SIDE as f32;
        let first =
            [0, 1].map(|axis| ((self.centre_m[axis] - shown_m / 2.0) / step_m).floor() * step_m);
        for step in 0..=count {
            let at = [0, 1].map(|axis| first[axis] + f64::from(step) * step_m);
            let [x, y] = self.place(at);
            self.panel.line([0x38; 3], 1.0, [[x, 0.0], [x, side]]);
            self.panel.line([0x38; 3], 1.0, [[0.0, y], [side, y]]);
        }
        step_m
    }

    fn place(&self, [right_m, forward_m]: [f64; 2]) -> [f32; 2] {
        let middle = f64::from(SIDE) / 2.0;
        [
            (middle + (right_m - self.centre_m[0]) * self.px_per_m) as f32,
            (middle - (forward_m - self.centre_m[1]) * self.px_per_m) as f32,
        ]
    }

    /// A camera with the direction in which it looks.
    fn camera(&mut self, thing: Thing, reference_from_camera: &Pose, label: &str) {
        let at = self.place(ground(reference_from_camera));
        let ahead = reference_from_camera.rotation * nalgebra::Vector3::z();
        let length = 26.0;
        let tip = [at[0] + length * ahead.x as f32, at[1] - length * ahead.z as f32];
        self.panel.line(thing.color(), 2.0, [at, tip]);
        self.panel.mark(thing, at, label);
    }

    /// The reference, the result and the truth. If reference and truth coincide, they share a label.
    fn cameras(
        &mut self,
        case: &ProofCase<'_>,
        name: &str,
        result: Option<&Pose>,
        truth: Option<&Pose>,
    ) {
        let origin = self.place([0.0, 0.0]);
        let is_same = truth.is_some_and(|pose| is_near(self.place(ground(pose)), origin, SAME_PX));
        let of_truth = if is_same { "truth, at the reference" } else { "truth" };
        let of_reference = if is_same { "" } else { name };
        self.camera(Thing::Reference, &Pose::identity(), of_reference);
        let grade = palette::grade(case.result.grade);
        if let Some(pose) = result {
            let label = if case.result.pose.is_some() { "result" } else { "refused pose" };
            self.camera(Thing::Result(grade), pose, label);
        }
        if let Some(pose) = truth {
            self.camera(Thing::Truth, pose, of_truth);
        }
    }

    fn circle(&mut self, [right_m, forward_m]: [f64; 2], radius_m: f64) {
        let points = (0..=96).map(|step| {
            let angle = f64::from(step) * std::f64::consts::TAU / 96.0;
            self.place([right_m + radius_m * angle.cos(), forward_m + radius_m * angle.sin()])
        });
        let points: Vec<[f32; 2]> = points.collect();
        self.panel.line([0x90; 3], 1.5, points);
    }
}

/// Two corners of the square around a circle.
fn square([right_m, forward_m]: [f64; 2], radius_m: f64) -> [[f64; 2]; 2] {
    [-radius_m, radius_m].map(|by_m| [right_m + by_m, forward_m + by_m])
}

/// Metres to the right and ahead.
fn ground(reference_from_camera: &Pose) -> [f64; 2] {
    let place = reference_from_camera.translation.vector;
    [place.x, place.z]
}

/// Reference, truth and result, or the pose that was refused, and what each reference of a fusion gave alone.
pub(super) fn pose_map(case: &ProofCase<'_>) -> ProofPicture {
    let problem = case.problem;
    let in_reference = |pose: &Pose| problem.reference_from_query(pose);
    let truth = case.truth.map(in_reference);
    let refused = || Some(case.latest::<PoseRefined>()?.reference_from_query);
    let result = case.pose().as_ref().map(in_reference).or_else(refused);
    let fused = case.latest::<ReferencesFused>();
    let shares = fused.map_or(&[][..], |fused| &fused.shares);
    let each = shares.iter().filter_map(|share| Some((share, in_reference(share.pose.as_ref()?))));
    let each: Vec<_> = each.collect();
    let poses = truth.iter().chain(&result).chain(each.iter().map(|(_, pose)| pose));
    let mut places: Vec<[f64; 2]> = poses.map(ground).collect();
    let radius_m = problem.believed_within_m();
    let is_alone = shares.is_empty();
    if is_alone {
        places.extend(square([0.0; 2], radius_m));
    }
    let mut map = Map::around("Poses from above", &places);
    if is_alone {
        map.circle([0.0; 2], radius_m);
    }
    let name = format!("reference {}", problem.reference().name());
    for (share, pose) in &each {
        let label = format!("{} alone, weight {:.2}", share.reference, share.weight);
        map.camera(Thing::Dot(palette::UNDECIDED), pose, &label);
    }
    map.cameras(case, &name, result.as_ref(), truth.as_ref());
    ProofPicture {
        large: map.panel,
        below: None,
        beside: vec![
            Panel::photo("Query", problem.query().photo()),
            Panel::photo(
                format!("Reference {}", problem.reference().name()),
                problem.reference().photo(),
            ),
        ],
    }
}

/// Points with the cameras, from above.
pub(super) fn from_above(case: &ProofCase<'_>, points: &[Point3<f64>]) -> Panel {
    let mut places: Vec<[f64; 2]> = points.iter().map(|point| [point.x, point.z]).collect();
    let truth = case.truth.map(|pose| case.problem.reference_from_query(pose));
    let result = case.pose().map(|pose| case.problem.reference_from_query(&pose));
    places.extend(truth.iter().chain(&result).map(ground));
    let mut map = Map::around("The points of the inliers from above", &places);
    for point in points {
        let at = map.place([point.x, point.z]);
        map.panel.mark(Thing::Dot(palette::TRUTH), at, "");
    }
    map.cameras(case, "reference", result.as_ref(), truth.as_ref());
    map.panel
}

/// The query and the frames that were ranked first, with how far each is from the truth.
pub(super) fn ranking(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let event = case.latest::<ReferencesRanked>()?;
    let ranking = &event.ranking;
    let mut beside = Vec::new();
    for (rank, (frame, photo)) in
        ranking.pictured().iter().zip(event.photos.iter()).enumerate().take(RANKED)
    {
        let Some(photo) = photo else { continue };
        let away_m = case
            .truth
            .zip(frame.world_from_camera)
            .map(|(truth, pose)| (pose.translation.vector - truth.translation.vector).norm());
        let away = away_m.map_or(String::new(), |away_m| format!(", {away_m:.1} m from the truth"));
        let is_taken = if rank < ranking.chosen { ", taken" } else { "" };
        let title = format!("{}. {}{away}{is_taken}", rank + 1, frame.name);
        let mut panel = Panel::photo(title, photo);
        if away_m.is_some_and(|away_m| away_m <= case.problem.uncertainty_radius_m()) {
            let (width, height) = (panel.picture.width() as f32, panel.picture.height() as f32);
            let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height], [0.0, 0.0]];
            panel.line(palette::TRUTH, 6.0, corners);
        }
        beside.push(panel);
    }
    beside.extend(narrowed(case, ranking));
    Some(ProofPicture {
        large: Panel::photo("Query", case.problem.query().photo()),
        below: None,
        beside,
    })
}

/// How retrieval narrows down where the query is: from the prior around its position to the radius around the
/// first of the ranked frames. `None` where there is no prior, or no position.
fn narrowed(case: &ProofCase<'_>, ranking: &ReferenceRanking) -> Option<Panel> {
    let problem = case.problem;
    let [prior_m, radius_m] = [problem.prior_m()?, problem.uncertainty_radius_m()];
    let truth = problem.reference_from_query(case.truth?);
    let frames = ranking.pictured().iter().take(RANKED);
    let poses = frames.map(|frame| Some(problem.reference_from_query(&frame.world_from_camera?)));
    let poses: Vec<Option<Pose>> = poses.collect();
    let circles = [(ground(&truth), prior_m), ([0.0; 2], radius_m)];
    let mut places = circles.map(|(centre, radius)| square(centre, radius)).concat();
    places.extend(poses.iter().flatten().map(ground));
    let mut map = Map::around("Prior and radius", &places);
    for (centre, radius) in circles {
        map.circle(centre, radius);
    }
    for (rank, pose) in poses.iter().enumerate() {
        let Some(pose) = pose else { continue };
        map.camera(Thing::Reference, pose, &format!("{}.", rank + 1));
    }
    map.camera(Thing::Truth, &truth, "truth");
    Some(map.panel)
}
