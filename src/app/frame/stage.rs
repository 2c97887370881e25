//! What a stage says in a few words, and what is large and small while it is selected.

use crate::app::ViewName;
use crate::event::{Event, Stage};
use crate::grid::Phase;
use crate::table::three_digits;
use crate::trace::Record;

/// The views of a stage: the first is large, the others stand beside it.
pub(super) fn scene(stage: Option<Stage>) -> &'static [ViewName] {
    use ViewName::{Fusion, Histogram, Images, Ransac, Retrieval, Space, Surface, Synthetic};
    match stage {
        None => &[Images],
        Some(stage) => match stage {
            Stage::Retrieve => &[Retrieval],
            Stage::Consensus | Stage::Accept => &[Images, Ransac],
            Stage::Color => &[Synthetic, Space],
            Stage::Search(_) | Stage::SearchCoarse | Stage::RefinePlane => &[Surface, Synthetic],
            Stage::Descend => &[Synthetic, Histogram],
            Stage::Assess => &[Synthetic, Surface, Histogram],
            Stage::RefineSix | Stage::Judge => &[Synthetic, Histogram, Space],
            Stage::Fuse => &[Fusion, Space],
            Stage::Opinion => &[Space, Images],
            // The estimator, and the steps of FB before the consensus.
            _ => &[Images],
        },
    }
}

/// The name of a stage in the storyboard.
pub(super) fn name(stage: Stage) -> String {
    match stage {
        Stage::Estimator(method) => method.label(),
        Stage::Search(Phase::PositionCoarse) => "coarse".to_owned(),
        Stage::Search(Phase::PositionFine) => "fine".to_owned(),
        Stage::Search(Phase::YawCoarse) => "yaw".to_owned(),
        Stage::Search(Phase::YawFine) => "fine yaw".to_owned(),
        Stage::Color => "start".to_owned(),
        Stage::Assess => "result".to_owned(),
        Stage::Consensus => "RANSAC".to_owned(),
        Stage::MatchGuided => "match again".to_owned(),
        other => other.name().replace('_', " "),
    }
}

/// The number of a stage that matters, from what was reported in it; its name where there is none.
pub(super) fn caption(stage: Stage, has_failed: bool, records: &[Record]) -> String {
    match stage {
        Stage::Estimator(method) if has_failed => format!("{}: no pose", method.label()),
        Stage::Estimator(method) => format!("takes {}", method.label()),
        Stage::Detect => {
            let counts = records.iter().filter_map(|record| match &record.event {
                Event::FeaturesDetected(event) => Some(event.features.keypoints.len().to_string()),
                _ => None,
            });
            let counts: Vec<String> = counts.collect();
            format!("{} keypoints", counts.join(" + "))
        }
        _ => {
            let latest = records.iter().rev().find_map(|record| number(stage, &record.event));
            latest.unwrap_or_else(|| name(stage))
        }
    }
}

fn number(stage: Stage, event: &Event) -> Option<String> {
    let cost = |words: &str, cost: f64| format!("{words} {}", three_digits(cost));
    Some(match (stage, event) {
        (Stage::Match, Event::MatchesDecided(event)) => format!("{} matches", event.candidates()),
        (Stage::MatchGuided, Event::MatchesGuided(event)) => {
            format!("{} matched again", event.matches.len())
        }
        (Stage::DepthLift, Event::DepthsLifted(event)) => {
            format!("{} with depth", event.with_depth())
        }
        (Stage::Consensus, Event::PoseRefined(event)) => format!("{} inliers", event.inliers),
        (Stage::Accept, Event::ConsensusJudged(event)) => match event.acceptance.needed {
            Some(needed) => format!("{} inliers, {needed} needed", event.acceptance.inliers),
            None => format!("{} inliers: too few", event.acceptance.inliers),
        },
        (Stage::Color, Event::ViewRendered(event)) => cost("start", event.comparison.score.cost?),
        (Stage::Search(_), Event::PhaseSearched(event)) => {
            let cell = event.surface.minimum()?;
            cost(&name(stage), event.surface.eligible_cost(cell)?)
        }
        (Stage::Assess, Event::MinimumAssessed(event)) => cost("result", event.best),
        (Stage::RefinePlane | Stage::RefineSix, Event::StartsRefined(event)) => {
            cost(&name(stage), event.refinements.first()?.cost)
        }
        (Stage::Descend, Event::DescentStepped(event)) => cost("descend", event.score.cost?),
        (Stage::Judge, Event::CandidatesJudged(event)) => {
            format!("{} poses judged", event.candidates.len())
        }
        (Stage::Opinion, Event::OpinionFormed(event)) => event.standing.to_owned(),
        (Stage::Fuse, Event::ReferencesFused(event)) => format!("{} poses", event.shares.len()),
        (Stage::Retrieve, Event::ReferencesRanked(event)) => {
            format!("{} ranked", event.ranking.candidates)
        }
        _ => return None,
    })
}
