//! The reader of `transforms.json`, on small scenes that are written here and on a real one.

use std::fs;
use std::path::Path;

use image::{ImageBuffer, Luma};
use nalgebra::{Point2, Point3, Vector3};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::binary::{arg, has};
use crate::damage::open;
use crate::small_sequence::wall;
use crate::{damage, data};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 80;

/// The rows of a camera that looks along the world's −z from (x, 0, 5), with OpenGL's axes.
fn rows(x: f64) -> Value {
    json!([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 5.0], [0.0, 0.0, 0.0, 1.0]])
}

fn content() -> Value {
    json!({
        "fl_x": 100.0, "fl_y": 101.0, "cx": 48.5, "cy": 40.5, "w": 96, "h": 80,
        "applied_transform": [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]],
        "ply_file_path": "points.ply",
        "frames": [
            { "file_path": "./images/b.png", "transform_matrix": rows(1.0) },
            { "file_path": "images/a", "transform_matrix": rows(0.0), "fl_x": 120.0 },
        ],
    })
}

fn save(folder: &Path, content: &Value) {
    fs::write(folder.join("transforms.json"), content.to_string()).expect("writable");
}

/// Two photos and points two units in front of the first camera.
pub fn write(folder: &Path) {
    fs::create_dir_all(folder.join("images")).expect("writable");
    for photo in ["a.png", "b.png"] {
        wall(WIDTH, HEIGHT).save(folder.join("images").join(photo)).expect("writable");
    }
    let points = "0 0 3\n0.5 0.25 3\n-0.5 0 2\n0 0 8\n";
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                  property float z\nend_header\n";
    fs::write(folder.join("points.ply"), format!("{header}{points}")).expect("writable");
    save(folder, &content());
}

#[test]
fn poses_are_turned_from_the_axes_of_opengl() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    for place in ["", "transforms.json"] {
        let scene = open(folder.path().join(place));
        assert_eq!(scene.frames(), ["a", "b"]);
        let pose = scene.pose(0).expect("a pose");
        assert!((pose.translation.vector - Vector3::new(0.0, 0.0, 5.0)).norm() < 1e-12);
        // Forward is −z of the world, and down is −y.
        assert!((pose * Vector3::z() - Vector3::new(0.0, 0.0, -1.0)).norm() < 1e-12);
        assert!((pose * Vector3::y() - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-12);
        // Each frame may have a camera of its own.
        let cameras = [0, 1].map(|frame| scene.intrinsics(frame));
        assert_eq!(cameras.map(|camera| camera.fx), [120.0, 100.0]);
        assert_eq!((cameras[1].fy, cameras[1].cx, cameras[1].cy), (101.0, 48.0, 40.0));
    }
}

#[test]
fn the_points_are_in_the_world_of_the_poses() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let scene = open(folder.path());
    let mut points = scene.cloud(0).expect("has points").points;
    points.sort_by(|a, b| a.z.total_cmp(&b.z).then(a.x.total_cmp(&b.x)));
    // What is behind the camera is not seen.
    let expected = [[0.0, 0.0, 2.0], [0.5, -0.25, 2.0], [-0.5, 0.0, 3.0]].map(Point3::from);
    assert_eq!(points.len(), expected.len());
    for (found, expected) in points.iter().zip(&expected) {
        assert!((found - expected).norm() < 1e-5, "{found}");
    }
}

#[test]
fn a_depth_image_smaller_than_its_photo_is_the_cloud_in_metres() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let depth: ImageBuffer<Luma<u16>, Vec<u16>> =
        ImageBuffer::from_pixel(WIDTH / 2, HEIGHT / 2, Luma([2500]));
    depth.save(folder.path().join("depth.png")).expect("writable");
    let mut content = content();
    content["frames"][1]["depth_file_path"] = json!("depth.png");
    save(folder.path(), &content);
    let scene = open(folder.path());
    let cloud = scene.cloud(0).expect("a depth image");
    assert_eq!(cloud.points.len() as u32, WIDTH / 2 * HEIGHT / 2);
    assert!(cloud.points.iter().all(|point| (point.z - 2.5).abs() < 1e-6));
    let camera = scene.intrinsics(0);
    let corner = camera.project(&cloud.points[0].cast()).expect("in front of the camera");
    // The first pixel of the half-sized image is the middle of four.
    assert!((corner.x - 0.5).abs() < 1e-3 && (corner.y - 0.5).abs() < 1e-3, "{corner}");
    assert!(!scene.has_cloud(1));
}

#[test]
fn a_depth_image_shows_what_the_lens_does() {
    for (model, k1) in [("OPENCV", -0.2), ("OPENCV_FISHEYE", 0.05)] {
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        // The depth of each pixel is its column and row.
        let depth = ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| Luma([(1000 + 100 * x + y) as u16]));
        depth.save(folder.path().join("depth.png")).expect("writable");
        let mut content = content();
        content["camera_model"] = json!(model);
        content["k1"] = json!(k1);
        content["frames"][1]["depth_file_path"] = json!("depth.png");
        save(folder.path(), &content);
        let scene = open(folder.path());
        let (camera, map) = (scene.intrinsics(0), scene.pixel_map(0).expect("a lens"));
        let cloud = scene.cloud(0).expect("a depth image");
        assert!(cloud.points.len() as u32 > WIDTH * HEIGHT / 2, "{}", cloud.points.len());
        let mut farthest: f64 = 0.0;
        for point in &cloud.points {
            let pixel = camera.project(&point.cast()).expect("in front of the camera");
            let in_file = map.to_file(pixel);
            let depth = (1000.0 * point.z).round() as u32 - 1000;
            let expected = Point2::new(f64::from(depth / 100), f64::from(depth % 100));
            assert!((in_file - expected).norm() < 1e-2, "{in_file} {expected}");
            farthest = farthest.max((pixel - expected).norm());
        }
        assert!(farthest > 1.0, "{farthest}");
    }
}

#[test]
fn angles_fisheyes_and_photos_that_are_not_there() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let frame = |file: &str| json!({ "file_path": file, "transform_matrix": rows(0.0) });
    // A synthetic scene has an angle alone.
    let frames = [frame("images/a"), frame("images/b"), frame("images/c")];
    save(
        folder.path(),
        &json!({ "camera_angle_x": std::f64::consts::FRAC_PI_2, "frames": frames }),
    );
    let scene = open(folder.path());
    assert_eq!(scene.frames(), ["a", "b"]);
    let camera = scene.intrinsics(0);
    assert!((camera.fx - 48.0).abs() < 1e-9 && camera.fx == camera.fy);
    assert_eq!((camera.cx, camera.cy), (47.5, 39.5));
    let mut fisheye = content();
    fisheye["camera_model"] = json!("OPENCV_FISHEYE");
    fisheye["k1"] = json!(0.01);
    save(folder.path(), &fisheye);
    assert!(open(folder.path()).pixel_map(0).is_some());
}

#[test]
fn what_is_wrong_with_a_file_is_said_in_a_line() {
    for (key, value, words) in [
        ("fl_x", json!(-1.0), "b: positive focal lengths"),
        ("w", json!(640), "w is 640 and the photo has 96 pixels"),
        ("camera_model", json!("EQUIRECTANGULAR"), "`EQUIRECTANGULAR` found"),
        ("k4", json!(0.5), "k4 = 0.5 found"),
        ("k5", json!(0.5), "k1 k2 k3 p1 p2 expected, k5 = 0.5 found"),
        ("camera_model", json!("FULL_OPENCV"), "`FULL_OPENCV` found"),
        ("frames", json!([]), "none of 0 found"),
        ("frames", json!([{ "file_path": "images/a" }]), "transform_matrix"),
        (
            "frames",
            json!([{ "file_path": "../a", "transform_matrix": rows(0.0) }]),
            "inside the scene's folder",
        ),
        (
            "frames",
            json!([{ "file_path": "images/a", "transform_matrix": [[1, 0, 0, 0]] }]),
            "a: a transform_matrix of",
        ),
    ] {
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        let mut content = content();
        content[key] = value;
        save(folder.path(), &content);
        let opened = posescope::scene::open(arg(folder.path()), None);
        let error = opened.err().unwrap_or_else(|| panic!("no error: {words}")).to_string();
        damage::expect_words(&error, words);
    }
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    fs::write(folder.path().join("transforms.json"), "{\n\"frames\": [\n}").expect("writable");
    let error = posescope::scene::open(arg(folder.path()), None).err().expect("is cut off");
    has(&error.to_string(), "transforms.json:3");
}

#[test]
fn the_real_fox_opens_and_its_poses_look_at_one_place() {
    let Some(root) = data::sample("fox") else { return };
    let scene = open(&root);
    assert_eq!(scene.frames().len(), 17);
    let rays = (0..17).map(|frame| {
        let pose = scene.pose(frame).expect("a pose");
        (pose.translation.vector, pose * Vector3::z())
    });
    // The point nearest to all axes is in front of all cameras.
    let (mut sum, mut weighted) = (nalgebra::Matrix3::zeros(), Vector3::zeros());
    let rays: Vec<_> = rays.collect();
    for (place, axis) in &rays {
        let across = nalgebra::Matrix3::identity() - axis * axis.transpose();
        sum += across;
        weighted += across * place;
    }
    let middle = sum.try_inverse().expect("no parallel axes") * weighted;
    assert!(rays.iter().all(|(place, axis)| (middle - place).dot(axis) > 0.5));
}
