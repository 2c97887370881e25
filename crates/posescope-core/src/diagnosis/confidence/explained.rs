//! How many matches a pose explains that was not found by them.

use crate::camera::Intrinsics;
use crate::diagnosis::Subject;
use crate::geometry::Pose;
use crate::robust::{SAMPLE, effective_area_px, inliers_beyond_chance};
use crate::solver::{Correspondence, Zoomed};

/// A search ends beside the pose that the matches would have, so it explains those within so many times the threshold.
const WITHIN: f64 = 2.0;

/// The signals at a pose of the query camera in the reference camera's frame: the matches that it explains, their share,
/// and how far beyond chance they are. Without matches, it explains none.
pub(super) fn signals(
    subject: &Subject<'_>,
    reference_from_query: &Pose,
) -> [(&'static str, f64); 3] {
    let matches = correspondences(subject, usize::MAX).unwrap_or_default();
    let threshold_px = WITHIN * subject.params.fb.mlesac.inlier_threshold_px;
    of_matches(&matches, &subject.problem.query.intrinsics, reference_from_query, threshold_px)
}

fn of_matches(
    matches: &[Correspondence],
    camera: &Intrinsics,
    reference_from_query: &Pose,
    threshold_px: f64,
) -> [(&'static str, f64); 3] {
    let pose = Zoomed { pose: reference_from_query.inverse(), zoom: 1.0 };
    let explains = pose.explains(matches, camera, threshold_px);
    let pixels: Vec<_> = matches.iter().map(|one| one.pixel).collect();
    let area_px = effective_area_px(&pixels, f64::from(camera.width) * f64::from(camera.height));
    // Three matches fit a pose for free.
    let beyond = if matches.len() > SAMPLE {
        -inliers_beyond_chance(explains, matches.len(), threshold_px, area_px).log10_nfa
    } else {
        0.0
    };
    [
        ("explained", (explains as f64).ln_1p()),
        ("explained_share", explains as f64 / matches.len().max(1) as f64),
        ("explained_beyond", beyond.max(0.0).ln_1p()),
    ]
}

/// The matches that have a depth, at most so many, evenly of all.
pub(super) fn correspondences(subject: &Subject<'_>, most: usize) -> Option<Vec<Correspondence>> {
    let evidence = subject.evidence;
    let features = evidence.query.as_ref()?;
    let lifted = evidence.lifted.as_ref()?.iter().filter_map(|one| {
        let pixel = features.keypoints.get(one.query)?.pixel();
        Some(Correspondence { pixel, point: one.point? })
    });
    let all: Vec<Correspondence> = lifted.collect();
    let step = all.len().div_ceil(most).max(1);
    Some(all.into_iter().step_by(step).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    const CAMERA: Intrinsics =
        Intrinsics { fx: 300.0, fy: 300.0, cx: 199.5, cy: 99.5, width: 400, height: 200 };

    /// Points of a slope as the reference camera itself sees them.
    fn matches(count: u16) -> Vec<Correspondence> {
        let point = |at: u16| {
            let (across, up) = (f64::from(at * 37 % 80), f64::from(at * 23 % 30));
            Point3::new(0.2 * across - 8.0, 0.1 * up - 1.5, 12.0 + 0.1 * across)
        };
        let seen = |point| Some(Correspondence { pixel: CAMERA.project(&point)?, point });
        (0..count).filter_map(|at| seen(point(at))).collect()
    }

    #[test]
    fn the_pose_of_the_matches_explains_them_and_another_one_hardly_any() {
        let of = |count: u16, away_m: f64| {
            let pose = Pose::translation(away_m, 0.0, 0.0);
            of_matches(&matches(count), &CAMERA, &pose, 6.0).map(|(_, value)| value)
        };
        let [explained, share, beyond] = of(60, 0.0);
        assert!((explained - 61_f64.ln()).abs() < 1e-12 && share == 1.0 && beyond > 4.0);
        let [_, beside, _] = of(60, 0.1);
        assert!(beside > 0.9, "a search ends a little beside: {beside}");
        let [_, share, beyond] = of(60, 4.0);
        assert!(share < 0.2 && beyond < 1.0, "{share} {beyond}");
        // Nothing, and what fits any pose, say nothing.
        assert_eq!(of(0, 0.0), [0.0; 3]);
        assert_eq!(of(3, 0.0)[2], 0.0);
    }
}
