//! Every event as data: one JSON object per line, for a notebook.
//!
//! Numbers and short lists are written whole, those of many things as one array for each of their
//! properties. What is a picture or as large as one is counted instead: descriptors, points of a cloud,
//! pixels of a view. What is not finite is `null`.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use crate::event::{DepthsLifted, Event, MatchesGuided, Moment, Side};
use crate::features::{FeatureState, MatchVerdict};
use crate::geometry::{Pose, matrix_from_pose};
use crate::grid::Offset;
use crate::method::Method;
use crate::problem::Problem;
use crate::render::Score;
use crate::robust::Hypothesis;
use crate::trace::Record;

/// The names of the scenes that frames are from.
#[derive(Clone, Debug, Default)]
pub struct SceneNames {
    /// That of the references.
    pub references: String,
    /// That of the query, where it is another.
    pub query: Option<String>,
}

/// Writes events of several queries, methods and references one after the other.
pub struct EventLines<W: Write> {
    writer: W,
}

impl<W: Write> EventLines<W> {
    /// Into this writer, which is worth a buffer.
    pub fn to(writer: W) -> Self {
        Self { writer }
    }

    /// Writes what a method told of a problem.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(
        &mut self,
        scenes: &SceneNames,
        problem: &Problem,
        method: Method,
        record: &Record,
    ) -> io::Result<()> {
        let query_scene = scenes.query.iter();
        let query_scene = query_scene.map(|name| ("query_scene".to_owned(), json!(name)));
        let head = [
            ("scene", json!(scenes.references)),
            ("radius_m", json!(problem.uncertainty_radius_m)),
            ("query", json!(problem.query.name)),
            ("reference", json!(problem.reference.name)),
            ("method", json!(method.name())),
            ("index", json!(record.index)),
            ("depth", json!(record.depth)),
            ("kind", json!(format!("{:?}", record.event.kind()))),
        ];
        let mut line = Map::new();
        line.extend(head.map(|(key, value)| (key.to_owned(), value)));
        line.extend(query_scene);
        if let Value::Object(data) = data(&record.event) {
            line.extend(data);
        }
        serde_json::to_writer(&mut self.writer, &line)?;
        self.writer.write_all(b"\n")
    }

    /// Writes what is left in a buffer, and hands the writer back.
    ///
    /// # Errors
    /// What the writer says.
    pub fn close(mut self) -> io::Result<W> {
        self.writer.flush()?;
        Ok(self.writer)
    }
}

/// What is told, without where.
fn data(event: &Event) -> Value {
    match event {
        Event::StageStarted(event) => json!({ "stage": event.stage.name() }),
        Event::StageEnded(event) => json!({
            "stage": event.stage.name(),
            "succeeded": event.succeeded,
            "reused": event.reused,
        }),
        Event::FeaturesDetected(event) => {
            let keypoints = &event.features.keypoints;
            let each = |part: fn(&crate::features::Keypoint) -> f32| -> Vec<f32> {
                keypoints.iter().map(part).collect()
            };
            json!({
                "side": match event.side {
                    Side::Query => "query",
                    Side::Reference => "reference",
                },
                "x_px": each(|keypoint| keypoint.x),
                "y_px": each(|keypoint| keypoint.y),
                "scale_px": each(|keypoint| keypoint.scale),
                "angle_rad": each(|keypoint| keypoint.angle),
                "response": each(|keypoint| keypoint.response),
                "descriptors": event.features.descriptors.len(),
            })
        }
        Event::MatchesDecided(event) => {
            let found: Vec<_> = event.decisions.iter().flatten().collect();
            json!({
                "query_keypoint": found.iter().map(|one| one.query).collect::<Vec<_>>(),
                "reference_keypoint": found.iter().map(|one| one.reference).collect::<Vec<_>>(),
                "distance": found.iter().map(|one| one.distance).collect::<Vec<_>>(),
                "ratio": found.iter().map(|one| one.ratio).collect::<Vec<_>>(),
                "verdict": found.iter().map(|one| match one.verdict {
                    MatchVerdict::Ambiguous => "ratio_failed",
                    MatchVerdict::NotUnique { .. } => "not_unique",
                    MatchVerdict::Candidate => "candidate",
                }).collect::<Vec<_>>(),
            })
        }
        Event::ProjectedCloud(event) => json!({
            "points": event.points,
            "in_view": event.in_view,
        }),
        Event::DepthsLifted(DepthsLifted { matches })
        | Event::MatchesGuided(MatchesGuided { matches }) => {
            json!({
                "query_keypoint": matches.iter().map(|one| one.query).collect::<Vec<_>>(),
                "reference_keypoint": matches.iter().map(|one| one.reference).collect::<Vec<_>>(),
                "lidar_distance_px": matches.iter().map(|one| one.lidar_distance_px).collect::<Vec<_>>(),
                "point_m": matches.iter().map(|one| {
                    one.point.map(|point| [point.x, point.y, point.z])
                }).collect::<Vec<_>>(),
            })
        }
        Event::HypothesisTried(event) => json!({
            "trial": event.trial.index,
            "sample": event.trial.sample,
            "hypothesis": event.trial.hypothesis.as_ref().map(hypothesis),
            "is_best": event.trial.is_best,
            "best": event.trial.best.as_ref().map(hypothesis),
            "trials_needed": event.trial.trials_needed,
        }),
        Event::PoseRefined(event) => json!({
            "reference_from_query": rows(&event.reference_from_query),
            "inliers": event.inliers,
            "correspondences": event.correspondences,
            "trials": event.trials,
        }),
        Event::ConsensusJudged(event) => json!({
            "inliers": event.acceptance.inliers,
            "counted": event.counted.name(),
            "log10_nfa": event.acceptance.log10_nfa,
            "needed": event.acceptance.needed,
            "distance_m": event.distance_m,
            "accepted": event.accepted,
        }),
        Event::FeaturesClassified(event) => json!({
            "state": event.states.iter().map(FeatureState::name).collect::<Vec<_>>(),
            "number": event.states.iter().map(number).collect::<Vec<_>>(),
        }),
        Event::CloudColored(event) => json!({ "points": event.cloud.points.len() }),
        Event::PoseScored(event) => json!({
            "phase": event.phase.name(),
            "evaluation": event.evaluation,
            "offset": offset(&event.offset),
            "score": score(&event.score),
            "coverage": event.coverage,
            "is_best": event.is_best,
        }),
        Event::PhaseSearched(event) => {
            let (surface, lattice) = (&event.surface, &event.surface.lattice);
            let scores = || surface.scores.iter();
            json!({
                "phase": lattice.phase.name(),
                "columns": lattice.columns,
                "rows": lattice.rows,
                "step": lattice.step,
                "centre": offset(&lattice.centre),
                "least_covered": surface.least_covered,
                "cost": scores().map(|one| one.and_then(|one| one.cost)).collect::<Vec<_>>(),
                "covered": scores().map(|one| one.map(|one| one.covered)).collect::<Vec<_>>(),
                "best": event.best.as_ref().map(offset),
            })
        }
        Event::ViewRendered(event) => json!({
            "moment": match event.moment {
                Moment::Start => "start",
                Moment::NewBest => "new_best",
                Moment::End => "end",
            },
            "evaluation": event.evaluation,
            "offset": offset(&event.offset),
            "score": score(&event.comparison.score),
            "pixels": event.comparison.view.pixels.len(),
        }),
        Event::DescentStepped(event) => json!({
            "level": event.level,
            "step": event.step,
            "reference_from_camera": rows(&event.reference_from_camera),
            "smooth_cost": event.smooth_cost,
            "score": score(&event.score),
        }),
        Event::MinimumAssessed(event) => json!({
            "offset": offset(&event.offset),
            "initial": event.initial,
            "best": event.best,
            "shuffled": event.shuffled,
            "runner_up": event.runner_up,
        }),
        Event::BranchTaken(event) => json!({
            "taken": event.method.name(),
            "why": event.why,
        }),
        Event::ReferencesFused(event) => json!({
            "fusion": event.fusion,
            "references": event.shares.iter().map(|share| &share.reference).collect::<Vec<_>>(),
            "matches": event.shares.iter().map(|share| share.matches).collect::<Vec<_>>(),
            "weight": event.shares.iter().map(|share| share.weight).collect::<Vec<_>>(),
            "world_from_camera": event.pose.as_ref().map(rows),
        }),
        Event::ReferencesRanked(event) => {
            let frames = &event.ranking.frames;
            json!({
                "candidates": event.ranking.candidates,
                "chosen": event.ranking.chosen,
                "references": frames.iter().map(|one| &one.name).collect::<Vec<_>>(),
                "score": frames.iter().map(|one| one.ranked.score).collect::<Vec<_>>(),
            })
        }
        Event::StartsRefined(event) => json!({
            "freedoms": format!("{:?}", event.freedoms),
            "cost": event.refinements.iter().map(|one| one.cost).collect::<Vec<_>>(),
            "evaluations": event.refinements.iter().map(|one| one.evaluations).collect::<Vec<_>>(),
            "reference_from_camera": event.refinements.iter().map(|one| rows(&one.pose)).collect::<Vec<_>>(),
        }),
        Event::CandidatesJudged(event) => json!({
            "methods": event.candidates.iter().map(|one| one.method.name()).collect::<Vec<_>>(),
            "cost": event.candidates.iter().map(|one| one.refined.cost).collect::<Vec<_>>(),
            "from_features": event.candidates.iter().map(|one| one.from_features).collect::<Vec<_>>(),
            "accepted": event.candidates.iter().map(|one| one.accepted).collect::<Vec<_>>(),
            "deviations": event.deviations,
            "needed": event.needed,
            "why": event.why,
        }),
    }
}

fn offset(offset: &Offset) -> Value {
    json!({
        "right_m": offset.right_m,
        "forward_m": offset.forward_m,
        "yaw_deg": offset.yaw_rad.to_degrees(),
    })
}

fn score(score: &Score) -> Value {
    json!({ "cost": score.cost, "covered": score.covered })
}

fn hypothesis(hypothesis: &Hypothesis) -> Value {
    json!({
        "log_likelihood": hypothesis.score.log_likelihood,
        "inliers": hypothesis.score.inliers,
    })
}

/// `[R|t]`, row by row.
fn rows(pose: &Pose) -> Vec<Vec<f64>> {
    let matrix = matrix_from_pose(pose);
    let rows = matrix.row_iter();
    rows.map(|row| row.iter().copied().collect()).collect()
}

/// What decided the state of a feature: a ratio, a rival's number, pixels.
fn number(state: &FeatureState) -> Option<f64> {
    match *state {
        FeatureState::RatioFailed { ratio } => Some(f64::from(ratio)),
        FeatureState::NotUnique { rival } => Some(rival as f64),
        FeatureState::NoDepth { distance_px } => Some(distance_px),
        FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px } => {
            Some(residual_px)
        }
    }
}
