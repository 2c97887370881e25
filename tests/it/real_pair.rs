//! The authors' pair of KITTI 00, in both directions: what the four methods attain there.

use std::sync::Arc;

use posescope::estimator;
use posescope::event::{DepthsLifted, FeaturesDetected, Side};
use posescope::geometry::{Pose, PoseError};
use posescope::history::History;
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::robust::mlesac;
use posescope::scene;
use posescope::solver::Correspondence;
use posescope::trace::Trace;

use crate::binary::run_in;
use crate::data;

/// The sequence with the authors' pair, 003814 and 003823.
pub fn authors_pair() -> Option<std::path::PathBuf> {
    data::sample("kitti/sequences/00")
}

/// The problem and the official pose of the query.
fn pair(query: &str, reference: &str) -> Option<(Problem, Pose)> {
    let folder = authors_pair()?;
    let scene = scene::open(folder.to_str()?, None).unwrap_or_else(|error| panic!("{error}"));
    let frame = |name| scene.find(name).expect("is there");
    let problem = Problem::new(
        scene.query(frame(query)).expect("readable"),
        scene.reference(frame(reference)).expect("readable"),
        15.0,
    )
    .expect("a radius");
    Some((problem, scene.pose(frame(query)).expect("is known")))
}

fn error_of(method: Method, problem: &Problem, truth: &Pose) -> PoseError {
    let outcome = estimator::entry(method)
        .make(&Params::default())
        .estimate(problem, &mut Trace::off())
        .expect("nobody cancels");
    let pose = outcome.pose.unwrap_or_else(|failure| panic!("{failure}"));
    PoseError::between(truth, &pose)
}

/// The correspondences that FB hands to MLESAC; they do not depend on the seed.
fn correspondences(problem: &Problem) -> Vec<Correspondence> {
    let mut history = History::default();
    estimator::entry(Method::FB)
        .make(&Params::default())
        .estimate(problem, &mut Trace::to(&mut history))
        .expect("nobody cancels");
    let query = history
        .all::<FeaturesDetected>()
        .find(|(_, event)| event.side == Side::Query)
        .map(|(_, event)| Arc::clone(&event.features))
        .expect("was told");
    let lifted = history.last::<DepthsLifted>().expect("was told");
    lifted
        .matches
        .iter()
        .filter_map(|lifted| {
            Some(Correspondence {
                pixel: query.keypoints[lifted.query].pixel(),
                point: lifted.point?,
            })
        })
        .collect()
}

#[test]
fn fb_recovers_the_pair_in_both_directions_for_nearly_every_seed() {
    for (query, reference) in [("3823", "3814"), ("3814", "3823")] {
        let Some((problem, truth)) = pair(query, reference) else {
            return;
        };
        let correspondences = correspondences(&problem);
        let params = Params::default().fb.mlesac;
        let mut errors: Vec<PoseError> = (0..100)
            .map(|seed| {
                let consensus =
                    mlesac(&correspondences, problem.query().intrinsics(), &params, seed, |_| {
                        Ok::<_, ()>(())
                    })
                    .expect("there is a consensus");
                PoseError::between(&truth, &problem.world_from_query(&consensus.pose.inverse()))
            })
            .collect();
        errors.sort_by(|a, b| a.translation_m.total_cmp(&b.translation_m));
        let good = errors
            .iter()
            .filter(|error| error.translation_m <= 0.5 && error.max_euler_deg <= 1.0)
            .count();
        println!(
            "{query} from {reference}: {good} of 100 within 0.5 m and 1°, median {:.3} m, worst {:.3} m",
            errors[50].translation_m, errors[99].translation_m
        );
        assert!(good >= 95);
        assert!(errors[50].translation_m <= 0.25);
    }
}

#[test]
fn the_direct_methods_end_about_a_metre_off_because_height_is_frozen() {
    let Some((problem, truth)) = pair("3823", "3814") else {
        return;
    };
    for method in [Method::MI, Method::PM] {
        let error = error_of(method, &problem, &truth);
        println!("{}: {error:?}", method.name());
        assert!(error.translation_m <= 1.3, "{}", method.name());
        assert!(error.max_euler_deg <= 1.5, "{}", method.name());
    }
}

#[test]
fn the_hybrid_returns_the_feature_based_pose_where_that_is_accepted() {
    let Some((problem, _)) = pair("3823", "3814") else {
        return;
    };
    let [indirect, hybrid] = [Method::FB, Method::HY].map(|method| {
        estimator::entry(method)
            .make(&Params::default())
            .estimate(&problem, &mut Trace::off())
            .expect("nobody cancels")
    });
    assert!(indirect.pose.is_ok());
    assert_eq!(indirect, hybrid);
}

/// As a user asks: with the limits on confidence, for which a pose may be refused.
#[test]
fn the_methods_beyond_the_paper_answer_both_ways() {
    let Some(folder) = authors_pair() else {
        return;
    };
    let out = tempfile::tempdir().expect("a folder");
    for (query, reference) in [("3823", "3814"), ("3814", "3823")] {
        let asked = format!(
            "run {} --query {query} --reference {reference} --method fb2,mi6,robust --json pair.jsonl -q",
            folder.display()
        );
        run_in(out.path(), &asked).ok();
        let lines = std::fs::read_to_string(out.path().join("pair.jsonl")).expect("results");
        let results: Vec<QueryResult> =
            lines.lines().map(|line| serde_json::from_str(line).expect("a result")).collect();
        assert_eq!(results.len(), 3);
        for result in results {
            let method = result.method;
            let error = result.error.unwrap_or_else(|| panic!("{method} has no pose"));
            println!("{query} from {reference}: {method} {error}");
            assert!(error.translation_m <= 0.25 && error.max_euler_deg <= 0.3, "{method}: {error}");
        }
    }
}
