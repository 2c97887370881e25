//! The contents of a scene, and whether its numbers are plausible.

use crate::geometry::Pose;
use crate::scene::{MapFacts, Scene, why_no_cloud};
use crate::table::grouped;

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
    let looked_at: Vec<usize> = spread(references.len(), CLOUDS).map(|at| references[at]).collect();
    let unseen: Vec<usize> = looked_at
        .iter()
        .copied()
        .filter(|&frame| !cloud(scene, frame, &mut inventory, &mut remarks))
        .collect();
    if let Some(map) = scene.cloud_facts().map
        && let Some(&first) = unseen.first()
    {
        remarks.push(if unseen.len() == looked_at.len() {
            Remark::Broken(out_of_view(&map, &poses, &frames[first]))
        } else {
            Remark::Odd(format!("no point of the map is in view of frame {}", frames[first]))
        });
    }
    let ends = || references.first().into_iter().chain(references.last());
    let unreadable: Vec<String> =
        ends().filter_map(|&frame| Some(scene.photo(frame).err()?.to_string())).collect();
    // One photo costs itself alone.
    let are_all = unreadable.len() == ends().count();
    remarks.extend(unreadable.into_iter().map(if are_all { Remark::Broken } else { Remark::Odd }));
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

/// Examines a cloud, and says whether any of it is in view.
fn cloud(
    scene: &dyn Scene,
    frame: usize,
    inventory: &mut Inventory,
    remarks: &mut Vec<Remark>,
) -> bool {
    let name = &scene.frames()[frame];
    let cloud = match scene.cloud(frame) {
        Ok(cloud) => cloud,
        Err(error) => {
            remarks.push(Remark::Broken(error.to_string()));
            return true;
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
    // Of a map, the scene has left out what is not in view.
    if depths.is_empty() && scene.cloud_facts().map.is_none() {
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
    !depths.is_empty()
}

/// How map and poses lie, if none of these frames has a point of the map in view; `None` without a map.
pub fn unseen_map(scene: &dyn Scene, frames: &[usize]) -> Option<String> {
    let sees = |&frame: &usize| {
        let camera = scene.intrinsics(frame);
        let is_seen = |point: &nalgebra::Point3<f32>| {
            camera.project(&point.cast()).is_some_and(|pixel| camera.contains(&pixel))
        };
        scene.cloud(frame).is_ok_and(|cloud| cloud.points.iter().any(is_seen))
    };
    if frames.iter().any(sees) {
        return None;
    }
    let poses: Vec<Option<Pose>> = (0..scene.frames().len()).map(|at| scene.pose(at)).collect();
    let name = &scene.frames()[*frames.first()?];
    Some(out_of_view(&scene.cloud_facts().map?, &poses, name))
}

/// What is known of a map that no frame has in view.
fn out_of_view(map: &MapFacts, poses: &[Option<Pose>], frame: &str) -> String {
    let positions = || poses.iter().flatten().map(|pose| pose.translation.vector);
    let of_poses = [0, 1, 2].map(|axis| {
        let along = || positions().map(|position| position[axis]);
        (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max))
    });
    let spans = |extent: &[(f64, f64); 3]| {
        let ranges = extent.iter().map(|range| range_words(*range));
        ranges
            .zip(["x", "y", "z"])
            .map(|(range, axis)| format!("{range} in {axis}"))
            .collect::<Vec<_>>()
            .join(", ")
    };
    format!(
        "none of the {} points of the map is in view, for example of frame {frame}; the map \
         spans {}; the poses {}; {}",
        grouped(map.points as f64, 0),
        spans(&map.extent),
        spans(&of_poses),
        unit_hint(&map.extent, &of_poses)
    )
}

/// What to do, judged by the numbers alone.
fn unit_hint(map: &[(f64, f64); 3], poses: &[(f64, f64); 3]) -> &'static str {
    /// Coordinates of surveys are larger, those of a local frame are not.
    const SURVEY_M: f64 = 1000.0;
    const FEET_A_METRE: f64 = 3.280_84;
    let middle = |(least, most): (f64, f64)| (least + most) / 2.0;
    let largest = |(least, most): (f64, f64)| least.abs().max(most.abs());
    let is_geographic =
        |extent: &[(f64, f64); 3]| largest(extent[0]) <= 180.0 && largest(extent[1]) <= 180.0;
    let is_survey = |extent: &[(f64, f64); 3]| {
        middle(extent[0]).abs() > SURVEY_M && middle(extent[1]).abs() > SURVEY_M
    };
    let are_times = |a: &[(f64, f64); 3], b: &[(f64, f64); 3]| {
        let ratio = |axis: usize| middle(a[axis]) / middle(b[axis]);
        is_survey(a)
            && is_survey(b)
            && [0, 1].iter().all(|axis| (ratio(*axis) / FEET_A_METRE - 1.0).abs() < 0.002)
    };
    if is_geographic(map) && is_survey(poses) {
        "the map may be in degrees or of a local frame: convert it to the frame of the poses, in metres"
    } else if is_geographic(poses) && is_survey(map) {
        "the poses may be in degrees or of a local frame: convert them to the frame of the map, in metres"
    } else if are_times(map, poses) {
        "the map seems to be in feet: multiply its coordinates by 0.3048"
    } else if are_times(poses, map) {
        "the poses seem to be in feet: multiply their positions by 0.3048"
    } else {
        "check that both are in one coordinate frame"
    }
}

/// A range, with enough digits to tell its ends apart.
fn range_words((least, most): (f64, f64)) -> String {
    let across = most - least;
    let digits = if across > 0.0 { (1.0 - across.log10()).ceil().clamp(0.0, 6.0) } else { 2.0 };
    let [least, most] = [least, most].map(|end| grouped(end, digits as usize));
    format!("{least} to {most}")
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

    #[test]
    fn numbers_of_surveys_are_grouped_and_ranges_have_the_digits_that_differ() {
        assert_eq!(grouped(5_334_567.25, 1), "5,334,567.2");
        assert_eq!(grouped(-512.0, 0), "-512");
        assert_eq!(range_words((691_234.4, 691_480.2)), "691,234 to 691,480");
        assert_eq!(range_words((11.57412, 11.57498)), "11.57412 to 11.57498");
    }

    #[test]
    fn a_unit_is_named_only_where_the_numbers_say_so() {
        let survey = [(691_230.0, 691_240.0), (5_334_560.0, 5_334_570.0), (510.0, 512.0)];
        let times = |factor: f64| survey.map(|(least, most)| (factor * least, factor * most));
        let degrees = [(11.57, 11.58), (48.13, 48.14), (510.0, 512.0)];
        for (map, poses, word) in [
            (degrees, survey, "the map may be in degrees"),
            (survey, degrees, "the poses may be in degrees"),
            (times(1.0 / 0.3048), survey, "the map seems to be in feet"),
            (survey, times(1.0 / 0.3048), "the poses seem to be in feet"),
            (times(3.0), survey, "check that both"),
            (degrees, degrees, "check that both"),
            (survey, survey, "check that both"),
        ] {
            assert!(unit_hint(&map, &poses).starts_with(word), "{word}");
        }
    }
}
