//! The contents of a scene, and whether its numbers are plausible.

use crate::geometry::Pose;
use crate::scene::{Scene, why_no_cloud};

/// How many clouds are examined.
const CLOUDS: usize = 3;
/// Plausible median depths of a cloud \[m\]: the map of a table has 0.3, that of a valley 200.
const DEPTHS_M: (f64, f64) = (0.1, 400.0);

/// The contents of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inventory {
    /// Frames in all.
    pub frames: usize,
    /// Frames with a pose.
    pub with_pose: usize,
    /// Frames with a cloud.
    pub with_cloud: usize,
    /// Frames with a time.
    pub with_time: usize,
    /// Sizes of photos and their fields of view.
    pub cameras: Vec<String>,
    /// The length of the route from pose to pose \[m\].
    pub way_m: f64,
    /// Least, median and greatest step from frame to frame \[m\].
    pub steps_m: Option<[f64; 3]>,
    /// The examined clouds: frame, number of points, and median depth in view \[m\].
    pub clouds: Vec<(String, usize, Option<f64>)>,
}

/// Something implausible, as a sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// The scene is unusable.
    Broken(String),
    /// It may be intended.
    Odd(String),
}

/// Examines everything but the fit with the photos.
pub(super) fn take(scene: &dyn Scene) -> (Inventory, Vec<Remark>) {
    let mut remarks = Vec::new();
    let frames = scene.frames();
    let poses: Vec<Option<Pose>> = (0..frames.len()).map(|frame| scene.pose(frame)).collect();
    let references: Vec<usize> =
        (0..frames.len()).filter(|&f| poses[f].is_some() && scene.has_cloud(f)).collect();
    let count = |has: &dyn Fn(usize) -> bool| (0..frames.len()).filter(|&frame| has(frame)).count();
    let mut inventory = Inventory {
        frames: frames.len(),
        with_pose: poses.iter().flatten().count(),
        with_cloud: count(&|frame| scene.has_cloud(frame)),
        with_time: count(&|frame| scene.time_s(frame).is_some()),
        cameras: cameras(scene),
        ..Inventory::default()
    };
    if references.is_empty() {
        let missing = match (inventory.with_pose, inventory.with_cloud) {
            (0, 0) => "no frame has a pose or a cloud",
            (0, _) => "no frame has a pose",
            (_, 0) => "no frame has a cloud",
            _ => "no frame has both a pose and a cloud",
        };
        let why = why_no_cloud(scene).map(|why| format!(" ({why})")).unwrap_or_default();
        remarks.push(Remark::Broken(format!(
            "{missing}{why}: the scene has no references, but its photos can be queries of another scene \
             (--query-scene)"
        )));
    }
    steps(&poses, &mut inventory, &mut remarks);
    times(scene, &mut remarks);
    for at in spread(references.len(), CLOUDS) {
        cloud(scene, references[at], &mut inventory, &mut remarks);
    }
    for &frame in references.first().into_iter().chain(references.last()) {
        if let Err(error) = scene.photo(frame) {
            remarks.push(Remark::Broken(error.to_string()));
        }
    }
    remarks.dedup();
    (inventory, remarks)
}

/// Up to `wanted` of `count` positions, evenly from the first to the last.
fn spread(count: usize, wanted: usize) -> impl Iterator<Item = usize> {
    let taken = wanted.min(count);
    let steps = taken.saturating_sub(1).max(1);
    (0..taken).map(move |step| step * (count - 1) / steps)
}

fn cameras(scene: &dyn Scene) -> Vec<String> {
    let mut cameras = Vec::new();
    for frame in 0..scene.frames().len() {
        let camera = scene.intrinsics(frame);
        let across = 2.0 * (f64::from(camera.width) / 2.0 / camera.fx).atan().to_degrees();
        let words = format!(
            "{}x{} px, focal length {:.1} px, centre ({:.1}, {:.1}), {across:.0}° across",
            camera.width, camera.height, camera.fx, camera.cx, camera.cy
        );
        if !cameras.contains(&words) {
            cameras.push(words);
        }
    }
    cameras
}

fn steps(poses: &[Option<Pose>], inventory: &mut Inventory, remarks: &mut Vec<Remark>) {
    let known: Vec<&Pose> = poses.iter().flatten().collect();
    let mut steps: Vec<f64> = known
        .windows(2)
        .map(|two| (two[1].translation.vector - two[0].translation.vector).norm())
        .collect();
    inventory.way_m = steps.iter().sum();
    if steps.is_empty() {
        return;
    }
    steps.sort_by(f64::total_cmp);
    let median = steps[steps.len() / 2];
    inventory.steps_m = Some([steps[0], median, steps[steps.len() - 1]]);
    if inventory.way_m == 0.0 {
        remarks.push(Remark::Broken(
            "all poses have the same position; check the file of poses".to_owned(),
        ));
    }
    if steps[steps.len() - 1] > 50.0 * median.max(0.1) && steps.len() > 10 {
        remarks.push(Remark::Odd(format!(
            "the greatest step between frames is {:.1} m, the median {median:.2} m; a pose may be missing or \
             wrong",
            steps[steps.len() - 1]
        )));
    }
}

fn times(scene: &dyn Scene, remarks: &mut Vec<Remark>) {
    let times: Vec<f64> = (0..scene.frames().len()).filter_map(|f| scene.time_s(f)).collect();
    if let Some(back) = times.windows(2).position(|two| two[1] <= two[0]) {
        remarks.push(Remark::Odd(format!(
            "times do not increase: {} s follows {} s",
            times[back + 1],
            times[back]
        )));
    }
}

fn cloud(scene: &dyn Scene, frame: usize, inventory: &mut Inventory, remarks: &mut Vec<Remark>) {
    let name = &scene.frames()[frame];
    let cloud = match scene.cloud(frame) {
        Ok(cloud) => cloud,
        Err(error) => {
            remarks.push(Remark::Broken(error.to_string()));
            return;
        }
    };
    let camera = scene.intrinsics(frame);
    let is_seen = |pixel: Option<_>| pixel.is_some_and(|pixel| camera.contains(&pixel));
    let mut depths: Vec<f64> = cloud
        .points
        .iter()
        .map(|point| point.cast())
        .filter(|point| is_seen(camera.project(point)))
        .map(|point| point.z)
        .collect();
    depths.sort_by(f64::total_cmp);
    let median = depths.get(depths.len() / 2).copied();
    if cloud.is_empty() || depths.is_empty() {
        remarks.push(Remark::Broken(format!(
            "none of the {} points of the cloud of frame {name} is in view of its camera; check the coordinate \
             frame of the cloud",
            cloud.len()
        )));
    }
    if let Some(median) = median.filter(|depth| !(DEPTHS_M.0..DEPTHS_M.1).contains(depth)) {
        remarks.push(Remark::Odd(format!(
            "the median depth of the cloud of frame {name} is {median:.3} m; is the unit metres?"
        )));
    }
    inventory.clouds.push((name.clone(), cloud.len(), median));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_looked_at_reaches_from_the_first_to_the_last() {
        let of = |count, wanted| spread(count, wanted).collect::<Vec<_>>();
        assert_eq!(of(0, 3), [0; 0]);
        assert_eq!(of(1, 3), [0]);
        assert_eq!(of(2, 3), [0, 1]);
        assert_eq!(of(3, 3), [0, 1, 2]);
        assert_eq!(of(101, 3), [0, 50, 100]);
        assert_eq!(of(9, 1), [0]);
    }
}
