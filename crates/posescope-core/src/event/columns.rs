//! How events are written as data: things of which there are many as one array for each property, and pictures
//! as counts.

use nalgebra::Point3;
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

use super::JudgedPose;
use crate::depth::LiftedMatch;
use crate::features::{FeatureState, Features, Keypoint, Match, MatchVerdict};
use crate::fusion::share::Share;
use crate::geometry::{Pose, matrix_from_pose};
use crate::grid::ScoredLattice;
use crate::render::{ColoredCloud, Comparison, Score};
use crate::retrieval::{RankedReference, ReferenceRanking};
use crate::search::Refined;

/// Writes the entries of a map; `name: things => property` is an array.
macro_rules! entries {
    ($serializer:ident, $($name:ident: $value:expr $(=> $property:expr)?),+ $(,)?) => {{
        let mut map = $serializer.serialize_map(None)?;
        $(map.serialize_entry(stringify!($name), &entries!(@ $value $(, $property)?))?;)+
        map.end()
    }};
    (@ $value:expr) => { $value };
    (@ $things:expr, $property:expr) => { $things.iter().map($property).collect::<Vec<_>>() };
}

pub(super) fn features<S: Serializer>(features: &Features, to: S) -> Result<S::Ok, S::Error> {
    let keypoints = &features.keypoints;
    // As wide as all other numbers, so that 0.1 is not another number here.
    let wide = |part: fn(&Keypoint) -> f32| move |keypoint: &Keypoint| f64::from(part(keypoint));
    entries!(to,
        x_px: keypoints => wide(|keypoint| keypoint.x),
        y_px: keypoints => wide(|keypoint| keypoint.y),
        scale_px: keypoints => wide(|keypoint| keypoint.scale),
        angle_rad: keypoints => wide(|keypoint| keypoint.angle),
        response: keypoints => wide(|keypoint| keypoint.response),
        descriptors: features.descriptors.len(),
    )
}

pub(super) fn decisions<S: Serializer>(
    decisions: &[Option<Match>],
    to: S,
) -> Result<S::Ok, S::Error> {
    let found: Vec<&Match> = decisions.iter().flatten().collect();
    entries!(to,
        query_keypoint: found => |one| one.query,
        reference_keypoint: found => |one| one.reference,
        distance: found => |one| f64::from(one.distance),
        ratio: found => |one| f64::from(one.ratio),
        verdict: found => |one| match one.verdict {
            MatchVerdict::Ambiguous => "ratio_failed",
            MatchVerdict::NotUnique { .. } => "not_unique",
            MatchVerdict::Candidate => "candidate",
        },
    )
}

pub(super) fn lifted<S: Serializer>(matches: &[LiftedMatch], to: S) -> Result<S::Ok, S::Error> {
    entries!(to,
        query_keypoint: matches => |one| one.query,
        reference_keypoint: matches => |one| one.reference,
        lidar_distance_px: matches => |one| one.lidar_distance_px,
        point_m: matches => |one| one.point.map(|Point3 { coords }| <[f64; 3]>::from(coords)),
    )
}

pub(super) fn states<S: Serializer>(states: &[FeatureState], to: S) -> Result<S::Ok, S::Error> {
    entries!(to,
        state: states => FeatureState::name,
        number: states => FeatureState::number,
    )
}

pub(super) fn surface<S: Serializer>(surface: &ScoredLattice, to: S) -> Result<S::Ok, S::Error> {
    let (lattice, scores) = (&surface.lattice, &surface.scores);
    entries!(to,
        phase: lattice.phase,
        columns: lattice.columns,
        rows: lattice.rows,
        step: lattice.step,
        centre: lattice.centre,
        least_covered: surface.least_covered,
        cost: scores => |score| score.and_then(|score| score.cost),
        covered: scores => |score| score.map(|score| score.covered),
    )
}

pub(super) fn shares<S: Serializer>(shares: &[Share], to: S) -> Result<S::Ok, S::Error> {
    entries!(to,
        references: shares => |share| &share.reference,
        matches: shares => |share| share.matches,
        weight: shares => |share| share.weight,
    )
}

pub(super) fn ranking<S: Serializer>(ranking: &ReferenceRanking, to: S) -> Result<S::Ok, S::Error> {
    let frames = &ranking.frames;
    entries!(to,
        candidates: ranking.candidates,
        chosen: ranking.chosen,
        references: frames => |one| &one.name,
        score: frames => |one: &RankedReference| f64::from(one.ranked.score),
    )
}

pub(super) fn refinements<S: Serializer>(all: &[Refined], to: S) -> Result<S::Ok, S::Error> {
    entries!(to,
        cost: all => |one| one.cost,
        evaluations: all => |one| one.evaluations,
        reference_from_camera: all => |one| Rows::of(&one.pose),
    )
}

pub(super) fn candidates<S: Serializer>(all: &[JudgedPose], to: S) -> Result<S::Ok, S::Error> {
    entries!(to,
        methods: all => |one| one.method,
        cost: all => |one| one.refined.cost,
        from_features: all => |one| one.from_features,
        accepted: all => |one| one.accepted,
    )
}

pub(super) fn points<S: Serializer>(cloud: &ColoredCloud, to: S) -> Result<S::Ok, S::Error> {
    cloud.points.len().serialize(to)
}

pub(super) fn comparison<S: Serializer>(shown: &Comparison, to: S) -> Result<S::Ok, S::Error> {
    let score: Score = shown.score;
    entries!(to, score: score, pixels: shown.view.pixels.len())
}

/// `[R|t]`, row by row.
#[derive(Serialize)]
struct Rows([[f64; 4]; 3]);

impl Rows {
    fn of(pose: &Pose) -> Self {
        Self(matrix_from_pose(pose).transpose().into())
    }
}

pub(super) fn rows<S: Serializer>(pose: &Pose, to: S) -> Result<S::Ok, S::Error> {
    Rows::of(pose).serialize(to)
}

pub(super) fn rows_if_any<S: Serializer>(pose: &Option<Pose>, to: S) -> Result<S::Ok, S::Error> {
    pose.as_ref().map(Rows::of).serialize(to)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::{Value, json};

    use crate::event::*;
    use crate::retrieval::{Criterion, Geometry, Ranked, RankedReference};
    use crate::robust::{Hypothesis, LikelihoodScore};
    use crate::search::Start;

    fn data(event: impl Into<Event>) -> Value {
        serde_json::to_value(event.into()).expect("an object")
    }

    #[test]
    fn a_picture_is_counted_and_what_there_is_many_of_is_an_array_for_each_property() {
        let keypoint = crate::features::Keypoint {
            x: 0.5,
            y: 1.0,
            scale: 2.0,
            angle: 0.1,
            response: f32::NAN,
            laplacian_positive: true,
        };
        assert_eq!(
            data(FeaturesDetected {
                side: Side::Query,
                features: Arc::new(Features {
                    keypoints: vec![keypoint],
                    descriptors: Default::default(),
                }),
            }),
            json!({"kind": "FeaturesDetected", "side": "query", "x_px": [0.5], "y_px": [1.0],
                "scale_px": [2.0], "angle_rad": [f64::from(0.1_f32)], "response": [null],
                "descriptors": 0})
        );
        let one = Match {
            query: 3,
            reference: 4,
            distance: 0.25,
            ratio: 0.5,
            verdict: MatchVerdict::Ambiguous,
        };
        assert_eq!(
            data(MatchesDecided { decisions: [None, Some(one)].into() }),
            json!({"kind": "MatchesDecided", "query_keypoint": [3], "reference_keypoint": [4],
                "distance": [0.25], "ratio": [0.5], "verdict": ["ratio_failed"]})
        );
        let lifted = LiftedMatch {
            query: 3,
            reference: 4,
            lidar_distance_px: 1.5,
            depth_range_m: None,
            point: Some([1.0, 2.0, 3.0].into()),
        };
        for (kind, event) in [
            ("DepthsLifted", data(DepthsLifted { matches: [lifted].into() })),
            ("MatchesGuided", data(MatchesGuided { matches: [lifted].into() })),
        ] {
            assert_eq!(
                event,
                json!({"kind": kind, "query_keypoint": [3], "reference_keypoint": [4],
                    "lidar_distance_px": [1.5], "point_m": [[1.0, 2.0, 3.0]]})
            );
        }
        let states = [
            FeatureState::RatioFailed { ratio: 0.5 },
            FeatureState::NotUnique { rival: 7 },
            FeatureState::Outlier { residual_px: f64::INFINITY },
        ];
        assert_eq!(
            data(FeaturesClassified { states: states.into() }),
            json!({"kind": "FeaturesClassified", "number": [0.5, 7.0, null],
                "state": ["ratio_failed", "not_unique", "outlier"]})
        );
        let cloud = Arc::default();
        assert_eq!(data(CloudColored { cloud }), json!({"kind": "CloudColored", "points": 0}));
    }

    #[test]
    fn a_number_has_the_name_and_unit_that_readers_know() {
        let offset = Offset { right_m: 1.0, forward_m: 2.0, yaw_rad: 0.0 };
        let offset_text = json!({"right_m": 1.0, "forward_m": 2.0, "yaw_deg": 0.0});
        let score = Score { cost: Some(0.5), covered: 9 };
        assert_eq!(
            data(PoseScored {
                phase: Phase::YawFine,
                evaluation: 6,
                offset,
                score,
                coverage: 0.25,
                is_best: true,
            }),
            json!({"kind": "PoseScored", "phase": "yaw, fine", "evaluation": 6,
                "offset": offset_text, "score": {"cost": 0.5, "covered": 9}, "coverage": 0.25,
                "is_best": true})
        );
        let hypothesis = Hypothesis {
            pose: Pose::identity(),
            score: LikelihoodScore { log_likelihood: -2.0, mixing: 0.5, inliers: 8 },
        };
        assert_eq!(
            data(HypothesisTried {
                trial: Trial {
                    index: 2,
                    sample: [5, 6, 7],
                    hypothesis: Some(hypothesis),
                    is_best: false,
                    best: None,
                    trials_needed: 30,
                },
            }),
            json!({"kind": "HypothesisTried", "trial": 2, "sample": [5, 6, 7],
                "hypothesis": {"log_likelihood": -2.0, "inliers": 8}, "is_best": false,
                "best": null, "trials_needed": 30})
        );
        assert_eq!(
            data(ConsensusJudged {
                acceptance: Acceptance { inliers: 8, log10_nfa: -3.0, needed: None },
                counted: Counted::Places,
                distance_m: 1.5,
                accepted: true,
            }),
            json!({"kind": "ConsensusJudged", "inliers": 8, "log10_nfa": -3.0, "needed": null,
                "counted": "places", "distance_m": 1.5, "accepted": true})
        );
        let refined = Refined {
            start: Start { pose: Pose::identity(), cost: 0.9 },
            pose: Pose::translation(1.0, 2.0, 3.0),
            cost: 0.5,
            evaluations: 70,
        };
        let pose = json!([[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0]]);
        assert_eq!(
            data(StartsRefined { freedoms: Freedoms::Six, refinements: [refined].into() }),
            json!({"kind": "StartsRefined", "freedoms": "Six", "cost": [0.5],
                "evaluations": [70], "reference_from_camera": [pose]})
        );
        assert_eq!(
            data(ReferencesFused {
                fusion: "r-wavg",
                shares: [].into(),
                pose: Some(Pose::translation(1.0, 2.0, 3.0)),
            }),
            json!({"kind": "ReferencesFused", "fusion": "r-wavg", "references": [], "matches": [],
                "weight": [], "world_from_camera": pose})
        );
        let frame = RankedReference {
            name: "000004".to_owned(),
            world_from_camera: None,
            ranked: Ranked { frame: 4, score: 0.5, geometry: Geometry::Refused },
        };
        assert_eq!(
            data(ReferencesRanked {
                ranking: Arc::new(ReferenceRanking {
                    criterion: Criterion::Words,
                    candidates: 40,
                    chosen: 1,
                    frames: vec![frame],
                }),
                photos: [None].into(),
            }),
            json!({"kind": "ReferencesRanked", "candidates": 40, "chosen": 1,
                "references": ["000004"], "score": [0.5]})
        );
        assert_eq!(
            data(DescentStepped {
                level: 1,
                step: 2,
                reference_from_camera: Pose::translation(1.0, 2.0, 3.0),
                smooth_cost: 0.25,
                score,
            }),
            json!({"kind": "DescentStepped", "level": 1, "step": 2, "reference_from_camera": pose,
                "smooth_cost": 0.25, "score": {"cost": 0.5, "covered": 9}})
        );
        assert_eq!(
            data(BranchTaken { method: Method::MI, why: "few".to_owned() }),
            json!({"kind": "BranchTaken", "taken": "mi", "why": "few"})
        );
    }
}
