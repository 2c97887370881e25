//! TUM RGB-D, in `NAME`. Depths are limited to 13 m.

use std::path::Path;

use super::{Drive, DriveWriter, Layout, joined, make_folder, write, write_depth, write_image};
use crate::camera::Intrinsics;
use crate::scene::SceneError;

pub(super) const LAYOUT: Layout = Layout { name: "tum", place: str::to_owned, create };

/// The name of a frame's images: its time.
fn stem(time_s: f64) -> String {
    format!("{time_s:.6}")
}

fn create(root: &Path, name: &str, drive: Drive) -> Result<DriveWriter, SceneError> {
    let folder = root.join(name);
    for (images, what) in [("rgb", "color images"), ("depth", "depth maps")] {
        make_folder(&folder.join(images))?;
        let times = drive.written.iter().map(|&frame| stem(drive.times_s[frame]));
        let lines = times.map(|time| format!("{time} {images}/{time}.png\n"));
        let list = format!("# {what}\n# timestamp filename\n{}", lines.collect::<String>());
        write(&folder.join(format!("{images}.txt")), list)?;
    }
    let poses = drive.poses.iter().zip(&drive.times_s).map(|(pose, &time)| {
        let parts = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        format!("{} {}\n", stem(time), joined(parts))
    });
    let truth = format!("# timestamp tx ty tz qx qy qz qw\n{}", poses.collect::<String>());
    write(&folder.join("groundtruth.txt"), truth)?;
    let Intrinsics { fx, fy, cx, cy, .. } = drive.intrinsics;
    let camera = joined(&[fx, fy, cx, cy]) + "\n";
    write(&folder.join("calibration.txt"), camera)?;
    Ok(DriveWriter::new(move |shot| {
        let name = stem(drive.times_s[shot.index]);
        let depth = folder.join(format!("depth/{name}.png"));
        write_depth(&depth, &drive.intrinsics, 1.0 / 5000.0, shot.depth)?;
        write_image(&folder.join(format!("rgb/{name}.png")), shot.photo)
    }))
}
