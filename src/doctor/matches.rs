//! A third measure of how well clouds, photos, cameras and poses fit together: features that two photos share.
//!
//! A feature of one photo gets its depth from that photo's cloud. The pose of the other photo says where the other photo
//! shows it, and its match says where it is. Wrong poses, axes and units are pixels off by the hundred, so a reading is
//! told from others by how many matches it explains, with no need to be near the truth.

use nalgebra::{Point2, Point3};

use super::agreement::Seen;
use crate::camera::Intrinsics;
use crate::covariance::PoseCovariance;
use crate::diagnosis::Tolerance;
use crate::features::{Features, MatchVerdict, SurfParams, best_matches, surf};
use crate::geometry::Pose;
use crate::image::GrayImage;
use crate::robust::{MlesacParams, effective_area_px, inliers_beyond_chance, mlesac};
use crate::solver::{Correspondence, pose_covariance};

/// The strongest features of a photo that are used.
const FEATURES: usize = 1500;
/// Larger photos are searched at every second pixel: they have more features than are used \[px\].
const LARGE: u32 = 28_000_000;
/// The greatest ratio of distances of a match. True matches agree on a motion, and false ones do not.
const RATIO: f32 = 0.9;
/// How far from where a pose says that it is a match counts half \[px\].
const HALF_PX: f64 = 2.5;
/// The fewest matches with a depth that are evidence.
const MIN_LIFTED: usize = 30;

/// The features of a photo.
pub(super) fn features(photo: &GrayImage) -> Features {
    let mut params = SurfParams::default();
    params.max_keypoints = FEATURES;
    if photo.width() * photo.height() > LARGE {
        params.initial_step = 2;
    }
    surf(photo, &params)
}

/// The same feature in two photos \[px\].
#[derive(Clone, Copy, Debug)]
pub(super) struct SharedFeature {
    pub(super) here: Point2<f64>,
    pub(super) there: Point2<f64>,
    /// The ratio of the distances to the nearest and the second nearest descriptor.
    ratio: f32,
}

/// Whether so many features of two photos have no second candidate that the photos share a view. Photos of different
/// places have a few by chance.
pub(super) fn is_view_shared(shared: &[SharedFeature]) -> bool {
    const DISTINCT: f32 = 0.7;
    const MIN_DISTINCT: usize = 30;
    shared.iter().filter(|one| one.ratio < DISTINCT).count() >= MIN_DISTINCT
}

/// The features that look alike in two photos, each the other's nearest.
pub(super) fn shared(here: &Features, there: &Features) -> Vec<SharedFeature> {
    let Ok(matches) = best_matches(&there.descriptors, &here.descriptors, RATIO, || {
        Ok::<_, std::convert::Infallible>(())
    });
    let mutual = matches.iter().flatten().filter(|one| one.verdict == MatchVerdict::Candidate);
    mutual
        .map(|one| SharedFeature {
            here: here.keypoints[one.reference].pixel(),
            there: there.keypoints[one.query].pixel(),
            ratio: one.ratio,
        })
        .collect()
}

/// The depths of a cloud's points in view, by small cells of the photo.
pub(super) struct DepthCells {
    /// Pixels along the side of a cell.
    side: f64,
    columns: usize,
    rows: usize,
    /// The nearest point of each cell.
    nearest: Vec<Option<Seen>>,
}

impl DepthCells {
    pub(super) fn new(camera: &Intrinsics, seen: &[Seen]) -> Self {
        /// Cells along the width: a scan of 64 beams has a point in most.
        const ACROSS: u32 = 300;
        let side = f64::from(camera.width.div_ceil(ACROSS).max(2));
        let count = |pixels: u32| (f64::from(pixels) / side).ceil() as usize;
        let (columns, rows) = (count(camera.width), count(camera.height));
        let mut cells = Self { side, columns, rows, nearest: vec![None; columns * rows] };
        for one in seen {
            if let Some(at) = cells.cell(&one.pixel) {
                let nearest = &mut cells.nearest[at];
                if nearest.is_none_or(|other| one.depth < other.depth) {
                    *nearest = Some(*one);
                }
            }
        }
        cells
    }

    /// The share of cells with a point whose depth is like that of the next cell with one, in their row; `None` without
    /// neighbours.
    pub(super) fn smooth_share(&self) -> Option<f64> {
        let rows = self.nearest.chunks(self.columns.max(1));
        let depths = rows.map(|row| row.iter().flatten().map(|one| one.depth).collect::<Vec<_>>());
        let pairs = depths.flat_map(|row| {
            row.windows(2).map(|two| (two[0] / two[1]).ln().abs() <= SMOOTH).collect::<Vec<_>>()
        });
        let pairs: Vec<bool> = pairs.collect();
        let smooth = pairs.iter().filter(|smooth| **smooth).count();
        (!pairs.is_empty()).then(|| smooth as f64 / pairs.len() as f64)
    }

    fn cell(&self, pixel: &Point2<f64>) -> Option<usize> {
        let at = |of: f64, count: usize| {
            let cell = ((of + 0.5) / self.side).floor();
            (cell >= 0.0 && cell < count as f64).then_some(cell as usize)
        };
        Some(at(pixel.y, self.rows)? * self.columns + at(pixel.x, self.columns)?)
    }

    /// The depth at a pixel: that of the point nearest to it, unless points of other depths are beside it.
    fn depth(&self, pixel: &Point2<f64>) -> Option<f64> {
        /// Depths of one surface differ by less, as a share.
        const SPREAD: f64 = 0.15;
        let at = self.cell(pixel)?;
        let (column, row) = ((at % self.columns) as isize, (at / self.columns) as isize);
        let beside = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (column + dx, row + dy)));
        let (columns, rows) = (self.columns as isize, self.rows as isize);
        let inside = beside.filter(|&(x, y)| (0..columns).contains(&x) && (0..rows).contains(&y));
        let around = inside.filter_map(|(x, y)| self.nearest[(y * columns + x) as usize]);
        let (mut nearest, mut least, mut most) = (None, f64::INFINITY, 0.0_f64);
        for one in around {
            let away = (one.pixel - pixel).norm();
            if nearest.is_none_or(|(known, _)| away < known) {
                nearest = Some((away, one.depth));
            }
            (least, most) = (least.min(one.depth), most.max(one.depth));
        }
        let (_, depth) = nearest?;
        (most - least <= SPREAD * depth).then_some(depth)
    }

    /// The shared features that have a depth: the point in the camera's frame, and the pixel in the other photo.
    pub(super) fn lifted(
        &self,
        camera: &Intrinsics,
        shared: &[SharedFeature],
    ) -> Vec<Correspondence> {
        let lift = |one: &SharedFeature| {
            let point: Point3<f64> = camera.unproject(&one.here, self.depth(&one.here)?);
            Some(Correspondence { pixel: one.there, point })
        };
        shared.iter().filter_map(lift).collect()
    }
}

/// Depths of neighbouring points of one surface differ by less, as the logarithm of their ratio.
const SMOOTH: f64 = 0.15;

/// How many correspondences a pose `there_from_here` explains. One that is off by [`HALF_PX`] counts half.
fn explained(lifted: &[Correspondence], camera: &Intrinsics, there_from_here: &Pose) -> f64 {
    let weight = |one: &Correspondence| {
        let seen = camera.project(&(there_from_here * one.point));
        seen.map_or(0.0, |seen| 1.0 / (1.0 + (seen - one.pixel).norm_squared() / HALF_PX.powi(2)))
    };
    lifted.iter().map(weight).sum()
}

/// The motion between two photos by their own features, and how many of these agree on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) there_from_here: Pose,
    /// How many correspondences it explains.
    pub(super) explained: f64,
    /// How far it may be off by the noise of its features alone: a distance \[m\] and an angle \[°\] for 95 %.
    pub(super) within: Option<Tolerance>,
}

/// The motion that more correspondences agree on than chance explains.
pub(super) fn motion(lifted: &[Correspondence], camera: &Intrinsics) -> Option<Motion> {
    const TRIALS: usize = 1000;
    let mut params = MlesacParams::default();
    params.max_trials = TRIALS;
    let found =
        mlesac(lifted, camera, &params, 0, |_| Ok::<_, std::convert::Infallible>(())).ok()?;
    let pixels: Vec<_> = lifted.iter().map(|one| one.pixel).collect();
    let area_px = f64::from(camera.width) * f64::from(camera.height);
    let accepted = inliers_beyond_chance(
        found.inliers.len(),
        lifted.len(),
        params.inlier_threshold_px,
        effective_area_px(&pixels, area_px),
    );
    let is_beyond_chance = accepted.needed.is_some_and(|needed| accepted.inliers >= needed);
    let explained = explained(lifted, camera, &found.pose);
    let inliers: Vec<_> = found.inliers.iter().map(|&at| lifted[at]).collect();
    let mut residuals: Vec<f64> = found.inliers.iter().map(|&at| found.residuals_px[at]).collect();
    residuals.sort_by(f64::total_cmp);
    // A residual is of two axes; the median of a Rayleigh distribution is 1.177 σ.
    let sigma_px = (residuals.get(residuals.len() / 2).unwrap_or(&1.0) / 1.177).max(0.3);
    let covariance = pose_covariance(&inliers, camera, &found.pose, sigma_px);
    let within = covariance.and_then(PoseCovariance::new).map(|known| known.holding(0.95));
    (is_beyond_chance && found.inliers.len() >= MIN_LIFTED / 2).then_some(Motion {
        there_from_here: found.pose,
        explained,
        within,
    })
}

/// The motion that the matches agree on, if a pose explains enough of them that it may be this one.
pub(super) fn motion_near(
    lifted: &[Correspondence],
    camera: &Intrinsics,
    there_from_here: &Pose,
) -> Option<Motion> {
    let is_likely = explained(lifted, camera, there_from_here) >= MIN_LIFTED as f64 / 4.0;
    if is_likely { motion(lifted, camera) } else { None }
}

/// The share of the matches that agree on any motion which a pose explains; `None` where nothing agrees on one, and too
/// few have a depth.
pub(super) fn share_explained(
    lifted: &[Correspondence],
    camera: &Intrinsics,
    there_from_here: &Pose,
    by_features: Option<&Motion>,
) -> Option<f64> {
    let explained = explained(lifted, camera, there_from_here);
    let most = match by_features {
        Some(motion) => motion.explained.max(explained),
        None if lifted.len() >= MIN_LIFTED => lifted.len() as f64,
        None => return None,
    };
    Some(explained / most)
}
