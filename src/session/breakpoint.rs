//! Breakpoints: where a run stops, at a stage or when a number crosses a limit.

use std::fmt;
use std::str::FromStr;

use crate::estimator;
use crate::event::{Event, Stage, StageStarted};
use crate::grid::Phase;
use crate::method::Method;
use crate::relation::Relation;
use crate::text::UnknownWord;
use crate::trace::{Cancelled, Record, Sink};

/// A number of an event that breakpoints can watch.
struct Quantity {
    name: &'static str,
    about: &'static str,
    of: fn(&Event) -> Option<f64>,
}

/// A quantity of one kind of event.
macro_rules! quantity {
    ($name:literal, $about:literal, $kind:ident, $event:ident => $value:expr) => {
        Quantity {
            name: $name,
            about: $about,
            of: |event| match event {
                Event::$kind($event) => $value,
                _ => None,
            },
        }
    };
}

/// All numbers that a breakpoint can watch.
#[rustfmt::skip]
const QUANTITIES: &[Quantity] = &[
    quantity!("keypoints", "keypoints of a photo",
        FeaturesDetected, event => Some(event.features.keypoints.len() as f64)),
    quantity!("matches", "matches that pass the ratio test and are unique",
        MatchesDecided, event => Some(event.candidates() as f64)),
    quantity!("depths", "matches with a depth",
        DepthsLifted, event => Some(event.with_depth() as f64)),
    quantity!("trial", "number of the MLESAC trial",
        HypothesisTried, event => Some(event.trial.index as f64)),
    quantity!("best_inliers", "inliers of the best MLESAC hypothesis so far",
        HypothesisTried, event => Some(event.trial.best?.score.inliers as f64)),
    quantity!("inliers", "inliers of the refined pose",
        PoseRefined, event => Some(event.inliers as f64)),
    quantity!("distance", "distance of the refined pose from the reference [m]",
        ConsensusJudged, event => Some(event.distance_m)),
    quantity!("evaluation", "number of the hypothesis of the grid search",
        PoseScored, event => Some(event.evaluation as f64)),
    quantity!("cost", "cost of a hypothesis that is the best of its phase so far",
        PoseScored, event => event.score.cost.filter(|_| event.is_best)),
    quantity!("coverage", "coverage of such a hypothesis, as a share of that at the reference pose",
        PoseScored, event => event.is_best.then_some(event.coverage)),
    quantity!("tried_cost", "cost of any hypothesis of the grid search",
        PoseScored, event => event.score.cost),
    quantity!("tried_coverage", "coverage of any hypothesis of the grid search",
        PoseScored, event => Some(event.coverage)),
    quantity!("margin", "cost of the second-best local minimum less that of the best",
        MinimumAssessed, event => Some(event.runner_up? - event.best)),
];

/// The condition of a breakpoint.
#[derive(Clone, Debug, PartialEq)]
enum BreakAt {
    /// The start of a stage of this name.
    Stage(&'static str),
    /// A comparison that becomes true, of the number at this position in the table of quantities.
    Crossing { quantity: usize, relation: Relation, bound: f64 },
}

/// Why a text is not a breakpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a breakpoint: {expected}; write a stage such as `fb.ransac` or a comparison such \
     as `inliers < 10`"
)]
pub struct BreakpointError {
    text: String,
    expected: String,
}

/// One breakpoint: `fb.ransac`, `inliers < 10`, `mi.coverage < 0.1`.
///
/// A comparison stops the run when it becomes true, and not again while it stays true.
#[derive(Clone, Debug, PartialEq)]
pub struct Breakpoint {
    text: String,
    method: Option<Method>,
    at: BreakAt,
}

impl Breakpoint {
    /// Stages outside the estimators.
    const OUTSIDE: [&'static str; 2] = ["retrieve", "fusion"];

    /// Whether a stage is outside the estimators.
    pub fn is_outside(stage: &str) -> bool {
        Self::OUTSIDE.contains(&stage)
    }

    /// The stages at which a breakpoint can be set, in the order of a run.
    pub fn stages() -> Vec<&'static str> {
        let stages = [
            Stage::Detect,
            Stage::Match,
            Stage::DepthLift,
            Stage::Consensus,
            Stage::Accept,
            Stage::Color,
        ];
        let names: Vec<_> = estimator::methods().map(Stage::Estimator).collect();
        let phases = Phase::ALL.map(Stage::Search);
        [Stage::Retrieve]
            .iter()
            .chain(&names)
            .chain(&stages)
            .chain(&phases)
            .chain(&[Stage::Descend, Stage::MatchGuided, Stage::SearchCoarse])
            .chain(&[Stage::RefinePlane, Stage::RefineSix])
            .chain(&[Stage::Judge, Stage::Assess, Stage::Fuse, Stage::Opinion])
            .map(|stage| stage.name())
            .collect()
    }

    /// The numbers that a breakpoint can watch: name and description.
    pub fn quantities() -> impl Iterator<Item = (&'static str, &'static str)> {
        QUANTITIES.iter().map(|quantity| (quantity.name, quantity.about))
    }

    /// The estimator of the stage or number; `None` means any.
    pub fn method(&self) -> Option<Method> {
        self.method
    }

    /// The stage at whose start it stops; `None` for a comparison.
    pub fn stage(&self) -> Option<&'static str> {
        match self.at {
            BreakAt::Stage(name) => Some(name),
            BreakAt::Crossing { .. } => None,
        }
    }
}

impl fmt::Display for Breakpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Breakpoint {
    type Err = BreakpointError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        let refuse = |expected: String| BreakpointError { text: text.to_owned(), expected };
        let comparison = Relation::split(text);
        let scoped = comparison.map_or(text, |(name, ..)| name);
        let (method, name) = match scoped.split_once('.') {
            Some((method, name)) => {
                let known =
                    method.parse().map_err(|error: UnknownWord| refuse(error.to_string()))?;
                (Some(known), name)
            }
            None => (None, scoped),
        };
        let at = match comparison {
            Some((_, relation, bound)) => {
                if relation == Relation::Contains {
                    return Err(refuse("numbers are compared with = != < <= > >=".to_owned()));
                }
                let quantity = QUANTITIES
                    .iter()
                    .position(|quantity| quantity.name == name)
                    .ok_or_else(|| {
                        let names: Vec<_> = QUANTITIES.iter().map(|q| q.name).collect();
                        refuse(format!("`{name}` is not one of {}", names.join(", ")))
                    })?;
                let bound = bound
                    .parse()
                    .ok()
                    .filter(|bound: &f64| bound.is_finite())
                    .ok_or_else(|| refuse(format!("`{bound}` is not a number")))?;
                BreakAt::Crossing { quantity, relation, bound }
            }
            None if method.is_some() && Self::OUTSIDE.contains(&name) => {
                return Err(refuse(format!("the stage `{name}` belongs to no method")));
            }
            None => {
                let stages = Self::stages();
                let stage = stages.iter().find(|stage| **stage == name);
                BreakAt::Stage(stage.ok_or_else(|| {
                    refuse(format!("`{name}` is not one of {}", stages.join(", ")))
                })?)
            }
        };
        Ok(Self { text: text.to_owned(), method, at })
    }
}

posescope_core::serde_as_text!(Breakpoint);

/// Breakpoints with their state in a run.
#[derive(Clone, Debug, Default)]
pub struct Breakpoints {
    watched: Vec<Watched>,
}

#[derive(Clone, Debug)]
struct Watched {
    breakpoint: Breakpoint,
    /// Whether the comparison was true at the last event of its number.
    was_true: bool,
}

impl Breakpoints {
    /// Breakpoints that have not been reached yet.
    pub fn new(breakpoints: impl IntoIterator<Item = Breakpoint>) -> Self {
        let watched =
            breakpoints.into_iter().map(|breakpoint| Watched { breakpoint, was_true: false });
        Self { watched: watched.collect() }
    }

    /// Replaces the breakpoints in the middle of a run. Those that stay keep their state.
    pub(super) fn replace(&mut self, other: Self) {
        let old = std::mem::replace(&mut self.watched, other.watched);
        for new in &mut self.watched {
            new.was_true = old.iter().any(|old| old.breakpoint == new.breakpoint && old.was_true);
        }
    }

    /// The text of the first breakpoint that an event reaches. Must be called with every event.
    pub fn reached(&mut self, record: &Record) -> Option<String> {
        let mut reached = None;
        for watched in &mut self.watched {
            let Breakpoint { text, method, at } = &watched.breakpoint;
            if method.is_some_and(|method| !record.methods.contains(&method)) {
                continue;
            }
            let fires = match at {
                BreakAt::Stage(name) => matches!(
                    record.event,
                    Event::StageStarted(StageStarted { stage }) if stage.name() == *name
                ),
                BreakAt::Crossing { quantity, relation, bound } => {
                    (QUANTITIES[*quantity].of)(&record.event).is_some_and(|value| {
                        let is_true = relation.holds(value, *bound);
                        !std::mem::replace(&mut watched.was_true, is_true) && is_true
                    })
                }
            };
            if fires && reached.is_none() {
                reached = Some(text.clone());
            }
        }
        if let Event::StageEnded(ended) = &record.event
            && matches!(ended.stage, Stage::Estimator(_))
            && record.methods.len() == 1
        {
            // The next estimator has its own numbers.
            for watched in &mut self.watched {
                watched.was_true = false;
            }
        }
        reached
    }
}

/// A sink that ends a run at its first breakpoint.
#[derive(Debug, Default)]
pub struct StopAtBreakpoint {
    breakpoints: Breakpoints,
    reached: Option<String>,
}

impl StopAtBreakpoint {
    /// Stops at the first of these breakpoints.
    pub fn new(breakpoints: Breakpoints) -> Self {
        Self { breakpoints, reached: None }
    }

    /// The text of the breakpoint that ended the run.
    pub fn reached(&self) -> Option<&str> {
        self.reached.as_deref()
    }
}

impl Sink for StopAtBreakpoint {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        // The ends of the open stages must not count as breaks.
        if self.reached.is_some() {
            return Err(Cancelled);
        }
        self.reached = self.breakpoints.reached(record);
        match self.reached {
            Some(_) => Err(Cancelled),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{DebugEvent, MinimumAssessed, PoseRefined, ProjectedCloud};
    use crate::geometry::Pose;
    use crate::grid::Offset;
    use crate::history::History;
    use crate::trace::Trace;

    fn record(event: impl DebugEvent) -> Record {
        let mut history = History::default();
        Trace::to(&mut history).emit(|| event).expect("nobody cancels");
        history.records()[0].clone()
    }

    fn inliers(inliers: usize) -> Record {
        record(PoseRefined {
            reference_from_query: Pose::identity(),
            inliers,
            correspondences: 30,
            trials: 9,
        })
    }

    fn reached(breakpoints: &[&str], records: &[Record]) -> Vec<Option<String>> {
        let breakpoints = breakpoints.iter().map(|b| b.parse().expect("a breakpoint"));
        let mut breakpoints = Breakpoints::new(breakpoints);
        records.iter().map(|record| breakpoints.reached(record)).collect()
    }

    #[test]
    fn a_stage_is_reached_in_the_method_that_was_named() {
        fn feature_based(trace: &mut Trace<'_>) -> Result<(), Cancelled> {
            trace.stage(Stage::Estimator(Method::FB), |trace| {
                trace.stage(Stage::Consensus, |_| Ok(()))
            })
        }
        let mut history = History::default();
        let mut trace = Trace::to(&mut history);
        feature_based(&mut trace).expect("not cancelled");
        trace.stage(Stage::Estimator(Method::HY), feature_based).expect("not cancelled");
        let run = history.records();
        let at = |text| -> Vec<usize> {
            let reached = reached(&[text], run);
            (0..run.len()).filter(|i| reached[*i].is_some()).collect()
        };
        assert_eq!(at("ransac"), [1, 6]);
        assert_eq!(at("fb.ransac"), [1, 6]);
        assert_eq!(at("hy.ransac"), [6]);
        assert_eq!(at("mi.ransac"), [0; 0]);
        assert_eq!(at("hy"), [4]);
    }

    #[test]
    fn a_comparison_is_reached_when_it_becomes_true() {
        let run = [inliers(20), inliers(9), inliers(8), inliers(10), inliers(3)];
        let hits: Vec<bool> =
            reached(&["inliers < 10"], &run).iter().map(Option::is_some).collect();
        assert_eq!(hits, [false, true, false, false, true]);
        let other = record(ProjectedCloud { points: 3, in_view: 2 });
        assert_eq!(reached(&["inliers < 10"], &[other]), [None]);
    }

    #[test]
    fn the_margin_is_the_runner_up_less_the_best() {
        let assessed = |runner_up| {
            record(MinimumAssessed {
                offset: Offset::default(),
                initial: None,
                best: 0.80,
                shuffled: None,
                runner_up,
            })
        };
        let run = [assessed(Some(0.81)), assessed(None), assessed(Some(0.9))];
        let hits = reached(&["margin<0.02", "margin >= 0.05"], &run);
        assert_eq!(hits, [Some("margin<0.02".to_owned()), None, Some("margin >= 0.05".to_owned())]);
    }

    #[test]
    fn nonsense_is_refused_with_what_there_is() {
        let message = |text: &str| text.parse::<Breakpoint>().expect_err("nonsense").to_string();
        assert!(message("fb.ransack").contains("ransac"));
        assert!(message("xy.ransac").contains("`xy` is no method"));
        assert!(message("inlers < 10").contains("inliers"));
        assert!(message("inliers < ten").contains("`ten` is not a number"));
        assert!(message("").contains("fb.ransac"));
        assert!(message("fb.fusion").contains("belongs to no method"));
    }

    #[test]
    fn every_stage_and_every_quantity_can_be_named() {
        for stage in Breakpoint::stages() {
            assert!(stage.parse::<Breakpoint>().is_ok(), "{stage}");
        }
        for (quantity, about) in Breakpoint::quantities() {
            assert!(format!("{quantity} >= 0").parse::<Breakpoint>().is_ok());
            assert!(!about.is_empty());
        }
    }
}
