use nalgebra::{Matrix2x3, Matrix2x6, Matrix3, Matrix6};
use posescope::camera::Intrinsics;
use posescope::depth::LiftedMatch;
use posescope::diagnosis::Evidence;
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::solver::Correspondence;
use posescope::trace::Trace;

use crate::Failure;
use crate::numbers::{percent, print_table};

/// Other signals that a given pose is wrong; the greater, the likelier.
pub const SIGNALS: [&str; 4] =
    ["few inliers", "small share of inliers", "standard deviation", "distance from the reference"];

/// The matches of a query with a depth, by which other signals judge a pose.
pub struct Matched<'a> {
    problem: &'a Problem,
    correspondences: Vec<Correspondence>,
    inlier_px: f64,
}

impl<'a> Matched<'a> {
    pub fn of(problem: &'a Problem, params: &Params) -> Result<Self, Failure> {
        let mut evidence = Evidence::default();
        let fb = estimator::entry(Method::FB).make(params);
        // Matches count where they give no pose, too.
        fb.estimate(problem, &mut Trace::to(&mut evidence))?;
        let correspondences = match (&evidence.query, &evidence.lifted) {
            (Some(features), Some(lifted)) => {
                let pixel = |one: &LiftedMatch| features.keypoints[one.query].pixel();
                let lifted = lifted.iter();
                let lifted = lifted.filter_map(|one| {
                    Some(Correspondence { pixel: pixel(one), point: one.point? })
                });
                lifted.collect()
            }
            _ => Vec::new(),
        };
        let inlier_px = params.fb.mlesac.inlier_threshold_px;
        Ok(Self { problem, correspondences, inlier_px })
    }

    /// The signals of a pose, `world_from_camera`, in the order of [`SIGNALS`].
    pub fn signals(&self, given: &Pose) -> [f64; SIGNALS.len()] {
        let camera = self.problem.query().intrinsics();
        let reference_from_query = self.problem.reference_from_query(given);
        let query_from_reference = reference_from_query.inverse();
        let residual_px = |one: &Correspondence| {
            let seen = camera.project(&(query_from_reference * one.point));
            seen.map_or(f64::INFINITY, |pixel| (pixel - one.pixel).norm())
        };
        let all = self.correspondences.iter();
        let inliers: Vec<&Correspondence> =
            all.filter(|one| residual_px(one) <= self.inlier_px).collect();
        let square: f64 = inliers.iter().map(|one| residual_px(one).powi(2)).sum();
        let information = inliers.iter().fold(Matrix6::zeros(), |sum, one| {
            let jacobian = jacobian(camera, &(query_from_reference * one.point).coords);
            sum + jacobian.transpose() * jacobian
        });
        // Two numbers for each inlier, less six for the pose.
        let freedom = (2.0 * inliers.len() as f64 - 6.0).max(1.0);
        let covariance = information.try_inverse().filter(|_| inliers.len() > 3);
        let deviation_m = covariance.map_or(f64::INFINITY, |covariance| {
            let of_position = covariance.fixed_view::<3, 3>(3, 3).trace();
            (of_position * square / freedom).sqrt()
        });
        let count = inliers.len() as f64;
        let share = count / self.correspondences.len().max(1) as f64;
        let reference = PoseError::between(&Pose::identity(), &reference_from_query);
        [-count, -share, deviation_m, reference.translation_m]
    }
}

/// How a pixel moves with a turn and a shift of its camera, at a point in the camera's frame.
fn jacobian(camera: &Intrinsics, p: &nalgebra::Vector3<f64>) -> Matrix2x6<f64> {
    let z = p.z.recip();
    let of_point = Matrix2x3::new(
        camera.fx * z,
        0.0,
        -camera.fx * p.x * z * z,
        0.0,
        camera.fy * z,
        -camera.fy * p.y * z * z,
    );
    let mut all = Matrix2x6::zeros();
    all.fixed_columns_mut::<3>(0).copy_from(&(of_point * p.cross_matrix()));
    all.fixed_columns_mut::<3>(3).copy_from(&(-of_point * Matrix3::identity()));
    all
}

/// Prints for each score, larger where it suspects a pose, the share of wrong poses that it names at some rates of false
/// alarms, and the area under its curve. A case is whether the pose is wrong, and its scores.
pub fn print_curves(names: &[&str], cases: &[(bool, Vec<f64>)]) {
    const RATES: [f64; 7] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
    let rows = names.iter().enumerate().map(|(score, name)| {
        let of = |is_wrong: bool| {
            let those = cases.iter().filter(|(wrong, _)| *wrong == is_wrong);
            let mut scores: Vec<f64> = those.map(|(_, scores)| scores[score]).collect();
            scores.sort_by(f64::total_cmp);
            scores
        };
        let (right, wrong) = (of(false), of(true));
        let above =
            |sorted: &[f64], limit: f64| sorted.len() - sorted.partition_point(|s| *s <= limit);
        let named = RATES.map(|rate| {
            // The least limit that leaves no more false alarms than that.
            let alarms = (rate * right.len() as f64) as usize;
            let limit = right.get(right.len().saturating_sub(alarms + 1));
            let count = above(&wrong, limit.copied().unwrap_or(f64::INFINITY));
            format!("{:.1} %", percent(count, wrong.len()))
        });
        // The share of pairs that it puts in the right order; of equal scores, half.
        let ordered: f64 = right
            .iter()
            .map(|score| {
                let above = above(&wrong, *score) as f64;
                let below = wrong.partition_point(|other| other < score) as f64;
                above + 0.5 * (wrong.len() as f64 - above - below)
            })
            .sum();
        let area = ordered / (right.len() * wrong.len()).max(1) as f64;
        [vec![(*name).to_owned()], named.to_vec(), vec![format!("{area:.3}")]].concat()
    });
    print_table("signal,0.5 %,1 %,2 %,5 %,10 %,20 %,50 %,area", &rows.collect::<Vec<_>>());
}
