//! Single decisions of the estimators, on two walls: each parameter changes what it says it does.

use posescope_core::cloud::Cloud;
use posescope_core::diagnosis::{Assessment, Code, Evidence, Subject, Tolerance};
use posescope_core::estimator::{self, Failure, Outcome};
use posescope_core::geometry::Pose;
use posescope_core::localize::{
    LocalizeError, Localizer, NoObserver, QueryResult, Request, evaluate,
};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::Problem;
use posescope_core::trace::Trace;

use crate::conformance::within;
use crate::two_walls::{cloud_of_the_walls, photo, problem, solvable};
use crate::walls_scene::Walls;

fn with(assignments: &[&str]) -> Params {
    let mut params = Params::default();
    for assignment in assignments {
        params.assign(assignment).expect("a good assignment");
    }
    params
}

fn outcome(method: Method, problem: &Problem, params: &Params) -> Outcome {
    estimator::entry(method)
        .make(params)
        .estimate(problem, &mut Trace::off())
        .expect("nobody cancels")
}

#[test]
fn a_consensus_outside_the_uncertainty_radius_is_refused_unless_the_bare_rule_is_asked_for() {
    // The query is 1 m from the reference.
    let near = within(solvable(), 0.5);
    let refused = outcome(Method::FB, &near, &Params::default()).pose;
    let failure = refused.expect_err("it is twice as far as it may be");
    assert!(matches!(failure, Failure::OutsideRadius { .. }), "{failure}");
    // A tenth beyond the radius is allowed.
    assert!(failure.to_string().ends_with("m, where 0.55 m is allowed."), "{failure}");
    assert_eq!(Code::of(&failure), Code::R9);
    for accepting in ["fb.accept=paper", "fb.radius_slack=2"] {
        let pose = outcome(Method::FB, &near, &with(&[accepting])).pose;
        assert!(pose.is_ok(), "{accepting}");
    }
    // Who searches no disc goes by the prior, where there is one.
    let far_prior = near.with_prior(Some(20.0)).expect("a prior");
    let pose = outcome(Method::FB, &far_prior, &Params::default()).pose;
    assert!(pose.is_ok(), "{pose:?}");
}

#[test]
fn the_guarded_depth_rule_drops_keypoints_at_depth_edges_and_only_those() {
    // Behind the left wall lies a second surface that the nearest-point rule does not notice.
    let mut points = cloud_of_the_walls().points;
    let behind: Vec<_> =
        points.iter().filter(|point| point.z < 13.0).map(|point| point * 2.0).collect();
    points.extend(behind);
    let edged = problem(photo(1.0, 5), photo(0.0, 5), Cloud { points });
    let with_depth = |problem: &Problem, rule: &str| {
        let outcome = outcome(Method::FB, problem, &with(&[rule]));
        outcome.counts.expect("features were used").with_depth
    };
    let nearest = with_depth(&edged, "fb.depth=nearest");
    let guarded = with_depth(&edged, "fb.depth=guarded");
    assert!(0 < guarded && guarded < nearest, "{guarded} of {nearest}");
    // On single walls the guard drops no more than the edge between them.
    let plain = solvable();
    let kept = with_depth(&plain, "fb.depth=guarded");
    assert!(10 * kept >= 8 * with_depth(&plain, "fb.depth=nearest"), "{kept}");
}

#[test]
fn without_the_uniqueness_test_every_match_that_passes_the_ratio_goes_on() {
    let problem = problem(photo(1.0, 5), photo(0.0, 6), cloud_of_the_walls());
    let counts = |assignment: &str| {
        let params = with(&["fb.ratio=1", assignment]);
        let outcome = outcome(Method::FB, &problem, &params);
        outcome.counts.expect("features were used")
    };
    let (strict, lax) = (counts("fb.unique=true"), counts("fb.unique=false"));
    assert!(strict.unique < strict.ratio_passed);
    assert_eq!(lax.unique, lax.ratio_passed);
}

#[test]
fn a_fused_hybrid_takes_the_first_methods_poses_alone_where_a_reference_has_one() {
    // The query is 1 m from one reference, where FB is refused, and 0.5 m from the other.
    let (scene, params) = (Walls::new(), Params::default());
    let localizer = Localizer::new(&scene, &scene, &params, 7);
    let request = Request {
        radius_m: 0.7,
        references: vec![0, 2].into(),
        fusions: vec!["avg".parse().expect("a fusion")],
        setting: None,
    };
    for methods in [&[Method::FB, Method::MI, Method::HY][..], &[Method::HY]] {
        let mut results = Vec::new();
        let keep = |result: QueryResult, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        localizer
            .localize(0, 1, std::slice::from_ref(&request), methods, &mut NoObserver, keep)
            .expect("good data");
        let hybrid = results.pop().expect("the last method is the hybrid");
        let alone = hybrid.per_reference.expect("two references");
        // MI answered where FB was refused: its search has a cost.
        assert!(alone.iter().all(|result| result.pose.is_some()));
        let fell_back: Vec<bool> = alone.iter().map(|result| result.cost.is_some()).collect();
        assert_eq!(fell_back, [true, false]);
        assert_eq!(hybrid.pose, alone[1].pose);
        if let Some(feature_based) = results.first() {
            assert_eq!(hybrid.pose, feature_based.pose);
        }
    }
}

#[test]
fn with_hy_per_reference_a_fused_hybrid_averages_the_poses_of_both_methods() {
    let scene = Walls::new();
    let mut params = Params::default();
    params.hy.per_reference = true;
    let localizer = Localizer::new(&scene, &scene, &params, 7);
    let request = Request {
        radius_m: 0.7,
        references: vec![0, 2].into(),
        fusions: vec!["avg".parse().expect("a fusion")],
        setting: None,
    };
    let mut results = Vec::new();
    let keep = |result: QueryResult, _| {
        results.push(result);
        Ok::<(), LocalizeError>(())
    };
    localizer.localize(0, 1, &[request], &[Method::HY], &mut NoObserver, keep).expect("good data");
    let hybrid = results.pop().expect("a result");
    let alone = hybrid.per_reference.as_deref().expect("two references");
    let position = |result: &QueryResult| result.pose.as_ref().expect("a pose").position_m;
    let [fused, first, second] = [position(&hybrid), position(&alone[0]), position(&alone[1])];
    for axis in 0..3 {
        let mean = (first[axis] + second[axis]) / 2.0;
        assert!((fused[axis] - mean).abs() < 1e-9, "{fused:?} {mean}");
    }
}

#[test]
fn the_cost_at_the_truth_is_that_of_the_true_pose_and_absent_without_one() {
    let problem = solvable();
    let params = Params::default();
    let result = |method, truth: Option<&Pose>| {
        let outcome = outcome(method, &problem, &params);
        let evidence = Evidence::default();
        let subject = Subject::new(&problem, method, &params, &outcome, &evidence);
        let subject = subject.against(truth, Tolerance::default());
        evaluate("two walls", &subject, Assessment::of(&subject))
    };
    // If the reference pose were the true one, its cost would be the initial cost.
    let reference = problem.reference().world_from_camera();
    for method in [Method::PM, Method::MI] {
        let cost = result(method, Some(reference)).cost.expect("a direct method");
        assert!(cost.initial.is_some());
        assert_eq!(cost.truth, cost.initial, "{}", method.name());
        let unknown = result(method, None);
        assert_eq!(unknown.cost.expect("a direct method").truth, None);
        assert_eq!((unknown.error, unknown.initial_error), (None, None));
    }
    assert_eq!(result(Method::FB, Some(reference)).cost, None);
}
