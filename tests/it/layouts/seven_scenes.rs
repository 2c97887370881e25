//! 7-Scenes, in `NAME/seq-01`, with depth images that are registered with the photos. Depths up to
//! 65 m can be said.

use std::path::{Path, PathBuf};

use image::{ImageBuffer, Luma};
use nalgebra::Point2;
use posescope::camera::Intrinsics;
use posescope::scene::SceneError;
use posescope::scene::layout::{Drive, DriveWriter, Layout, Shot};

use super::{joined, make_folder, write};

pub const LAYOUT: Layout = Layout {
    name: "7scenes",
    place: str::to_owned,
    create: |root, name, drive| Ok(Box::new(Writer::create(root, name, drive))),
};

struct Writer {
    folder: PathBuf,
    drive: Drive,
}

impl Writer {
    fn create(root: &Path, name: &str, drive: Drive) -> Self {
        let scene = root.join(name);
        let folder = scene.join("seq-01");
        make_folder(&folder);
        let Intrinsics { fx, fy, cx, cy, .. } = drive.intrinsics;
        let matrix = format!("{fx:e} 0 {cx:e}\n0 {fy:e} {cy:e}\n0 0 1\n");
        write(&scene.join("camera-intrinsics.txt"), matrix);
        Self { folder, drive }
    }
}

impl DriveWriter for Writer {
    fn frame(&self, shot: &Shot<'_>) -> Result<(), SceneError> {
        let name = &self.drive.names[shot.index];
        let file = |end: &str| self.folder.join(format!("frame-{name}.{end}"));
        let matrix = self.drive.poses[shot.index].to_homogeneous();
        let rows = matrix.row_iter();
        let rows = rows.map(|row| joined(&row.into_owned(), " ") + "\n");
        write(&file("pose.txt"), rows.collect::<String>());
        let Intrinsics { width, height, .. } = self.drive.intrinsics;
        let depth: ImageBuffer<Luma<u16>, Vec<u16>> =
            ImageBuffer::from_fn(width, height, |x, y| {
                let depth_m = (shot.depth)(Point2::new(f64::from(x), f64::from(y)));
                Luma([depth_m.map_or(0, |depth_m| (depth_m / 0.001).round() as u16)])
            });
        depth.save(file("depth.png")).expect("writable");
        shot.photo.save(file("color.png")).expect("writable");
        Ok(())
    }
}
