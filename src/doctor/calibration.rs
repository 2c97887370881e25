//! Whether camera and scanner are where a scene says: the turn, the shift, the delay and the focal length that put the
//! depth edges of clouds on the edges of photos (after Levinson and Thrun, *Automatic Online Calibration of Cameras and
//! Lasers*, RSS 2013).

mod depth_edges;
mod gross;
#[cfg(feature = "rerun")]
mod picture;
mod search;
mod view;

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

pub(super) use self::gross::Outlines;
use self::search::{
    DELAY, FOCAL_LENGTH, Frame, POSE, Values, WITH_FOCAL_LENGTH, best, delay, spread, units,
};
use self::view::View;
use super::reading::Change;
use super::sample::{AS_STATED, Agreement, Sample};
use crate::geometry::Pose;
use crate::scene::Scene;

/// The most frames that are compared.
const FRAMES: usize = 25;
/// The fewest frames and depth edges that say something.
const MIN_FRAMES: usize = 3;
const MIN_EDGES: usize = 800;
/// No edge is located better than this on average, however many frames there are \[px of the finest map\].
const FLOOR_PX: f64 = 0.35;
/// A value that is more standard deviations from 0 is off. One of seven sound ones is by chance in about 50 scenes.
const OFF: f64 = 3.0;
/// Standard deviations of a normal distribution that hold 90 %.
const HOLD_90: f64 = 1.645;
/// A camera that is slower says nothing about a delay \[m/s\].
const MIN_SPEED: f64 = 1.0;

/// A value with an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value that fits best.
    pub value: f64,
    /// The standard deviation, by how the value changes from frames to frames and by how exactly edges can be located.
    pub std_dev: f64,
}

impl Estimate {
    /// Half of the interval that holds the true value with 90 %.
    pub fn half_width(&self) -> f64 {
        HOLD_90 * self.std_dev
    }

    /// Whether the stated value is not the true one.
    pub fn is_off(&self) -> bool {
        self.value.abs() > OFF * self.std_dev
    }
}

/// How far the stated calibration of a scene is off.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The frames that were compared.
    pub frames: usize,
    /// Their depth edges.
    pub edges: usize,
    /// How the clouds must be turned about x, y and z of the camera's frame \[rad\].
    pub turn: [Estimate; 3],
    /// How they must be shifted along x, y and z after that \[m\].
    pub shift: [Estimate; 3],
    /// By how much the focal length must be larger, as a share.
    pub focal_length: Estimate,
    /// How much later the photos were taken than the clouds \[s\], if turn, shift and focal length are as stated; `None`
    /// where the camera stands or the times are not known.
    pub delay: Option<Estimate>,
    /// Whether the features that photos share and the grey values of points fit worse with what the edges say than as
    /// stated. The intervals then hold what is stated, too.
    pub is_disputed: bool,
    /// Whether a delay alone explains the photos nearly as well as the turn and the shift.
    pub may_be_delay: bool,
    /// Whether more frames would narrow the intervals.
    pub is_narrowed_by_frames: bool,
    /// Depth edges on a photo, as stated above and as found below.
    #[cfg(feature = "rerun")]
    pub picture: crate::image::RgbImage,
}

/// Why a calibration cannot be judged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NotJudged {
    /// Too few frames have a photo and a cloud.
    #[error("{found} frames have a photo and a cloud that can be read; {MIN_FRAMES} are needed")]
    FewFrames {
        /// How many have.
        found: usize,
    },
    /// The clouds show too few outlines in the photos.
    #[error(
        "the clouds have {found} depth edges in the photos, and {MIN_EDGES} are needed; take more frames, denser clouds, \
         or places where near things stand before far ones"
    )]
    FewEdges {
        /// How many they show.
        found: usize,
    },
}

impl Calibration {
    /// `camera_from_stated`: multiplied from the left to the stated `camera_from_cloud`, this gives the one that fits.
    pub fn camera_from_stated(&self) -> Pose {
        let vector = |of: &[Estimate; 3]| Vector3::from(of.map(|one| one.value));
        Pose::from_parts(
            Translation3::from(vector(&self.shift)),
            UnitQuaternion::from_scaled_axis(vector(&self.turn)),
        )
    }

    /// With intervals that hold what is stated.
    fn disputed(mut self) -> Self {
        let all = self.turn.iter_mut().chain(&mut self.shift).chain([&mut self.focal_length]);
        for one in all.chain(&mut self.delay) {
            one.std_dev = one.std_dev.max(one.value.abs() / HOLD_90);
        }
        Self { is_disputed: true, ..self }
    }

    /// Whether anything is not as stated.
    pub fn is_off(&self) -> bool {
        let delay = self.delay.iter();
        let of_pose = self.turn.iter().chain(&self.shift);
        of_pose.chain([&self.focal_length]).chain(delay).any(Estimate::is_off)
    }
}

/// The steps of [`calibration`] that it tells.
pub const CALIBRATION_STEPS: [&str; 4] = [
    "reading frames",
    "searching a delay",
    "searching with the focal length",
    "searching turn and shift",
];

/// Estimates how far the calibration of a scene is off, from frames spread over it. It calls `begins` with the number of each of
/// [`CALIBRATION_STEPS`].
///
/// # Errors
/// [`NotJudged`] if too little can be compared.
pub fn calibration(scene: &dyn Scene, begins: &dyn Fn(usize)) -> Result<Calibration, NotJudged> {
    begins(0);
    let mut frames = read(scene, FRAMES);
    if frames.len() < MIN_FRAMES {
        return Err(NotJudged::FewFrames { found: frames.len() });
    }
    let edges = frames.iter().map(|frame| frame.edges.len()).sum();
    if edges < MIN_EDGES {
        return Err(NotJudged::FewEdges { found: edges });
    }
    begins(1);
    let delay = delayed(&mut frames);
    begins(2);
    let with_focal_length = best(&mut frames, &WITH_FOCAL_LENGTH);
    let by_frames = spread(&refs(&frames), &WITH_FOCAL_LENGTH, &with_focal_length);
    let unit = units(&refs(&frames));
    let estimate = |values: &Values, by_frames: &Values, at: usize| Estimate {
        value: values[at],
        std_dev: by_frames[at].hypot(FLOOR_PX * unit[at]),
    };
    let focal_length = estimate(&with_focal_length, &by_frames, FOCAL_LENGTH);
    begins(3);
    // A free focal length makes the shift along z less certain.
    let (values, by_frames) = if focal_length.is_off() {
        (with_focal_length, by_frames)
    } else {
        let values = best(&mut frames, &POSE);
        let by_frames = spread(&refs(&frames), &POSE, &values);
        (values, by_frames)
    };
    let of = |at: usize| estimate(&values, &by_frames, at);
    let may_be_delay = delay.is_some_and(|(delay, gain)| {
        delay.is_off() && gain > AS_GOOD * search::gain(&refs(&frames), &values)
    });
    let narrowed = POSE.iter().filter(|&&at| by_frames[at] > FLOOR_PX * unit[at]).count();
    let found = Calibration {
        frames: frames.len(),
        edges,
        turn: [of(0), of(1), of(2)],
        shift: [of(3), of(4), of(5)],
        focal_length: Estimate { value: focal_length.value.exp_m1(), ..focal_length },
        delay: delay.map(|(delay, _)| delay),
        is_disputed: false,
        may_be_delay,
        is_narrowed_by_frames: 2 * narrowed > POSE.len(),
        #[cfg(feature = "rerun")]
        picture: picture::before_and_after(scene, &frames, &values),
    };
    Ok(if found.is_off() && is_disputed(scene, &values) { found.disputed() } else { found })
}

/// Whether shared features and grey values together fit worse with these values than as stated.
fn is_disputed(scene: &dyn Scene, values: &Values) -> bool {
    /// What they vary by.
    const LOST: f64 = 0.01;
    let sample = Sample::read(scene);
    let change = Change::Calibration {
        camera_from_stated: pose_of(values),
        times: values[FOCAL_LENGTH].exp(),
    };
    let worth = |change: &Change| {
        let mean = Agreement::mean(&sample.scores(&sample.anchors, change));
        Some(mean.carried?.tanh() + mean.motions?)
    };
    match (worth(&AS_STATED), worth(&change)) {
        (Some(stated), Some(found)) => found < stated - LOST,
        _ => false,
    }
}

/// `camera_from_stated` of a turn and a shift.
fn pose_of(values: &Values) -> Pose {
    Pose::from_parts(
        Translation3::from(values.fixed_rows::<3>(3).into_owned()),
        UnitQuaternion::from_scaled_axis(values.fixed_rows::<3>(0)),
    )
}

/// A delay that explains this share of what turn and shift do may be the cause.
const AS_GOOD: f64 = 0.85;

fn refs(frames: &[Frame]) -> Vec<&Frame> {
    frames.iter().collect()
}

/// The delay alone, and how much better the photos then fit.
fn delayed(frames: &mut [Frame]) -> Option<(Estimate, f64)> {
    let mut speeds: Vec<f64> =
        frames.iter().map(|one| one.motion.map_or(0.0, |[speed, _]| speed.norm())).collect();
    speeds.sort_by(f64::total_cmp);
    if speeds[speeds.len() / 2] < MIN_SPEED {
        return None;
    }
    let values = delay(frames);
    let all = refs(frames);
    let by_frames = spread(&all, &[DELAY], &values)[DELAY];
    let std_dev = by_frames.hypot(FLOOR_PX * units(&all)[DELAY]);
    Some((Estimate { value: values[DELAY], std_dev }, search::gain(&all, &values)))
}

/// Reads so many frames that are spread over the scene; those that cannot be read are left out.
fn read(scene: &dyn Scene, most: usize) -> Vec<Frame> {
    let all: Vec<usize> = (0..scene.frames().len()).filter(|&at| scene.has_cloud(at)).collect();
    let count = most.min(all.len());
    let chosen: Vec<usize> = (0..count).map(|at| all[at * all.len() / count]).collect();
    let frame = |&at: &usize| {
        let (photo, cloud) = (scene.photo(at).ok()?, scene.cloud(at).ok()?);
        let points: Vec<Point3<f64>> = cloud.points.iter().map(|point| point.cast()).collect();
        let mut frame = Frame {
            at,
            view: View::new(&photo.gray, scene.intrinsics(at)),
            points,
            edges: Vec::new(),
            motion: motion(scene, at),
        };
        frame.look(&Values::zeros());
        Some(frame)
    };
    chosen.par_iter().filter_map(frame).collect()
}

/// Speed and turning of a frame's camera in its own frame \[m/s, rad/s\], from the frames beside it.
fn motion(scene: &dyn Scene, at: usize) -> Option<[Vector3<f64>; 2]> {
    /// Frames that are farther apart do not say how fast the camera is \[s\].
    const LONGEST_S: f64 = 1.0;
    let (before, after) = (at.saturating_sub(1), (at + 1).min(scene.frames().len() - 1));
    let passed_s = scene.time_s(after)? - scene.time_s(before)?;
    if !(passed_s > 0.0 && passed_s < LONGEST_S) {
        return None;
    }
    let (before, here, after) = (scene.pose(before)?, scene.pose(at)?, scene.pose(after)?);
    let moved = after.translation.vector - before.translation.vector;
    let turned = (before.rotation.inverse() * after.rotation).scaled_axis();
    Some([here.rotation.inverse() * moved / passed_s, turned / passed_s])
}
