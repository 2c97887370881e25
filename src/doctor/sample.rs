//! The frames of a scene that are compared, and how well a reading fits them.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use image::GrayImage;
use nalgebra::Point3;
use rayon::prelude::*;

use super::agreement::{EdgeMap, Seen, carried_agreement, edge_agreement, edge_map, project};
use super::matches::{
    DepthCells, Motion, SharedFeature, features, is_view_shared, motion, motion_near,
    share_explained, shared,
};
use super::reading::Change;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::diagnosis::Tolerance;
use crate::features::Features;
use crate::geometry::{Pose, PoseError};
use crate::scene::{Scene, SceneError};
use crate::solver::Correspondence;

/// How many frames are compared, each with its partners.
const ANCHORS: usize = 8;
/// The offsets of an anchor's partners; the first two that exist are used.
const PARTNERS: [isize; 4] = [1, 3, -1, -3];
const PARTNERS_OF_EACH: usize = 2;
/// The most points of a cloud; edges need a dense one.
const MAX_POINTS: usize = 40_000;
/// About what photos may take \[bytes\]. So photos of more than 28 million pixels have fewer anchors.
const BYTES: u64 = 1_900_000_000;
/// What an anchor and its partners take per pixel, and their edges with it \[bytes\].
const BYTES_OF_ANCHOR: u64 = 7;
/// What it takes to find the features and the edges of two photos at once, per pixel \[bytes\].
const BYTES_OF_READING: u64 = 10;
/// Every how many points one is carried to other frames.
const CARRIED: usize = 4;

/// A photo with its edges, its features and its camera.
#[derive(Clone)]
pub(super) struct Sight {
    gray: Arc<GrayImage>,
    /// Of anchors.
    edges: Option<Arc<EdgeMap>>,
    features: Features,
    pub(super) camera: Intrinsics,
}

/// A frame beside an anchor, and the features that both photos share.
#[derive(Clone)]
struct Partner {
    frame: usize,
    shared: Vec<SharedFeature>,
}

/// A cloud in the photo of its frame, in some reading.
#[derive(Clone)]
struct Seeing {
    edges: Option<f64>,
    /// Points that are carried to other frames, and where the photo shows them.
    carried: Vec<(Point3<f64>, Option<Seen>)>,
    /// The fewest points that are evidence; with few points in view, agreement is chance.
    least: usize,
    /// For each partner the shared features with a depth.
    lifted: Vec<Vec<Correspondence>>,
}

/// A pair of frames whose features agree on a motion.
#[derive(Clone, Copy, Debug)]
pub struct FramePair {
    /// How far the stated poses are from it.
    pub error: PoseError,
    /// How far it may be off by the noise of its features alone, in 95 % of cases.
    pub within: Tolerance,
}

/// The compared frames, with all poses.
#[derive(Clone)]
pub(super) struct Sample<'a> {
    pub(super) scene: &'a dyn Scene,
    /// Whether the poses decide what of the clouds is seen.
    pub(super) has_map: bool,
    /// Whether clouds and cameras are as the scene states them.
    pub(super) has_stated_clouds: bool,
    pub(super) poses: Vec<Option<Pose>>,
    pub(super) sights: BTreeMap<usize, Sight>,
    pub(super) clouds: BTreeMap<usize, Vec<Point3<f64>>>,
    pub(super) anchors: Vec<usize>,
    /// Why photos and clouds could not be read; each costs itself alone.
    pub(super) unreadable: Vec<String>,
    partners: BTreeMap<usize, Vec<Partner>>,
    /// The clouds as stated.
    stated: BTreeMap<usize, Seeing>,
    /// The motions between an anchor and its partners by the features and the clouds as stated.
    motions: BTreeMap<usize, Vec<Option<Motion>>>,
}

/// How well a reading fits the photos on average; higher is better.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Logarithm of the ratio of image-edge strength at depth edges to that at all points.
    pub edges: Option<f64>,
    /// Correlation of the points' grey values between photos, as Fisher's z.
    pub carried: Option<f64>,
    /// The share that the poses explain of the features that two photos share and that agree on a motion.
    pub motions: Option<f64>,
}

impl Agreement {
    /// The mean over frames.
    pub(super) fn mean(scores: &[Self]) -> Self {
        let of = |pick: fn(&Self) -> Option<f64>| mean(scores.iter().filter_map(pick));
        Self {
            edges: of(|score| score.edges),
            carried: of(|score| score.carried),
            motions: of(|score| score.motions),
        }
    }

    /// One number for all measures; missing edges count slightly against a reading.
    pub(super) fn worth(&self) -> f64 {
        self.carried.unwrap_or(0.0) + self.motions.unwrap_or(0.0) + self.edges.unwrap_or(-0.2)
    }
}

pub(super) fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let numbers: Vec<f64> = numbers.collect();
    (!numbers.is_empty()).then(|| numbers.iter().sum::<f64>() / numbers.len() as f64)
}

fn thinned(cloud: &Cloud) -> Vec<Point3<f64>> {
    let step = cloud.points.len().div_ceil(MAX_POINTS).max(1);
    cloud.points.iter().step_by(step).map(|point| point.cast()).collect()
}

pub(super) fn partners(anchor: usize, count: usize) -> impl Iterator<Item = usize> {
    let frames = PARTNERS.iter().filter_map(move |&step| anchor.checked_add_signed(step));
    frames.filter(move |&frame| frame < count).take(PARTNERS_OF_EACH)
}

/// The pixels of the largest photo of a scene, as its cameras say.
fn pixels_of_largest(scene: &dyn Scene) -> u64 {
    let cameras = (0..scene.frames().len()).map(|frame| scene.intrinsics(frame));
    let pixels = cameras.map(|camera| u64::from(camera.width) * u64::from(camera.height));
    pixels.max().unwrap_or(0).max(1)
}

/// How many anchors photos of so many pixels may have.
fn anchors_of(pixels: u64) -> usize {
    let per_pixel = (BYTES / pixels).saturating_sub(BYTES_OF_READING);
    (per_pixel / BYTES_OF_ANCHOR).clamp(1, ANCHORS as u64) as usize
}

impl<'a> Sample<'a> {
    /// Reads frames with pose and cloud, spread over the scene.
    pub(super) fn read(scene: &'a dyn Scene) -> Self {
        let count = scene.frames().len();
        let poses: Vec<Option<Pose>> = (0..count).map(|frame| scene.pose(frame)).collect();
        let references: Vec<usize> =
            (0..count).filter(|&frame| poses[frame].is_some() && scene.has_cloud(frame)).collect();
        let largest = pixels_of_largest(scene);
        let many = anchors_of(largest).min(references.len());
        let anchors: Vec<usize> =
            (0..many).map(|at| references[at * references.len() / many]).collect();
        let mut seen: Vec<usize> = anchors
            .iter()
            .flat_map(|&anchor| std::iter::once(anchor).chain(partners(anchor, count)))
            .collect();
        seen.sort_unstable();
        seen.dedup();
        let sight = |&frame: &usize| {
            let gray = scene.photo(frame)?.gray;
            let sight = Sight {
                features: features(&gray),
                edges: anchors.contains(&frame).then(|| Arc::new(edge_map(&gray))),
                gray: Arc::new(gray),
                camera: scene.intrinsics(frame),
            };
            Ok((frame, sight))
        };
        let at_once = (BYTES / largest / BYTES_OF_READING).max(1);
        let at_once = seen.chunks(usize::try_from(at_once).unwrap_or(usize::MAX));
        let read = at_once.flat_map(|some| some.par_iter().map(sight).collect::<Vec<_>>());
        let read: Vec<Result<_, SceneError>> = read.collect();
        let (mut sights, mut clouds) = (BTreeMap::new(), BTreeMap::new());
        let mut unreadable = Vec::new();
        for one in read {
            match one {
                Ok((frame, sight)) => {
                    sights.insert(frame, sight);
                }
                Err(error) => unreadable.push(error.to_string()),
            }
        }
        for &anchor in &anchors {
            for frame in anchor.saturating_sub(1)..(anchor + 2).min(count) {
                if let Entry::Vacant(place) = clouds.entry(frame)
                    && scene.has_cloud(frame)
                {
                    match scene.cloud(frame) {
                        Ok(cloud) => {
                            place.insert(thinned(&cloud));
                        }
                        Err(error) => unreadable.push(error.to_string()),
                    }
                }
            }
        }
        unreadable.sort();
        unreadable.dedup();
        let is_readable =
            |anchor: &usize| sights.contains_key(anchor) && clouds.contains_key(anchor);
        let anchors: Vec<usize> = anchors.into_iter().filter(is_readable).collect();
        let at = |frame: usize| scene.cloud_at(frame, &poses[frame]?);
        let has_map = anchors.first().is_some_and(|&anchor| at(anchor).is_some());
        let mut sample = Self {
            scene,
            has_map,
            has_stated_clouds: true,
            poses,
            sights,
            clouds,
            anchors,
            unreadable,
            partners: BTreeMap::new(),
            stated: BTreeMap::new(),
            motions: BTreeMap::new(),
        };
        let found = sample.anchors.par_iter().map(|&anchor| (anchor, sample.partners_of(anchor)));
        sample.partners = found.collect();
        sample.measured()
    }

    fn partners_of(&self, anchor: usize) -> Vec<Partner> {
        let there = partners(anchor, self.poses.len());
        there
            .filter_map(|frame| {
                let (here, there) = (self.sights.get(&anchor)?, self.sights.get(&frame)?);
                Some(Partner { frame, shared: shared(&here.features, &there.features) })
            })
            .collect()
    }

    /// With what does not depend on other readings.
    fn measured(mut self) -> Self {
        let anchors = self.anchors.par_iter();
        let stated = anchors.filter_map(|&anchor| Some((anchor, self.seeing(anchor, &AS_STATED)?)));
        self.stated = stated.collect();
        self.motions = self.motions_in(&AS_STATED);
        self
    }

    /// The motions that the features and the clouds of a reading agree on.
    pub(super) fn motions_in(&self, change: &Change) -> BTreeMap<usize, Vec<Option<Motion>>> {
        let motions = |&anchor: &usize| {
            let seeing = self.seeing(anchor, change);
            let partners = self.partners.get(&anchor).into_iter().flatten();
            let lifted = seeing.iter().flat_map(|seeing| &seeing.lifted);
            let of = |(partner, lifted): (&Partner, &Vec<Correspondence>)| {
                motion(lifted, &change.camera(&self.sights.get(&partner.frame)?.camera).0)
            };
            (anchor, partners.zip(lifted).map(of).collect())
        };
        self.anchors.par_iter().map(motions).collect()
    }

    /// The scene as it is if a reading is right.
    pub(super) fn read_as(mut self, change: &Change) -> Self {
        let frames = 0..self.poses.len();
        let poses = frames.map(|frame| change.pose(frame, &self.poses)).collect();
        let clouds = self.anchors.iter();
        let clouds = clouds.filter_map(|&anchor| Some((anchor, self.cloud(anchor, change)?)));
        self.clouds = clouds.collect();
        self.poses = poses;
        self.has_stated_clouds &= change.is_of_poses() && !self.has_map;
        self.has_map &= change.is_of_poses();
        for sight in self.sights.values_mut() {
            sight.camera = change.camera(&sight.camera).0;
        }
        self.measured()
    }

    /// A frame's photo, and the points of its cloud in front of its camera.
    pub(super) fn seen(&self, anchor: usize) -> Option<(&GrayImage, Vec<Seen>)> {
        let sight = self.sights.get(&anchor)?;
        let points = self.clouds.get(&anchor)?;
        let seen = points.iter().filter_map(|point| project(&sight.camera, 0.0, point));
        Some((&sight.gray, seen.collect()))
    }

    /// The points of a frame in its camera's frame. Of a map, those in view of the pose in this reading.
    fn cloud(&self, anchor: usize, change: &Change) -> Option<Vec<Point3<f64>>> {
        let mut pose = change.pose(anchor, &self.poses);
        match *change {
            _ if !self.has_map => {}
            Change::Size(times) => {
                let pose = pose.as_mut()?;
                pose.translation.vector /= times;
                let cloud = thinned(&self.scene.cloud_at(anchor, pose)?);
                return Some(change.points(&cloud));
            }
            Change::None => {}
            _ if change.is_of_poses() => {
                return Some(thinned(&self.scene.cloud_at(anchor, &pose?)?));
            }
            _ => {}
        }
        Some(change.points(self.clouds.get(&change.cloud_of(anchor)?)?))
    }

    fn seeing(&self, anchor: usize, change: &Change) -> Option<Seeing> {
        let sight = self.sights.get(&anchor)?;
        let points = self.cloud(anchor, change)?;
        let (camera, k1) = change.camera(&sight.camera);
        let seen: Vec<Option<Seen>> =
            points.iter().map(|point| project(&camera, k1, point)).collect();
        let in_front: Vec<Seen> = seen.iter().flatten().copied().collect();
        let in_view = in_front.iter().filter(|seen| camera.contains(&seen.pixel)).count();
        let cells = DepthCells::new(&camera, &in_front);
        let partners = self.partners.get(&anchor).into_iter().flatten();
        Some(Seeing {
            edges: sight.edges.as_ref().and_then(|edges| edge_agreement(edges, &in_front)),
            carried: points.into_iter().zip(seen).step_by(CARRIED).collect(),
            least: in_view / CARRIED / 20,
            lifted: partners.map(|one| cells.lifted(&camera, &one.shared)).collect(),
        })
    }

    /// The scores of a reading, frame by frame.
    pub(super) fn scores(&self, anchors: &[usize], change: &Change) -> Vec<Agreement> {
        anchors.par_iter().map(|&anchor| self.score(anchor, change)).collect()
    }

    fn score(&self, anchor: usize, change: &Change) -> Agreement {
        // Poses alone leave a cloud that is not of a map where it is in its photo.
        let is_kept = change.is_of_poses() && (!self.has_map || matches!(change, Change::None));
        let anew = if is_kept { None } else { self.seeing(anchor, change) };
        let as_stated = || self.stated.get(&anchor).filter(|_| is_kept);
        match anew.as_ref().or_else(as_stated) {
            Some(seeing) => self.score_of(anchor, seeing, change),
            None => Agreement::default(),
        }
    }

    fn score_of(&self, anchor: usize, seeing: &Seeing, change: &Change) -> Agreement {
        let (mut carried, mut motions) = (Vec::new(), Vec::new());
        let partners = self.partners.get(&anchor).into_iter().flatten();
        let by_features = self.motions.get(&anchor).into_iter().flatten();
        for ((partner, lifted), by_features) in partners.zip(&seeing.lifted).zip(by_features) {
            let (Some(sight), Some(other), Some(here), Some(there)) = (
                self.sights.get(&anchor),
                self.sights.get(&partner.frame),
                change.pose(anchor, &self.poses),
                change.pose(partner.frame, &self.poses),
            ) else {
                continue;
            };
            let there_from_here = there.inverse() * here;
            let (camera, k1) = change.camera(&other.camera);
            let (seen, carried_to): (Vec<_>, Vec<_>) = seeing
                .carried
                .iter()
                .map(|(point, seen)| (*seen, project(&camera, k1, &(there_from_here * point))))
                .unzip();
            let agreement =
                carried_agreement((&sight.gray, &seen), (&other.gray, &carried_to), seeing.least);
            // Points that are out of view of the partner do not agree.
            carried.push(agreement.unwrap_or(0.0));
            // The features were lifted by the part of the map that the stated pose sees.
            let by_features = if self.has_map && !matches!(change, Change::None) {
                motion_near(lifted, &camera, &there_from_here)
            } else {
                *by_features
            };
            motions.extend(share_explained(
                lifted,
                &camera,
                &there_from_here,
                by_features.as_ref(),
            ));
        }
        Agreement {
            edges: seeing.edges,
            carried: mean(carried.into_iter()),
            motions: mean(motions.into_iter()),
        }
    }

    /// How many pairs of photos there are, how many share a view, and of how many the features agree on a motion.
    pub(super) fn pairs(&self) -> [usize; 3] {
        let shared = || self.partners.values().flatten().map(|one| is_view_shared(&one.shared));
        let motions = self.motions.values().flatten().flatten().count();
        [shared().count(), shared().filter(|shared| *shared).count(), motions]
    }

    /// How far the stated poses of pairs of frames are from what their features agree on.
    pub(super) fn frame_pairs(&self) -> Vec<FramePair> {
        let of = |(&anchor, motions): (&usize, &Vec<Option<Motion>>)| {
            let partners = self.partners.get(&anchor).into_iter().flatten();
            let pairs = partners.zip(motions).filter_map(|(partner, motion)| {
                let motion = motion.as_ref()?;
                let there_from_here = self.poses[partner.frame]?.inverse() * self.poses[anchor]?;
                let [stated, found] =
                    [there_from_here, motion.there_from_here].map(|pose| pose.inverse());
                let error = PoseError::between(&stated, &found);
                Some(FramePair { error, within: motion.within? })
            });
            pairs.collect::<Vec<_>>()
        };
        self.motions.iter().flat_map(of).collect()
    }

    /// The share of shared features that a reading of the poses explains, with their lengths multiplied by a factor.
    pub(super) fn explained(&self, change: &Change, times: f64) -> f64 {
        let of = |anchor: &usize| {
            let seeing = self.stated.get(anchor);
            let lifted = seeing.into_iter().flat_map(|seeing| &seeing.lifted);
            let partners = self.partners.get(anchor).into_iter().flatten();
            let motions = self.motions.get(anchor).into_iter().flatten();
            let shares =
                partners.zip(lifted).zip(motions).filter_map(|((partner, lifted), motion)| {
                    let camera = self.sights.get(&partner.frame)?.camera;
                    let here = change.pose(*anchor, &self.poses)?;
                    let there = change.pose(partner.frame, &self.poses)?;
                    let mut there_from_here = there.inverse() * here;
                    there_from_here.translation.vector *= times;
                    share_explained(lifted, &camera, &there_from_here, motion.as_ref())
                });
            shares.collect::<Vec<_>>()
        };
        mean(self.anchors.iter().flat_map(of)).unwrap_or(0.0)
    }

    /// How much larger the motions by the features are than those of a reading of the poses, and the standard error of its
    /// logarithm; `None` where they do not agree on it.
    pub(super) fn scale_of(&self, change: &Change) -> Option<(f64, f64)> {
        const LARGEST_ERROR: f64 = 0.08;
        const MIN_RATIOS: usize = 4;
        let ratios = self.anchors.iter().flat_map(|anchor| {
            let partners = self.partners.get(anchor).into_iter().flatten();
            let motions = self.motions.get(anchor).into_iter().flatten();
            partners.zip(motions).filter_map(|(partner, motion)| {
                let here = change.pose(*anchor, &self.poses)?;
                let there = change.pose(partner.frame, &self.poses)?;
                let stated_m = (there.inverse() * here).translation.vector.norm();
                let real_m = motion.as_ref()?.there_from_here.translation.vector.norm();
                (stated_m > 0.0 && real_m > 0.0).then(|| (real_m / stated_m).ln())
            })
        });
        let mut ratios: Vec<f64> = ratios.collect();
        ratios.sort_by(f64::total_cmp);
        if ratios.len() < MIN_RATIOS {
            return None;
        }
        let quantile = |share: f64| ratios.get((share * (ratios.len() - 1) as f64) as usize);
        // That of the median of normally distributed ratios, by their interquartile range.
        let error = 0.93 * (quantile(0.75)? - quantile(0.25)?) / (ratios.len() as f64).sqrt();
        log::debug!("motions are {:.3} times the stated ones, ± {error:.3}", quantile(0.5)?.exp());
        (error < LARGEST_ERROR).then_some((quantile(0.5)?.exp(), error))
    }
}

/// The reading as stated.
pub(super) const AS_STATED: Change = Change::None;

#[cfg(test)]
mod tests {
    use super::anchors_of;

    #[test]
    fn only_large_photos_have_fewer_anchors() {
        for (megapixels, anchors) in [(1, 8), (24, 8), (28, 8), (40, 5), (67, 2), (1000, 1)] {
            assert_eq!(anchors_of(megapixels * 1_000_000), anchors, "{megapixels}");
        }
        assert_eq!(anchors_of(1), 8);
    }
}
