//! Where the true matches went: with the truth known, every match is true or false.

use nalgebra::{Matrix3, Point2, Point3, Vector3};
use serde::Serialize;

use super::Subject;
use crate::camera::Intrinsics;
use crate::depth::{LiftedMatch, ProjectedCloudIndex};
use crate::estimator::projected_cloud;
use crate::features::{Features, MatchVerdict};
use crate::geometry::Pose;
use crate::render::RenderParams;
use crate::robust::MlesacParams;
use crate::solver::{Correspondence, pose_covariance};

/// A match is true if the keypoint is this many inlier thresholds from where the truth puts it: the
/// truth and the depths are not exact either.
const TRUE_MATCH_THRESHOLDS: f64 = 2.0;

/// How far the keypoint of a true match may be from where the truth puts it, for a method with this inlier threshold
/// \[px\]. A threshold below the default may be what is wrong, and makes no match false.
pub fn true_match_px(inlier_threshold_px: f64) -> f64 {
    TRUE_MATCH_THRESHOLDS * inlier_threshold_px.max(MlesacParams::default().inlier_threshold_px)
}

/// How many reference keypoints with a depth, and true matches of them, were left at each stage of FB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Funnel {
    /// Reference keypoints with a depth.
    pub(super) with_depth: usize,
    /// Those that the query photo shows, by the truth.
    pub(super) visible: usize,
    /// Those with a query keypoint where they must be.
    pub(super) detected: usize,
    /// Query keypoints whose nearest reference feature is a true match.
    pub(super) nearest: usize,
    /// Those that passed the ratio test.
    pub(super) ratio: usize,
    /// Those that are mutually best.
    pub(super) unique: usize,
    /// Those whose 3-D point was lifted to where the truth says.
    pub(super) lifted: usize,
    /// Those that are inliers of the estimate.
    pub(super) inliers: usize,
}

impl Funnel {
    /// The step before `lifted` that lost the greatest share of what it got, and both counts. One more on each side
    /// keeps a step from the blame that got one or two.
    pub(super) fn worst_step(&self) -> (FunnelStep, usize, usize) {
        let steps = [
            (FunnelStep::Detect, self.visible, self.detected),
            (FunnelStep::Match, self.detected, self.nearest),
            (FunnelStep::Ratio, self.nearest, self.ratio),
            (FunnelStep::Unique, self.ratio, self.unique),
        ];
        let kept = |before: usize, after: usize| (after + 1) as f64 / (before + 1) as f64;
        let worst = steps
            .into_iter()
            .filter(|(_, before, _)| *before > 0)
            .min_by(|a, b| kept(a.1, a.2).total_cmp(&kept(b.1, b.2)));
        worst.unwrap_or((FunnelStep::View, self.with_depth, self.visible))
    }
}

/// A step at which true matches are lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum FunnelStep {
    /// Reference keypoints are out of the query's view.
    View,
    /// No query keypoint is where one must be.
    Detect,
    /// The nearest neighbour is another one.
    Match,
    /// The ratio test fails.
    Ratio,
    /// Another query keypoint is nearer.
    Unique,
}

/// How a method matches and lifts features.
pub(super) struct Matching<'a> {
    pub(super) mlesac: &'a MlesacParams,
    pub(super) depth_radius_px: f64,
    pub(super) visible: bool,
    pub(super) radius_slack: f64,
}

/// All that the truth says about the matches of a problem.
pub(super) struct TrueMatches {
    pub(super) funnel: Funnel,
    /// The correspondences that MLESAC got, in their order.
    pub(super) correspondences: Vec<Correspondence>,
    /// For each of them, whether the truth explains it.
    pub(super) is_true: Vec<bool>,
    /// For each of them, whether it is an inlier of the estimate.
    pub(super) is_inlier: Vec<bool>,
    /// Correspondences that lie on the epipolar line of the truth, but whose depth puts them elsewhere,
    /// beyond as many as lie there by chance. Inliers of the estimate are left out: what agrees on
    /// another pose has moved, or belongs to another place, and its depth need not be wrong.
    pub(super) wrong_depth: usize,
    /// Unique matches that lie on the epipolar line and have no depth at all, beyond chance.
    pub(super) no_depth: usize,
    /// All unique matches.
    pub(super) all_unique: usize,
    /// Keypoints of the reference.
    pub(super) reference_keypoints: usize,
}

impl TrueMatches {
    /// `None` where the method sought no features, or the truth is unknown.
    pub(super) fn of(subject: &Subject<'_>, matching: &Matching<'_>) -> Option<Self> {
        let evidence = subject.evidence;
        let (query, reference) = (evidence.query.as_ref()?, evidence.reference.as_ref()?);
        let truth = subject.reference_from_truth()?;
        let query_from_reference = truth.inverse();
        let camera = &subject.problem.query.intrinsics;
        let inlier_px = matching.mlesac.inlier_threshold_px;
        let threshold_px = true_match_px(inlier_px);
        let points = lifted_keypoints(subject, matching, reference);
        let predicted: Vec<Option<Point2<f64>>> = points
            .iter()
            .map(|point| {
                let seen = camera.project(&(query_from_reference * (*point)?))?;
                camera.contains(&seen).then_some(seen)
            })
            .collect();
        let is_near = |query_keypoint: usize, reference_keypoint: usize| {
            predicted[reference_keypoint].is_some_and(|predicted| {
                let keypoint = query.keypoints[query_keypoint].pixel();
                (keypoint - predicted).norm() <= threshold_px
            })
        };
        let mut funnel = Funnel {
            with_depth: points.iter().flatten().count(),
            visible: predicted.iter().flatten().count(),
            detected: detected(query, &predicted, threshold_px),
            ..Funnel::default()
        };
        let mut all_unique = 0;
        for found in evidence.decisions.iter().flat_map(|d| d.iter()).flatten() {
            all_unique += usize::from(found.verdict == MatchVerdict::Candidate);
            if !is_near(found.query, found.reference) {
                continue;
            }
            funnel.nearest += 1;
            funnel.ratio += usize::from(found.verdict != MatchVerdict::Ambiguous);
            funnel.unique += usize::from(found.verdict == MatchVerdict::Candidate);
        }
        let mut matches = Self {
            funnel,
            correspondences: Vec::new(),
            is_true: Vec::new(),
            is_inlier: Vec::new(),
            wrong_depth: 0,
            no_depth: 0,
            all_unique,
            reference_keypoints: reference.keypoints.len(),
        };
        let epipolar =
            Epipolar::new(&truth, camera, &subject.problem.reference.intrinsics, threshold_px);
        let refined = evidence.refined.as_ref();
        let query_from_reference_found = refined.map(|found| found.reference_from_query.inverse());
        let all_lifted = evidence.lifted.as_deref().unwrap_or_default();
        let pixels: Vec<_> = all_lifted
            .iter()
            .map(|lifted| {
                let seen = reference.keypoints[lifted.reference].pixel();
                (seen, query.keypoints[lifted.query].pixel())
            })
            .collect();
        let by_chance = epipolar.share_by_chance(&pixels);
        let (mut lifted_elsewhere, mut unlifted) = (0, 0);
        for (lifted, (seen, pixel)) in all_lifted.iter().zip(pixels) {
            let on_line = epipolar.explains(&seen, &pixel);
            let Some(point) = lifted.point else {
                matches.no_depth += usize::from(on_line);
                unlifted += 1;
                continue;
            };
            let seen = camera.project(&(query_from_reference * point));
            let is_true = seen.is_some_and(|seen| (seen - pixel).norm() <= threshold_px);
            let at_result = query_from_reference_found
                .as_ref()
                .and_then(|pose| camera.project(&(pose * point)));
            let is_inlier = at_result.is_some_and(|seen| (seen - pixel).norm() <= inlier_px);
            matches.correspondences.push(Correspondence { pixel, point });
            matches.is_true.push(is_true);
            matches.is_inlier.push(is_inlier);
            matches.wrong_depth += usize::from(on_line && !is_true && !is_inlier);
            lifted_elsewhere += usize::from(!is_true && !is_inlier);
            matches.funnel.lifted += usize::from(is_true);
            matches.funnel.inliers += usize::from(is_true && is_inlier);
        }
        let chance = |count: usize| (by_chance * f64::from(count as u32)).round() as usize;
        matches.wrong_depth = matches.wrong_depth.saturating_sub(chance(lifted_elsewhere));
        matches.no_depth = matches.no_depth.saturating_sub(chance(unlifted));
        Some(matches)
    }

    /// The correspondences that the truth explains.
    pub(super) fn true_ones(&self) -> Vec<usize> {
        let all = self.is_true.iter().enumerate();
        all.filter_map(|(at, is_true)| is_true.then_some(at)).collect()
    }

    /// The correspondences that the truth explains and the estimate does not.
    pub(super) fn of_truth_alone(&self) -> Vec<usize> {
        self.true_ones().into_iter().filter(|&at| !self.is_inlier[at]).collect()
    }

    /// Whether so many unique matches lie on their epipolar lines without the right depth that they cannot
    /// all be false. Streets look alike, and false matches of a drive lie near epipolar lines too.
    pub(super) fn many_without_depth(&self) -> bool {
        self.all_unique > 0 && 4 * (self.wrong_depth + self.no_depth) >= self.all_unique
    }

    /// True matches that a better cloud would have kept. Where the cloud gives depths as clouds do, those
    /// that have none lie where no scan reaches, and more of them would not have come from there.
    pub(super) fn lost_for_depth(&self) -> usize {
        /// Share of the reference keypoints that a scan gives a depth at least.
        const USUAL: f64 = 0.1;
        let is_usual = self.funnel.with_depth as f64 >= USUAL * self.reference_keypoints as f64;
        if is_usual { 0 } else { self.no_depth }
    }

    /// How far the inliers of the consensus let its camera centre move \[m\]; `None` where they do not fix
    /// it.
    pub(super) fn deviation_m(&self, subject: &Subject<'_>, sigma_px: f64) -> Option<f64> {
        let refined = subject.evidence.refined.as_ref()?;
        let inliers: Vec<Correspondence> = self
            .correspondences
            .iter()
            .zip(&self.is_inlier)
            .filter_map(|(correspondence, is_inlier)| is_inlier.then_some(*correspondence))
            .collect();
        let covariance = pose_covariance(
            &inliers,
            &subject.problem.query.intrinsics,
            &refined.reference_from_query.inverse(),
            sigma_px,
        )?;
        let variances = Vector3::new(covariance[(3, 3)], covariance[(4, 4)], covariance[(5, 5)]);
        Some(variances.sum().sqrt())
    }

    /// Inliers of the estimate.
    pub(super) fn inliers(&self) -> usize {
        self.is_inlier.iter().filter(|is_inlier| **is_inlier).count()
    }
}

/// The 3-D point of every reference keypoint that has a depth near by.
fn lifted_keypoints(
    subject: &Subject<'_>,
    matching: &Matching<'_>,
    reference: &Features,
) -> Vec<Option<Point3<f64>>> {
    let tuple = &subject.problem.reference;
    let render = RenderParams { visibility: true, ..subject.params.render.clone() };
    let cloud = projected_cloud(tuple, matching.visible.then_some(&render));
    let radius_px = matching.depth_radius_px;
    reference
        .keypoints
        .iter()
        .map(|keypoint| {
            let pixel = keypoint.pixel();
            let depths = cloud.read(&pixel, radius_px).within?;
            Some(tuple.intrinsics.unproject(&pixel, depths.nearest))
        })
        .collect()
}

/// The unique matches with the cloud, to ask how many a camera of both photos would explain.
pub(super) struct Pairs {
    /// Of each match, the pixel in the query and that in the reference.
    pixels: Vec<[Point2<f64>; 2]>,
    cloud: ProjectedCloudIndex,
    stated: Intrinsics,
    /// The camera whose pixels the cloud has: that of the reference with a wider image.
    wide: Intrinsics,
    query_from_reference: Pose,
    radius_px: f64,
    threshold_px: f64,
}

impl Pairs {
    /// `None` where the method did not reach matching, or the truth is unknown.
    pub(super) fn of(subject: &Subject<'_>, matching: &Matching<'_>) -> Option<Self> {
        let evidence = subject.evidence;
        let (query, reference) = (evidence.query.as_ref()?, evidence.reference.as_ref()?);
        let pixels = |lifted: &LiftedMatch| {
            [query.keypoints[lifted.query].pixel(), reference.keypoints[lifted.reference].pixel()]
        };
        let tuple = &subject.problem.reference;
        let stated = &tuple.intrinsics;
        let wide = Intrinsics {
            cx: stated.cx + f64::from(stated.width),
            cy: stated.cy + f64::from(stated.height),
            width: 3 * stated.width,
            height: 3 * stated.height,
            ..*stated
        };
        Some(Self {
            pixels: evidence.lifted.as_deref()?.iter().map(pixels).collect(),
            cloud: ProjectedCloudIndex::new(&tuple.cloud, &wide),
            stated: *stated,
            wide,
            query_from_reference: subject.reference_from_truth()?.inverse(),
            radius_px: matching.depth_radius_px,
            threshold_px: true_match_px(matching.mlesac.inlier_threshold_px),
        })
    }

    /// Whether depths matter: from one place any depth explains a match. The parallax of most points must be more than
    /// what a match may be off.
    pub(super) fn test_depths(&self) -> bool {
        let camera = &self.wide;
        let parallax_px = |point: &Point3<f64>| {
            let there = camera.project(&(self.query_from_reference * point))?;
            let turned = camera.project(&(self.query_from_reference.rotation * point))?;
            Some((there - turned).norm())
        };
        let points = self.pixels.iter().filter_map(|[_, seen]| {
            let at = self.stated.unproject(seen, 1.0);
            let depths = self.cloud.read(&camera.project(&at)?, self.radius_px).within?;
            Some(at * depths.nearest)
        });
        let parallaxes: Vec<f64> = points.filter_map(|point| parallax_px(&point)).collect();
        let enough = parallaxes.iter().filter(|parallax| **parallax > self.threshold_px).count();
        2 * enough > parallaxes.len()
    }

    /// How many matches the truth explains with the depths of the cloud, if both photos are of this camera; and how many
    /// have a depth then.
    pub(super) fn explained_by(&self, camera: &Intrinsics) -> (usize, usize) {
        let radius_px = self.radius_px * self.wide.fx / camera.fx;
        let point = |seen: &Point2<f64>| {
            let at = self.wide.project(&camera.unproject(seen, 1.0))?;
            let depths = self.cloud.read(&at, radius_px).within?;
            Some(camera.unproject(seen, depths.nearest))
        };
        let (mut explained, mut with_depth) = (0, 0);
        for [pixel, seen] in &self.pixels {
            let Some(point) = point(seen) else { continue };
            let there = camera.project(&(self.query_from_reference * point));
            with_depth += 1;
            let is_near = there.is_some_and(|there| (there - pixel).norm() <= self.threshold_px);
            explained += usize::from(is_near);
        }
        (explained, with_depth)
    }
}

/// How many of the predicted places have a query keypoint.
fn detected(query: &Features, predicted: &[Option<Point2<f64>>], threshold_px: f64) -> usize {
    // Sorted by column, so that each place is compared with few.
    let mut keypoints: Vec<Point2<f64>> = query.keypoints.iter().map(|k| k.pixel()).collect();
    keypoints.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
    let has_keypoint = |place: &&Point2<f64>| {
        let first = keypoints.partition_point(|k| k.x < place.x - threshold_px);
        keypoints[first..]
            .iter()
            .take_while(|k| k.x <= place.x + threshold_px)
            .any(|k| (*k - **place).norm() <= threshold_px)
    };
    predicted.iter().flatten().filter(has_keypoint).count()
}

/// The epipolar lines of the true pose, each as far as it has points in front of both cameras.
struct Epipolar {
    /// Takes a reference pixel (homogeneous) to its line in the query.
    fundamental: Matrix3<f64>,
    query_from_reference: Pose,
    query: Intrinsics,
    reference: Intrinsics,
    threshold_px: f64,
}

impl Epipolar {
    fn new(
        reference_from_query: &Pose,
        query: &Intrinsics,
        reference: &Intrinsics,
        threshold_px: f64,
    ) -> Self {
        let query_from_reference = reference_from_query.inverse();
        let essential = query_from_reference.translation.vector.cross_matrix()
            * query_from_reference.rotation.to_rotation_matrix();
        let inverse = |camera: &Intrinsics| {
            let Intrinsics { fx, fy, cx, cy, .. } = *camera;
            let mut inverse = Matrix3::from_diagonal(&Vector3::new(1.0 / fx, 1.0 / fy, 1.0));
            (inverse[(0, 2)], inverse[(1, 2)]) = (-cx / fx, -cy / fy);
            inverse
        };
        Self {
            fundamental: inverse(query).transpose() * essential * inverse(reference),
            query_from_reference,
            query: *query,
            reference: *reference,
            threshold_px,
        }
    }

    /// The share of pixels that lie on the line of something that they have nothing to do with: each is
    /// held against the lines of some others.
    fn share_by_chance(&self, pixels: &[(Point2<f64>, Point2<f64>)]) -> f64 {
        const OTHERS: usize = 5;
        let count = pixels.len();
        let hits = (1..=OTHERS)
            .flat_map(|k| (0..count).map(move |at| (at, (at + k * count / (OTHERS + 1)) % count)))
            .filter(|&(at, other)| self.explains(&pixels[other].0, &pixels[at].1))
            .count();
        hits as f64 / (OTHERS * count).max(1) as f64
    }

    /// Whether a query pixel lies on the line of a reference pixel, and their point is in front of both cameras.
    fn explains(&self, reference: &Point2<f64>, query: &Point2<f64>) -> bool {
        let line = self.fundamental * reference.to_homogeneous();
        let distance = line.dot(&query.to_homogeneous()).abs() / line.x.hypot(line.y);
        let threshold_px = self.threshold_px / TRUE_MATCH_THRESHOLDS;
        distance <= threshold_px && self.is_in_front(reference, query, threshold_px)
    }

    /// Whether a pixel on the line is on the side of the vanishing point that has points in front of both cameras.
    fn is_in_front(&self, reference: &Point2<f64>, query: &Point2<f64>, slack_px: f64) -> bool {
        /// The inverse depth \[1/m\] of a point so far away that it stands for the direction of all nearer ones.
        const FAR: f64 = 1e-3;
        let ray = self.reference.unproject(reference, 1.0);
        let at = |inverse_depth: f64| {
            let Pose { rotation, translation } = self.query_from_reference;
            self.query.project(&(rotation * ray + inverse_depth * translation.vector))
        };
        let (Some(vanishing), Some(nearer)) = (at(0.0), at(FAR)) else {
            return false;
        };
        let towards = nearer - vanishing;
        (query - vanishing).dot(&towards) >= -slack_px * towards.norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 200 reference keypoints this many have a depth; 40 true matches have none.
    fn lost(with_depth: usize) -> usize {
        let matches = TrueMatches {
            funnel: Funnel { with_depth, ..Funnel::default() },
            correspondences: Vec::new(),
            is_true: Vec::new(),
            is_inlier: Vec::new(),
            wrong_depth: 0,
            no_depth: 40,
            all_unique: 40,
            reference_keypoints: 200,
        };
        matches.lost_for_depth()
    }

    #[test]
    fn a_match_whose_point_is_behind_the_cameras_is_not_explained() {
        let camera =
            Intrinsics { fx: 100.0, fy: 100.0, cx: 99.5, cy: 49.5, width: 200, height: 100 };
        // The query is one metre ahead of the reference: what both see moves away from the centre.
        let epipolar = Epipolar::new(&Pose::translation(0.0, 0.0, 1.0), &camera, &camera, 4.0);
        let seen = Point2::new(119.5, 49.5);
        let explains = |x: f64, y: f64| epipolar.explains(&seen, &Point2::new(x, y));
        assert!(explains(124.5, 49.5), "five metres away");
        assert!(explains(119.0, 49.5), "as far away as noise lets it be");
        assert!(!explains(110.0, 49.5), "on the line, but behind");
        assert!(!explains(124.5, 55.0), "off the line");
    }

    #[test]
    fn a_stricter_inlier_threshold_makes_no_match_false() {
        let usual = MlesacParams::default().inlier_threshold_px;
        assert_eq!(true_match_px(0.1 * usual), true_match_px(usual));
        assert_eq!(true_match_px(2.0 * usual), 2.0 * true_match_px(usual));
    }

    #[test]
    fn matches_without_a_depth_are_lost_where_the_cloud_is_sparser_than_clouds_are() {
        assert_eq!([0, 19].map(lost), [40, 40]);
        assert_eq!([20, 120].map(lost), [0, 0]);
    }
}
