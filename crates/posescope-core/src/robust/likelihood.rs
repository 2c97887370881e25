//! The mixture that MLESAC scores a hypothesis with.

use std::f64::consts::TAU;

use fearless_simd::{Level, dispatch};

use super::params::MlesacParams;
use crate::camera::Intrinsics;
use crate::geometry::Pose;
use crate::solver::Correspondence;

/// Share of the uniform density below which the Gaussian is left out. With σ = 1 px on a KITTI
/// image that is so beyond 6.7 px, and EM has a handful of residuals to look at instead of all.
const NEGLIGIBLE: f64 = 1e-5;

/// How well a pose explains all correspondences.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct LikelihoodScore {
    /// Logarithm of the likelihood of the residuals, each a density per px².
    pub log_likelihood: f64,
    /// γ, the estimated share of true matches.
    #[serde(skip)]
    pub mixing: f64,
    /// Correspondences within the inlier threshold.
    pub inliers: usize,
}

/// The likelihood of the residuals `e` of a pose, `Π γ N(e; 0, σ² I) + (1 − γ) / A`, with the
/// image area `A` and the γ that maximises it.
///
/// Torr, Zisserman, *MLESAC*, CVIU 2000, section 4; a false match lands anywhere in the image.
pub(super) struct Likelihood {
    level: Level,
    blocks: Vec<Block>,
    correspondences: usize,
    focal: [f64; 2],
    variance: f64,
    /// Density of a false match \[1/px²\].
    background: f64,
    squared_threshold: f64,
    /// Squared residual beyond which a match is surely false \[px²\].
    squared_reach: f64,
    em_iterations: usize,
    /// Squared residuals within reach, kept to save the allocation \[px²\].
    near: Vec<f64>,
}

/// Densities that are multiplied before one logarithm is taken of all: so few that the product is neither too
/// small nor too large for a number.
const AT_A_TIME: usize = 8;

/// Correspondences side by side in a block, so that the compiler projects several at a time.
const LANES: usize = 8;

/// [`LANES`] correspondences, one array per coordinate. The last block is filled up with NaN,
/// which is within reach of nothing.
struct Block {
    point: [[f64; LANES]; 3],
    /// Pixel of the normalised image plane.
    ray: [[f64; LANES]; 2],
}

impl Block {
    fn new(correspondences: &[Correspondence], intrinsics: &Intrinsics) -> Self {
        let mut block = Self { point: [[f64::NAN; LANES]; 3], ray: [[f64::NAN; LANES]; 2] };
        for (lane, correspondence) in correspondences.iter().enumerate() {
            for (axis, coordinates) in block.point.iter_mut().enumerate() {
                coordinates[lane] = correspondence.point[axis];
            }
            let ray = intrinsics.unproject(&correspondence.pixel, 1.0);
            for (axis, coordinates) in block.ray.iter_mut().enumerate() {
                coordinates[lane] = ray[axis];
            }
        }
        block
    }
}

impl Likelihood {
    pub(super) fn new(
        correspondences: &[Correspondence],
        intrinsics: &Intrinsics,
        params: &MlesacParams,
    ) -> Self {
        let variance = params.sigma_px * params.sigma_px;
        let background = intrinsics.area().recip();
        let squared_threshold = params.inlier_threshold_px * params.inlier_threshold_px;
        let reach = -2.0 * variance * (TAU * variance * background * NEGLIGIBLE).ln();
        Self {
            level: Level::new(),
            blocks: correspondences
                .chunks(LANES)
                .map(|chunk| Block::new(chunk, intrinsics))
                .collect(),
            correspondences: correspondences.len(),
            focal: [intrinsics.fx, intrinsics.fy],
            variance,
            background,
            squared_threshold,
            squared_reach: reach.max(squared_threshold),
            em_iterations: params.em_iterations,
            near: Vec::new(),
        }
    }

    /// The score of a pose `camera_from_points`.
    pub(super) fn score(&mut self, pose: &Pose) -> LikelihoodScore {
        self.collect_near(pose);
        let inliers =
            self.near.iter().filter(|&&squared| squared <= self.squared_threshold).count();
        for squared in &mut self.near {
            // From here on the density of a true match.
            *squared = (-0.5 * *squared / self.variance).exp() / (TAU * self.variance);
        }
        let (far, total) = (self.correspondences - self.near.len(), self.correspondences as f64);
        // EM from γ = ½: the share of true matches is the mean of what each is expected to be.
        let mut mixing = 0.5;
        for _ in 0..self.em_iterations {
            let false_match = (1.0 - mixing) * self.background;
            let near = &self.near;
            let expected = dispatch!(self.level, _simd => expected(near, mixing, false_match));
            mixing = expected / total;
        }
        let false_match = (1.0 - mixing) * self.background;
        let densities = self
            .near
            .chunks(AT_A_TIME)
            .map(|some| some.iter().map(|density| mixing * density + false_match).product::<f64>());
        let mut log_likelihood: f64 = densities.map(f64::ln).sum();
        if far > 0 {
            log_likelihood += far as f64 * false_match.ln();
        }
        LikelihoodScore { log_likelihood, mixing, inliers }
    }

    /// Collects the squared residuals within reach, in front of the camera.
    fn collect_near(&mut self, pose: &Pose) {
        // A place more, where what is not near is written.
        self.near.resize(self.correspondences + 1, 0.0);
        let count = dispatch!(self.level, _simd => self.put_near(pose));
        self.near.truncate(count);
    }

    #[inline(always)]
    fn put_near(&mut self, pose: &Pose) -> usize {
        let r = pose.rotation.to_rotation_matrix().into_inner();
        let t = pose.translation.vector;
        let [fx, fy] = self.focal;
        let mut count = 0;
        for Block { point: [x, y, z], ray: [u, v] } in &self.blocks {
            let mut depth = [0.0; LANES];
            let mut squared_error = [0.0; LANES];
            let mut excess = [0.0; LANES];
            for i in 0..LANES {
                let seen_x = r.m11 * x[i] + r.m12 * y[i] + r.m13 * z[i] + t.x;
                let seen_y = r.m21 * x[i] + r.m22 * y[i] + r.m23 * z[i] + t.y;
                depth[i] = r.m31 * x[i] + r.m32 * y[i] + r.m33 * z[i] + t.z;
                let (dx, dy) = (fx * (seen_x - u[i] * depth[i]), fy * (seen_y - v[i] * depth[i]));
                // The residual times the depth: division is for the few within reach.
                squared_error[i] = dx * dx + dy * dy;
                excess[i] = squared_error[i] - self.squared_reach * depth[i] * depth[i];
            }
            if excess.iter().any(|&excess| excess <= 0.0) {
                let mut squared = [0.0; LANES];
                for i in 0..LANES {
                    squared[i] = squared_error[i] / (depth[i] * depth[i]);
                }
                // Which are near cannot be foreseen: all are written, and the next over those that are not.
                for i in 0..LANES {
                    self.near[count] = squared[i];
                    count += usize::from((excess[i] <= 0.0) & (depth[i] > 0.0));
                }
            }
        }
        count
    }
}

/// How many of the near are expected to be true, of their densities as true matches. Summed up lane by lane,
/// whatever the processor.
#[inline(always)]
fn expected(densities: &[f64], mixing: f64, false_match: f64) -> f64 {
    let share = |density: f64| mixing * density / (mixing * density + false_match);
    let (blocks, rest) = densities.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for block in blocks {
        for i in 0..LANES {
            sums[i] += share(block[i]);
        }
    }
    let rest: f64 = rest.iter().copied().map(share).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector2};

    const CAMERA: Intrinsics =
        Intrinsics { fx: 500.0, fy: 450.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };

    /// Points 10 m away, seen with the given errors along x \[px\]; not a multiple of the lanes.
    fn correspondences(errors: &[f64]) -> Vec<Correspondence> {
        errors
            .iter()
            .zip(0_u8..)
            .map(|(error, i)| {
                let point = Point3::new(0.3 * f64::from(i) - 1.0, 0.1 * f64::from(i), 10.0);
                let pixel = CAMERA.project(&point).expect("in front");
                Correspondence { pixel: pixel + Vector2::new(*error, 0.0), point }
            })
            .collect()
    }

    const ERRORS: [f64; 11] = [0.0, 0.5, -1.0, 2.0, 1.5, -2.9, 3.1, 6.0, 40.0, -90.0, 25.0];

    #[test]
    fn the_score_is_that_of_the_mixture_with_all_residuals_written_out() {
        let params = MlesacParams { em_iterations: 200, ..MlesacParams::default() };
        let mut likelihood = Likelihood::new(&correspondences(&ERRORS), &CAMERA, &params);
        let score = likelihood.score(&Pose::identity());
        let at = |mixing: f64| -> f64 {
            let density =
                |e: f64| mixing * (-0.5 * e * e).exp() / TAU + (1.0 - mixing) / CAMERA.area();
            ERRORS.iter().map(|&e| density(e).ln()).sum()
        };
        assert!((score.log_likelihood - at(score.mixing)).abs() < 1e-4);
        // EM has found the maximum over γ.
        for mixing in [score.mixing - 0.01, score.mixing + 0.01] {
            assert!(at(mixing) < at(score.mixing));
        }
        assert_eq!(score.inliers, 6);
    }

    #[test]
    fn as_many_residuals_as_one_likes_have_a_likelihood() {
        let errors = [6.0].repeat(200);
        let params = MlesacParams::default();
        let score = |errors: &[f64]| {
            Likelihood::new(&correspondences(errors), &CAMERA, &params).score(&Pose::identity())
        };
        let (few, many) = (score(&errors[..8]), score(&errors));
        // Equal residuals: the likelihood of one, as often as there are.
        let expected = few.log_likelihood / 8.0 * 200.0;
        let off = (many.log_likelihood - expected).abs();
        assert!(off < 1e-6 * expected.abs(), "{} {expected}", many.log_likelihood);
    }

    #[test]
    fn three_rounds_of_em_are_enough() {
        let mixing = |em_iterations| {
            let params = MlesacParams { em_iterations, ..MlesacParams::default() };
            let mut likelihood = Likelihood::new(&correspondences(&ERRORS), &CAMERA, &params);
            likelihood.score(&Pose::identity()).mixing
        };
        assert!((mixing(3) - mixing(200)).abs() < 1e-3);
    }

    #[test]
    fn nothing_behind_the_camera_counts_and_perfect_residuals_stay_finite() {
        let params = MlesacParams { em_iterations: 100, ..MlesacParams::default() };
        let perfect = correspondences(&[0.0; 9]);
        let mut likelihood = Likelihood::new(&perfect, &CAMERA, &params);
        let score = likelihood.score(&Pose::identity());
        assert_eq!(score.inliers, 9);
        assert!(score.log_likelihood.is_finite());

        // Mirrored through the camera centre, the points project where they were, from behind.
        let behind: Vec<_> =
            perfect.iter().map(|c| Correspondence { point: -c.point, ..*c }).collect();
        let score = Likelihood::new(&behind, &CAMERA, &params).score(&Pose::identity());
        assert_eq!((score.inliers, score.mixing), (0, 0.0));
        assert!(score.log_likelihood.is_finite());
    }
}
