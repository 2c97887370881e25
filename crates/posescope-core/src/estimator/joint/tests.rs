use super::*;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::cost::SearchRule;
use crate::diagnosis::Code;
use crate::estimator::{Entry, all, methods};
use crate::geometry::yaw;
use crate::image::Photo;
use crate::problem::{Query, ReferenceTuple};
use nalgebra::{Point2, Point3, Vector3};

const CAMERA: Intrinsics =
    Intrinsics { fx: 180.0, fy: 180.0, cx: 119.5, cy: 49.5, width: 240, height: 100 };

/// Brightness of a tile of a wall.
fn tile(right: f64, down: f64, texture: u32) -> f64 {
    let number = |place: f64| (place + 1000.0).floor() as u32;
    let mixed =
        number(right).wrapping_mul(0x9E37_79B9) ^ number(down).wrapping_mul(0x85EB_CA6B) ^ texture;
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from((mixed ^ (mixed >> 12)) >> 24)
}

/// Where a pixel's ray meets the walls: one at 12 m on the left, one at 17 m on the right.
fn seen(pose: &Pose, pixel: Point2<f64>) -> Point3<f64> {
    let centre = pose.translation.vector;
    let ray = pose.rotation * CAMERA.unproject(&pixel, 1.0).coords;
    let at = |depth: f64| Point3::from(centre + ray * ((depth - centre.z) / ray.z));
    let near = at(12.0);
    if near.x < -0.6 { near } else { at(17.0) }
}

fn pixels() -> impl Iterator<Item = Point2<f64>> {
    let row = |y| (0..CAMERA.width).map(move |x| Point2::new(f64::from(x), f64::from(y)));
    (0..CAMERA.height).flat_map(row)
}

fn photo(pose: &Pose, texture: u32) -> Photo {
    let value = |pixel| {
        let point = seen(pose, pixel);
        let coarse = tile(point.x / 0.9, point.y / 0.7, texture);
        let fine = tile(point.x / 0.31, point.y / 0.29, texture);
        (0.6 * coarse + 0.4 * fine) as u8
    };
    let values = pixels().map(value).collect();
    Photo::from_gray_values(CAMERA.width, CAMERA.height, values).expect("of that size")
}

/// A reference at a place of the world, with a scan of the columns in a range.
fn reference(pose: Pose, texture: u32, columns: std::ops::Range<f64>) -> Arc<ReferenceTuple> {
    let scanned = pixels().filter(|pixel| columns.contains(&pixel.x));
    let cloud: Cloud = scanned
        .map(|pixel| (pose.inverse() * seen(&pose, pixel)).cast::<f32>())
        .map(|point: Point3<f32>| [point.x, point.y, point.z])
        .collect();
    let name = format!("{:.1}", pose.translation.x + 100.0 * pose.translation.z);
    let photo = photo(&pose, texture);
    Arc::new(ReferenceTuple::new(name, photo, CAMERA, pose, cloud).expect("fits"))
}

fn truth() -> Pose {
    let centre = Vector3::new(0.4, 0.0, 2.0);
    Pose::from_parts(centre.into(), yaw(0.02))
}

const TEXTURE: u32 = 0;
const WIDTH: f64 = 240.0;

fn places() -> [Pose; 3] {
    [(0.0, 0.0), (0.6, 0.8), (-0.4, 1.4)].map(|(x, z)| Pose::translation(x, 0.0, z))
}

fn problems(references: Vec<Arc<ReferenceTuple>>) -> Vec<Problem> {
    problems_at(&truth(), references)
}

/// Those of a query elsewhere.
fn problems_at(place: &Pose, references: Vec<Arc<ReferenceTuple>>) -> Vec<Problem> {
    let query = Query::new("query", photo(place, TEXTURE), CAMERA).expect("fits");
    let query = Arc::new(query);
    let problem = |reference| Problem::new(Arc::clone(&query), reference, 4.0).expect("fits");
    references.into_iter().map(problem).collect()
}

fn jointly(
    method: Method,
    problems: &[Problem],
    matches: &[usize],
) -> (Result<Pose, Failure>, Vec<Share>) {
    let params = Params::default();
    let alone: Vec<_> = problems
        .iter()
        .map(|problem| crate::localize::localize(problem, method, &params).pose)
        .collect();
    let references: Vec<_> = problems
        .iter()
        .zip(&alone)
        .zip(matches)
        .map(|((problem, alone), &matches)| JointReference {
            problem,
            matches,
            alone: alone.as_ref().ok(),
        })
        .collect();
    estimate_jointly(method, &params, &references, &mut Trace::off()).expect("nobody cancels")
}

fn off_m(pose: &Pose) -> f64 {
    PoseError::between(&truth(), pose).translation_m
}

#[test]
fn of_one_reference_a_joint_pose_is_its_own() {
    let problems = problems(vec![reference(places()[1], TEXTURE, 0.0..WIDTH)]);
    for method in ["fb", "pm", "mi", "nid", "hy"] {
        let method: Method = method.parse().expect("registered");
        let alone = crate::localize::localize(&problems[0], method, &Params::default()).pose;
        let (pose, shares) = jointly(method, &problems, &[50]);
        assert!(pose.is_ok(), "{method}");
        assert_eq!(pose, alone, "{method}");
        assert_eq!(shares[0].weight, 1.0, "{method}");
        assert_eq!(shares[0].outcome, ShareOutcome::Kept, "{method}");
    }
}

#[test]
fn references_that_agree_share_the_pose_and_one_of_another_place_is_left_out() {
    let mut references: Vec<_> =
        places().into_iter().map(|pose| reference(pose, TEXTURE, 0.0..WIDTH)).collect();
    references.push(reference(Pose::translation(0.2, 0.0, 0.6), 77, 0.0..WIDTH));
    let problems = problems(references);
    for method in ["fb", "mi", "hy"] {
        let method: Method = method.parse().expect("registered");
        let (pose, shares) = jointly(method, &problems, &[50, 60, 70, 9]);
        let pose = pose.expect("three of four agree");
        assert!(off_m(&pose) < 0.3, "{method}: {}", off_m(&pose));
        let total: f64 = shares.iter().map(|share| share.weight).sum();
        assert!((total - 1.0).abs() < 1e-12, "{method}");
        for share in &shares[..3] {
            assert_eq!(share.outcome, ShareOutcome::Kept, "{method} {share:?}");
        }
        assert_ne!(shares[3].outcome, ShareOutcome::Kept, "{method} {:?}", shares[3]);
    }
}

#[test]
fn the_height_of_a_reference_does_not_bind_several() {
    let raised_m = 0.3;
    let place = truth() * Pose::translation(0.07, -raised_m, 0.09);
    let references = places().map(|pose| reference(pose, TEXTURE, 0.0..WIDTH));
    let problems = problems_at(&place, references.into());
    for method in [Method::PM, Method::MI] {
        let (pose, _) = jointly(method, &problems, &[50, 60, 70]);
        let between = place.inverse() * pose.expect("all agree");
        let off_m = between.translation.y.abs();
        assert!(off_m < 0.5 * raised_m, "{method}: {off_m}");
    }
}

#[test]
fn a_heading_beyond_the_grid_of_one_reference_is_started_from_where_another_found_it() {
    let headed = |yaw_rad: f64, x: f64| {
        let pose = Pose::from_parts(Vector3::new(x, 0.0, 0.4).into(), yaw(yaw_rad));
        reference(pose, TEXTURE, 0.0..WIDTH)
    };
    // The first has the most matches, and its grid ends at 10 of the 17 degrees.
    let place = Pose::from_parts(Vector3::new(0.2, 0.0, 1.0).into(), yaw(0.3));
    let problems = problems_at(&place, vec![headed(0.0, 0.0), headed(0.3, 0.5)]);
    let (pose, _) = jointly(Method::MI, &problems, &[90, 20]);
    let error = PoseError::between(&place, &pose.expect("both see it"));
    assert!(error.translation_m < 0.2 && error.rotation_deg < 1.0, "{error}");
}

#[test]
fn what_each_reference_sees_too_little_of_is_enough_together() {
    let slices = (0..8).map(|i| {
        let (from, pose) = (30.0 * f64::from(i), places()[i as usize % 3]);
        reference(pose, TEXTURE, from..from + 30.0)
    });
    let problems = problems(slices.collect());
    let params = Params::default();
    let alone = problems
        .iter()
        .filter(|problem| crate::localize::localize(problem, Method::FB, &params).pose.is_ok())
        .count();
    let (pose, shares) = jointly(Method::FB, &problems, &[9; 8]);
    let pose = pose.expect("together they are enough");
    assert!(off_m(&pose) < 0.2, "{}", off_m(&pose));
    let supporting = shares.iter().filter(|share| share.weight > 0.0).count();
    assert!(supporting > alone, "{supporting} of 8, {alone} of them alone");
}

#[test]
fn the_same_reference_many_times_is_no_more_evidence_than_once() {
    let other = reference(places()[0], 77, 0.0..WIDTH);
    let copy = |name: &str| {
        Arc::new(ReferenceTuple { name: name.to_owned(), ..ReferenceTuple::clone(&other) })
    };
    let problems = problems(["a", "b", "c", "d", "e"].map(copy).into());
    let (pose, shares) = jointly(Method::FB, &problems, &[9; 5]);
    assert_eq!(pose.map_err(|failure| Code::of(&failure)), Err(Code::R3));
    assert!(shares.iter().all(|share| share.weight == 0.0));
    assert!(shares.iter().all(|share| share.outcome == ShareOutcome::Failed));
}

#[test]
fn a_joint_pose_does_not_depend_on_the_number_of_threads() {
    let references = places().map(|pose| reference(pose, TEXTURE, 0.0..WIDTH));
    let problems = problems(references.into());
    for method in [Method::FB, Method::MI] {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let run = || jointly(method, &problems, &[9, 8, 7]);
            pool.expect("a pool").install(run)
        };
        assert_eq!(on(1), on(3), "{method}");
    }
}

#[test]
fn a_method_that_takes_one_reference_at_a_time_says_so() {
    let problems = problems(vec![reference(places()[0], TEXTURE, 0.0..WIDTH)]);
    let references = [JointReference { problem: &problems[0], matches: 9, alone: None }];
    let params = Params::default();
    let mut jointly = Vec::new();
    for method in methods() {
        let (pose, shares) = estimate_jointly(method, &params, &references, &mut Trace::off())
            .expect("nobody cancels");
        if matches!(pose, Err(Failure::NotJoint { method: of, search: None }) if of == method) {
            assert_eq!(shares[0].outcome, ShareOutcome::Failed);
        } else {
            jointly.push(method.name());
        }
    }
    // A hybrid has a joint pose where its methods have one.
    let has_joint = |entry: &&Entry| {
        let joins = [Family::Features, Family::Grid];
        entry.hybrid().is_some() || entry.family(&params).is_some_and(|of| joins.contains(&of))
    };
    let expected: Vec<_> = all().iter().filter(has_joint).map(|one| one.method.name()).collect();
    assert_eq!(jointly, expected);
}

#[test]
fn a_search_that_takes_one_reference_at_a_time_says_so_and_no_grid_is_searched_instead() {
    let problems = problems(vec![reference(places()[0], TEXTURE, 0.0..WIDTH)]);
    let references = [JointReference { problem: &problems[0], matches: 9, alone: None }];
    for (search, word) in [(SearchRule::Descent, "descent"), (SearchRule::MultiStart, "starts")] {
        let mut params = Params::default();
        params.set("pm.search", word).expect("a search");
        let (pose, _) =
            estimate_jointly(Method::PM, &params, &references, &mut Trace::off()).expect("runs");
        let failure = pose.expect_err("it does not search a grid");
        assert_eq!(failure, Failure::NotJoint { method: Method::PM, search: Some(search) });
        assert!(failure.to_string().starts_with(&format!("pm with search={word} takes one")));
        // What is another method's search is none of MI's.
        let (pose, _) =
            estimate_jointly(Method::MI, &params, &references, &mut Trace::off()).expect("runs");
        assert!(!matches!(pose, Err(Failure::NotJoint { .. })));
    }
}

#[test]
fn without_references_there_is_no_joint_pose() {
    let params = Params::default();
    let (pose, _) =
        estimate_jointly(Method::FB, &params, &[], &mut Trace::off()).expect("nobody cancels");
    assert_eq!(pose, Err(Failure::NoReference { radius_m: None }));
}
