//! Scenes with planted mistakes, written as folders.

use std::fs;
use std::path::Path;

use posescope::camera::Intrinsics;
use posescope::scene::Scene as _;

use crate::binary::write;
use crate::planted::Planted;

/// Writes a planted scene.
pub trait Written {
    /// As a `scene.toml` with a text of points for each frame.
    fn write_to(&self, folder: &Path);

    /// As a `scene.toml` with one map for all frames, which is where it is whatever the poses say.
    fn write_with_map(&self, folder: &Path);
}

impl Written for Planted<'_> {
    fn write_to(&self, folder: &Path) {
        fs::create_dir_all(folder.join("scans")).expect("writable");
        for (frame, name) in self.frames().iter().enumerate() {
            let points = self.cloud(frame).expect("readable").points;
            let lines = points.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z));
            write(folder.join(format!("scans/{name}.txt")), lines.collect::<String>());
        }
        write_described(self, folder, "", "[clouds]\nfiles = \"scans/*.txt\"\n");
    }

    fn write_with_map(&self, folder: &Path) {
        /// Every how many points one is written.
        const STEP: usize = 3;
        let mut map = String::new();
        for frame in 0..self.frames().len() {
            let world_from_camera = self.true_pose(frame).expect("has a pose");
            for point in self.cloud(frame).expect("readable").points.iter().step_by(STEP) {
                let p = world_from_camera * point.cast::<f64>();
                map += &format!("{:.4} {:.4} {:.4}\n", p.x, p.y, p.z);
            }
        }
        fs::create_dir_all(folder).expect("writable");
        write(folder.join("map.txt"), map);
        write_described(self, folder, "cloud = \"map.txt\"\n", "");
    }
}

fn write_described(planted: &Planted<'_>, folder: &Path, map: &str, clouds: &str) {
    fs::create_dir_all(folder.join("photos")).expect("writable");
    let mut poses = "name x y z qx qy qz qw\n".to_owned();
    for (frame, name) in planted.frames().iter().enumerate() {
        let photo = planted.photo(frame).expect("readable").gray;
        photo.save(folder.join(format!("photos/{name}.png"))).expect("writable");
        let pose = planted.pose(frame).expect("has a pose");
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        poses += &format!("{name} {} {} {} {} {} {} {}\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    write(folder.join("poses.txt"), poses);
    let Intrinsics { fx, fy, cx, cy, .. } = planted.intrinsics(0);
    let scene = format!(
        "images = \"photos/*.png\"\nposes = \"poses.txt\"\n{map}[camera]\nfx = {fx}\nfy = {fy}\ncx = {cx}\n\
         cy = {cy}\n{clouds}"
    );
    write(folder.join("scene.toml"), scene);
}
