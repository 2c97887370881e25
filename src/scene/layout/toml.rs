//! A `scene.toml` with a PLY per frame, in `NAME`.

use std::path::Path;

use super::{Drive, DriveWriter, Layout, make_frame_folder, row_by_row, write, write_image};
use crate::geometry::matrix_from_pose;
use crate::scene::SceneError;

pub(super) const LAYOUT: Layout = Layout { name: "toml", place: str::to_owned, create };

fn create(root: &Path, name: &str, drive: Drive) -> Result<DriveWriter, SceneError> {
    let folder = root.join(name);
    for (kind, extension) in [("photos", "png"), ("scans", "ply")] {
        make_frame_folder(&folder.join(kind), extension)?;
    }
    let lines = drive.poses.iter().map(matrix_from_pose);
    let poses: String = lines.map(|pose| row_by_row(&pose) + "\n").collect();
    write(&folder.join("poses.txt"), poses)?;
    let camera = drive.intrinsics;
    let description = format!(
        "images = \"photos/*.png\"\nposes = \"poses.txt\"\n\n\
             [camera]\nfx = {:?}\nfy = {:?}\ncx = {:?}\ncy = {:?}\n\n\
             [clouds]\nfiles = \"scans/*.ply\"\n",
        camera.fx, camera.fy, camera.cx, camera.cy
    );
    write(&folder.join("scene.toml"), description)?;
    Ok(DriveWriter::new(move |shot| {
        let name = &drive.names[shot.index];
        let mut ply = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
             property float y\nproperty float z\nproperty float intensity\nend_header\n",
            shot.scan.len()
        )
        .into_bytes();
        for (position, reflectance) in shot.scan {
            let values = position.iter().chain([reflectance]);
            ply.extend(values.flat_map(|value| value.to_le_bytes()));
        }
        write(&folder.join(format!("scans/{name}.ply")), &ply)?;
        write_image(&folder.join(format!("photos/{name}.png")), shot.photo)
    }))
}
