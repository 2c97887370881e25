//! How large a scene is.

use super::{Lengths, Scene};
use crate::cloud::Cloud;
use crate::geometry::{Pose, PoseError};
use crate::scale::Scale;
use crate::stats::median;

/// Clouds that are read to learn a scene's depth, evenly spaced.
const MAX_CLOUDS: usize = 20;

/// The size of a scene, as far as it decides how to search it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSize {
    /// The scale.
    pub scale: Scale,
    /// The median depth of what the cameras see of their clouds \[m\]; `None` where it was not measured.
    pub depth_m: Option<f64>,
    /// The median distance of consecutive frames \[m\]; `None` without poses.
    pub spacing_m: Option<f64>,
    /// The median angle between the views of consecutive frames \[°\]; `None` without poses.
    pub turn_deg: Option<f64>,
    /// The diagonal of the box around all camera centres \[m\]; `None` without poses.
    pub extent_m: Option<f64>,
}

impl SceneSize {
    /// That of a scene with the paper's scale.
    pub const PAPER: Self = Self {
        scale: Scale::PAPER,
        depth_m: None,
        spacing_m: None,
        turn_deg: None,
        extent_m: None,
    };

    /// Measures a scene. Streets have the paper's scale, and so do scenes whose clouds cannot be read.
    ///
    /// The size depends on the whole scene and on nothing else, so all parts of a run agree on it.
    pub fn of(scene: &dyn Scene) -> Self {
        let is_metric = match scene.lengths() {
            Lengths::Street => return Self::PAPER,
            Lengths::Metres => true,
            Lengths::Model => false,
        };
        let frames = 0..scene.frames().len();
        let poses: Vec<Pose> = frames.clone().filter_map(|frame| scene.pose(frame)).collect();
        let steps = || poses.windows(2).map(|pair| PoseError::between(&pair[0], &pair[1]));
        let centres = || poses.iter().map(|pose| pose.translation.vector);
        let extent_m = centres().reduce(|a, b| a.sup(&b)).zip(centres().reduce(|a, b| a.inf(&b)));
        let with_cloud: Vec<usize> = frames.filter(|&frame| scene.has_cloud(frame)).collect();
        let step = with_cloud.len().div_ceil(MAX_CLOUDS).max(1);
        let depths = with_cloud.iter().step_by(step).filter_map(|&frame| {
            let camera = scene.intrinsics(frame);
            let is_seen = |point: &nalgebra::Point3<f64>| {
                camera.project(point).is_some_and(|pixel| camera.contains(&pixel))
            };
            let Cloud { points } = scene.cloud(frame).ok()?;
            let seen = points.iter().map(|point| point.cast()).filter(is_seen);
            median(&mut seen.map(|point| point.z).collect::<Vec<f64>>())
        });
        let depth_m = median(&mut depths.collect::<Vec<f64>>());
        Self {
            scale: Scale::of_depth(depth_m.unwrap_or(f64::NAN), is_metric),
            depth_m,
            spacing_m: median(&mut steps().map(|step| step.translation_m).collect::<Vec<f64>>()),
            turn_deg: median(&mut steps().map(|step| step.rotation_deg).collect::<Vec<f64>>()),
            extent_m: extent_m.map(|(most, least)| (most - least).norm()),
        }
    }

    /// How far from a reference to search \[m\]: as far as in the paper's scenes, and where frames are far apart
    /// as far as the next but one, up to twice as far.
    pub fn radius_m(&self) -> f64 {
        let usual = self.scale.radius();
        match self.spacing_m {
            Some(spacing) if 2.0 * spacing > usual => 2.0 * usual,
            _ => usual,
        }
    }
}
