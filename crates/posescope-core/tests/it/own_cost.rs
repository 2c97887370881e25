//! The ways of a library's user: one call for one query, a cost of one's own.

use posescope_core::cost::{IntensityPair, QueryChannel, Statistic};
use posescope_core::event::{Stage, StageEnded, ViewRendered};
use posescope_core::{
    Cost, Direct, Failure, History, Method, Params, Problem, Trace, estimator, localize,
    localize_by, localize_traced,
};

use crate::conformance::remembering;
use crate::two_walls::solvable;

/// The mean of some function of each pair, of a smoothed query.
#[derive(Clone, Copy)]
struct Mean {
    of: fn(&IntensityPair) -> f64,
    sigma_px: f64,
}

impl Cost for Mean {
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(self.sigma_px)
    }

    fn statistic(&self) -> Statistic<'_> {
        Statistic::of_pairs(|pairs| {
            let sum: f64 = pairs.iter().map(self.of).sum();
            (!pairs.is_empty()).then(|| sum / pairs.len() as f64)
        })
    }
}

const DIFFERENCE: Mean =
    Mean { of: |pair| f64::from((pair.query - pair.synthetic).abs()), sigma_px: 0.0 };

const BRIGHTNESS: Mean = Mean { of: |pair| f64::from(pair.synthetic), ..DIFFERENCE };

fn outcome(cost: Mean, problem: &Problem) -> estimator::Outcome {
    let estimator = Direct::searching("mine", Box::new(cost), &Params::default());
    localize_by(&estimator, problem, &mut Trace::off()).expect("nobody cancels")
}

#[test]
fn one_call_gives_what_the_estimator_gives() {
    let problem = solvable();
    let params = Params::default();
    for entry in estimator::all() {
        let expected = entry.make(&params).estimate(&problem, &mut Trace::off());
        let outcome = localize(&problem, entry.method, &params);
        assert_eq!(Ok(&outcome), expected.as_ref(), "{}", entry.method.name());
        let mut history = History::default();
        let mut trace = Trace::to(&mut history);
        let traced = localize_traced(&problem, entry.method, &params, &mut trace);
        assert_eq!(Ok(outcome), traced);
        assert!(history.records().len() > 10);
    }
}

#[test]
fn a_cost_of_ones_own_is_searched_and_told_like_any_other() {
    let problem = solvable();
    let estimator = Direct::searching("mine", Box::new(DIFFERENCE), &Params::default());
    let mut history = History::default();
    let outcome = localize_by(&estimator, &problem, &mut Trace::to(&mut history));
    let pose = outcome.expect("nobody cancels").pose.expect("textured");
    let ahead = problem.reference_from_query(&pose).translation.vector;
    assert!((ahead - nalgebra::Vector3::z()).norm() < 0.3, "{ahead}");
    let last = history.last::<StageEnded>().expect("it ended");
    assert_eq!((last.stage, last.stage.name()), (Stage::Estimator(Method::named("mine")), "mine"));
    // It explains nothing, which is no reason not to show its views.
    let view = history.last::<ViewRendered>().expect("shown at the end");
    assert!(view.comparison.score.cost.is_some() && view.comparison.explanation.is_none());
}

#[test]
fn what_is_remembered_of_one_cost_is_not_taken_for_another_of_the_same_name() {
    let problem = remembering(&solvable());
    for _ in 0..2 {
        for cost in [DIFFERENCE, BRIGHTNESS, Mean { sigma_px: 3.0, ..DIFFERENCE }] {
            assert_eq!(outcome(cost, &problem), outcome(cost, &solvable()));
        }
    }
}

#[test]
fn a_panic_in_a_cost_is_an_outcome() {
    let panicking = outcome(Mean { of: |_| panic!("no\nidea"), ..DIFFERENCE }, &solvable());
    let message = "no idea".to_owned();
    assert_eq!(panicking.pose, Err(Failure::Internal { message }));
}

#[test]
fn a_method_that_nobody_registered_is_an_outcome() {
    let outcome = localize(&solvable(), Method::named("mine"), &Params::default());
    let (method, nearest) = (Method::named("mine"), Some(Method::MI));
    assert_eq!(outcome.pose, Err(Failure::UnknownMethod { method, nearest }));
}
