//! 7-Scenes, in `NAME/seq-01`, with depth images that are registered with the photos. Depths up to
//! 65 m can be said.

use std::path::{Path, PathBuf};

use super::{
    Drive, DriveWriter, Layout, Shot, joined, make_folder, remove_frames, write, write_depth,
    write_photo,
};
use crate::camera::Intrinsics;
use crate::scene::SceneError;

pub(super) const LAYOUT: Layout = Layout {
    name: "7scenes",
    place: str::to_owned,
    create: |root, name, drive| Ok(Box::new(Writer::create(root, name, drive)?)),
};

struct Writer {
    folder: PathBuf,
    drive: Drive,
}

impl Writer {
    fn create(root: &Path, name: &str, drive: Drive) -> Result<Self, SceneError> {
        let scene = root.join(name);
        let folder = scene.join("seq-01");
        make_folder(&folder)?;
        remove_frames(&folder, |name| {
            let number = name.strip_prefix("frame-").and_then(|rest| rest.get(..6));
            number.is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
        })?;
        let Intrinsics { fx, fy, cx, cy, .. } = drive.intrinsics;
        let matrix = format!("{fx:e} 0 {cx:e}\n0 {fy:e} {cy:e}\n0 0 1\n");
        write(&scene.join("camera-intrinsics.txt"), matrix.as_bytes())?;
        Ok(Self { folder, drive })
    }
}

impl DriveWriter for Writer {
    fn frame(&self, shot: &Shot<'_>) -> Result<(), SceneError> {
        let name = &self.drive.names[shot.index];
        let file = |end: &str| self.folder.join(format!("frame-{name}.{end}"));
        let matrix = self.drive.poses[shot.index].to_homogeneous();
        let rows = matrix
            .row_iter()
            .map(|row| joined(&row.into_owned()) + "\n");
        write(&file("pose.txt"), rows.collect::<String>().as_bytes())?;
        let camera = &self.drive.intrinsics;
        write_depth(&file("depth.png"), camera, 0.001, shot.depth)?;
        write_photo(&file("color.png"), shot.photo)
    }
}
