//! A COLMAP model as text, in `NAME/sparse/0`, with its photos in `NAME/images`. The points are a part of each frame's
//! scan, observed by that frame only.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Point2, Point3};

use super::{Drive, DriveWriter, Layout, Shot, joined, make_folder, write, write_image};
use crate::scene::SceneError;

pub(super) const LAYOUT: Layout = Layout { name: "colmap", place: str::to_owned, create };

/// The most points per frame: a photo has some thousand features.
const MAX_POINTS: usize = 2000;

/// A pixel, and the point there in the world frame \[m\].
type Observation = (Point2<f64>, Point3<f64>);

struct Writer {
    folder: PathBuf,
    drive: Drive,
    /// The observations of each written frame.
    observed: Mutex<BTreeMap<usize, Vec<Observation>>>,
}

fn create(root: &Path, name: &str, drive: Drive) -> Result<DriveWriter, SceneError> {
    let folder = root.join(name);
    make_folder(&folder.join("images"))?;
    make_folder(&folder.join("sparse/0"))?;
    let writer = Arc::new(Writer { folder, drive, observed: Mutex::default() });
    let finished = Arc::clone(&writer);
    Ok(DriveWriter {
        frame: Box::new(move |shot| writer.frame(shot)),
        finish: Box::new(move || finished.finish()),
    })
}

impl Writer {
    fn frame(&self, shot: &Shot<'_>) -> Result<(), SceneError> {
        let camera = &self.drive.intrinsics;
        let world_from_camera = self.drive.poses[shot.index];
        let in_view: Vec<_> = shot
            .scan
            .iter()
            .filter_map(|(position, _)| {
                let position: Point3<f64> = position.cast();
                let pixel = camera.project(&position).filter(|pixel| camera.contains(pixel))?;
                Some((pixel, world_from_camera * position))
            })
            .collect();
        let step = in_view.len().div_ceil(MAX_POINTS).max(1);
        let some = in_view.into_iter().step_by(step).collect();
        let mut observed = self.observed.lock().unwrap_or_else(PoisonError::into_inner);
        observed.insert(shot.index, some);
        drop(observed);
        let name = &self.drive.names[shot.index];
        write_image(&self.folder.join(format!("images/{name}.png")), shot.photo)
    }

    fn finish(&self) -> Result<(), SceneError> {
        let camera = self.drive.intrinsics;
        let parameters = joined(&[camera.fx, camera.fy, camera.cx + 0.5, camera.cy + 0.5]);
        let cameras = format!("1 PINHOLE {} {} {parameters}\n", camera.width, camera.height);
        let (mut images, mut points) = (String::new(), String::new());
        let observed = self.observed.lock().unwrap_or_else(PoisonError::into_inner);
        let mut id = 0;
        for (&frame, seen) in observed.iter() {
            let image = frame + 1;
            let pose = self.drive.poses[frame].inverse();
            let [x, y, z, w] = pose.rotation.coords.into();
            let rotation = joined(&[w, x, y, z]);
            let position = joined(pose.translation.vector.iter());
            let name = &self.drive.names[frame];
            let _ = writeln!(images, "{image} {rotation} {position} 1 {name}.png");
            for (feature, (pixel, point)) in seen.iter().enumerate() {
                id += 1;
                let _ = write!(images, "{} {} {id} ", pixel.x + 0.5, pixel.y + 0.5);
                let point = joined(point.iter());
                let _ = writeln!(points, "{id} {point} 0 0 0 0 {image} {feature}");
            }
            images.push('\n');
        }
        let model = self.folder.join("sparse/0");
        write(&model.join("points3D.txt"), points)?;
        write(&model.join("images.txt"), images)?;
        write(&model.join("cameras.txt"), cameras)
    }
}
