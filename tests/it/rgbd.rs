//! The readers of RGB-D sequences, on small ones that are written here and on a real one.

use std::fs;
use std::path::Path;

use image::{GrayImage, ImageBuffer, Luma};
use nalgebra::{Point2, Point3};
use posescope::camera::Intrinsics;
use posescope::geometry::PoseError;
use posescope::localize::localize;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::Scene;
use tempfile::TempDir;

use crate::binary::{arg, has};
use crate::damage::open;
use crate::small_sequence::wall;
use crate::{damage, data};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

/// A slanted wall, whose depth grows to the right, with a pixel of each kind of invalid depth in the
/// middle of a block of 4 × 4, of which one becomes a point.
fn depth(unit_m: f64) -> ImageBuffer<Luma<u16>, Vec<u16>> {
    ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
        Luma([match (x, y) {
            (2, 2) => 0,
            (6, 2) => u16::MAX,
            _ => (depth_m(x) / unit_m).round() as u16,
        }])
    })
}

fn depth_m(x: u32) -> f64 {
    2.0 + f64::from(x) / 640.0
}

/// A TUM sequence of three photos, of which the middle one has no depth image.
pub fn write_tum(folder: &Path) {
    for images in ["rgb", "depth"] {
        fs::create_dir_all(folder.join(images)).expect("writable");
    }
    let photo = wall(WIDTH, HEIGHT);
    let mut list = "# color images\n# timestamp filename\n".to_owned();
    for time in ["100.000000", "100.033000", "100.066000"] {
        photo.save(folder.join(format!("rgb/{time}.png"))).expect("writable");
        list += &format!("{time} rgb/{time}.png\n");
    }
    fs::write(folder.join("rgb.txt"), list).expect("writable");
    let mut list = "# depth maps\n".to_owned();
    for time in ["100.011000", "100.054000", "100.070000"] {
        depth(1.0 / 5000.0).save(folder.join(format!("depth/{time}.png"))).expect("writable");
        list += &format!("{time} depth/{time}.png\n");
    }
    fs::write(folder.join("depth.txt"), list).expect("writable");
    let mut truth = "# timestamp tx ty tz qx qy qz qw\n".to_owned();
    for step in 0..20 {
        let time = 99.995 + 0.01 * f64::from(step);
        let x = time - 100.0;
        truth += &format!("{time:.4} {x:.6} 0.5 1 0 0 0.70710678 0.70710678\n");
    }
    fs::write(folder.join("groundtruth.txt"), truth).expect("writable");
}

/// A 7-Scenes scene of two sequences as they are distributed, with their split.
pub fn write_seven_scenes(folder: &Path) {
    for (sequence, frames) in [("seq-01", 0..2), ("seq-02", 0..1)] {
        let path = folder.join(sequence);
        fs::create_dir_all(&path).expect("writable");
        for frame in frames {
            let name = |end: &str| path.join(format!("frame-{frame:06}.{end}"));
            wall(WIDTH, HEIGHT).save(name("color.png")).expect("writable");
            depth(0.001).save(name("depth.png")).expect("writable");
            let pose = format!("1\t0\t0\t{frame}\n0\t0\t-1\t2\n0\t1\t0\t3\n0\t0\t0\t1\n");
            fs::write(name("pose.txt"), pose).expect("writable");
        }
    }
    fs::write(folder.join("TrainSplit.txt"), "sequence2\n").expect("writable");
    fs::write(folder.join("TestSplit.txt"), "sequence1\n").expect("writable");
}

/// Every point lies on the wall, behind the pixel that it was made from.
fn expect_the_wall(scene: &dyn Scene, frame: usize, camera: &Intrinsics, unit_m: f64) {
    let cloud = scene.cloud(frame).unwrap_or_else(|error| panic!("{error}"));
    // One pixel in 4 × 4, and two of these have no depth.
    assert_eq!(cloud.len(), 160 * 120 - 2);
    for point in &cloud.points {
        let pixel = camera.project(&point.cast()).expect("is ahead");
        assert!((pixel.x - pixel.x.round()).abs() < 1e-3, "{pixel}");
        let expected = depth_m(pixel.x.round() as u32);
        assert!((f64::from(point.z) - expected).abs() <= 0.51 * unit_m);
    }
}

#[test]
fn a_tum_sequence_is_associated_by_time() {
    let folder = TempDir::new().expect("a folder");
    write_tum(folder.path());
    let scene = open(folder.path());
    assert_eq!(scene.frames(), ["100.000000", "100.033000", "100.066000"]);
    assert_eq!(scene.time_s(1), Some(100.033));
    // 11 ms, 21 ms and 4 ms to the nearest depth image.
    let has_cloud: Vec<bool> = (0..3).map(|frame| scene.has_cloud(frame)).collect();
    assert_eq!(has_cloud, [true, false, true]);
    let error = scene.reference(1).expect_err("no depth").to_string();
    has(&error, "depth.txt ~ 2 frames have one");

    for frame in 0..3 {
        let pose = scene.pose(frame).expect("is known");
        let time = scene.time_s(frame).expect("is known");
        // Between two samples of the truth.
        assert!((pose.translation.vector.x - (time - 100.0)).abs() < 1e-6);
        let ahead = pose.rotation * nalgebra::Vector3::x();
        assert!((ahead - nalgebra::Vector3::y()).norm() < 1e-6, "{ahead}");
    }
    let camera = scene.intrinsics(0);
    assert_eq!((camera.fx, camera.cx, camera.cy), (525.0, 319.5, 239.5));
    expect_the_wall(scene.as_ref(), 0, &camera, 1.0 / 5000.0);
}

#[test]
fn a_tum_folder_may_name_its_camera() {
    let folder = TempDir::new().expect("a folder");
    write_tum(folder.path());
    let calibration = folder.path().join("calibration.txt");
    fs::write(&calibration, "500.5 501 320 240\n").expect("writable");
    let camera = open(folder.path()).intrinsics(0);
    assert_eq!((camera.fx, camera.fy, camera.cy), (500.5, 501.0, 240.0));
}

#[test]
fn what_is_wrong_with_a_tum_folder_is_named_with_its_line() {
    let write = |folder: &Path| {
        write_tum(folder);
        arg(folder).to_owned()
    };
    damage::expect(
        write,
        r#"
        rgb.txt | text # none\n | rgb.txt:  ~ `time file`
        rgb.txt | text 1.0 rgb/1.png\nx y.png\n | rgb.txt:2 ~ `x`
        rgb.txt | text 1.0 ../../1.png\n | rgb.txt:1 ~ scene's folder
        rgb.txt | text 1.0 rgb/none.png\n | rgb/none.png
        depth.txt | text 1.0\n | depth.txt:1 ~ `time file`
        groundtruth.txt | text # t\n100 0 0 0 0 0 0\n | groundtruth.txt:2 ~ 8 numbers expected, 7 found
        groundtruth.txt | text 100 0 0 0 0 0 0 2\n | groundtruth.txt:1 ~ length 2.000
        groundtruth.txt | text 7 0 0 0 0 0 0 1\n | groundtruth.txt ~ between 7 and 7
        calibration.txt | text -500 501 320 240\n | calibration.txt ~ positive focal lengths
        depth/100.011000.png | image 640x480 | depth/100.011000.png ~ 16-bit
        depth/100.011000.png | gone | depth/100.011000.png
        rgb/100.033000.png | image 320x240 | rgb/100.033000.png ~ 640x480 ~ 320x240
        rgb/100.000000.png | image 320x240 | rgb/100.000000.png ~ 640x480 ~ 320x240
        "#,
    );
}

#[test]
fn a_depth_image_of_another_size_is_named() {
    let folder = TempDir::new().expect("a folder");
    write_tum(folder.path());
    let path = folder.path().join("depth/100.011000.png");
    ImageBuffer::<Luma<u16>, Vec<u16>>::new(320, 240).save(&path).expect("writable");
    let error = open(folder.path()).cloud(0).expect_err("small").to_string();
    damage::expect_words(&error, "640x480 ~ 320x240");
}

#[test]
fn seven_scenes_as_distributed_have_two_cameras() {
    let folder = TempDir::new().expect("a folder");
    write_seven_scenes(folder.path());
    let scene = open(folder.path());
    let names = ["seq-01-000000", "seq-01-000001", "seq-02-000000"];
    assert_eq!(scene.frames(), names);
    let camera = scene.intrinsics(0);
    assert_eq!((camera.fx, camera.cx), (525.0, 320.0));
    // Taken back to the depth camera, the cloud is the wall again.
    let cloud = scene.cloud(1).expect("is there");
    let depth_camera = Intrinsics { fx: 585.0, fy: 585.0, ..camera };
    let world_from_depth = nalgebra::Isometry3::from_parts(
        nalgebra::Translation3::new(1.0, 2.0, 3.0),
        nalgebra::UnitQuaternion::from_axis_angle(
            &nalgebra::Vector3::x_axis(),
            std::f64::consts::FRAC_PI_2,
        ),
    );
    let pose = scene.pose(1).expect("is known");
    let beside = pose.translation.vector - world_from_depth.translation.vector;
    assert!((0.02..0.03).contains(&beside.norm()), "{beside}");
    for point in &cloud.points {
        let in_depth = world_from_depth.inverse() * (pose * point.cast::<f64>());
        let pixel = depth_camera.project(&in_depth).expect("is ahead");
        assert!((pixel.x - pixel.x.round()).abs() < 2e-3, "{pixel}");
        assert!((in_depth.z - depth_m(pixel.x.round() as u32)).abs() < 0.001);
    }
}

#[test]
fn seven_scenes_open_by_split_and_by_sequence() {
    let folder = TempDir::new().expect("a folder");
    let scene_folder = folder.path().join("chess");
    write_seven_scenes(&scene_folder);
    let argument = scene_folder.to_str().expect("a plain path").to_owned();
    for (end, name, frames) in [
        (":train", "7scenes/chess:train", &["000000"][..]),
        (":test", "7scenes/chess:test", &["000000", "000001"]),
        ("/seq-02", "7scenes/chess/seq-02", &["000000"]),
    ] {
        let scene = open(&(argument.clone() + end));
        assert_eq!(scene.name(), name);
        assert_eq!(scene.frames(), frames);
    }
}

#[test]
fn photos_of_seven_scenes_are_found_by_their_paths() {
    let folder = TempDir::new().expect("a folder");
    let root = folder.path().join("kitchen");
    write_seven_scenes(&root);
    let file = folder.path().join("poses.txt");
    let found = |scene: &dyn Scene, name: &str| {
        fs::write(&file, format!("{name} 1 0 0 0 0 0 0\n")).expect("writable");
        let read = posescope::scene::read_estimates(&file, scene);
        read.ok().map(|estimates| estimates.into_keys().collect::<Vec<_>>())
    };
    let one = |name: &str| Some(vec![name.to_owned()]);
    let sequence = open(root.join("seq-01"));
    for name in [
        "seq-01/frame-000001.color.png",
        "kitchen/seq-01/frame-000001.color.png",
        "7scenes/kitchen/seq-01/frame-000001.color.png",
        "seq-01-frame-000001.color.png",
        "frame-000001.color.png",
        "frame-000001.color",
        "frame-000001",
        "000001",
        "1",
    ] {
        assert_eq!(found(sequence.as_ref(), name), one("000001"), "{name}");
        if !name.contains("-frame") {
            assert_eq!(sequence.find(name).ok(), Some(1), "{name}");
        }
    }
    for name in
        ["seq-02/frame-000001.color.png", "office/seq-01/frame-000001.color.png", "img-000001"]
    {
        assert_eq!(found(sequence.as_ref(), name), None, "{name}");
    }
    assert!(sequence.find("seq-02/frame-000001.color.png").is_err());
    let scene = open(&root);
    let name = "seq-02/frame-000000.color.png";
    assert_eq!(found(scene.as_ref(), name), one("seq-02-000000"));
    assert_eq!(scene.find(name).ok(), Some(2));
    assert_eq!(found(scene.as_ref(), "frame-000000"), None);
    assert_eq!(found(scene.as_ref(), "frame-000001"), one("seq-01-000001"));
}

#[test]
fn registered_depth_images_share_the_camera_of_the_photos() {
    let folder = TempDir::new().expect("a folder");
    write_seven_scenes(folder.path());
    fs::write(folder.path().join("camera-intrinsics.txt"), "585 0 320\n0 585 240\n0 0 1\n")
        .expect("writable");
    for path in [folder.path().to_owned(), folder.path().join("seq-01")] {
        let scene = open(&path);
        let camera = scene.intrinsics(0);
        assert_eq!(camera.fx, 585.0);
        expect_the_wall(scene.as_ref(), 0, &camera, 0.001);
        let pose = scene.pose(1).expect("is known");
        assert_eq!(pose.translation.vector.as_slice(), [1.0, 2.0, 3.0]);
    }
}

#[test]
fn a_pose_that_is_lost_is_none_and_one_that_is_wrong_is_named() {
    let folder = TempDir::new().expect("a folder");
    write_seven_scenes(folder.path());
    let pose = "seq-01/frame-000001.pose.txt";
    let lost = "-inf -inf -inf -inf\n".repeat(4);
    fs::write(folder.path().join(pose), lost).expect("writable");
    assert!(open(folder.path()).pose(1).is_none());
    let write = |folder: &Path| {
        write_seven_scenes(folder);
        arg(folder).to_owned()
    };
    damage::expect(
        write,
        r#"
        seq-01/frame-000001.pose.txt | text 1 0 0 0\n0 1 0\n | pose.txt:2 ~ 4 numbers expected, 3 found
        seq-01/frame-000001.pose.txt | text 1 0 0 0\n0 2 0 0\n0 0 1 0\n0 0 0 1\n | pose.txt ~ not a rotation
        seq-01/frame-000001.pose.txt | text 1 0 0 0\n0 1 0 0\n0 0 1 0\n4 5 6 1\n | pose.txt ~ last row 0 0 0 1
        seq-01/frame-000000.color.png | image 320x240 | seq-01/frame-000000.color.png ~ 640x480 ~ 320x240
        seq-02/frame-000000.color.png | image 320x240 | seq-02/frame-000000.color.png ~ 640x480 ~ 320x240
        camera-intrinsics.txt | text 585 1 320\n0 585 240\n0 0 1\n | camera-intrinsics.txt ~ fx 0 cx
        "#,
    );
}

#[test]
fn a_point_of_the_real_kitchen_lands_on_itself_in_another_frame() {
    let Some(folder) = data::sample("7scenes/redkitchen") else {
        return;
    };
    let scene = open(&folder);
    assert_eq!(scene.name(), "7scenes/redkitchen");
    let [a, b] = ["0", "25"].map(|name| scene.find(name).expect("is there"));
    let poses = [a, b].map(|frame| scene.pose(frame).expect("is known"));
    let b_from_a = poses[1].inverse() * poses[0];
    let camera = scene.intrinsics(b);
    let [photo_a, photo_b] = [a, b].map(|frame| scene.photo(frame).expect("readable"));
    // What the photos show at both projections of a point differs less than elsewhere.
    let value = |photo: &GrayImage, pixel: Point2<f64>| {
        f64::from(photo.get_pixel(pixel.x.round() as u32, pixel.y.round() as u32).0[0])
    };
    let difference = |shift: f64| {
        let cloud = scene.cloud(a).expect("readable");
        let differences: Vec<f64> = cloud
            .points
            .iter()
            .filter_map(|point| {
                let point: Point3<f64> = point.cast();
                let in_a = camera.project(&point)?;
                let mut in_b = camera.project(&(b_from_a * point))?;
                in_b.x += shift;
                let inside = |p: &Point2<f64>| p.x > 1.0 && p.y > 1.0 && p.x < 638.0 && p.y < 478.0;
                (inside(&in_a) && inside(&in_b))
                    .then(|| (value(&photo_a.gray, in_a) - value(&photo_b.gray, in_b)).abs())
            })
            .collect();
        assert!(differences.len() > 8_000, "{}", differences.len());
        differences.iter().sum::<f64>() / differences.len() as f64
    };
    let [there, aside] = [difference(0.0), difference(15.0)];
    println!("mean difference {there:.1}, 15 px aside {aside:.1}");
    assert!(there < 0.7 * aside, "{there} {aside}");
}

#[test]
fn fb_localises_in_the_real_kitchen() {
    let Some(folder) = data::sample("7scenes/redkitchen") else {
        return;
    };
    let scene = open(&folder);
    let frame = |name| scene.find(name).expect("is there");
    let problem = Problem::new(
        scene.query(frame("25")).expect("readable"),
        scene.reference(frame("0")).expect("readable"),
        2.0,
    )
    .expect("a radius");
    let outcome = localize(&problem, Method::FB, &Params::default());
    let truth = scene.pose(frame("25")).expect("is known");
    let pose = outcome.pose.unwrap_or_else(|failure| panic!("{failure}"));
    let error = PoseError::between(&truth, &pose);
    println!("{error}");
    assert!(error.translation_m < 0.1 && error.rotation_deg < 2.0);
}
