//! The stages by name: the same work for the benches and for the comparison with others.

use posescope::cost::{
    self, BinPair, Entropies, IntensityPair, LesserHalfFinder, Statistic, byte_bin,
};
use posescope::estimator;
use posescope::features::{SiftParams, SurfParams, nearest_neighbours, sift, surf};
use posescope::geometry::Pose;
use posescope::method::Method;
use posescope::params::Params;
use posescope::render::{PointArrays, Scorer, Values, ZBuffer};
use posescope::robust::{MlesacParams, mlesac};
use posescope::solver::p3p;
use posescope::trace::Trace;
use serde_json::{Value, json};

use super::problems::{Outliers, p3p_problems};
use super::{PAIR, poses_of_a_disc, registered_cost, seen_by};

/// Problems of the stage `p3p`.
const P3P_PROBLEMS: usize = 20_000;
/// Trials of each case of robust estimation.
pub const TRIALS: u64 = 10;

/// The features that turn with the image, as those of other programs do.
pub fn turning() -> SurfParams {
    let mut params = SurfParams::default();
    params.upright = false;
    params
}

/// SIFT's that turn with the image, all of them.
pub fn turning_sift() -> SiftParams {
    let mut params = SiftParams::default();
    (params.upright, params.max_keypoints) = (false, 0);
    params
}

/// What a stage does each time it is called; how good the outcome is.
pub type Work<'a> = dyn FnMut() -> Value + 'a;

/// Prepares the stage of a name and hands `measure` its work and how many items one call takes; `None` where no stage
/// is called so.
///
/// Stages are `surf`, `surf_upright`, `sift`, `sift_upright`, `match`, `p3p`, `pose_PERCENT_MATCHES`, `COST_SPLAT` with a cost of
/// the direct methods or `both`, and the methods themselves.
pub fn with_stage<R>(name: &str, measure: impl FnOnce(usize, &mut Work<'_>) -> R) -> Option<R> {
    let (query, reference) = (&PAIR.query().photo().gray, &PAIR.reference().photo().gray);
    if let Some((_, case)) = Outliers::cases().find(|(case, _)| case == name) {
        return Some(robust_pose(case, measure));
    }
    if let Some((cost, splat_px)) = name.split_once('_')
        && let Ok(splat_px) = splat_px.parse()
    {
        return match cost {
            "both" => Some(both_costs(splat_px, measure)),
            name if cost::ALL.iter().any(|entry| entry.name == name) => {
                Some(hypotheses(name, splat_px, measure))
            }
            _ => None,
        };
    }
    Some(match name {
        "surf" | "surf_upright" => {
            let params = if name == "surf" { turning() } else { SurfParams::default() };
            let items = surf(reference, &params).keypoints.len();
            measure(items, &mut || json!(surf(reference, &params).keypoints.len()))
        }
        "sift" | "sift_upright" => {
            let mut params = turning_sift();
            params.upright = name == "sift_upright";
            let items = sift(reference, &params).keypoints.len();
            measure(items, &mut || json!(sift(reference, &params).keypoints.len()))
        }
        "match" => {
            let [query, reference] =
                [query, reference].map(|gray| surf(gray, &turning()).descriptors);
            measure(query.len() * reference.len(), &mut || {
                let found = nearest_neighbours(&query, &reference);
                let sum: usize = found.iter().flatten().map(|found| found.nearest).sum();
                json!({ "sum_of_nearest": sum })
            })
        }
        "p3p" => {
            let problems = p3p_problems(P3P_PROBLEMS);
            measure(problems.len(), &mut || {
                let solutions =
                    problems.iter().map(|(bearings, points)| p3p(bearings, points).len());
                json!({ "solutions": solutions.sum::<usize>() })
            })
        }
        _ => {
            let estimator = estimator::find(name.parse::<Method>().ok()?)?.make(&Params::default());
            measure(1, &mut || {
                let outcome = estimator.estimate(&PAIR, &mut Trace::off());
                json!({ "answered": outcome.is_ok_and(|outcome| outcome.pose.is_ok()) })
            })
        }
    })
}

/// Rendering and judging the hypotheses of a coarse search.
fn hypotheses<R>(
    name: &str,
    splat_px: usize,
    measure: impl FnOnce(usize, &mut Work<'_>) -> R,
) -> R {
    let cost = registered_cost(name);
    let (query, cloud) = seen_by(cost.as_ref());
    let intrinsics = PAIR.query().intrinsics();
    let scorer = Scorer::new(cloud, query, intrinsics, splat_px, cost.as_ref());
    let poses = poses_of_a_disc();
    scorer.score(&poses[..1]);
    measure(poses.len(), &mut || {
        let covered: u32 = scorer.score(&poses).iter().map(|score| score.covered).sum();
        json!({ "covered": covered })
    })
}

/// Rendering each hypothesis once and judging it by PM's cost and MI's, on one thread.
fn both_costs<R>(splat_px: usize, measure: impl FnOnce(usize, &mut Work<'_>) -> R) -> R {
    let information = registered_cost("mi");
    let (query, cloud) = seen_by(information.as_ref());
    let Statistic::Histogram { bins, cost } = information.statistic() else {
        unreachable!("MI looks at a joint histogram");
    };
    let mut halves = LesserHalfFinder::default();
    // What PM and MI look at.
    let both = |value: f32| (value, byte_bin(value, bins));
    let of_points: Vec<_> = cloud.points.iter().map(|point| both(point.intensity)).collect();
    let of_query: Vec<_> = query.iter().copied().map(both).collect();
    let values = Values { query: &of_query, points: &of_points };
    let points = PointArrays::new(cloud.points.iter().map(|point| point.position));
    let mut canvas = ZBuffer::new(PAIR.query().intrinsics(), splat_px);
    let keep = |query: (f32, u8), synthetic: (f32, u8)| {
        let pair = IntensityPair { query: query.0, synthetic: synthetic.0 };
        (pair.squared_difference(), BinPair { query: query.1, synthetic: synthetic.1 })
    };
    let (mut differences, mut bin_pairs, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    let poses = poses_of_a_disc();
    measure(poses.len(), &mut || {
        let (mut covered, mut sum) = (0, 0.0);
        for pose in &poses {
            let pairs = canvas.draw(&points, values, &pose.inverse(), keep);
            differences.clear();
            differences.extend(pairs.iter().map(|pair| pair.0));
            bin_pairs.clear();
            bin_pairs.extend(pairs.iter().map(|pair| pair.1));
            cost::count_pairs(&bin_pairs, |pair| *pair, bins, &mut counts);
            covered += pairs.len();
            let information = cost(&Entropies::of(&counts, bins));
            sum += halves.mean(&differences).unwrap_or_default() + information.unwrap_or_default();
        }
        json!({ "covered": covered, "sum": sum })
    })
}

/// All trials of a case; how many found the pose within 0.3 m, and the median distance from it \[m\].
fn robust_pose<R>(case: Outliers, measure: impl FnOnce(usize, &mut Work<'_>) -> R) -> R {
    let params = MlesacParams::default();
    let drawn: Vec<_> = (0..TRIALS).map(|trial| case.draw(trial)).collect();
    let centre = |pose: &Pose| pose.inverse().translation.vector;
    measure(drawn.len(), &mut || {
        let distances = drawn.iter().map(|(correspondences, truth)| {
            let intrinsics = PAIR.query().intrinsics();
            let found = mlesac(correspondences, intrinsics, &params, 0, |_| Ok::<_, ()>(()));
            found.map_or(f64::INFINITY, |found| (centre(&found.pose) - centre(truth)).norm())
        });
        let mut distances: Vec<f64> = distances.collect();
        distances.sort_by(f64::total_cmp);
        json!({
            "found": distances.iter().filter(|&&distance| distance < 0.3).count(),
            "median_m": distances[distances.len() / 2],
        })
    })
}
