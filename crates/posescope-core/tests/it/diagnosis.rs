//! Verdicts: what is said of results that are right, wrong or missing.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::{UnitQuaternion, Vector3};
use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::diagnosis::Code;
use posescope_core::diagnosis::{Diagnosis, Evidence, Subject, Tolerance, diagnose};
use posescope_core::event::{JudgedPose, KindSet};
use posescope_core::geometry::Pose;
use posescope_core::localize::{
    LocalizeError, LocalizeObserver, Localizer, NoObserver, QueryResult, Request, StageTimes,
    localize_traced,
};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::{Problem, Query};
use posescope_core::trace::{Cancelled, Record, Sink, Trace};

use crate::conformance::{remembering, within};
use crate::two_walls::{cloud_of_the_walls, photo, problem, solvable};
use crate::walls_scene::Walls;

/// The methods that search from many starts, match again, and judge between both.
const BESIDE_THE_PAPER: [Method; 3] =
    [Method::named("mi6"), Method::named("fb2"), Method::named("robust")];

/// Where the query really is: 1 m ahead of the reference.
fn truth(problem: &Problem) -> Pose {
    problem.reference().world_from_camera() * Pose::translation(0.0, 0.0, 1.0)
}

fn with(assignments: &[&str]) -> Params {
    let mut params = Params::default();
    for assignment in assignments {
        params.assign(assignment).expect("a parameter");
    }
    params
}

fn verdicts(
    problem: &Problem,
    method: Method,
    params: &Params,
    truth: Option<&Pose>,
) -> Vec<Diagnosis> {
    let mut evidence = Evidence::default();
    let mut trace = Trace::to(&mut evidence);
    let outcome = localize_traced(problem, method, params, &mut trace).expect("nobody cancels");
    let subject = Subject::new(problem, method, params, &outcome, &evidence);
    let tolerance = Tolerance { translation_m: 0.5, rotation_deg: 5.0 };
    let found = diagnose(&subject.against(truth, tolerance));
    for finding in &found {
        assert_plain(&finding.text);
    }
    found
}

/// At most two sentences of about twenty words, and the second may be the reason that a method reported.
fn assert_plain(text: &str) {
    let text = text.replace(" (lower is better)", "");
    let sentences: Vec<&str> = text.split_inclusive(". ").collect();
    let longest = sentences.iter().map(|one| one.split_whitespace().count());
    assert!(sentences.len() <= 2, "{text}");
    assert!(longest.max().unwrap_or(0) <= 22, "{text}");
    assert!(text.ends_with('.') && text.starts_with(char::is_uppercase), "{text}");
}

fn codes(found: &[Diagnosis]) -> Vec<Code> {
    found.iter().map(|finding| finding.code).collect()
}

fn primary(found: &[Diagnosis]) -> Option<Code> {
    found.first().map(|finding| finding.code)
}

#[test]
fn a_pose_that_is_right_carries_at_most_low_confidence() {
    let problem = solvable();
    for method in Method::PAPER.into_iter().chain(BESIDE_THE_PAPER) {
        let found = verdicts(&problem, method, &Params::default(), Some(&truth(&problem)));
        assert!(codes(&found).iter().all(|code| !code.is_failure()), "{method}: {found:?}");
    }
}

#[test]
fn a_truth_that_the_photos_contradict_is_suspect() {
    let problem = solvable();
    let wrong = truth(&problem) * Pose::translation(2.0, 0.0, 0.0);
    let found = verdicts(&problem, Method::FB, &Params::default(), Some(&wrong));
    assert_eq!(primary(&found), Some(Code::X1), "{found:?}");
    assert!(found[0].evidence["inliers"].as_u64() > found[0].evidence["supports_truth"].as_u64());
}

/// About the axis of a turn, many matches agree with both poses.
#[test]
fn a_truth_that_is_rolled_against_the_photo_is_suspect_whatever_the_method() {
    let problem = solvable();
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 12_f64.to_radians());
    let rolled = truth(&problem) * roll;
    for method in Method::PAPER.into_iter().chain(BESIDE_THE_PAPER) {
        let found = verdicts(&problem, method, &Params::default(), Some(&rolled));
        assert_eq!(primary(&found), Some(Code::X1), "{method}: {found:?}");
        let words = ["The ground truth is suspect", "° from it"];
        let has = |found: &Diagnosis| words.iter().all(|words| found.text.contains(words));
        assert!(has(&found[0]), "{method}: {found:?}");
    }
}

#[test]
fn a_cloud_in_millimetres_is_suspect_with_and_without_the_truth() {
    let mut cloud = cloud_of_the_walls();
    for point in &mut cloud.points {
        *point *= 1000.0;
    }
    let problem = problem(photo(1.0, 5), photo(0.0, 5), cloud);
    for truth in [Some(truth(&problem)), None] {
        for method in [Method::FB, Method::MI] {
            let found = verdicts(&problem, method, &Params::default(), truth.as_ref());
            assert_eq!(primary(&found), Some(Code::X1), "{method}: {found:?}");
        }
    }
}

#[test]
fn another_camera_is_suspected_from_the_matches() {
    let problem = solvable();
    let query = problem.query();
    let stated = *query.intrinsics();
    // A longer focal length alone looks like a camera that stands nearer.
    let other = Intrinsics {
        fx: 0.8 * stated.fx,
        fy: 0.8 * stated.fy,
        cx: stated.cx + 20.0,
        cy: stated.cy - 15.0,
        ..stated
    };
    let query = Query::new(query.name(), Arc::clone(query.photo()), other).expect("a camera");
    let problem = problem.with_query(query);
    let found = verdicts(&problem, Method::FB, &Params::default(), Some(&truth(&problem)));
    assert_eq!(primary(&found), Some(Code::X1), "{found:?}");
    let focal_length = found[0].evidence["camera"]["fx"].as_f64().expect("a camera");
    assert!((focal_length - 180.0).abs() < 6.0, "{focal_length}");
}

#[test]
fn a_truth_beyond_the_disc_is_outside_the_grid() {
    let problem = within(solvable(), 3.0);
    let far = problem.reference().world_from_camera() * Pose::translation(0.0, 0.0, 9.0);
    let found = verdicts(&problem, Method::PM, &Params::default(), Some(&far));
    assert!(codes(&found).contains(&Code::D4), "{found:?}");
    let outside = found.iter().find(|finding| finding.code == Code::D4).expect("D4");
    assert_eq!(outside.evidence["distance_m"], 9.0);
}

#[test]
fn what_is_remembered_of_a_search_is_said_of_no_other() {
    let problem = solvable();
    let remembering = remembering(&problem);
    let at = |right, ahead| {
        problem.reference().world_from_camera() * Pose::translation(right, 0.0, ahead)
    };
    let truths = [None, Some(at(0.0, 1.0)), Some(at(2.0, 1.0)), Some(at(0.0, 9.0))];
    let settings = [
        with(&[]),
        with(&["grid.coarse_step=3", "grid.fine_range=0"]),
        with(&["mi.bins=8", "render.splat_px=3", "fb.accept=consensus", "fb.radius_slack=0"]),
    ];
    let mut failures = 0;
    // The second time all is at hand.
    for _ in 0..2 {
        for (params, truth) in settings
            .iter()
            .flat_map(|params| truths.iter().map(move |truth| (params, truth.as_ref())))
        {
            for method in Method::PAPER {
                let found = verdicts(&remembering, method, params, truth);
                assert_eq!(found, verdicts(&problem, method, params, truth), "{method}");
                failures += usize::from(found.iter().any(|finding| finding.code.is_failure()));
            }
        }
    }
    assert!(failures > 20, "{failures}");
}

#[test]
fn the_look_of_one_pose_is_not_taken_for_that_of_another() {
    let problem = solvable();
    let remembering = remembering(&problem);
    let believed = |problem: &Problem, params: &Params| {
        let mut evidence = Evidence::default();
        let mut trace = Trace::to(&mut evidence);
        let outcome = localize_traced(problem, Method::FB, params, &mut trace);
        let outcome = outcome.expect("nobody cancels");
        let subject = Subject::new(problem, Method::FB, params, &outcome, &evidence);
        let confidence = subject.confidence.expect("of a pose");
        (outcome.pose.expect("a pose"), confidence)
    };
    let settings = ["fb.ratio=0.8", "fb.ratio=0.5"].map(|setting| with(&[setting]));
    let told = settings.each_ref().map(|params| believed(&remembering, params));
    assert_ne!(told[0].0, told[1].0);
    for (params, told) in settings.iter().zip(told) {
        assert_eq!(told, believed(&problem, params));
    }
}

#[test]
fn a_truth_beyond_the_prior_is_said_of_a_pose_that_was_accepted_elsewhere() {
    let problem = within(solvable(), 3.0);
    let at = |metres| problem.reference().world_from_camera() * Pose::translation(0.0, 0.0, metres);
    let found = |truth: Pose| verdicts(&problem, Method::FB, &Params::default(), Some(&truth));
    // A tenth beyond the prior is allowed.
    let beyond = found(at(3.4));
    let outside = beyond.iter().find(|finding| finding.code == Code::R9);
    let outside = outside.expect("R9");
    let words = "The truth is outside the prior: 3.40 m from the reference, 3.30 m allowed.";
    assert_eq!(outside.text, words);
    let within = found(at(3.2));
    assert!(primary(&within).is_some(), "wrong all the same");
    assert!(!codes(&within).contains(&Code::R9), "{within:?}");
}

#[test]
fn poses_that_are_read_the_wrong_way_round_are_suspect() {
    let problem = solvable();
    let reference = problem.reference().world_from_camera();
    let from_query = Pose::translation(0.0, 0.0, 1.0);
    // As stated, the query is elsewhere; with both poses inverted it is where it is.
    let stated = from_query.inverse() * reference;
    // PM says of two walls that its pose is hardly likely, and then a reading is none.
    for method in [Method::FB, Method::MI] {
        let found = verdicts(&problem, method, &Params::default(), Some(&stated));
        assert_eq!(primary(&found), Some(Code::X1), "{method}: {found:?}");
        let reading = found[0].evidence["reading"].as_str();
        assert!(reading.is_some_and(|words| words.contains("inverted")), "{method}");
    }
}

#[test]
fn a_query_that_shows_nothing_has_too_few_features_and_costs_that_tell_nothing() {
    let grey = image::GrayImage::from_pixel(240, 100, image::Luma([90]));
    let problem = problem(grey, photo(0.0, 5), cloud_of_the_walls());
    let truth = truth(&problem);
    for truth in [Some(&truth), None] {
        for (method, code) in
            [(Method::FB, Code::R2), (Method::PM, Code::D5), (Method::MI, Code::D5)]
        {
            let found = verdicts(&problem, method, &Params::default(), truth);
            assert_eq!(primary(&found), Some(code), "{method}: {found:?}");
        }
    }
}

#[test]
fn a_search_in_steps_over_the_truth_failed_and_not_the_cost() {
    let problem = solvable();
    let params = with(&["grid.coarse_step=3", "grid.fine_range=0.2"]);
    let found = verdicts(&problem, Method::PM, &params, Some(&truth(&problem)));
    assert_eq!(primary(&found), Some(Code::D3), "{found:?}");
    let evidence = &found[0].evidence;
    assert!(evidence["cost_near_truth"].as_f64() < evidence["cost_at_result"].as_f64());
    assert_eq!(evidence["lost_in"], "position, coarse");
}

#[test]
fn a_search_from_one_start_that_hardly_moves_failed_and_not_the_cost() {
    let problem = solvable();
    let params = with(&[
        "grid.coarse_step=10",
        "mi6.yaws=1",
        "mi6.coarse_shrink=1",
        "mi6.first_step=0.01",
        "mi6.six_step=0.001",
        "mi6.last_step=0.001",
    ]);
    let mi6 = Method::named("mi6");
    let found = verdicts(&problem, mi6, &params, Some(&truth(&problem)));
    assert_eq!(primary(&found), Some(Code::D3), "{found:?}");
    let cost = |name: &str| found[0].evidence[name].as_f64().expect("a cost");
    assert!(cost("cost_near_truth") < cost("cost_at_result"));
}

#[test]
fn where_the_truth_leads_away_from_itself_the_cost_failed() {
    let problem = solvable();
    let wrong = truth(&problem) * Pose::translation(2.0, 0.0, 0.0);
    for method in ["mi6", "robust"].map(Method::named) {
        let found = verdicts(&problem, method, &Params::default(), Some(&wrong));
        assert!(codes(&found).contains(&Code::D2), "{method}: {found:?}");
        assert!(!codes(&found).contains(&Code::D3), "{method}: {found:?}");
        let outside = truth(&problem) * Pose::translation(0.0, 0.0, 60.0);
        let found = verdicts(&problem, method, &Params::default(), Some(&outside));
        assert!(codes(&found).contains(&Code::D4), "{method}: {found:?}");
    }
    let found = verdicts(&problem, BESIDE_THE_PAPER[1], &Params::default(), Some(&wrong));
    assert_eq!(primary(&found), Some(Code::X1), "{found:?}");
}

#[test]
fn a_judge_that_passes_over_what_is_right_answers_for_it() {
    let problem = solvable();
    let params = Params::default();
    let robust = Method::named("robust");
    let mut evidence = Evidence::default();
    let mut trace = Trace::to(&mut evidence);
    let mut outcome =
        localize_traced(&problem, robust, &params, &mut trace).expect("nobody cancels");
    let candidates = evidence.candidates.clone().expect("several poses");
    let mut taken = candidates.iter().find(|one| !one.from_features).expect("of mi6").clone();
    taken.refined.pose *= Pose::translation(3.0, 0.0, 0.0);
    outcome.pose = Ok(problem.world_from_query(&taken.refined.pose));
    let truth = truth(&problem);
    let mut found_of = |is_there: fn(&JudgedPose) -> bool| {
        let others = candidates.iter().filter(|one| is_there(one)).cloned();
        evidence.candidates = Some([taken.clone()].into_iter().chain(others).collect());
        let subject = Subject::new(&problem, robust, &params, &outcome, &evidence);
        diagnose(&subject.against(Some(&truth), Tolerance::default()))
    };
    let found = found_of(|_| true);
    assert_eq!(primary(&found), Some(Code::H1), "{found:?}");
    // Between two minima of one method, its cost or its search decided.
    let found = found_of(|one| !one.from_features);
    assert!(!codes(&found).contains(&Code::H1), "{found:?}");
    let is_of_the_search = |code: &Code| [Code::D2, Code::D3].contains(code);
    assert!(codes(&found).iter().any(is_of_the_search), "{found:?}");
}

#[test]
fn the_true_matches_only_become_fewer_on_their_way() {
    // The ratio leaves hardly any match, so that there is something to explain.
    let problem = solvable();
    let found = verdicts(&problem, Method::FB, &with(&["fb.ratio=0.1"]), Some(&truth(&problem)));
    assert_eq!(primary(&found), Some(Code::R3), "{found:?}");
    let funnel = &found[0].evidence["true_matches"];
    let count = |stage: &str| funnel[stage].as_u64().expect("a count");
    let stages = ["with_depth", "visible", "detected"].map(count);
    assert!(stages.is_sorted_by(|a, b| a >= b), "{funnel}");
    let matches = ["nearest", "ratio", "unique"].map(count);
    assert!(matches.is_sorted_by(|a, b| a >= b), "{funnel}");
    assert!(matches[0] > 20 && matches[2] < 8, "{funnel}");
}

#[test]
fn nothing_is_said_of_matches_that_were_never_sought() {
    let problem = solvable();
    let params = with(&["surf.threshold=1000000"]);
    let found = verdicts(&problem, Method::FB, &params, Some(&truth(&problem)));
    assert_eq!(codes(&found), [Code::R2], "{found:?}");
    // The ratio test leaves no match: R3 says so, and R4 does not speak of depths.
    let found = verdicts(&problem, Method::FB, &with(&["fb.ratio=0.1"]), Some(&truth(&problem)));
    assert_eq!(primary(&found), Some(Code::R3), "{found:?}");
    assert!(!codes(&found).contains(&Code::R4), "{found:?}");
}

#[test]
fn matches_of_the_place_without_depths_speak_of_depths_and_not_of_another_place() {
    let few = cloud_of_the_walls().points.into_iter().step_by(4000).collect();
    let problem = problem(photo(1.0, 5), photo(0.0, 5), Cloud { points: few });
    for method in [Method::FB, Method::named("fb2")] {
        let found = verdicts(&problem, method, &Params::default(), None);
        assert_eq!(codes(&found), [Code::R4], "{method}: {found:?}");
    }
}

/// Nothing else of the evidence changes with the pose.
#[test]
fn a_pose_at_which_the_photos_agree_less_is_less_likely_right() {
    let problem = solvable();
    let params = Params::default();
    for method in ["mi6", "robust"].map(Method::named) {
        let mut evidence = Evidence::default();
        let mut trace = Trace::to(&mut evidence);
        let found = localize_traced(&problem, method, &params, &mut trace).expect("nobody cancels");
        // All are near 1, so that how likely they are wrong tells more.
        let doubt = |shift: Pose| {
            let mut outcome = found.clone();
            outcome.pose = found.pose.clone().map(|pose| pose * shift);
            let subject = Subject::new(&problem, method, &params, &outcome, &evidence);
            1.0 - subject.confidence.expect("a pose").probability
        };
        let at_minimum = doubt(Pose::identity());
        for elsewhere in [Pose::translation(2.0, 0.0, 0.0), Pose::translation(0.0, 0.0, -3.0)] {
            let elsewhere = doubt(elsewhere);
            assert!(elsewhere > 3.0 * at_minimum, "{method}: {elsewhere}, {at_minimum}");
        }
    }
}

#[test]
fn a_limit_of_keypoints_that_is_reached_is_named() {
    let problem = solvable();
    let params = with(&["surf.max_keypoints=5"]);
    let found = verdicts(&problem, Method::FB, &params, Some(&truth(&problem)));
    assert_eq!(primary(&found), Some(Code::R2), "{found:?}");
    assert!(found[0].text.ends_with("The limit is surf.max_keypoints=5."), "{found:?}");
}

#[test]
fn what_is_said_to_help_helps() {
    let scene = Walls::new();
    let params = with(&["grid.coarse_step=3", "grid.fine_range=0.2"]);
    let tolerance: Tolerance = "0.4m,5deg".parse().expect("a tolerance");
    let request =
        Request { radius_m: 3.0, references: vec![0].into(), fusions: Vec::new(), setting: None };
    let run = |params: &Params, explaining: usize| {
        let localizer = Localizer::new(&scene, &scene, params, 7)
            .with_tolerance(tolerance)
            .explaining(explaining);
        let mut results = Vec::new();
        let keep = |result: QueryResult, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        let requests = std::slice::from_ref(&request);
        localizer
            .localize(0, 1, requests, &[Method::PM], &mut NoObserver, keep)
            .expect("good data");
        results.pop().expect("a result")
    };
    let result = run(&params, 12);
    let explanation = result.explanation.expect("it went wrong");
    assert!(explanation.complete && explanation.runs <= 12);
    let settings: Vec<_> = explanation
        .helped
        .iter()
        .filter(|helped| helped.args.iter().step_by(2).all(|name| name == "--set"))
        .collect();
    assert!(!settings.is_empty(), "{:?}", explanation.helped);
    for helped in settings {
        let mut changed = params.clone();
        for assignment in helped.args.iter().skip(1).step_by(2) {
            changed.assign(assignment).expect("a parameter");
        }
        assert_eq!(run(&changed, 0).error, Some(helped.error), "{:?}", helped.args);
    }
    // A result that is right needs no explanation.
    assert_eq!(run(&Params::default(), 12).explanation, None);
}

/// Notes what is told of explanations, and stops after so many remedies.
#[derive(Default)]
struct Listener {
    told: Vec<String>,
    most: Option<usize>,
    flag: Arc<AtomicBool>,
}

impl Sink for Listener {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }
    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
    fn attend(&mut self) -> Result<(), Cancelled> {
        Err(Cancelled)
    }
}

impl LocalizeObserver for Listener {
    fn end_method(&mut self, result: &QueryResult, _times: &StageTimes) {
        assert_eq!(result.explanation, None);
        self.told.push(result.method.to_string());
    }
    fn explaining(&mut self, result: &QueryResult, tried: usize, remedies: usize) {
        assert!(tried < remedies);
        self.told.push(format!("{} {tried}", result.method));
        if self.most == Some(tried) {
            self.flag.store(true, Ordering::Release);
        }
    }
    fn explained(&mut self, result: &QueryResult) {
        assert!(result.explanation.is_some());
        self.told.push(format!("{} explained", result.method));
    }
    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.flag))
    }
}

#[test]
fn all_answers_come_before_explanations_and_a_stopped_one_says_that_it_is_incomplete() {
    let scene = Walls::new();
    let params = with(&["grid.coarse_step=3", "grid.fine_range=0.2"]);
    let request =
        Request { radius_m: 3.0, references: vec![0].into(), fusions: Vec::new(), setting: None };
    let run = |listener: &mut Listener| {
        let localizer = Localizer::new(&scene, &scene, &params, 7)
            .with_tolerance("0.4m,5deg".parse().expect("a tolerance"))
            .explaining(3);
        let mut results = Vec::new();
        let keep = |result: QueryResult, times: StageTimes| {
            results.push((result, times));
            Ok::<(), LocalizeError>(())
        };
        let (requests, methods) = ([request.clone()], [Method::PM, Method::MI]);
        let done = localizer.localize(0, 1, &requests, &methods, listener, keep);
        (results, done.is_ok())
    };
    let mut listener = Listener::default();
    let (results, is_done) = run(&mut listener);
    assert!(is_done);
    let expected = [
        "pm",
        "mi",
        "pm 0",
        "pm 1",
        "pm 2",
        "pm explained",
        "mi 0",
        "mi 1",
        "mi 2",
        "mi explained",
    ];
    assert_eq!(listener.told, expected);
    for (result, times) in &results {
        // Had a remedy of another method done the work before, it would have taken no time.
        assert!(times.total() > Duration::ZERO, "{}", result.method);
        let explanation = result.explanation.as_ref().expect("it went wrong");
        assert!(explanation.complete && explanation.runs == 3);
    }
    let mut stopped = Listener { most: Some(1), ..Listener::default() };
    let (results, is_done) = run(&mut stopped);
    assert!(!is_done);
    let explanations: Vec<_> = results.iter().map(|(result, _)| &result.explanation).collect();
    let first = explanations[0].as_ref().expect("it was begun");
    assert!(!first.complete && first.runs == 1, "{first:?}");
    // What was computed is handed out all the same.
    assert_eq!((explanations.len(), explanations[1]), (2, &None));
}

#[test]
fn a_pose_that_is_less_certain_than_asked_for_is_refused() {
    let (scene, params) = (Walls::new(), Params::default());
    let request =
        Request { radius_m: 3.0, references: vec![0].into(), fusions: Vec::new(), setting: None };
    let mut results = Vec::new();
    for needed in [None, Some(1.0)] {
        let localizer = Localizer::new(&scene, &scene, &params, 7).accepting_from(needed);
        let keep = |result: QueryResult, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        let requests = std::slice::from_ref(&request);
        localizer
            .localize(0, 1, requests, &[Method::FB], &mut NoObserver, keep)
            .expect("good data");
    }
    let probability = results[0].confidence.as_ref().map(|one| one.probability);
    assert!(probability.is_some_and(|p| (0.0..1.0).contains(&p)), "{probability:?}");
    let reason = results[1].reason.as_ref().expect("no pose is that certain");
    assert_eq!(reason.code, Code::L1);
    assert_eq!(results[1].pose, None);
}

#[test]
fn a_method_may_ask_for_more_certainty_than_nobody_does() {
    let (scene, request) = (
        Walls::new(),
        Request { radius_m: 3.0, references: vec![0].into(), fusions: Vec::new(), setting: None },
    );
    let fb2 = Method::named("fb2");
    let answered = |least_probability: f64| {
        let mut params = Params::default();
        params.fb2.least_probability = least_probability;
        let mut results = Vec::new();
        let keep = |result: QueryResult, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        let requests = std::slice::from_ref(&request);
        Localizer::new(&scene, &scene, &params, 7)
            .localize(0, 1, requests, &[fb2], &mut NoObserver, keep)
            .expect("good data");
        results.pop().expect("one method")
    };
    let (always, never) = (answered(0.0), answered(1.0));
    assert!(always.pose.is_some(), "{:?}", always.reason);
    assert_eq!(never.pose, None);
    let reason = never.reason.expect("no pose is that certain");
    assert_eq!(reason.code, Code::L1);
    assert_eq!(always.confidence, never.confidence, "how certain it is, it says all the same");
}
