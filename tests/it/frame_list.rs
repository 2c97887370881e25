//! The reader of `frames.jsonl`, which recordings of running localisers write.

use std::fs;
use std::path::Path;

use nalgebra::Point3;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::binary::has;
use crate::damage::open;
use crate::small_sequence::wall;

const HEADER: &str = "{\"schema\": \"posescope.frames/1\", \"scene\": \"photo\"}\n";

fn frame(name: &str, focal_px: f64) -> Value {
    json!({
        "name": name, "photo": format!("photos/{name}.png"),
        "camera": {"width": 96, "height": 80, "fx": focal_px, "fy": focal_px, "cx": 47.5, "cy": 39.5},
        "pose": {"position_m": [4.0e5, 5.0e6, 0.25], "quaternion_xyzw": [0.0, 0.6, 0.0, 0.8]},
        "time_s": 12.5, "cloud": "clouds/a.ply", "estimate": null
    })
}

fn save(folder: &Path, text: &str) {
    fs::write(folder.join("frames.jsonl"), text).expect("writable");
}

/// Two frames, in folders of their own, with one cloud.
pub fn write(folder: &Path) {
    for name in ["cam0/1", "cam1/1"] {
        let photo = folder.join("photos").join(format!("{name}.png"));
        fs::create_dir_all(photo.parent().expect("a folder")).expect("writable");
        wall(96, 80).save(photo).expect("writable");
    }
    fs::create_dir_all(folder.join("clouds")).expect("writable");
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
               property float z\nend_header\n0.5 0 3\n0 1 8\n";
    fs::write(folder.join("clouds/a.ply"), ply).expect("writable");
    let lines = [frame("cam0/1", 100.0), frame("cam1/1", 120.0)].map(|line| format!("{line}\n"));
    save(folder, &(HEADER.to_owned() + &lines.concat()));
}

#[test]
fn frames_have_cameras_poses_times_and_clouds_of_their_own() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    for place in ["", "frames.jsonl"] {
        let scene = open(folder.path().join(place));
        assert_eq!(
            (scene.name(), scene.frames()),
            ("photo", &["cam0/1", "cam1/1"].map(str::to_owned)[..])
        );
        assert_eq!([0, 1].map(|frame| scene.intrinsics(frame).fx), [100.0, 120.0]);
        let pose = scene.pose(0).expect("a pose");
        // Not a bit is lost.
        assert_eq!(pose.translation.vector.as_slice(), [4.0e5, 5.0e6, 0.25]);
        assert_eq!(pose.rotation.coords.as_slice(), [0.0, 0.6, 0.0, 0.8]);
        assert_eq!(scene.time_s(1), Some(12.5));
        let cloud = scene.cloud(0).expect("a cloud");
        assert_eq!(cloud.points, [Point3::new(0.5, 0.0, 3.0), Point3::new(0.0, 1.0, 8.0)]);
    }
}

#[test]
fn a_last_line_that_a_killed_process_left_is_skipped_and_others_are_named() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let whole = format!("{HEADER}{}\n", frame("cam0/1", 100.0));
    let half = frame("cam1/1", 120.0).to_string();
    save(folder.path(), &format!("{whole}{}", &half[..half.len() / 2]));
    assert_eq!(open(folder.path()).frames(), ["cam0/1"]);
    let text = |path: &Path| path.display().to_string();
    for (wrong, words) in [
        (format!("{HEADER}{{}}\n"), "frames.jsonl:2"),
        (whole.replace("frames/1", "frames/9"), "posescope.frames/1 expected"),
        (whole.clone() + &format!("{}\n", frame("cam0/1", 100.0)), "different names"),
        (whole.replace("photos/", "../photos/"), "inside the scene's folder"),
        (whole.replace("0.6", "0.9"), "a quaternion of length 1"),
        (whole.replace("100.0", "-1.0"), "focal lengths above 0"),
        (HEADER.to_owned(), "a line for each frame"),
        (String::new(), "schema and scene"),
    ] {
        save(folder.path(), &wrong);
        let error = posescope::scene::open(&text(folder.path()), None).err().expect("refused");
        has(&error.to_string(), words);
    }
}
