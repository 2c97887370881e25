//! Compares a scene, as stated and in other readings, with its own photos.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use image::GrayImage;
use nalgebra::Point3;

use super::agreement::{EdgeMap, Seen, carried_agreement, edge_agreement, edge_map, project};
use super::reading::{Change, Mistake, Reading, readings};
use crate::camera::Intrinsics;
use crate::geometry::Pose;
use crate::scene::{Scene, SceneError};

/// How many frames are compared, each with its partners.
const ANCHORS: usize = 8;
/// The offsets of an anchor's partners; the first two that exist are used.
const PARTNERS: [isize; 4] = [1, 3, -1, -3];
const CARRIED_TO: usize = 2;
/// The most points of a cloud; edges need a dense one.
const MAX_POINTS: usize = 40_000;
/// Every how many points one is carried to other frames.
const CARRIED: usize = 4;

/// The least mean gain of another reading over the frames.
const TELLING_GAIN: f64 = 0.04;
/// The fewest frames that a reading with a free number is fitted to.
const MIN_FRAMES: usize = 4;
/// What counts of the gain of a reading whose free numbers were chosen too.
const CHOSEN: f64 = 0.85;
/// The least mean gain in standard errors of the mean.
const CERTAIN: f64 = 2.5;

/// A photo with its edges and its camera.
struct Sight {
    gray: GrayImage,
    edges: EdgeMap,
    camera: Intrinsics,
}

/// The compared frames, with all poses.
pub(super) struct Sample {
    poses: Vec<Option<Pose>>,
    sights: BTreeMap<usize, Sight>,
    clouds: BTreeMap<usize, Vec<Point3<f64>>>,
    pub(super) anchors: Vec<usize>,
}

/// A reading that fits better than the scene as stated.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The mistake.
    pub mistake: Mistake,
    /// How to correct it.
    pub remedy: String,
    /// The agreement of the scene as stated.
    pub stated: Agreement,
    /// The agreement in the other reading.
    pub otherwise: Agreement,
}

/// How well a reading fits the photos on average; higher is better.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Logarithm of the ratio of image-edge strength at depth edges to that at all points.
    pub edges: Option<f64>,
    /// Correlation of the points' grey values between photos, as Fisher's z.
    pub carried: Option<f64>,
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let numbers: Vec<f64> = numbers.collect();
    (!numbers.is_empty()).then(|| numbers.iter().sum::<f64>() / numbers.len() as f64)
}

/// The mean of the scores of one reading over the frames.
fn mean_of(scores: &[Agreement]) -> Agreement {
    Agreement {
        edges: mean(scores.iter().filter_map(|score| score.edges)),
        carried: mean(scores.iter().filter_map(|score| score.carried)),
    }
}

/// One number for both measures; missing edges count slightly against a reading.
fn worth(score: &Agreement, weigh_edges: f64) -> f64 {
    score.carried.unwrap_or(0.0) + weigh_edges * score.edges.unwrap_or(-0.2)
}

impl Sample {
    /// Reads frames with pose and cloud, spread over the scene.
    pub(super) fn read(scene: &dyn Scene) -> Result<Self, SceneError> {
        let count = scene.frames().len();
        let poses: Vec<Option<Pose>> = (0..count).map(|frame| scene.pose(frame)).collect();
        let references: Vec<usize> =
            (0..count).filter(|&frame| poses[frame].is_some() && scene.has_cloud(frame)).collect();
        let many = ANCHORS.min(references.len());
        let anchors: Vec<usize> =
            (0..many).map(|at| references[at * references.len() / many]).collect();
        let mut sample = Self { poses, sights: BTreeMap::new(), clouds: BTreeMap::new(), anchors };
        for &anchor in &sample.anchors {
            for frame in std::iter::once(anchor).chain(partners(anchor, count)) {
                if let Entry::Vacant(place) = sample.sights.entry(frame) {
                    let photo = scene.photo(frame)?;
                    place.insert(Sight {
                        edges: edge_map(&photo.gray),
                        gray: photo.gray,
                        camera: scene.intrinsics(frame),
                    });
                }
            }
            for frame in anchor.saturating_sub(1)..(anchor + 2).min(count) {
                if let Entry::Vacant(place) = sample.clouds.entry(frame)
                    && scene.has_cloud(frame)
                {
                    let cloud = scene.cloud(frame)?;
                    let step = cloud.points.len().div_ceil(MAX_POINTS).max(1);
                    let points = cloud.points.iter().step_by(step);
                    place.insert(points.map(|point| point.cast()).collect());
                }
            }
        }
        Ok(sample)
    }

    /// A frame's photo, and the points of its cloud in the photo.
    pub(super) fn seen(&self, anchor: usize) -> Option<(&GrayImage, Vec<Seen>)> {
        let sight = self.sights.get(&anchor)?;
        let points = self.clouds.get(&anchor)?;
        let seen = points.iter().filter_map(|point| project(&sight.camera, 0.0, point));
        Some((&sight.gray, seen.collect()))
    }

    /// The scores of a reading, frame by frame.
    fn scores(&self, change: &Change) -> Vec<Agreement> {
        let anchors = self.anchors.iter();
        anchors.map(|&anchor| self.score(anchor, change)).collect()
    }

    fn score(&self, anchor: usize, change: &Change) -> Agreement {
        let cloud = change.cloud_of(anchor);
        let cloud = cloud.and_then(|frame| self.clouds.get(&frame));
        let (Some(sight), Some(cloud)) = (self.sights.get(&anchor), cloud) else {
            return Agreement::default();
        };
        let points = change.points(cloud);
        let (camera, k1) = change.camera(&sight.camera);
        let seen: Vec<Option<Seen>> =
            points.iter().map(|point| project(&camera, k1, point)).collect();
        let in_front: Vec<Seen> = seen.iter().flatten().copied().collect();
        let in_view = in_front.iter().filter(|seen| camera.contains(&seen.pixel)).count();
        let carried_points: Vec<&Point3<f64>> = points.iter().step_by(CARRIED).collect();
        let seen: Vec<Option<Seen>> = seen.into_iter().step_by(CARRIED).collect();
        // With few points in view, agreement is chance.
        let least = in_view / CARRIED / 20;
        let carried = partners(anchor, self.poses.len()).filter_map(|partner| {
            let other = self.sights.get(&partner)?;
            let here = change.pose(anchor, &self.poses)?;
            let partner_from_anchor = change.pose(partner, &self.poses)?.inverse() * here;
            let (camera, k1) = change.camera(&other.camera);
            let there: Vec<Option<Seen>> = carried_points
                .iter()
                .map(|point| project(&camera, k1, &(partner_from_anchor * **point)))
                .collect();
            let agreement = carried_agreement((&sight.gray, &seen), (&other.gray, &there), least);
            // Points that are out of view of the partner do not agree.
            Some(agreement.unwrap_or(0.0))
        });
        Agreement { edges: edge_agreement(&sight.edges, &in_front), carried: mean(carried) }
    }

    /// The reading that fits better than the scene as stated, if any.
    pub(super) fn diagnose(&self) -> (Agreement, Option<Finding>) {
        let stated = self.scores(&Change::Pose(|pose| *pose));
        let mut best: Option<(f64, Reading, Agreement)> = None;
        let usual = readings().into_iter().filter(|reading| self.may_be(&reading.change));
        for reading in usual.chain(self.searched()) {
            let scores = self.scores(&reading.change);
            let gain = gain(&stated, &scores, &reading.change);
            // Of six numbers two were chosen: some of the gain is chance.
            let is_free = reading.mistake == Mistake::MovedCloud;
            let gain = gain.map(|gain| if is_free { CHOSEN * gain } else { gain });
            let otherwise = mean_of(&scores);
            log::debug!("{:?} {}: {gain:?} {otherwise:?}", reading.mistake, reading.remedy);
            if let Some(gain) = gain
                && best.as_ref().is_none_or(|(known, ..)| gain > *known)
            {
                best = Some((gain, reading, otherwise));
            }
        }
        let stated = mean_of(&stated);
        let finding = best.map(|(_, reading, otherwise)| Finding {
            mistake: reading.mistake,
            remedy: reading.remedy,
            stated,
            otherwise,
        });
        (stated, finding)
    }

    /// The readings with a free number, each with the number that fits best.
    fn searched(&self) -> Vec<Reading> {
        let mut found = Vec::new();
        let aside: Vec<f64> = (-20..=20).map(|step| 0.05 * f64::from(step)).collect();
        if let Some(right_m) = self.best_of(&aside, &|right_m| Change::Aside(right_m))
            && right_m.abs() > MIN_ASIDE_M
        {
            found.push(Reading {
                mistake: Mistake::OtherStereoCamera,
                remedy: format!(
                    "shift poses and clouds by {right_m:.2} m along the camera's x axis"
                ),
                change: Change::Aside(right_m),
            });
        }
        found.extend(self.best_camera());
        found.extend(self.best_move());
        let bends: Vec<f64> = (-16..=16).map(|step| 0.03 * f64::from(step)).collect();
        if let Some(k1) = self.best_of(&bends, &Change::Lens)
            && self.bends_by_px(k1) > MIN_PX
        {
            found.push(Reading {
                mistake: Mistake::UndistortedTwice,
                remedy: format!("add {k1:.2} to the distortion k1, which fits the photos better"),
                change: Change::Lens(k1),
            });
        }
        found
    }

    /// The value that fits best.
    fn best_of(&self, values: &[f64], change: &dyn Fn(f64) -> Change) -> Option<f64> {
        let scored = values.iter().map(|&value| {
            let mean = mean_of(&self.scores(&change(value)));
            (value, worth(&mean, IN_FRAME))
        });
        let best = scored.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(best.0)
    }

    /// Fits focal length and principal point alternately.
    fn best_camera(&self) -> Option<Reading> {
        let first = self.sights.values().next()?.camera;
        let step = f64::from(first.width) / 120.0;
        let shifts: Vec<f64> = (-6..=6).map(|k| step * f64::from(k)).collect();
        let scales: Vec<f64> = (-14..=14).map(|k| (0.025 * f64::from(k)).exp()).collect();
        let (mut times, mut right, mut down) = (1.0, 0.0, 0.0);
        for _ in 0..2 {
            let camera = |times, right, down| Change::Camera { times, right, down };
            times = self.best_of(&scales, &|times| camera(times, right, down))?;
            right = self.best_of(&shifts, &|right| camera(times, right, down))?;
            down = self.best_of(&shifts, &|down| camera(times, right, down))?;
        }
        let moved_px =
            f64::hypot(right, down).max((times - 1.0_f64).abs() * f64::from(first.width) / 2.0);
        (moved_px > MIN_PX).then(|| Reading {
            mistake: Mistake::WrongCamera,
            remedy: format!(
                "use a focal length of {:.0} px instead of {:.0} and a centre at ({:.0}, {:.0}) instead of \
                 ({:.0}, {:.0}), which fit the photos better",
                first.fx * times,
                first.fx,
                first.cx + right,
                first.cy + down,
                first.cx,
                first.cy
            ),
            change: Change::Camera { times, right, down },
        })
    }

    /// Turns or shifts the clouds along one axis, and along a second one if that helps too.
    fn best_move(&self) -> Option<Reading> {
        const STEPS: i32 = 4;
        const TURN_DEG: f64 = 2.0;
        /// A step of a shift as a share of the depth.
        const SHIFT: f64 = 0.05;
        /// Fine steps are this share of a step.
        const FINE: f64 = 0.2;
        const AXES: usize = 2;
        const NAMES: [&str; 6] = ["about y", "about x", "about z", "along x", "along y", "along z"];
        let camera = self.sights.values().next()?.camera;
        let depth_m = self.median_depth_m()?;
        let step = |axis: usize| if axis < 3 { TURN_DEG } else { SHIFT * depth_m };
        let mut moved = [0.0; 6];
        let mut worth_before = worth(&mean_of(&self.scores(&Change::Move(moved))), IN_FRAME);
        for _ in 0..AXES {
            let along = |moved: &[f64; 6], axis: usize, by: f64| {
                let mut changed = *moved;
                changed[axis] += by * step(axis);
                let score = mean_of(&self.scores(&Change::Move(changed)));
                (changed, worth(&score, IN_FRAME))
            };
            let steps = (-STEPS..=STEPS).filter(|by| *by != 0).map(f64::from);
            let coarse = (0..6).flat_map(|axis| steps.clone().map(move |by| (axis, by)));
            let tried = coarse.map(|(axis, by)| (axis, along(&moved, axis, by)));
            let (axis, (best, _)) = tried.max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
            let fine = (-STEPS..=STEPS).map(|by| along(&best, axis, FINE * f64::from(by)));
            let (best, worth) = fine.max_by(|a, b| a.1.total_cmp(&b.1))?;
            if worth < worth_before + TELLING_GAIN {
                break;
            }
            (moved, worth_before) = (best, worth);
        }
        let px_of = |axis: usize| match axis {
            2 => moved[2].to_radians() * f64::from(camera.width) / 2.0,
            0 | 1 => moved[axis].to_radians() * camera.fx,
            _ => moved[axis] / depth_m * camera.fx,
        };
        let words = (0..6).filter(|axis| px_of(*axis).abs() > MIN_PX).map(|axis| match axis {
            0..=2 => format!("turn the clouds by {:.1}° {}", moved[axis], NAMES[axis]),
            _ => format!("shift the clouds by {:.2} {}", moved[axis], NAMES[axis]),
        });
        let words: Vec<String> = words.collect();
        (!words.is_empty()).then(|| Reading {
            mistake: Mistake::MovedCloud,
            remedy: words.join(" and "),
            change: Change::Move(moved),
        })
    }

    /// Whether the stated lengths are such as a wrong unit would leave. At one place all photos agree, so a unit that
    /// draws cameras together would always seem to fit.
    fn may_be(&self, change: &Change) -> bool {
        /// What no scan reaches.
        const FAR_M: f64 = 300.0;
        let Change::Size(times) = *change else { return true };
        let Some(depth_m) = self.median_depth_m() else { return true };
        let steps = self.anchors.iter().flat_map(|&anchor| {
            let here = self.poses.get(anchor).copied().flatten();
            let there = partners(anchor, self.poses.len());
            there.filter_map(move |partner| {
                Some((self.poses[partner]?.translation.vector - here?.translation.vector).norm())
            })
        });
        let mut steps: Vec<f64> = steps.collect();
        steps.sort_by(f64::total_cmp);
        let step_m = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        if times < 1.0 { depth_m > FAR_M } else { step_m > depth_m }
    }

    /// The median depth of the points of the compared clouds.
    fn median_depth_m(&self) -> Option<f64> {
        let points = self.clouds.values().flatten();
        let mut depths: Vec<f64> = points.map(|point| point.z).filter(|z| *z > 0.0).collect();
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied()
    }

    /// How far a distortion moves pixels at the left and right edge.
    fn bends_by_px(&self, k1: f64) -> f64 {
        let Some(sight) = self.sights.values().next() else {
            return 0.0;
        };
        let half = f64::from(sight.camera.width) / 2.0;
        let x = half / sight.camera.fx;
        (k1 * x * x).abs() * half
    }
}

fn partners(anchor: usize, count: usize) -> impl Iterator<Item = usize> {
    let frames = PARTNERS.iter().filter_map(move |&step| anchor.checked_add_signed(step));
    frames.filter(move |&frame| frame < count).take(CARRIED_TO)
}

/// Smaller shifts of a camera are ignored \[m\].
const MIN_ASIDE_M: f64 = 0.12;
/// Smaller shifts of pixels are ignored \[px\].
const MIN_PX: f64 = 8.0;
/// The weight of edges for mistakes within a frame.
const IN_FRAME: f64 = 1.0;

/// The gain of a reading, if it is significant.
fn gain(stated: &[Agreement], other: &[Agreement], change: &Change) -> Option<f64> {
    // Mistakes in poses do not affect edges, which are within a frame.
    let weigh_edges = match change {
        Change::Pose(_) | Change::Poses(_) => 0.0,
        _ => IN_FRAME,
    };
    let gains: Vec<f64> = stated
        .iter()
        .zip(other)
        .filter(|(_, other)| other.edges.is_some() || other.carried.is_some())
        .map(|(stated, other)| worth(other, weigh_edges) - worth(stated, weigh_edges))
        .collect();
    let count = gains.len() as f64;
    // With few frames, a chance fit of two must not count as a mistake.
    if gains.len() < MIN_FRAMES.min(stated.len()).max(2) || gains.len() * 2 < stated.len() {
        return None;
    }
    let has_number = matches!(
        change,
        Change::Aside(_) | Change::Camera { .. } | Change::Lens(_) | Change::Move(_)
    );
    if has_number && gains.len() < MIN_FRAMES {
        return None;
    }
    let mean = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / count;
    let error = (variance / (count - 1.0).max(1.0)).sqrt();
    (mean > TELLING_GAIN && mean > CERTAIN * error).then_some(mean)
}
