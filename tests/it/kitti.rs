//! The reader of KITTI odometry, on a small sequence and on the real one.

use nalgebra::Point3;
use posescope::scene::{self, Scene};

use crate::damage::Damage::{Bytes, Cut, Gone, Image, Swap, Text};
use crate::real_pair::authors_pair;
use crate::small_sequence::{self, SmallSequence};
use crate::{damage, data};

fn open(path: &std::path::Path) -> Box<dyn Scene> {
    scene::open(path.to_str().expect("a plain path"), None).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn frames_may_have_gaps_and_are_found_by_number() {
    let sequence = SmallSequence::write();
    let scene = open(&sequence.folder());
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
    let scene = open(&sequence.folder());
    let cloud = scene.cloud(0).expect("is there");
    // The first point: 10 m ahead, 7.6 m to the right, 2.85 m down.
    let first = cloud.points[0];
    assert!(
        (first - Point3::new(7.6, 2.85, 10.0)).norm() < 1e-5,
        "{first}"
    );
}

#[test]
fn the_colour_camera_is_offset_by_its_projection_matrix() {
    let sequence = SmallSequence::write();
    let folder = sequence.folder();
    std::fs::rename(folder.join("image_0"), folder.join("image_2")).expect("writable");
    let scene = open(&folder.join("image_2"));
    assert_eq!(scene.name(), "kitti/42/image_2");
    // P2's fourth column over fx: the camera is 0.06 m to the left of camera 0.
    let pose = scene.pose(0).expect("is known");
    assert!((pose.translation.vector.x + 0.06).abs() < 1e-12);
    let first = scene.cloud(0).expect("is there").points[0];
    assert!(
        (first - Point3::new(7.66, 2.85, 10.0)).norm() < 1e-5,
        "{first}"
    );
}

#[test]
fn a_sequence_without_poses_still_yields_queries() {
    let sequence = SmallSequence::write();
    std::fs::remove_file(sequence.poses()).expect("just written");
    let scene = open(&sequence.folder());
    assert!(scene.pose(0).is_none());
    assert!(scene.query(0).is_ok());
    let error = scene.reference(0).expect_err("no pose").to_string();
    assert!(error.contains("000004 has no pose"), "{error}");
}

#[test]
fn what_is_wrong_with_a_sequence_is_named() {
    let (image, scan) = (
        "sequences/42/image_0/000005.png",
        "sequences/42/velodyne/000004.bin",
    );
    let (calibration, times, poses) = (
        "sequences/42/calib.txt",
        "sequences/42/times.txt",
        "poses/42.txt",
    );
    let pose = "1 0 0 0 0 1 0 0 0 0 1 2\n";
    let write = |root: &std::path::Path| {
        small_sequence::write(root, &[4, 5, 7]);
        let folder = root.join("sequences/42");
        folder.to_str().expect("a plain path").to_owned()
    };
    damage::expect(
        write,
        &[
            (
                scan,
                Cut(5),
                &["velodyne/000004.bin", "16 bytes", "cut off"],
            ),
            (
                scan,
                Bytes(16 * 3 + 4, b"\x00\x00\xc0\x7f"),
                &["velodyne/000004.bin", "point 3 (byte 48)", "NaN"],
            ),
            (scan, Text(""), &["velodyne/000004.bin", "empty"]),
            (scan, Gone, &["velodyne/000004.bin", "2 frames have one"]),
            (
                image,
                Image(80, 64),
                &["image_0/000005.png", "160x64", "80x64"],
            ),
            (image, Cut(400), &["image_0/000005.png"]),
            (
                calibration,
                Swap("P0: 100 0 80 0", "P0: 100 0 80"),
                &["calib.txt:1", "12 numbers expected, 11 found"],
            ),
            (
                calibration,
                Swap("P0: 100", "P0: 0"),
                &["calib.txt", "focal lengths"],
            ),
            (calibration, Swap("P0:", "P9:"), &["calib.txt", "`P0:`"]),
            (
                calibration,
                Swap("Tr:", "T:"),
                &["calib.txt", "`Tr:`", "reference"],
            ),
            (times, Swap("0.3", "soon"), &["times.txt:4", "`soon`"]),
            (
                times,
                Text("0.1\n"),
                &["times.txt", "frame 7", "1 lines found"],
            ),
            (
                poses,
                Text("1 0 0 0 0 1 0 0 0 0 1 0\n"),
                &["poses/42.txt", "frame 7", "1 lines found"],
            ),
            (
                poses,
                Swap(pose, "1 0 0 0 0 2 0 0 0 0 1 2\n"),
                &["poses/42.txt:3", "not a rotation"],
            ),
        ],
    );
}

#[test]
fn the_real_pair_is_ten_metres_apart_and_its_cloud_lies_in_the_image() {
    let Some(folder) = authors_pair() else {
        return;
    };
    let scene = open(&folder);
    let (query, reference) = (
        scene.find("3823").expect("is there"),
        scene.find("3814").expect("is there"),
    );
    let at = |frame| scene.pose(frame).expect("is known").translation.vector;
    assert!(((at(query) - at(reference)).norm() - 10.2).abs() < 0.05);
    let tuple = scene.reference(reference).expect("is complete");
    let index = posescope::depth::ProjectedCloudIndex::new(&tuple.cloud, &tuple.intrinsics);
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
    assert!(error.contains("Tr"), "{error}");
}
