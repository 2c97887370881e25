//! Records FB: keypoints, matches, RANSAC, funnel, rays.

use std::sync::Arc;

use nalgebra::Point3;
use rerun::{BarChart, Clear, LineStrips2D, Points2D, Radius, Scalars, TextDocument};

use super::encode::jpeg;
use super::entities::{self, UNDECIDED};
use super::scene::{EventContext, log_rays};
use super::stream::Stream;
use crate::depth::LiftedMatch;
use crate::event::{DepthsLifted, Event, FeaturesDetected, HypothesisTried, MatchesGuided, Side};
use crate::features::FeatureState;
use crate::features::{Features, Match, MatchVerdict};
use crate::geometry::Pose;
use crate::palette::{self, Rgb};
use crate::picture;

/// The state of FB that later events need.
#[derive(Default)]
pub(super) struct FeatureContext {
    query: Arc<Features>,
    reference: Arc<Features>,
    decisions: Arc<[Option<Match>]>,
    lifted: Arc<[LiftedMatch]>,
    reference_from_query: Option<Pose>,
    /// The first row of the reference photo on the canvas.
    canvas_top: u32,
    likelihoods: Vec<(i64, f64)>,
    inliers: Vec<(i64, f64)>,
}

impl FeatureContext {
    /// Records one event.
    pub(super) fn tell(&mut self, event: &Event, context: &EventContext<'_>, stream: &mut Stream) {
        match event {
            Event::FeaturesDetected(detected) => self.detected(detected, context, stream),
            Event::MatchesDecided(decided) => {
                self.decisions = Arc::clone(&decided.decisions);
                self.canvas(context, stream);
                self.undecided(context, stream);
            }
            Event::DepthsLifted(DepthsLifted { matches })
            | Event::MatchesGuided(MatchesGuided { matches }) => {
                self.lifted = Arc::clone(matches);
            }
            Event::HypothesisTried(tried) => self.tried(tried, context.evals, stream),
            Event::PoseRefined(refined) => {
                self.reference_from_query = Some(refined.reference_from_query);
            }
            Event::FeaturesClassified(classified) => {
                self.classified(&classified.states, context, stream);
            }
            _ => {}
        }
    }

    /// Records the trials, which are collected until a stage is over.
    pub(super) fn tell_trials(&mut self, stream: &mut Stream) {
        stream.log_scalars(entities::RANSAC_LIKELIHOOD, &mut self.likelihoods);
        stream.log_scalars(entities::RANSAC_INLIERS, &mut self.inliers);
    }

    fn detected(
        &mut self,
        event: &FeaturesDetected,
        context: &EventContext<'_>,
        stream: &mut Stream,
    ) {
        let FeaturesDetected { side, features } = event;
        match side {
            Side::Query => self.query = Arc::clone(features),
            Side::Reference => self.reference = Arc::clone(features),
        }
        let pixels = features.keypoints.iter().map(|keypoint| shown([keypoint.x, keypoint.y]));
        let points = Points2D::new(pixels)
            .with_radii(features.keypoints.iter().map(|keypoint| keypoint.scale))
            .with_colors([super::color(palette::UNDECIDED)]);
        stream.log(&entities::detected(*side, context.reference), &points);
    }

    fn canvas(&mut self, context: &EventContext<'_>, stream: &mut Stream) {
        let problem = context.problem;
        let (query, reference) = (problem.query().photo(), problem.reference().photo());
        self.canvas_top = picture::row_below(query);
        if context.is_first_match {
            let (canvas, _) = picture::stacked(query, reference);
            stream.log_image(&entities::matches(context.reference), jpeg(&canvas));
        }
    }

    fn undecided(&self, context: &EventContext<'_>, stream: &mut Stream) {
        let matches: Vec<usize> = self
            .decisions
            .iter()
            .flatten()
            .filter(|decision| decision.verdict == MatchVerdict::Candidate)
            .map(|decision| decision.query)
            .collect();
        let lines = self.lines(&matches, palette::UNDECIDED);
        stream.log(&entities::matches_in_state(context.reference, UNDECIDED), &lines);
    }

    /// Lines from query keypoints, by index, to their nearest reference keypoints.
    fn lines(&self, members: &[usize], color: Rgb) -> LineStrips2D {
        let ends = members.iter().filter_map(|&query| {
            let from = self.query.keypoints.get(query)?;
            let decision = self.decisions.get(query)?.as_ref()?;
            let to = self.reference.keypoints.get(decision.reference)?;
            let below = to.y + self.canvas_top as f32;
            Some([shown([from.x, from.y]), shown([to.x, below])])
        });
        LineStrips2D::new(ends)
            .with_colors([super::color(color)])
            .with_radii([Radius::new_ui_points(0.75)])
    }

    fn tried(&mut self, event: &HypothesisTried, evals: i64, stream: &mut Stream) {
        let trial = &event.trial;
        let eval = evals + trial.index as i64;
        if let Some(hypothesis) = &trial.hypothesis {
            let score = &hypothesis.score;
            self.likelihoods.push((eval, score.log_likelihood));
            self.inliers.push((eval, score.inliers as f64));
        }
        if let (true, Some(best)) = (trial.is_best, &trial.best) {
            stream.set_eval(Some(eval));
            let inliers = Scalars::single(best.score.inliers as f64);
            stream.log(entities::RANSAC_BEST, &inliers);
            stream.set_eval(None);
        }
    }

    fn classified(&self, states: &[FeatureState], context: &EventContext<'_>, stream: &mut Stream) {
        stream.log(entities::QUERY_DETECTED, &Clear::flat());
        stream.log(&entities::matches_in_state(context.reference, UNDECIDED), &Clear::flat());
        for (index, name) in FeatureState::NAMES.into_iter().enumerate() {
            let members: Vec<usize> =
                (0..states.len()).filter(|&query| states[query].index() == index).collect();
            let color = palette::STATES[index];
            let points = self.points(&members, states, color);
            stream.log(&entities::query_keypoints(name), &points);
            let lines = self.lines(&members, color);
            stream.log(&entities::matches_in_state(context.reference, name), &lines);
        }
        self.funnel(states, stream);
        self.rays(states, context, stream);
    }

    /// Keypoints in one state, labelled with the number that decided it.
    fn points(&self, members: &[usize], states: &[FeatureState], color: Rgb) -> Points2D {
        let pixels = members.iter().filter_map(|&query| {
            let keypoint = self.query.keypoints.get(query)?;
            Some(shown([keypoint.x, keypoint.y]))
        });
        Points2D::new(pixels)
            .with_colors([super::color(color)])
            .with_radii([Radius::new_ui_points(3.0)])
            .with_labels(members.iter().map(|&query| decided_by(&states[query])))
            .with_show_labels(false)
    }

    fn funnel(&self, states: &[FeatureState], stream: &mut Stream) {
        let rows = funnel(states);
        let counts: Vec<u64> = rows.iter().map(|(_, count)| *count as u64).collect();
        stream.log(entities::FUNNEL, &BarChart::new(counts));
        let mut table = "| features | count |\n|:--|--:|\n".to_owned();
        for (name, count) in rows {
            table.push_str(&format!("| {name} | {count} |\n"));
        }
        stream.log(entities::FUNNEL_TABLE, &TextDocument::from_markdown(table));
    }

    fn rays(&self, states: &[FeatureState], context: &EventContext<'_>, stream: &mut Stream) {
        let Some(pose) = &self.reference_from_query else {
            return;
        };
        let centre = Point3::from(pose.translation.vector);
        for name in ["inlier", "outlier"] {
            let members = self.lifted.iter().filter(|lifted| {
                states.get(lifted.query).is_some_and(|state| state.name() == name)
            });
            let points: Vec<Point3<f64>> = members.filter_map(|lifted| lifted.point).collect();
            let color = if name == "inlier" { palette::TRUTH } else { palette::ESTIMATE };
            let path = entities::correspondences(name);
            log_rays(stream, &path, context.problem, context.origin, &centre, &points, color);
        }
    }
}

/// The number of features that passed each step, from their final states.
fn funnel(states: &[FeatureState]) -> [(&'static str, usize); 5] {
    let at_least = |index: usize| states.iter().filter(|state| state.index() >= index).count();
    [
        ("detected in the query", at_least(0)),
        ("passed the ratio test", at_least(1)),
        ("unique", at_least(2)),
        ("with a depth", at_least(3)),
        ("inliers", at_least(4)),
    ]
}

/// The number that decided a state, as text.
fn decided_by(state: &FeatureState) -> String {
    match state {
        FeatureState::RatioFailed { ratio } => format!("ratio {ratio:.2}"),
        FeatureState::NotUnique { rival } => format!("nearer to query feature {rival}"),
        FeatureState::NoDepth { distance_px } => format!("LiDAR {distance_px:.1} px away"),
        FeatureState::Outlier { residual_px } if residual_px.is_infinite() => {
            "no pose explains it".to_owned()
        }
        FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px } => {
            format!("residual {residual_px:.1} px")
        }
    }
}

/// Rerun's pixel (0, 0) is the corner of the image, ours the centre of its first pixel.
fn shown([x, y]: [f32; 2]) -> [f32; 2] {
    [x + 0.5, y + 0.5]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_funnel_counts_every_feature_once_and_never_widens() {
        let states = [
            FeatureState::RatioFailed { ratio: 0.95 },
            FeatureState::NotUnique { rival: 3 },
            FeatureState::Inlier { residual_px: 0.4 },
            FeatureState::Outlier { residual_px: 9.0 },
            FeatureState::NoDepth { distance_px: 7.0 },
        ];
        assert_eq!(funnel(&states).map(|row| row.1), [5, 4, 3, 2, 1]);
    }
}
