//! TUM RGB-D, in `NAME`. Depths are limited to 13 m.

use std::path::{Path, PathBuf};

use super::{
    Drive, DriveWriter, Layout, Shot, joined, make_folder, write, write_depth, write_image,
};
use crate::camera::Intrinsics;
use crate::scene::SceneError;

pub(super) const LAYOUT: Layout = Layout {
    name: "tum",
    place: str::to_owned,
    create: |root, name, drive| Ok(Box::new(Writer::create(root, name, drive)?)),
};

struct Writer {
    folder: PathBuf,
    drive: Drive,
}

/// The name of a frame's images: its time.
fn stem(time_s: f64) -> String {
    format!("{time_s:.6}")
}

impl Writer {
    fn create(root: &Path, name: &str, drive: Drive) -> Result<Self, SceneError> {
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
        Ok(Self { folder, drive })
    }
}

impl DriveWriter for Writer {
    fn frame(&self, shot: &Shot<'_>) -> Result<(), SceneError> {
        let name = stem(self.drive.times_s[shot.index]);
        let depth = self.folder.join(format!("depth/{name}.png"));
        write_depth(&depth, &self.drive.intrinsics, 1.0 / 5000.0, shot.depth)?;
        write_image(&self.folder.join(format!("rgb/{name}.png")), shot.photo)
    }
}
