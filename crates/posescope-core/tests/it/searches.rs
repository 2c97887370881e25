//! What every search of every cost must keep. A search is chosen by a parameter, so the same method is
//! tested once for each.

use posescope_core::cost::SearchRule;
use posescope_core::diagnosis::{
    Code, Evidence, Family, PoseConfidence, Subject, Tolerance, confidence, diagnose,
};
use posescope_core::estimator::{self, Failure, Outcome};
use posescope_core::event::{BranchTaken, MinimumAssessed};
use posescope_core::geometry::Pose;
use posescope_core::grid::Offset;
use posescope_core::history::History;
use posescope_core::localize::{localize, localize_traced};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::Problem;
use posescope_core::trace::Trace;

use crate::conformance::within;
use crate::two_walls::{cloud_of_the_walls, photo, problem, solvable};

/// Every method with every search that it can be set to.
fn settings() -> Vec<(String, Method, Params)> {
    let searches = [SearchRule::Grid, SearchRule::MultiStart, SearchRule::Descent];
    let mut settings = Vec::new();
    for entry in estimator::all() {
        let has_search = |key: &String| Params::default().list().iter().any(|row| row.key == *key);
        let key = Some(format!("{}.search", entry.method)).filter(has_search);
        let words = searches.iter().map(|search| search.name()).filter(|_| key.is_some());
        for word in words.map(Some).chain(key.is_none().then_some(None)) {
            let mut params = Params::default();
            if let (Some(key), Some(word)) = (&key, word) {
                params.set(key, word).expect("a search");
            }
            let name = format!("{} {}", entry.method, word.unwrap_or_default());
            settings.push((name, entry.method, params));
        }
    }
    settings
}

fn traced(problem: &Problem, method: Method, params: &Params) -> (Outcome, History) {
    let mut history = History::default();
    let outcome = localize_traced(problem, method, params, &mut Trace::to(&mut history));
    (outcome.expect("nobody cancels"), history)
}

/// The outcome, what it left behind, and its confidence.
fn assessed(
    problem: &Problem,
    method: Method,
    params: &Params,
) -> (Outcome, Evidence, Option<PoseConfidence>) {
    let mut evidence = Evidence::default();
    let outcome = localize_traced(problem, method, params, &mut Trace::to(&mut evidence));
    let outcome = outcome.expect("nobody cancels");
    let confidence = Subject::new(problem, method, params, &outcome, &evidence).confidence;
    (outcome, evidence, confidence)
}

fn codes_and_texts(
    problem: &Problem,
    method: Method,
    params: &Params,
    truth: &Pose,
) -> Vec<(Code, String)> {
    let (outcome, evidence, _) = assessed(problem, method, params);
    let tolerance = Tolerance { translation_m: 0.5, rotation_deg: 5.0 };
    let subject = Subject::new(problem, method, params, &outcome, &evidence);
    let found = diagnose(&subject.against(Some(truth), tolerance));
    found.into_iter().map(|one| (one.code, one.text)).collect()
}

fn strangers() -> Problem {
    problem(photo(1.0, 99), photo(0.0, 5), cloud_of_the_walls())
}

fn with(assignments: &[&str]) -> Params {
    let mut params = Params::default();
    for assignment in assignments {
        params.assign(assignment).expect("a parameter");
    }
    params
}

#[test]
fn every_search_answers_the_same_with_and_without_a_listener() {
    assert_eq!(settings().len(), estimator::all().len() + 6, "three costs have three searches");
    for problem in [solvable(), strangers()] {
        for seed in [0, 11] {
            let problem = problem.clone().with_seed(seed);
            for (name, method, params) in settings() {
                let quiet = localize(&problem, method, &params);
                let (heard, _) = traced(&problem, method, &params);
                assert_eq!(quiet, heard, "{name}, seed {seed}");
            }
        }
    }
}

#[test]
fn a_descent_needs_no_lattice_so_none_is_too_large_for_it() {
    let problem = within(solvable(), 600.0);
    let params = with(&["pm.search=descent"]);
    let quiet = localize(&problem, Method::PM, &params);
    assert!(quiet.pose.is_ok(), "{:?}", quiet.pose);
    let (heard, _) = traced(&problem, Method::PM, &params);
    assert_eq!(quiet, heard);
    // The grid is too large all the same.
    let failure = localize(&problem, Method::PM, &Params::default()).pose.expect_err("too large");
    assert!(matches!(failure, Failure::LatticeTooLarge(_)), "{failure}");
}

#[test]
fn what_is_said_of_a_cost_is_of_the_pose_that_is_answered() {
    let problem = solvable();
    let area = f64::from(problem.query().intrinsics().width * problem.query().intrinsics().height);
    let mut settings = settings();
    // With so much credit the features' pose wins against that of the search.
    let credit = with(&["robust.credit=100"]);
    settings.push(("robust with credit".to_owned(), Method::named("robust"), credit));
    for (name, method, params) in settings {
        let (outcome, history) = traced(&problem, method, &params);
        let Some(cost) = outcome.cost else { continue };
        let pose = outcome.pose.expect("a pose has the cost");
        if name == "robust with credit" {
            let taken = history.last::<BranchTaken>().expect("a candidate was taken");
            assert_ne!(taken.method, Method::named("mi6"));
        }
        let there = estimator::entry(method).make(&params).compare_at(&problem, &pose);
        let there = there.expect("it has a cost").score;
        assert!((there.cost.expect("covered") - cost.best).abs() < 1e-9, "{name}");
        assert!((f64::from(there.covered) / area - cost.coverage_best).abs() < 1e-4, "{name}");
        let minimum = history.last::<MinimumAssessed>().expect("it was assessed");
        let offset = Offset::of(&problem.reference_from_query(&pose));
        assert!(minimum.offset.distance_from(&offset) < 1e-6, "{name}");
        assert_eq!((minimum.best, minimum.shuffled), (cost.best, cost.shuffled), "{name}");
    }
}

#[test]
fn a_confidence_follows_what_counts_as_right() {
    let (problem, params) = (solvable(), Params::default());
    for method in ["fb", "pm", "mi", "fb2", "mi6", "robust"].map(Method::named) {
        let (outcome, evidence, _) = assessed(&problem, method, &params);
        let subject = Subject::new(&problem, method, &params, &outcome, &evidence);
        let evidenced = confidence::evidenced(&subject).expect("a pose");
        let names: Vec<&str> = evidenced.signals.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, confidence::fitted(method).expect("fitted").signals, "{method}");
        let of = |metres, degrees| {
            let right = Tolerance { translation_m: metres, rotation_deg: degrees };
            let subject = Subject::new(&problem, method, &params, &outcome, &evidence);
            subject.against(None, right).confidence.expect("of a pose")
        };
        let (usual, wide) = (of(1.0, 5.0), of(3.0, 9.0));
        assert_eq!(usual.probability, wide.probability, "{method}: of being near at most");
        let held = usual.within_95.expect("an interval");
        let covariance = usual.covariance.expect("a covariance");
        let deviations = covariance.deviations();
        assert_eq!(usual.position_std_m, Some([3, 4, 5].map(|axis| deviations[axis])), "{method}");
        // Of poses that are near, 95 % are within the interval, and few within a hundredth of it.
        let strict = of(0.01 * held.m, held.deg);
        assert!(strict.probability < 0.2 * usual.probability, "{method}: {strict:?}");
        assert_eq!((strict.within.m, strict.within_95), (0.01 * held.m, usual.within_95));
    }
}

#[test]
fn a_search_has_a_confidence_only_where_that_was_fitted_to_it() {
    let problem = solvable();
    for (name, method, params) in settings() {
        let (outcome, _, confidence) = assessed(&problem, method, &params);
        let entry = estimator::entry(method);
        let is_usual = entry.family(&params) == entry.family(&Params::default());
        let is_fitted = is_usual && method != Method::named("nid");
        assert_eq!(confidence.is_some(), outcome.pose.is_ok() && is_fitted, "{name}");
    }
    // A hybrid that takes its second method's answer takes its search too.
    let params = with(&["mi.search=descent", "fb.ratio=0.1"]);
    let (outcome, _, confidence) = assessed(&problem, Method::HY, &params);
    assert!(outcome.fell_back && outcome.pose.is_ok());
    assert_eq!(confidence, None);
}

#[test]
fn a_search_is_the_family_that_its_parameter_says() {
    let family =
        |method: Method, assignments: &[&str]| estimator::entry(method).family(&with(assignments));
    assert_eq!(family(Method::PM, &[]), Some(Family::Grid));
    assert_eq!(family(Method::PM, &["pm.search=starts"]), Some(Family::MultiStart));
    assert_eq!(family(Method::PM, &["pm.search=descent"]), Some(Family::Descent));
    assert_eq!(family(Method::MI, &["pm.search=descent"]), Some(Family::Grid));
    assert_eq!(family(Method::HY, &["mi.search=descent"]), None);
}

#[test]
fn no_verdict_speaks_of_a_search_that_was_not_made() {
    // The truth is named wrongly, so that every search has a cause to be looked for.
    let problem = solvable();
    let elsewhere = problem.reference().world_from_camera() * Pose::translation(2.0, 0.4, 2.2);
    let far = problem.reference().world_from_camera() * Pose::translation(0.0, 0.0, -9.0);
    for cost in ["pm", "mi", "nid"] {
        let method = cost.parse().expect("a method");
        for search in ["starts", "descent"] {
            let params = with(&[&format!("{cost}.search={search}")]);
            for truth in [&elsewhere, &far] {
                let found = codes_and_texts(&problem, method, &params, truth);
                assert!(!found.is_empty(), "{cost} {search}");
                for (code, text) in found {
                    assert!(![Code::D7, Code::D8].contains(&code), "{cost} {search}: {text}");
                    let words = ["grid", "yaw is", "is searched", "coarse", "start led", "phase"];
                    let is_of_a_grid = words.iter().any(|word| text.contains(word));
                    let is_of_the_disc = text.contains("from the reference");
                    assert!(!is_of_a_grid || is_of_the_disc, "{cost} {search}: {text}");
                }
            }
        }
    }
}

#[test]
fn a_descent_that_ends_right_has_no_verdict_and_one_that_was_led_astray_says_so() {
    let params = with(&["pm.search=descent"]);
    // From 1 m away a descent arrives.
    let near = solvable();
    let truth = near.reference().world_from_camera() * Pose::translation(0.0, 0.0, 1.0);
    assert_eq!(codes_and_texts(&near, Method::PM, &params, &truth), []);
    // From 6 m away it ends in another minimum, or outside of the disc.
    let far = problem(photo(6.0, 5), photo(0.0, 5), cloud_of_the_walls());
    let truth = far.reference().world_from_camera() * Pose::translation(0.0, 0.0, 6.0);
    for (radius_m, code, words) in [
        (20.0, Code::D3, "The way down from the reference led elsewhere."),
        (8.0, Code::D8, "lies outside the search, more than 8.0 m from the reference."),
    ] {
        let far = within(far.clone(), radius_m);
        let found = codes_and_texts(&far, Method::PM, &params, &truth);
        assert_eq!(found[0].0, code, "{found:?}");
        assert!(found[0].1.ends_with(words), "{found:?}");
    }
}

#[test]
fn another_seed_draws_other_samples_and_the_same_seed_the_same() {
    let problem = strangers();
    let mut poses = Vec::new();
    for seed in [0, 1, 2, 0] {
        let problem = problem.clone().with_seed(seed);
        let outcome = localize(&problem, Method::named("mi6"), &Params::default());
        poses.push(outcome.pose.expect("a search always ends somewhere"));
    }
    assert_eq!(poses[0], poses[3]);
    assert!(poses[0] != poses[1] && poses[1] != poses[2] && poses[0] != poses[2]);
}
