//! Every estimator can be stopped soon, and wherever it looks whether it is.

use std::sync::atomic::{AtomicBool, Ordering};

use posescope_core::estimator;
use posescope_core::event::{Kind, KindSet};
use posescope_core::history::History;
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::Problem;
use posescope_core::trace::{Cancelled, Record, Sink, Trace};

use crate::conformance::{estimators, on_many_threads, silent};
use crate::two_walls::solvable;

/// Stops the run at one event.
struct StopAt(u64);

impl Sink for StopAt {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if record.index == self.0 { Err(Cancelled) } else { Ok(()) }
    }
}

#[test]
fn every_estimator_can_be_stopped_at_any_event() {
    let problem = solvable();
    for (name, estimator) in estimators() {
        let mut history = History::default();
        estimator.estimate(&problem, &mut Trace::to(&mut history)).expect("nobody cancels");
        let events = history.records().len() as u64;
        // The first and last events, and a sample of the many in between.
        let stops = (0..events).filter(|i| *i < 8 || events - i < 3 || i % 1999 == 0);
        for stop in stops {
            let outcome = estimator.estimate(&problem, &mut Trace::to(&mut StopAt(stop)));
            assert_eq!(outcome.err(), Some(Cancelled), "{name} at {stop} of {events}");
        }
    }
}

/// What a run does that concerns its observer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Moment {
    /// It looks at the attention flag.
    LooksUp,
    /// It tells an event of this kind.
    Tells(Kind),
}

/// Keeps the attention flag up, so that the run comes by whenever it looks; stops it at one of the
/// times.
struct AttentionSeeker<'a> {
    flag: &'a AtomicBool,
    wanted: KindSet,
    moments: Vec<Moment>,
    looks: usize,
    stop_at: Option<usize>,
}

impl<'a> AttentionSeeker<'a> {
    fn new(flag: &'a AtomicBool, wanted: KindSet, stop_at: Option<usize>) -> Self {
        flag.store(true, Ordering::Release);
        Self { flag, wanted, moments: Vec::new(), looks: 0, stop_at }
    }
}

impl Sink for AttentionSeeker<'_> {
    fn wanted(&self) -> KindSet {
        self.wanted
    }
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.moments.push(Moment::Tells(record.event.kind()));
        Ok(())
    }
    fn attend(&mut self) -> Result<(), Cancelled> {
        self.moments.push(Moment::LooksUp);
        self.flag.store(true, Ordering::Release);
        self.looks += 1;
        if self.stop_at == Some(self.looks) {
            return Err(Cancelled);
        }
        Ok(())
    }
}

/// Everything that concerns the observer of a run that is not stopped.
fn moments(
    estimator: &dyn estimator::Estimator,
    problem: &Problem,
    wanted: KindSet,
) -> Vec<Moment> {
    let flag = AtomicBool::new(false);
    let mut sink = AttentionSeeker::new(&flag, wanted, None);
    estimator
        .estimate(problem, &mut Trace::watched(&mut sink, Some(&flag)))
        .expect("nobody cancels");
    sink.moments
}

/// 1,681 coarse hypotheses, and more trials than are looked up between.
fn long() -> (Problem, Params) {
    let mut params = Params::default();
    for change in ["grid.coarse_step=0.14", "fb.confidence=0.999999", "fb.ratio=1"] {
        params.assign(change).expect("a good value");
    }
    (solvable(), params)
}

#[test]
fn between_two_looks_at_the_flag_lie_at_most_300_hypotheses_or_1000_trials() {
    let (problem, params) = long();
    for entry in estimator::all() {
        let name = entry.method.name();
        let estimator = entry.make(&params);
        let moments = on_many_threads(|| moments(estimator.as_ref(), &problem, KindSet::ALL));
        // An event may report work that was done long before it. So only looks without an event count: between two of
        // them, few hypotheses may be reported.
        let (mut since, mut scored, mut tried) = (0, 0, 0);
        let mut before = None;
        for pair in moments.windows(2) {
            match pair[0] {
                Moment::LooksUp if pair[1] == Moment::LooksUp => since = 0,
                Moment::Tells(Kind::PoseScored) => (since, scored) = (since + 1, scored + 1),
                Moment::Tells(Kind::HypothesisTried) => {
                    // MLESAC tells its trials one by one, as it goes.
                    assert_eq!(before, Some(Moment::LooksUp), "{name}");
                    tried += 1;
                }
                Moment::LooksUp | Moment::Tells(_) => {}
            }
            assert!(since <= 300, "{name}");
            before = Some(pair[0]);
        }
        match silent(estimator.as_ref(), &problem).counts {
            Some(_) => assert!(tried > 90, "{name}: {tried}"),
            None => assert!(scored > 1000, "{name}: {scored}"),
        }
    }
}

#[test]
fn every_stage_that_takes_time_looks_up_more_than_its_events_do() {
    let (problem, params) = long();
    for entry in estimator::all() {
        let name = entry.method.name();
        let estimator = entry.make(&params);
        let loud = moments(estimator.as_ref(), &problem, KindSet::ALL);
        let quiet = moments(estimator.as_ref(), &problem, KindSet::NONE);
        let looks = |moments: &[Moment]| {
            let looks = |moment: &&Moment| **moment == Moment::LooksUp;
            moments.iter().filter(looks).count()
        };
        // Whoever wants to hear nothing is heard as often.
        assert_eq!(looks(&loud), looks(&quiet), "{name}");
        let told = loud.len() - looks(&loud);
        assert!(looks(&loud) + 20 > told, "{name}: {told}");
    }
    let fb = estimator::entry(Method::FB).make(&params);
    let all = moments(fb.as_ref(), &problem, KindSet::of(&[Kind::FeaturesDetected]));
    let told = |kind: Kind| all.iter().position(|moment| *moment == Moment::Tells(kind));
    let first = told(Kind::FeaturesDetected).expect("always told");
    // The sums, the octaves, the descriptors.
    assert!(first >= 8, "one photo's passes: {first}");
}

#[test]
fn a_run_that_is_stopped_wherever_it_looks_up_ends_there() {
    let (problem, mut params) = long();
    // A look is like the next; this leaves some 200 hypotheses.
    params.assign("grid.coarse_step=0.4").expect("a good value");
    for entry in estimator::all() {
        let name = entry.method.name();
        let estimator = entry.make(&params);
        for wanted in [KindSet::ALL, KindSet::NONE] {
            let looks = moments(estimator.as_ref(), &problem, wanted)
                .iter()
                .filter(|moment| **moment == Moment::LooksUp)
                .count();
            let stops = (1..=looks).filter(|i| *i < 8 || *i == looks || i % 4999 == 0);
            for stop in stops {
                let flag = AtomicBool::new(false);
                let mut sink = AttentionSeeker::new(&flag, wanted, Some(stop));
                let mut trace = Trace::watched(&mut sink, Some(&flag));
                let outcome = estimator.estimate(&problem, &mut trace);
                assert_eq!(outcome.err(), Some(Cancelled), "{name} at {stop} of {looks}");
                // Nothing follows but the ends of the stages that were open.
                assert_eq!(sink.looks, stop, "{name}");
                let last = sink.moments.iter().rposition(|m| *m == Moment::LooksUp);
                let after = &sink.moments[last.expect("it was stopped") + 1..];
                let is_end = |moment: &Moment| *moment == Moment::Tells(Kind::StageEnded);
                assert!(after.len() <= 4 && after.iter().all(is_end), "{name}: {after:?}");
            }
        }
    }
}
