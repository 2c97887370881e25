//! What every estimator must keep. It walks over the registry, so a new entry is tested by being
//! there.

use std::sync::Arc;

use image::{GrayImage, Luma};
use nalgebra::Point3;
use posescope::cloud::Cloud;
use posescope::estimator::{self, Outcome};
use posescope::event::{
    DepthsLifted, Event, FeaturesClassified, FeaturesDetected, KindSet, MatchesDecided,
    PhaseSearched, PoseScored, Stage, StageEnded, StageStarted,
};
use posescope::features::FeatureState;
use posescope::history::History;
use posescope::memo::Memo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::trace::{Cancelled, Record, Sink, Trace};
use proptest::prelude::*;

use crate::two_walls::{CAMERA, cloud_of_the_walls, photo, problem, solvable};

/// Problems with nothing to go by.
fn hopeless() -> Vec<(&'static str, Problem)> {
    let flat = || GrayImage::from_pixel(CAMERA.width, CAMERA.height, Luma([90]));
    let one_point = Cloud {
        points: vec![Point3::new(0.0, 0.0, 9.0)],
    };
    let behind = Cloud {
        points: vec![Point3::new(0.0, 0.0, -9.0); 50],
    };
    vec![
        (
            "flat query and reference",
            problem(flat(), flat(), cloud_of_the_walls()),
        ),
        (
            "no cloud",
            problem(photo(1.0, 5), photo(0.0, 5), Cloud::default()),
        ),
        (
            "a cloud behind the camera",
            problem(photo(1.0, 5), photo(0.0, 5), behind),
        ),
        ("one point", problem(flat(), photo(0.0, 5), one_point)),
    ]
}

fn estimators() -> impl Iterator<Item = (&'static str, Box<dyn estimator::Estimator>)> {
    estimator::all()
        .iter()
        .map(|entry| (entry.method.name(), entry.make(&Params::default())))
}

fn silent(estimator: &dyn estimator::Estimator, problem: &Problem) -> Outcome {
    estimator
        .estimate(problem, &mut Trace::off())
        .expect("nobody cancels")
}

#[test]
fn every_estimator_finds_the_pose_and_says_the_same_whoever_listens() {
    let problem = solvable();
    for (name, estimator) in estimators() {
        let outcome = silent(estimator.as_ref(), &problem);
        let pose = outcome
            .pose
            .as_ref()
            .unwrap_or_else(|f| panic!("{name}: {f}"));
        let error = pose.translation.vector - nalgebra::Vector3::new(100.0, -2.0, 31.0);
        assert!(error.norm() < 0.45, "{name}: {error}");

        let mut history = History::default();
        let told = estimator.estimate(&problem, &mut Trace::to(&mut history));
        assert_eq!(told.expect("nobody cancels"), outcome, "{name}");
    }
}

#[test]
fn every_estimator_is_polite_on_a_hopeless_problem() {
    for (what, problem) in hopeless() {
        for (name, estimator) in estimators() {
            let outcome = silent(estimator.as_ref(), &problem);
            let failure = outcome.pose.expect_err(&format!("{name}: {what}"));
            assert!(!failure.to_string().is_empty());
        }
    }
}

/// Stops the run at one event.
struct StopAt(u64);

impl Sink for StopAt {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if record.index == self.0 {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }
}

#[test]
fn every_estimator_can_be_stopped_at_any_event() {
    let problem = solvable();
    for (name, estimator) in estimators() {
        let mut history = History::default();
        estimator
            .estimate(&problem, &mut Trace::to(&mut history))
            .expect("nobody cancels");
        let events = history.records().len() as u64;
        // Every event near both ends, and a sample of the many in between.
        let stops = (0..events).filter(|i| *i < 12 || events - i < 12 || i % 97 == 0);
        for stop in stops {
            let outcome = estimator.estimate(&problem, &mut Trace::to(&mut StopAt(stop)));
            assert_eq!(
                outcome.err(),
                Some(Cancelled),
                "{name} at {stop} of {events}"
            );
        }
    }
}

#[test]
fn stages_nest_and_every_one_that_starts_ends() {
    for problem in [solvable()]
        .into_iter()
        .chain(hopeless().into_iter().map(|h| h.1))
    {
        for (name, estimator) in estimators() {
            let mut history = History::default();
            estimator
                .estimate(&problem, &mut Trace::to(&mut history))
                .expect("nobody cancels");
            let mut open: Vec<Stage> = Vec::new();
            let mut seen = 0;
            for record in history.records() {
                if let Event::StageStarted(StageStarted { stage }) = record.event {
                    open.push(stage);
                    seen += 1;
                } else if let Event::StageEnded(StageEnded { stage, .. }) = record.event {
                    assert_eq!(open.pop(), Some(stage), "{name}");
                } else {
                    assert_eq!(record.depth, open.len(), "{name}");
                }
            }
            assert!(open.is_empty() && seen > 1, "{name}");
        }
    }
}

#[test]
fn an_uninterested_sink_hears_stages_only() {
    struct Uninterested(History);
    impl Sink for Uninterested {
        fn wanted(&self) -> KindSet {
            KindSet::NONE
        }
        fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
            self.0.accept(record)
        }
    }
    for (name, estimator) in estimators() {
        let mut sink = Uninterested(History::default());
        estimator
            .estimate(&solvable(), &mut Trace::to(&mut sink))
            .expect("nobody cancels");
        let stages = sink.0.all::<StageStarted>().count() + sink.0.all::<StageEnded>().count();
        assert_eq!(stages, sink.0.records().len(), "{name}");
    }
}

#[test]
fn the_outcome_does_not_depend_on_the_number_of_threads() {
    let problem = solvable();
    for (name, estimator) in estimators() {
        let on = |threads: usize| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool")
                .install(|| silent(estimator.as_ref(), &problem))
        };
        let alone = on(1);
        assert_eq!(on(2), alone, "{name}");
        assert_eq!(on(8), alone, "{name}");
    }
}

#[test]
fn the_minimum_of_a_direct_method_is_the_least_eligible_cost_that_was_told() {
    let problem = solvable();
    for entry in estimator::all() {
        let mut history = History::default();
        let outcome = entry
            .make(&Params::default())
            .estimate(&problem, &mut Trace::to(&mut history))
            .expect("nobody cancels");
        let Some(cost) = outcome.cost else { continue };
        assert_eq!(
            cost.evaluations,
            1 + history.all::<PoseScored>().count() as u64
        );
        let (_, last) = history.all::<PhaseSearched>().last().expect("was searched");
        let cell = last.surface.minimum().expect("has one");
        assert_eq!(last.surface.eligible_cost(cell), Some(cost.best));
        assert!(cost.best <= cost.initial.expect("textured"));
        assert!(cost.shuffled.expect("textured") > cost.best);
    }
}

/// Checks that every query feature is in one state and that the counts add up.
fn check_states(problem: &Problem) {
    let entry = estimator::entry(Method::FB);
    let mut history = History::default();
    let outcome = entry
        .make(&Params::default())
        .estimate(problem, &mut Trace::to(&mut history))
        .expect("nobody cancels");
    let counts = outcome.counts.expect("features were used");
    let states = &history
        .last::<FeaturesClassified>()
        .expect("always told")
        .states;
    let of = |name: &str| states.iter().filter(|state| state.name() == name).count();
    let [ratio_failed, not_unique, no_depth, outlier, inlier] = FeatureState::NAMES.map(of);

    assert_eq!(states.len(), counts.query_keypoints);
    let all = ratio_failed + not_unique + no_depth + outlier + inlier;
    assert_eq!(all, counts.query_keypoints, "each in exactly one");
    if history.last::<MatchesDecided>().is_some() {
        assert_eq!(counts.ratio_passed, counts.query_keypoints - ratio_failed);
        assert_eq!(counts.unique, counts.ratio_passed - not_unique);
    }
    if let Some(lifted) = history.last::<DepthsLifted>() {
        assert_eq!(lifted.matches.len(), counts.unique);
        assert_eq!(counts.with_depth, counts.unique - no_depth);
        assert_eq!(inlier + outlier, counts.with_depth);
    }
    assert_eq!(inlier, counts.inliers);
    let params = Params::default().fb;
    for state in states.iter() {
        match *state {
            FeatureState::RatioFailed { ratio } => assert!(ratio >= params.ratio as f32),
            FeatureState::NotUnique { rival } => assert!(rival < states.len()),
            FeatureState::NoDepth { distance_px } => assert!(distance_px > params.depth_radius_px),
            FeatureState::Outlier { residual_px } => {
                assert!(residual_px > params.mlesac.inlier_threshold_px);
            }
            FeatureState::Inlier { residual_px } => {
                assert!(residual_px <= params.mlesac.inlier_threshold_px);
            }
        }
    }
    assert!(history.all::<FeaturesDetected>().count() == 2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_feature_ends_in_one_state_and_the_counts_add_up(
        seed in 0_u32..50, other in 0_u32..50, forward in 0.0_f64..3.0,
        kept in 0.0_f64..1.0,
    ) {
        // Equal seeds match, others do not; few points leave many features without a depth.
        let mut cloud = cloud_of_the_walls();
        let keep = (cloud.points.len() as f64 * kept * kept) as usize;
        cloud.points.truncate(keep);
        let reference_seed = if other % 2 == 0 { seed } else { other };
        check_states(&problem(photo(forward, seed), photo(0.0, reference_seed), cloud));
    }
}

/// Stages of a run with a remembering problem, and whether each reused its result.
fn stages_of(estimator: &dyn estimator::Estimator, problem: &Problem) -> Vec<(Stage, bool)> {
    let mut history = History::default();
    estimator
        .estimate(problem, &mut Trace::to(&mut history))
        .expect("nobody cancels");
    history
        .all::<StageEnded>()
        .map(|(_, ended)| (ended.stage, ended.reused))
        .collect()
}

fn remembering() -> Problem {
    let mut problem = solvable();
    let mut query = (*problem.query).clone();
    query.memo = Memo::of(64);
    problem.query = Arc::new(query);
    let mut reference = (*problem.reference).clone();
    reference.memo = Memo::of(64);
    problem.reference = Arc::new(reference);
    problem
}

#[test]
fn a_remembering_problem_has_the_same_outcomes_the_second_time_too() {
    let problem = remembering();
    for (name, estimator) in estimators() {
        let outcome = silent(estimator.as_ref(), &solvable());
        for _ in 0..2 {
            assert_eq!(silent(estimator.as_ref(), &problem), outcome, "{name}");
        }
    }
}

#[test]
fn what_does_not_depend_on_a_changed_parameter_is_reused() {
    let reused_after = |method: Method, change: &str| -> Vec<&'static str> {
        let problem = remembering();
        let entry = estimator::entry(method);
        let first = stages_of(entry.make(&Params::default()).as_ref(), &problem);
        assert!(first.iter().all(|(_, reused)| !reused), "{first:?}");
        let mut params = Params::default();
        params.assign(change).expect("a good assignment");
        stages_of(entry.make(&params).as_ref(), &problem)
            .into_iter()
            .filter_map(|(stage, reused)| reused.then_some(stage.name()))
            .collect()
    };
    let positions = ["color", "position_coarse", "position_fine"];
    assert_eq!(
        reused_after(Method::FB, "fb.accept=paper"),
        ["detect", "match", "ransac"]
    );
    assert_eq!(
        reused_after(Method::FB, "fb.depth_radius=0.5"),
        ["detect", "match"]
    );
    assert_eq!(reused_after(Method::FB, "fb.ratio=0.7"), ["detect"]);
    assert!(reused_after(Method::FB, "surf.threshold=900").is_empty());
    assert_eq!(
        // Around the same coarse yaw the fine angles are the same too.
        reused_after(Method::MI, "grid.yaw_step=2"),
        [&positions[..], &["yaw_fine"]].concat()
    );
    assert_eq!(reused_after(Method::MI, "mi.bins=8"), ["color"]);
    assert_eq!(
        reused_after(Method::PM, "mi.bins=8"),
        [&positions[..], &["yaw_coarse", "yaw_fine"]].concat()
    );
}
