//! What every estimator must keep. It walks over the registry, so a new entry is tested by being
//! there.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use image::{GrayImage, Luma};
use nalgebra::Point3;
use posescope_core::cloud::Cloud;
use posescope_core::cost::{
    self, Cost, Entropies, IntensityPair, Photometric, QueryChannel, Statistic,
};
use posescope_core::diagnosis::Code;
use posescope_core::estimator::{self, Family, Outcome};
use posescope_core::event::{
    DepthsLifted, Event, FeaturesClassified, FeaturesDetected, HypothesisTried, KindSet,
    MatchesDecided, PhaseSearched, PoseScored, Stage, StageEnded, StageStarted, StartsRefined,
};
use posescope_core::features::FeatureState;
use posescope_core::geometry::Pose;
use posescope_core::history::History;
use posescope_core::image::gaussian_smoothed;
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::{Problem, Query, ReferenceTuple};
use posescope_core::render::{Objective as _, Scorer, color_cloud};
use posescope_core::trace::{Cancelled, Record, Sink, Trace};
use proptest::prelude::*;

use crate::two_walls::{CAMERA, cloud_of_the_walls, photo, problem, solvable};

/// Problems with nothing to go by.
fn hopeless() -> Vec<(&'static str, Problem)> {
    let flat = || GrayImage::from_pixel(CAMERA.width, CAMERA.height, Luma([90]));
    let one_point = Cloud { points: vec![Point3::new(0.0, 0.0, 9.0)] };
    let behind = Cloud { points: vec![Point3::new(0.0, 0.0, -9.0); 50] };
    vec![
        ("flat query and reference", problem(flat(), flat(), cloud_of_the_walls())),
        ("no cloud", problem(photo(1.0, 5), photo(0.0, 5), Cloud::default())),
        ("a cloud behind the camera", problem(photo(1.0, 5), photo(0.0, 5), behind)),
        ("one point", problem(flat(), photo(0.0, 5), one_point)),
    ]
}

pub fn estimators() -> impl Iterator<Item = (&'static str, Box<dyn estimator::Estimator>)> {
    estimator::all().iter().map(|entry| (entry.method.name(), entry.make(&Params::default())))
}

pub fn silent(estimator: &dyn estimator::Estimator, problem: &Problem) -> Outcome {
    estimator.estimate(problem, &mut Trace::off()).expect("nobody cancels")
}

#[test]
fn every_estimator_finds_the_pose_and_says_the_same_whoever_listens() {
    let problem = solvable();
    for (name, estimator) in estimators() {
        let outcome = silent(estimator.as_ref(), &problem);
        let pose = outcome.pose.as_ref().unwrap_or_else(|f| panic!("{name}: {f}"));
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

/// Runs something on 32 threads: as many hypotheses are scored at a time as on any other number.
pub fn on_many_threads<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(32).build();
    pool.expect("a pool").install(work)
}

/// A cost that looks at each pair in a way of its own.
struct Own<F>(F);

impl<F: Fn(&[IntensityPair]) -> Option<f64> + Send + Sync> Cost for Own<F> {
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(0.0)
    }
    fn statistic(&self) -> Statistic<'_> {
        Statistic::of_pairs(&self.0)
    }
}

#[test]
fn what_is_scored_at_a_time_is_bounded_and_scored_once() {
    let problem = solvable();
    let query = Arc::new(gaussian_smoothed(&problem.query().photo().gray, 0.0));
    let reference = problem.reference();
    let cloud = color_cloud(
        reference.cloud(),
        &reference.photo().gray,
        reference.intrinsics(),
        &Params::default().render,
    );
    let judged = AtomicUsize::new(0);
    let cost = Own(|pairs: &[IntensityPair]| {
        judged.fetch_add(1, Ordering::Relaxed);
        Some(pairs.len() as f64)
    });
    let scorer = Scorer::new(cloud, query, &CAMERA, 1, &cost);
    assert!(on_many_threads(|| scorer.batch(1)) <= 300);
    let poses: Vec<_> = (0..70).map(|i| Pose::translation(0.0, 0.0, 0.02 * f64::from(i))).collect();
    let at_once = scorer.score(&poses);
    assert_eq!(judged.load(Ordering::Relaxed), poses.len());
    let one_by_one: Vec<_> =
        poses.iter().flat_map(|pose| scorer.score(std::slice::from_ref(pose))).collect();
    assert_eq!(at_once, one_by_one);
}

/// Mutual information with as many bins as one likes.
struct ManyBins(usize);

impl Cost for ManyBins {
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(1.0)
    }
    fn statistic(&self) -> Statistic<'_> {
        let cost = Entropies::normalized_mutual_information;
        Statistic::Histogram { bins: self.0, cost }
    }
}

/// What depends on the order of the pairs.
fn in_order(pairs: &[IntensityPair]) -> Option<f64> {
    let weighed =
        (1..).zip(pairs).map(|(place, pair)| f64::from(place) * f64::from(pair.synthetic));
    Some(weighed.sum())
}

#[test]
fn what_the_search_scores_is_what_the_view_shows() {
    let problem = solvable();
    let reference = problem.reference();
    let registered = cost::ALL.iter().map(|entry| (entry.make)() as Box<dyn Cost>);
    // More bins than a byte tells apart are scored the plain way.
    let many = [16, 256, 300].map(|bins| Box::new(ManyBins(bins)) as Box<dyn Cost>);
    let mut squared_again = Photometric::default();
    squared_again.power = 2;
    let squared_again: Box<dyn Cost> = Box::new(squared_again);
    let own = [squared_again, Box::new(Own(in_order))];
    let poses: Vec<_> =
        (0..9).map(|i| Pose::translation(0.1 * f64::from(i), 0.0, 0.3 * f64::from(i))).collect();
    for cost in registered.chain(many).chain(own) {
        let visible = reference.visible_cloud(&Params::default().render);
        let cloud = visible.colored_by(cost.reference_channel().of(&reference.photo().gray));
        let query = cost.query_channel().of(&problem.query().photo().gray);
        let (cloud, query) = (Arc::new(cloud), Arc::new(query));
        for splat_px in [1, 3] {
            let (cloud, query) = (Arc::clone(&cloud), Arc::clone(&query));
            let scorer = Scorer::new(cloud, query, &CAMERA, splat_px, cost.as_ref());
            let shown: Vec<_> = poses.iter().map(|pose| scorer.compare(pose).score).collect();
            assert!(shown.iter().all(|score| score.cost.is_some()));
            assert_eq!(scorer.score(&poses), shown);
        }
    }
}

#[test]
fn a_grid_beyond_the_limit_is_a_failure_and_no_allocation() {
    let problem = within(solvable(), 500.0);
    let mut params = Params::default();
    params.assign("grid.coarse_step=0.05").expect("a good value");
    for entry in estimator::all() {
        let outcome = silent(entry.make(&params).as_ref(), &problem);
        match outcome.counts {
            // FB searches no grid, and the hybrid takes its pose.
            Some(_) => assert!(outcome.pose.is_ok()),
            None => {
                let failure = outcome.pose.expect_err("400 million hypotheses");
                assert_eq!(Code::of(&failure), Code::D9);
                let said = failure.to_string();
                assert!(said.contains("400040001") && said.contains("grid.coarse_step"), "{said}");
            }
        }
    }
}

#[test]
fn trials_that_are_not_remembered_are_told_again_all_the_same() {
    // No photo shows the other: no sample is ever good enough, and all trials are drawn.
    let (problem, mut params) = (remembering(&problem_of_strangers()), Params::default());
    let changes = [
        "fb.max_trials=30000",
        "fb.confidence=0.999999",
        "fb.ratio=1",
        "fb.unique=false",
        "fb.depth_radius=50",
        "fb.inlier=0.2",
    ];
    for change in changes {
        params.assign(change).expect("a good value");
    }
    let fb = estimator::entry(Method::FB).make(&params);
    let quiet = silent(fb.as_ref(), &problem);
    let told = || {
        let mut history = History::default();
        let outcome = fb.estimate(&problem, &mut Trace::to(&mut history));
        assert_eq!(outcome.expect("nobody cancels"), quiet);
        let trials: Vec<_> =
            history.all::<HypothesisTried>().map(|(_, tried)| tried.trial).collect();
        trials
    };
    let first = told();
    assert!(first.len() > 20_000, "{}", first.len());
    assert_eq!(told(), first);
}

#[test]
fn stages_nest_and_every_one_that_starts_ends() {
    for problem in [solvable()].into_iter().chain(hopeless().into_iter().map(|h| h.1)) {
        for (name, estimator) in estimators() {
            let mut history = History::default();
            estimator.estimate(&problem, &mut Trace::to(&mut history)).expect("nobody cancels");
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
    struct WantsNothing(History);
    impl Sink for WantsNothing {
        fn wanted(&self) -> KindSet {
            KindSet::NONE
        }
        fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
            self.0.accept(record)
        }
    }
    for (name, estimator) in estimators() {
        let mut sink = WantsNothing(History::default());
        estimator.estimate(&solvable(), &mut Trace::to(&mut sink)).expect("nobody cancels");
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
        assert!(cost.best <= cost.initial.expect("textured"));
        assert!(cost.shuffled.expect("textured") > cost.best);
        // What is refined after the lattices has no cell there.
        if entry.family(&Params::default()) == Some(Family::MultiStart) {
            let (_, refined) = history.all::<StartsRefined>().last().expect("was refined");
            assert!(cost.best <= refined.refinements[0].start.cost);
            continue;
        }
        assert_eq!(cost.evaluations, 1 + history.all::<PoseScored>().count() as u64);
        let (_, last) = history.all::<PhaseSearched>().last().expect("was searched");
        let cell = last.surface.minimum().expect("has one");
        assert_eq!(last.surface.eligible_cost(cell), Some(cost.best));
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
    let states = &history.last::<FeaturesClassified>().expect("always told").states;
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
    estimator.estimate(problem, &mut Trace::to(&mut history)).expect("nobody cancels");
    history.all::<StageEnded>().map(|(_, ended)| (ended.stage, ended.reused)).collect()
}

fn problem_of_strangers() -> Problem {
    problem(photo(1.0, 99), photo(0.0, 5), cloud_of_the_walls())
}

#[test]
fn a_remembering_problem_has_the_same_outcomes_the_second_time_too() {
    let problem = remembering(&solvable());
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
        let problem = remembering(&solvable());
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
    assert_eq!(reused_after(Method::FB, "fb.accept=paper"), ["detect", "match", "ransac"]);
    assert_eq!(reused_after(Method::FB, "fb.depth_radius=0.5"), ["detect", "match"]);
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

/// The same problem, where the query is sought within another radius \[m\].
pub fn within(problem: Problem, radius_m: f64) -> Problem {
    problem.with_radius(radius_m).expect("a radius")
}

/// The same problem, where estimators keep what they compute of both frames.
pub fn remembering(problem: &Problem) -> Problem {
    let query = Query::clone(problem.query()).remembering();
    let reference = ReferenceTuple::clone(problem.reference()).remembering();
    problem.clone().with_query(query).with_reference(reference)
}
