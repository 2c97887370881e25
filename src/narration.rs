//! Sentences for decisions, for logs.

use crate::diagnosis::confidence::percent;
use crate::event::{
    CandidatesJudged, Event, MinimumAssessed, Moment, OwnAnswered, ReferencesFused,
    ReferencesRanked, Side, Stage, StartsRefined, ViewRendered,
};
use crate::features::MatchVerdict;
use crate::fusion::ShareOutcome;
use crate::geometry::PoseError;
use crate::place::place;
use crate::retrieval::{Criterion, Geometry, RankedReference};
#[cfg(feature = "app")]
use crate::trace::Record;

/// One sentence for an event that is a decision; `None` for the others.
pub(crate) fn sentence(event: &Event) -> Option<String> {
    Some(match event {
        Event::FeaturesDetected(event) => {
            let side = match event.side {
                Side::Query => "query",
                Side::Reference => "reference",
            };
            format!("{} keypoints in the {side}", event.features.keypoints.len())
        }
        Event::MatchesDecided(event) => {
            let [mut kept, mut ambiguous, mut rivalled] = [0; 3];
            for decision in event.decisions.iter().flatten() {
                *match decision.verdict {
                    MatchVerdict::Candidate => &mut kept,
                    MatchVerdict::Ambiguous => &mut ambiguous,
                    MatchVerdict::NotUnique { .. } => &mut rivalled,
                } += 1;
            }
            format!("{kept} matches; {ambiguous} failed the ratio test, {rivalled} were not unique")
        }
        Event::ProjectedCloud(event) => format!(
            "{} of the cloud's {} points are in the reference's view",
            event.in_view, event.points
        ),
        Event::DepthsLifted(event) => {
            format!("{} of {} matches have a depth", event.with_depth(), event.matches.len())
        }
        Event::HypothesisTried(event) if event.trial.is_best => {
            let score = event.trial.best?.score;
            format!(
                "trial {}: new best with {} inliers, log likelihood {:.1}; {} trials needed",
                event.trial.index, score.inliers, score.log_likelihood, event.trial.trials_needed
            )
        }
        Event::PoseRefined(event) => format!(
            "refined: {} of {} correspondences are inliers, after {} trials",
            event.inliers, event.correspondences, event.trials
        ),
        Event::ConsensusJudged(event) => format!(
            "{}: {} {} agree, {} needed, log10 of false alarms {:.1}, {:.2} m from the reference",
            if event.accepted { "accepted" } else { "refused" },
            event.acceptance.inliers,
            event.counted.name(),
            event.acceptance.needed.map_or("more than all".to_owned(), |needed| needed.to_string()),
            event.acceptance.log10_nfa,
            event.distance_m
        ),
        Event::MatchesGuided(event) => format!(
            "{} matches have a depth after matching again",
            event.matches.iter().filter(|one| one.point.is_some()).count()
        ),
        Event::FeaturesClassified(event) => {
            format!("the states of all {} query keypoints are known", event.states.len())
        }
        Event::CloudColored(event) => {
            let counts = &event.cloud.counts;
            format!(
                "{} points coloured, {} outside the photo, {} occluded",
                counts.colored, counts.outside, counts.occluded
            )
        }
        Event::ViewRendered(event) => rendered(event),
        Event::PhaseSearched(event) => {
            let phase = event.surface.lattice.phase.name();
            match &event.best {
                Some(best) => format!(
                    "{phase}: the lowest cost is at {}",
                    place(&best.reference_from_camera())
                ),
                None if event.surface.minimum().is_some() => {
                    format!("{phase}: recorded for display, not searched")
                }
                None => format!("{phase}: no hypothesis has a cost"),
            }
        }
        Event::MinimumAssessed(event) => assessed(event),
        Event::BranchTaken(event) => {
            format!("takes the pose of {}: {}", event.method.name(), event.why)
        }
        Event::DescentStepped(event) => format!(
            "level {}, step {}: smooth cost {:.4}, cost {}, {}",
            event.level,
            event.step,
            event.smooth_cost,
            cost(event.score.cost),
            place(&event.reference_from_camera)
        ),
        Event::StartsRefined(event) => refined(event)?,
        Event::CandidatesJudged(event) => judged(event),
        Event::OwnAnswered(event) => own_answer(event),
        Event::OpinionFormed(event) => format!("{}. {}", event.words, event.because),
        Event::ReferencesFused(event) => fused(event),
        Event::ReferencesRanked(event) => ranked(event),
        _ => return None,
    })
}

/// The hypothesis that the last of these records tries, beside the best of its phase before it; `None` for another event.
#[cfg(feature = "app")]
pub(crate) fn tried(records: &[Record]) -> Option<String> {
    let (last, before) = records.split_last()?;
    let Event::PoseScored(tried) = &last.event else {
        return None;
    };
    let own = format!("hypothesis {}: cost {}", tried.evaluation, cost(tried.score.cost));
    if tried.is_best {
        return Some(own + ", the lowest so far");
    }
    let best = before.iter().rev().find_map(|record| match &record.event {
        Event::PoseScored(one) if one.phase == tried.phase && one.is_best => Some(one.score.cost),
        _ => None,
    });
    Some(best.map_or(own.clone(), |best| format!("{own}; the lowest so far is {}", cost(best))))
}

/// What a stage does, for someone who sees it for the first time.
#[cfg(feature = "app")]
pub(crate) fn about(stage: Stage) -> &'static str {
    use crate::grid::Phase;

    match stage {
        Stage::Estimator(_) => "The method begins with two photos. One has a pose and a scan.",
        Stage::Retrieve => "The photos' looks suggest which places could be the right one.",
        Stage::Detect => "It finds points that stand out, and describes the surroundings of each.",
        Stage::Match => {
            "Each query point looks for its like in the reference and keeps only a clear winner."
        }
        Stage::DepthLift => {
            "The scan gives matched points a depth, so they become points in space."
        }
        Stage::MatchGuided => {
            "A first pose says where each point must be seen, so it may match more freely."
        }
        Stage::Consensus => {
            "Three matches give up to four poses. The pose under which all matches are likeliest wins."
        }
        Stage::Accept => "Would chance alone explain as many matches? Then there is no pose.",
        Stage::Color => "The scan takes its colours from the reference photo.",
        Stage::Search(Phase::PositionCoarse) => {
            "It renders the map at each position of a coarse grid and compares it with the query."
        }
        Stage::Search(Phase::PositionFine) => {
            "Around the position of lowest cost the grid becomes finer."
        }
        Stage::Search(Phase::YawCoarse) => {
            "At the position of lowest cost the camera turns left and right."
        }
        Stage::Search(Phase::YawFine) => {
            "Around the heading of lowest cost the steps become finer."
        }
        Stage::Descend => {
            "From the reference it goes downhill, first over blurred photos, then over sharper ones."
        }
        Stage::SearchCoarse => {
            "Smaller copies of the photos have wider basins, so it searches them for starts."
        }
        Stage::RefinePlane => "The best coarse minima go downhill in position and heading.",
        Stage::RefineSix => {
            "Samples gather around the best poses. Height, pitch and roll may change too."
        }
        Stage::Judge => "One cost compares the poses of several methods.",
        Stage::Assess => {
            "How good is the minimum? It is compared with its rivals and with shuffled pixels."
        }
        Stage::Fuse => "The poses from all references become one.",
        Stage::Opinion => {
            "Posescope finds the query itself, and compares its pose with the given one."
        }
        _ => stage.name(),
    }
}

/// The stages around an event, outermost first.
pub(crate) fn stages(open: &[Stage]) -> String {
    let names: Vec<&str> = open.iter().map(|stage| stage.name()).collect();
    names.join(" › ")
}

fn rendered(event: &ViewRendered) -> String {
    let what = match event.moment {
        Moment::Start => "at the reference",
        Moment::NewBest => "new best",
        Moment::End => "result",
    };
    format!(
        "{what}: cost {} over {} pixels, {}",
        cost(event.comparison.score.cost),
        event.comparison.score.covered,
        place(&event.offset.reference_from_camera())
    )
}

fn assessed(event: &MinimumAssessed) -> String {
    format!(
        "cost {} at the minimum; {} at the reference, {} with shuffled pixels, {} at the \
         second-best minimum",
        cost(Some(event.best)),
        cost(event.initial),
        cost(event.shuffled),
        cost(event.runner_up)
    )
}

fn refined(event: &StartsRefined) -> Option<String> {
    let best = event.refinements.first()?;
    let moved = PoseError::between(&best.start.pose, &best.pose);
    let evaluations: u64 = event.refinements.iter().map(|one| one.evaluations).sum();
    Some(format!(
        "{} starts refined in {} freedoms by {evaluations} hypotheses; the best went {} and {} to cost \
         {:.4} from {:.4}",
        event.refinements.len(),
        event.freedoms.count(),
        moved.translation(),
        moved.rotation(),
        best.cost,
        best.start.cost,
    ))
}

fn judged(event: &CandidatesJudged) -> String {
    format!(
        "{} poses compared: {}; {:.1} standard deviations below the coarse positions, {:.1} are needed",
        event.candidates.len(),
        event.why,
        event.deviations,
        event.needed
    )
}

fn own_answer(event: &OwnAnswered) -> String {
    let (method, reference) = (event.by, &event.from);
    if event.world_from_camera.is_none() {
        return format!("{method} has no pose from {reference}");
    }
    let likely = event.probability.map_or_else(
        || "of unknown confidence".to_owned(),
        |probability| format!("{} likely right", percent(probability)),
    );
    let apart = event.apart.map(|apart| format!(", {apart} from the given pose"));
    format!("{method} has a pose from {reference}, {likely}{}", apart.unwrap_or_default())
}

fn fused(event: &ReferencesFused) -> String {
    let shares: Vec<String> = event
        .shares
        .iter()
        .map(|share| {
            let say = match share.outcome {
                ShareOutcome::Kept | ShareOutcome::Outvoted => format!("weight {}", share.words()),
                _ => share.words(),
            };
            let support = share.support.map(|support| format!(", {}", support.words()));
            let support = support.unwrap_or_default();
            format!("{} {say} ({} matches{support})", share.reference, share.matches)
        })
        .collect();
    format!("{} of {}", event.fusion, shares.join(", "))
}

fn ranked(event: &ReferencesRanked) -> String {
    let ranking = &event.ranking;
    let say = |reference: &RankedReference| {
        let score = score(ranking.criterion, reference.ranked.score);
        format!("{} ({score}{})", reference.name, verified(&reference.ranked.geometry))
    };
    let chosen: Vec<String> = ranking.frames.iter().take(ranking.chosen).map(say).collect();
    format!(
        "{} of {} frames are references: {}",
        chosen.len(),
        ranking.candidates,
        chosen.join(", ")
    )
}

/// The score of a ranked frame.
pub(crate) fn score(criterion: Criterion, score: f32) -> String {
    match criterion {
        Criterion::Words => format!("{score:.3}"),
        Criterion::Matches => format!("{score:.0} matches"),
    }
}

/// What verification says about a ranked frame, after its score. Frames ranked by matches are never verified.
pub(crate) fn verified(geometry: &Geometry) -> String {
    match geometry {
        Geometry::Verified(found) => format!(", {} inliers", found.inliers),
        Geometry::Refused => ", not verified".to_owned(),
        Geometry::Unchecked => String::new(),
    }
}

fn cost(cost: Option<f64>) -> String {
    cost.map_or("none".to_owned(), |cost| format!("{cost:.4}"))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::event::Kind;
    use crate::foreign::Foreign;
    use crate::fusion::Fusion;
    use crate::history::History;
    use crate::localize::{LocalizeError, LocalizeObserver, Localizer, Request};
    use crate::params::Params;
    use crate::retrieval::ReferenceRanking;
    use crate::scene;
    use crate::trace::{Cancelled, Record, Sink};
    use crate::{Method, estimator};

    /// What is too frequent for a sentence, or has a place of its own in every log.
    const SILENT: &[Kind] = &[Kind::StageStarted, Kind::StageEnded, Kind::PoseScored];

    #[derive(Default)]
    struct Kept(History);

    impl Sink for Kept {
        fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
            self.0.accept(record)
        }
    }

    impl LocalizeObserver for Kept {}

    #[test]
    fn every_event_has_a_sentence_or_is_named_as_silent() {
        let scene = scene::open("street", None).expect("the built-in street");
        let mut descent = Params::default();
        descent.set("pm.search", "descent").expect("a search");
        let mut kept = Kept::default();
        let all: Vec<Method> = estimator::methods().collect();
        let other = Method::called("other").expect("a plain name");
        let pose = scene.pose(0).expect("a pose");
        let foreign =
            Foreign::default().with_estimates(other, [(scene.frames()[0].clone(), pose)].into());
        for (params, methods) in
            [(Params::default(), &all[..]), (Params::default(), &[other]), (descent, &[Method::PM])]
        {
            let localizer = Localizer::new(scene.as_ref(), scene.as_ref(), &params, 0)
                .with_foreign(foreign.clone());
            let request = Request {
                radius_m: 5.0,
                references: vec![1, 2].into(),
                fusions: Fusion::all().take(1).collect(),
                setting: None,
            };
            localizer
                .localize(0, 0, &[request], methods, &mut kept, |_, _| Ok::<(), LocalizeError>(()))
                .expect("nobody stops it");
        }
        let mut events: Vec<&Event> = kept.0.events().collect();
        let ranking = ReferenceRanking {
            criterion: Criterion::Words,
            candidates: 0,
            chosen: 0,
            frames: Vec::new(),
        };
        let ranked = ReferencesRanked { ranking: Arc::new(ranking), photos: Vec::new().into() };
        let ranked = Event::from(ranked);
        events.push(&ranked);
        for &kind in Kind::ALL {
            let of_kind = events.iter().filter(|event| event.kind() == kind);
            let is_told = of_kind.clone().any(|event| sentence(event).is_some());
            assert!(of_kind.count() > 0, "no {kind:?} was emitted");
            assert_ne!(is_told, SILENT.contains(&kind), "{kind:?}");
        }
    }
}
