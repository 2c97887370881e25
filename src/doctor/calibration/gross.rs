//! A camera or clouds that are far off, by the same depth edges.

use super::search::{
    FOCAL_LENGTH, Frame, POSE, Values, WITH_FOCAL_LENGTH, climbed, refined, strength_in, total,
    turns, units,
};
use super::view::LEVELS;
use super::{MIN_EDGES, pose_of, read};
use crate::camera::Intrinsics;
use crate::doctor::reading::{Change, Mistake, Reading, pose_of_moves, readings};
use crate::doctor::search::{aside_reading, camera_reading, moves_in_words};
use crate::scene::Scene;

/// The most frames that are read, and the fewest; every second one chooses the values, and the others test them.
const FRAMES: usize = 18;
const MIN_FRAMES: usize = 6;
/// What moves depth edges by less is left to a calibration [px of the finest map]. Depth images show outlines that far aside.
const MIN_PX: f64 = 10.0;
/// What moves them by less is not told beside what moves them farther.
const TOLD_PX: f64 = 3.0;
/// A focal length that is closer to the stated one is, too; as a share.
const MIN_FOCAL: f64 = 0.03;
/// How much stronger the photo's edges must be on average, as a share of those around, and in standard errors.
const MIN_GAIN: f64 = 0.12;
const CERTAIN: f64 = 3.5;
/// A kind that reaches this share of the gain of the best one explains it.
const EXPLAINS: f64 = 0.85;
/// Ends of a search with less than this share of the gain of its best one are not considered.
const CONSIDERED: f64 = 0.7;
/// Starts of each search, on the most blurred map.
const STARTS: usize = 4;
const LEVEL: usize = LEVELS - 1;

/// What may be off, and which freedoms that changes. The simplest comes first.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// The poses and the clouds are those of a camera beside this one.
    Aside,
    /// The focal length and the centre. A turn moves far points as another centre does.
    Camera,
    Turned,
    Shifted,
    Moved,
    /// Clouds and camera.
    All,
}

impl Kind {
    const EACH: [Self; 6] =
        [Self::Aside, Self::Camera, Self::Turned, Self::Shifted, Self::Moved, Self::All];

    fn free(self) -> &'static [usize] {
        match self {
            Self::Aside => &[3],
            Self::Camera => &[0, 1, FOCAL_LENGTH],
            Self::Turned => &[0, 1, 2],
            Self::Shifted => &[3, 4, 5],
            Self::Moved => &POSE,
            Self::All => &WITH_FOCAL_LENGTH,
        }
    }

    /// The values as a reading of the scene.
    fn change(self, values: &Values, focal_px: f64) -> Change {
        let times = values[FOCAL_LENGTH].exp();
        match self {
            Self::Aside => Change::Aside(-values[3]),
            Self::Camera => Change::Camera {
                times,
                right: focal_px * times * values[1].tan(),
                down: -focal_px * times * values[0].tan(),
            },
            _ => Change::Calibration { camera_from_stated: pose_of(values), times },
        }
    }
}

/// Frames with the depth edges of their clouds.
pub(in crate::doctor) struct Outlines {
    frames: Vec<Frame>,
    camera: Intrinsics,
}

/// What puts depth edges on edges of the photos, and how much stronger these are.
struct Found {
    kind: Kind,
    change: Change,
    values: Values,
    gain: f64,
}

impl Outlines {
    /// Those of frames that are spread over a scene; `None` where there are too few.
    pub(in crate::doctor) fn of(scene: &dyn Scene) -> Option<Self> {
        let frames = read(scene, FRAMES);
        let edges: usize = frames.iter().map(|frame| frame.edges.len()).sum();
        let camera = frames.first()?.view.camera;
        (frames.len() >= MIN_FRAMES && edges >= MIN_EDGES).then_some(Self { frames, camera })
    }

    /// Every second frame.
    fn half(&self, of: usize) -> Vec<&Frame> {
        self.frames.iter().skip(of).step_by(2).collect()
    }

    /// Whether a reading with numbers puts depth edges on stronger edges than the scene as stated; `None` of others.
    pub(in crate::doctor) fn confirm(&self, change: &Change) -> Option<bool> {
        let mut values = Values::zeros();
        match *change {
            Change::Aside(right_m) => values[3] = -right_m,
            Change::Camera { times, right, down } => {
                let focal_px = self.camera.fx * times;
                values[0] = -(down / focal_px).atan();
                values[1] = (right / focal_px).atan();
                values[FOCAL_LENGTH] = times.ln();
            }
            Change::Move(moves) => {
                let pose = pose_of_moves(&moves);
                values.fixed_rows_mut::<3>(0).copy_from(&pose.rotation.scaled_axis());
                values.fixed_rows_mut::<3>(3).copy_from(&pose.translation.vector);
            }
            _ => return None,
        }
        let all: Vec<&Frame> = self.frames.iter().collect();
        Some(gain(&all, &values).is_some())
    }

    /// The reading that puts depth edges on edges of the photos far better than the scene as stated, if any does so in
    /// frames that did not choose it, and if `is_possible` says so.
    pub(in crate::doctor) fn gross(
        mut self,
        scene: &dyn Scene,
        is_possible: &dyn Fn(&Change) -> bool,
    ) -> Option<Reading> {
        let neighbour = self.of_neighbour(scene, is_possible);
        let all = Kind::EACH.into_iter().filter_map(|kind| self.best(kind, is_possible));
        let all: Vec<Found> = all.collect();
        let of_neighbour = neighbour.as_ref().map_or(0.0, |(gain, _)| *gain);
        let most = all.iter().map(|found| found.gain).fold(of_neighbour, f64::max);
        if let Some((gain, reading)) = neighbour
            && gain >= EXPLAINS * most
        {
            return Some(reading);
        }
        let found = all.into_iter().find(|found| found.gain >= EXPLAINS * most)?;
        self.reading(&found)
    }

    fn reading(&self, found: &Found) -> Option<Reading> {
        let &Found { kind, change, values, .. } = found;
        match change {
            Change::Aside(right_m) => Some(aside_reading(right_m)),
            Change::Camera { .. } => Some(camera_reading(&self.camera, change)),
            // This names the camera alone. A second search, with that camera, looks for clouds that are moved too.
            _ if kind == Kind::All && values[FOCAL_LENGTH].abs() >= MIN_FOCAL => {
                let change = Kind::Camera.change(&values, self.camera.fx);
                Some(camera_reading(&self.camera, change))
            }
            _ => {
                let [x, y, z] = [0, 1, 2].map(|axis: usize| values[axis].to_degrees());
                let moves = [y, x, z, values[3], values[4], values[5]];
                let unit = units(&self.half(0));
                let is_told = |place: usize| {
                    let at = [1, 0, 2, 3, 4, 5][place];
                    values[at].abs() > TOLD_PX * unit[at]
                };
                let remedy = moves_in_words(&moves, is_told)?;
                Some(Reading::new(Mistake::MovedCloud, &remedy, change))
            }
        }
    }

    /// The clouds of the frames before or behind, if these put depth edges on stronger edges, and how much stronger.
    fn of_neighbour(
        &mut self,
        scene: &dyn Scene,
        is_possible: &dyn Fn(&Change) -> bool,
    ) -> Option<(f64, Reading)> {
        let zeros = Values::zeros();
        let neighbours =
            readings().into_iter().filter(|one| matches!(one.change, Change::Neighbour(_)));
        let mut best: Option<(f64, Reading)> = None;
        for one in neighbours {
            let gains = self.frames.iter().filter_map(|frame| {
                let at = one.change.cloud_of(frame.at).filter(|&at| at < scene.frames().len())?;
                let cloud = scene.cloud(at).ok()?;
                let edges = frame.edges_of(&cloud);
                Some(strength_in(frame, &edges, &zeros) - strength_in(frame, &frame.edges, &zeros))
            });
            let gains: Vec<f64> = gains.collect();
            log::debug!("outlines of neighbours, {}: {gains:.3?}", one.remedy);
            if let Some(gain) = certain(&gains)
                && best.as_ref().is_none_or(|(most, _)| gain > *most)
                && is_possible(&one.change)
            {
                best = Some((gain, one));
            }
        }
        best
    }

    /// The values of a kind under which the edges are strongest, of those that are possible and far from what is stated.
    fn best(&self, kind: Kind, is_possible: &dyn Fn(&Change) -> bool) -> Option<Found> {
        let free = kind.free();
        let [choosing, testing] = [self.half(0), self.half(1)];
        let frames = &choosing[..];
        let unit = units(frames);
        let mut starts = strongest(frames, free, &unit);
        match kind {
            Kind::Camera => starts.extend(cameras(frames, &unit)),
            Kind::Turned | Kind::Moved | Kind::All => starts.extend(turns(frames, STARTS)),
            Kind::Aside | Kind::Shifted => {}
        }
        let ends = starts.into_iter().map(|start| {
            let end = refined(frames, free, climbed(frames, free, start, LEVELS));
            (total(frames, 0, &end), end)
        });
        let stated = total(frames, 0, &Values::zeros());
        let mut ends: Vec<(f64, Values)> = ends.filter(|(score, _)| *score > stated).collect();
        ends.sort_by(|one, other| other.0.total_cmp(&one.0));
        let least = stated + CONSIDERED * (ends.first()?.0 - stated);
        ends.dedup_by(|next, kept| {
            free.iter().all(|&at| (next.1[at] - kept.1[at]).abs() < unit[at])
        });
        let considered = ends.into_iter().take_while(|(score, _)| *score >= least);
        let mut possible = considered.filter_map(|(_, values)| {
            let is_off = kind != Kind::Camera || values[FOCAL_LENGTH].abs() >= MIN_FOCAL;
            let moved_px =
                free.iter().map(|&at| (values[at] / unit[at]).powi(2)).sum::<f64>().sqrt();
            let gain = gain(&testing, &values)?;
            let change = kind.change(&values, self.camera.fx);
            log::debug!("outlines, {kind:?}: {:.4?}, {gain:.3}", values.as_slice());
            (is_off && moved_px >= MIN_PX && is_possible(&change)).then_some(Found {
                kind,
                change,
                values,
                gain,
            })
        });
        possible.next()
    }
}

/// The strongest places along one freedom and then along another one, on the most blurred map.
fn strongest(frames: &[&Frame], free: &[usize], unit: &Values) -> Vec<Values> {
    let firsts =
        free.iter().map(|&freedom| (freedom, along(frames, freedom, unit, &Values::zeros())));
    let firsts: Vec<(usize, (f64, Values))> = firsts.collect();
    let seconds = firsts.iter().flat_map(|(first, (_, from))| {
        let others = free.iter().filter(move |other| *other != first);
        others.map(|&other| along(frames, other, unit, from))
    });
    let mut all: Vec<(f64, Values)> = seconds.collect();
    all.extend(firsts.iter().map(|(_, one)| *one));
    apart(all, free, unit)
}

/// The strongest places along one freedom from these values, with how strong it is.
fn along(frames: &[&Frame], freedom: usize, unit: &Values, from: &Values) -> (f64, Values) {
    /// Steps to each side, each of a pixel of that map.
    const STEPS: i32 = 16;
    let at = |step: i32| {
        let mut values = *from;
        values[freedom] += f64::from(step << LEVEL) * unit[freedom];
        (total(frames, LEVEL, &values), values)
    };
    let scored = (-STEPS..=STEPS).map(at);
    scored.reduce(|best, next| if next.0 > best.0 { next } else { best }).unwrap_or((0.0, *from))
}

/// The strongest focal lengths and centres of a coarse grid: each of them alone leads nowhere.
fn cameras(frames: &[&Frame], unit: &Values) -> Vec<Values> {
    /// Steps to each side: up or down, to the left or right, and of the focal length.
    const STEPS: [i32; 3] = [3, 6, 8];
    const STEP_PX: f64 = 6.0;
    let [x, y, f] = STEPS.map(|most| -most..=most);
    let grid = x.flat_map(|x| y.clone().map(move |y| (x, y)));
    let grid = grid.flat_map(|(x, y)| f.clone().map(move |f| [x, y, f]));
    let scored = grid.map(|steps| {
        let mut values = Values::zeros();
        for (&freedom, step) in Kind::Camera.free().iter().zip(steps) {
            values[freedom] = f64::from(step) * STEP_PX * unit[freedom];
        }
        (total(frames, LEVEL, &values), values)
    });
    apart(scored.collect(), Kind::Camera.free(), unit)
}

/// The strongest ones that are not beside each other.
fn apart(mut all: Vec<(f64, Values)>, free: &[usize], unit: &Values) -> Vec<Values> {
    const APART_PX: f64 = 8.0;
    all.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut found: Vec<Values> = Vec::new();
    for (_, values) in all {
        let is_known = |known: &Values| {
            free.iter().all(|&at| (values[at] - known[at]).abs() < APART_PX * unit[at])
        };
        if found.len() < STARTS && !found.iter().any(is_known) {
            found.push(values);
        }
    }
    found
}

/// How much stronger the edges of frames are than as stated, on average, if that is certain.
fn gain(frames: &[&Frame], values: &Values) -> Option<f64> {
    let of = |frame: &&Frame, values: &Values| strength_in(frame, &frame.edges, values);
    let gains = frames.iter().map(|frame| of(frame, values) - of(frame, &Values::zeros()));
    certain(&gains.collect::<Vec<_>>())
}

/// The mean of what frames gain, if it is large and certain.
fn certain(gains: &[f64]) -> Option<f64> {
    let count = gains.len() as f64;
    if gains.len() < MIN_FRAMES / 2 {
        return None;
    }
    let mean = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = (variance / count).sqrt();
    log::debug!("outlines: {mean:.3} ± {error:.3} stronger");
    (mean >= MIN_GAIN && mean >= CERTAIN * error).then_some(mean)
}
