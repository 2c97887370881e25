//! Pairs of real photos with scans.
//!
//! The data are not part of the project: `POSESCOPE_DATA` names their folder. They are the pair of the
//! paper's authors (KITTI odometry 00, frames 3814 and 3823) and frames of drive 0013 (KITTI raw), 3.6
//! to 10 m apart, in both directions, with the poses that were registered from the scans, which are
//! better than the official ones. Those are of camera 0; the colour camera is 6 cm beside it, which changes
//! the poses between frames by less than 2 mm.

use std::path::Path;

use image::RgbImage;
use image::imageops::{FilterType, resize};
use posescope::cloud::Cloud;

use crate::Failure;
use crate::frames::Frame;
use crate::truth;

/// Frames that are as far apart as this are a pair \[m\].
const APART_M: std::ops::RangeInclusive<f64> = 3.0..=11.0;

/// A cloud is of another place from here on \[m\].
const FARTHER_M: f64 = 9.0;

/// A query and a reference.
pub struct RealPair {
    /// The query; its pose is the truth.
    pub query: Frame,
    pub reference: Frame,
    /// The cloud of a frame that is neither, some 9 to 20 m from the reference.
    pub farther_cloud: Option<Cloud>,
    /// A photo of another place, of the query's size.
    pub foreign_photo: RgbImage,
}

/// A scene, and the poses registered for its frames.
const SOURCES: [(&str, &str); 2] = [
    ("kitti/sequences/00", "derived/kitti_odometry_00_003814_003823.txt"),
    (
        "kitti_raw/2011_09_26/2011_09_26_drive_0013_sync",
        "derived/kitti_raw_2011_09_26_drive_0013.txt",
    ),
];

/// All pairs below `POSESCOPE_DATA`.
pub fn all() -> Result<Vec<RealPair>, Failure> {
    let root = std::env::var_os("POSESCOPE_DATA")
        .ok_or("real pairs need POSESCOPE_DATA, the folder with the sample data")?;
    let root = Path::new(&root);
    let sources = SOURCES
        .map(|(folder, poses)| frames(&root.join(folder), &root.join(poses)))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let others = sources.iter().cycle().skip(1);
    let pairs = sources.iter().zip(others).flat_map(|(frames, others)| {
        let foreign = others.first().map(|frame| &frame.photo);
        foreign.map_or(Vec::new(), |foreign| pairs_of(frames, foreign))
    });
    Ok(pairs.collect())
}

/// The frames of the drive with most registered poses.
pub fn drive() -> Result<Vec<Frame>, Failure> {
    let root = std::env::var_os("POSESCOPE_DATA").ok_or("POSESCOPE_DATA expected")?;
    let [_, (folder, poses)] = SOURCES;
    frames(&Path::new(&root).join(folder), &Path::new(&root).join(poses))
}

/// The frames that have a registered pose, in the order of the file.
fn frames(folder: &Path, poses: &Path) -> Result<Vec<Frame>, Failure> {
    let scene = truth::open(&folder.to_string_lossy(), Some(poses))?;
    let known = (0..scene.frames().len()).filter(|&frame| scene.pose(frame).is_some());
    known.map(|frame| Ok(Frame::read(scene.as_ref(), frame)?)).collect()
}

fn pairs_of(frames: &[Frame], foreign: &RgbImage) -> Vec<RealPair> {
    let apart = |a: usize, b: usize| match (frames[a].pose, frames[b].pose) {
        (Some(a), Some(b)) => (a.translation.vector - b.translation.vector).norm(),
        _ => f64::INFINITY,
    };
    let all = 0..frames.len();
    let pairs = all.clone().flat_map(|query| all.clone().map(move |reference| (query, reference)));
    let pairs = pairs.filter(|&(query, reference)| APART_M.contains(&apart(query, reference)));
    let pair = |(query, reference): (usize, usize)| {
        let far = |&other: &usize| other != query && apart(reference, other) >= FARTHER_M;
        let farther = all.clone().filter(far);
        let farther = farther.min_by(|&a, &b| apart(reference, a).total_cmp(&apart(reference, b)));
        let (width, height) = frames[query].photo.dimensions();
        RealPair {
            query: frames[query].clone(),
            reference: frames[reference].clone(),
            farther_cloud: farther.map(|other| frames[other].cloud.clone()),
            foreign_photo: resize(foreign, width, height, FilterType::Triangle),
        }
    };
    pairs.map(pair).collect()
}
