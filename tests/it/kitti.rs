//! The reader of KITTI odometry, on a small sequence and on the real one.

use std::fs;

use nalgebra::Point3;

use crate::binary::has;
use crate::damage::open;
use crate::real_pair::authors_pair;
use crate::small_sequence::{self, SmallSequence};
use crate::{damage, data};

#[test]
fn frames_may_have_gaps_and_are_found_by_number() {
    let sequence = SmallSequence::write();
    let scene = open(sequence.folder());
    assert_eq!(scene.frames(), ["000004", "000005", "000007"]);
    assert_eq!(scene.find("7").expect("is there"), 2);
    assert_eq!(scene.find("000005").expect("is there"), 1);
    assert!(scene.find("6").is_err());
    let pose = scene.pose(2).expect("is known");
    assert_eq!(pose.translation.vector.z, 7.0);
    assert_eq!(scene.time_s(2), Some(0.7));
}

#[test]
fn a_point_of_the_scan_lands_where_the_calibration_says() {
    let sequence = SmallSequence::write();
    let scene = open(sequence.folder());
    let cloud = scene.cloud(0).expect("is there");
    // The first point: 10 m ahead, 7.6 m to the right, 2.85 m down.
    let first = cloud.points[0];
    assert!((first - Point3::new(7.6, 2.85, 10.0)).norm() < 1e-5);
}

#[test]
fn the_colour_camera_is_offset_by_its_projection_matrix() {
    let sequence = SmallSequence::write();
    let folder = sequence.folder();
    std::fs::rename(folder.join("image_0"), folder.join("image_2")).expect("writable");
    let scene = open(folder.join("image_2"));
    assert_eq!(scene.name(), "kitti/42/image_2");
    // P2's fourth column over fx: the camera is 0.06 m to the left of camera 0.
    let pose = scene.pose(0).expect("is known");
    assert!((pose.translation.vector.x + 0.06).abs() < 1e-12);
    let first = scene.cloud(0).expect("is there").points[0];
    assert!((first - Point3::new(7.66, 2.85, 10.0)).norm() < 1e-5);
}

#[test]
fn a_sequence_without_poses_still_yields_queries() {
    let sequence = SmallSequence::write();
    std::fs::remove_file(sequence.poses()).expect("just written");
    let scene = open(sequence.folder());
    assert!(scene.pose(0).is_none());
    assert!(scene.query(0).is_ok());
    let error = scene.reference(0).expect_err("no pose").to_string();
    has(&error, "000004 has no pose");
}

#[test]
fn what_is_wrong_with_a_sequence_is_named() {
    let write = |root: &std::path::Path| {
        small_sequence::write(root, &[4, 5, 7]);
        root.join("sequences/42").display().to_string()
    };
    damage::expect(
        write,
        r#"
        sequences/42/velodyne/000004.bin | cut 5 | velodyne/000004.bin ~ 16 bytes ~ cut off
        sequences/42/velodyne/000004.bin | at 52 \x00\x00\xc0\x7f | velodyne/000004.bin ~ point 3 (byte 48) ~ NaN
        sequences/42/velodyne/000004.bin | text  | velodyne/000004.bin ~ empty
        sequences/42/velodyne/000004.bin | gone | velodyne/000004.bin ~ 2 frames have one
        sequences/42/image_0/000005.png | image 80x64 | image_0/000005.png ~ 160x64 ~ 80x64
        sequences/42/image_0/000004.png | image 80x64 | image_0/000004.png ~ 160x64 ~ 80x64
        sequences/42/image_0/000005.png | cut 400 | image_0/000005.png
        sequences/42/calib.txt | P0: 100 0 80 0 -> P0: 100 0 80 | calib.txt:1 ~ 12 numbers expected, 11 found
        sequences/42/calib.txt | P0: 100 -> P0: 0 | calib.txt ~ focal lengths
        sequences/42/calib.txt | P0: -> P9: | calib.txt ~ `P0:`
        sequences/42/calib.txt | Tr: -> T: | calib.txt ~ `Tr:` ~ reference
        sequences/42/times.txt | 0.3 -> soon | times.txt:4 ~ `soon`
        sequences/42/times.txt | text 0.1\n | times.txt ~ frame 7 ~ 1 lines found
        poses/42.txt | text 1 0 0 0 0 1 0 0 0 0 1 0\n | poses/42.txt ~ frame 7 ~ 1 lines found
        poses/42.txt | 1 0 0 0 0 1 0 0 0 0 1 2\n -> 1 0 0 0 0 2 0 0 0 0 1 2\n | poses/42.txt:3 ~ not a rotation
        "#,
    );
}

#[test]
fn the_real_pair_is_ten_metres_apart_and_its_cloud_lies_in_the_image() {
    let Some(folder) = authors_pair() else {
        return;
    };
    let scene = open(&folder);
    let [query, reference] = ["3823", "3814"].map(|name| scene.find(name).expect("is there"));
    let at = |frame| scene.pose(frame).expect("is known").translation.vector;
    assert!(((at(query) - at(reference)).norm() - 10.2).abs() < 0.05);
    let tuple = scene.reference(reference).expect("is complete");
    let index = posescope::depth::ProjectedCloudIndex::new(tuple.cloud(), tuple.intrinsics());
    assert!((15_000..25_000).contains(&index.len()), "{}", index.len());
}

#[test]
fn an_incomplete_real_sequence_opens_and_says_what_it_lacks() {
    let Some(folder) = data::sample("kitti/sequences/06") else {
        return;
    };
    let scene = open(&folder);
    assert_eq!(scene.frames().len(), 11);
    let error = scene.reference(0).expect_err("no Tr, no scan").to_string();
    has(&error, "Tr");
}

#[test]
fn a_sequence_whose_calibration_has_no_scanner_says_so_everywhere() {
    let sequence = SmallSequence::write();
    let path = sequence.folder().join("calib.txt");
    let text = fs::read_to_string(&path).expect("just written");
    let without: Vec<&str> = text.lines().filter(|line| !line.starts_with("Tr")).collect();
    fs::write(&path, without.join("\n")).expect("writable");
    has(
        &sequence.run("doctor sequences/42").out,
        "no frame has a cloud ~ a line `Tr:` (camera 0 from Velodyne)",
    );
    let line = "run sequences/42 --query 5 --reference nearest:1 --method fb";
    sequence.run(line).fails(3, "no frame has a cloud: a line `Tr:`");
}
