//! The reader of COLMAP models, on a small one in both forms and on a real one.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nalgebra::{Point2, Point3, Quaternion, UnitQuaternion, Vector3};
use posescope::geometry::{Pose, PoseError};
use posescope::localize::localize;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene;
use tempfile::TempDir;

use crate::binary::{arg, has, run_in};
use crate::damage::open;
use crate::small_sequence::wall;
use crate::{damage, data};

/// Which form a model is written in.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    Text,
    Binary,
}

/// Id, model, its number, size, parameters.
type Camera = (u32, &'static str, u32, [u64; 2], &'static [f64]);

const CAMERAS: [Camera; 2] = [
    (1, "PINHOLE", 1, [160, 64], &[100.0, 101.0, 80.5, 32.5]),
    (7, "OPENCV", 4, [96, 80], &[90.0, 90.0, 48.0, 40.0, -0.05, 0.01, 0.001, -0.001]),
];

/// Id, name, camera, rotation and translation of `camera_from_world`, ids of the points that it observes.
type Image = (u32, &'static str, u32, [f64; 4], [f64; 3], &'static [i64]);

const IMAGES: [Image; 2] = [
    (4, "b side/2.png", 7, [0.923_879_533, 0.0, 0.382_683_432, 0.0], [1.0, 2.0, 3.0], &[]),
    (2, "a/1.png", 1, [1.0, 0.0, 0.0, 0.0], [0.5, 0.0, 4.0], &[30, -1, 10, 20]),
];

const POINTS: [(u64, [f64; 3]); 3] =
    [(10, [0.0, 0.0, 6.0]), (20, [1.0, -0.5, 7.0]), (30, [-2.0, 0.25, 16.0])];

/// A project with photos and the model in `sparse/0`.
pub fn write(folder: &Path, form: Form) {
    let model = folder.join("sparse/0");
    fs::create_dir_all(&model).expect("writable");
    for (_, name, camera, ..) in IMAGES {
        let (.., [width, height], _) =
            CAMERAS.into_iter().find(|(id, ..)| *id == camera).expect("is there");
        let path = folder.join("images").join(name);
        fs::create_dir_all(path.parent().expect("has one")).expect("writable");
        wall(width as u32, height as u32).save(path).expect("writable");
    }
    match form {
        Form::Text => write_text(&model),
        Form::Binary => write_binary(&model),
    }
}

fn joined<T: ToString>(values: &[T]) -> String {
    let words: Vec<String> = values.iter().map(ToString::to_string).collect();
    words.join(" ")
}

fn write_text(model: &Path) {
    let mut text = "# Camera list\n".to_owned();
    for (id, name, _, [width, height], parameters) in CAMERAS {
        let _ = writeln!(text, "{id} {name} {width} {height} {}", joined(parameters));
    }
    fs::write(model.join("cameras.txt"), text).expect("writable");
    let mut text = "# Image list\n".to_owned();
    for (id, name, camera, rotation, translation, observed) in IMAGES {
        let (q, t) = (joined(&rotation), joined(&translation));
        let _ = writeln!(text, "{id} {q} {t} {camera} {name}");
        let features: Vec<String> = observed.iter().map(|id| format!("1.5 2.5 {id}")).collect();
        let _ = writeln!(text, "{}", features.join(" "));
    }
    fs::write(model.join("images.txt"), text).expect("writable");
    let mut text = "# Points\n".to_owned();
    for (id, position) in POINTS {
        let _ = writeln!(text, "{id} {} 1 2 3 0.5 2 0 4 1", joined(&position));
    }
    fs::write(model.join("points3D.txt"), text).expect("writable");
}

fn write_binary(model: &Path) {
    let floats = |values: &[f64]| -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    };
    let mut bytes = (CAMERAS.len() as u64).to_le_bytes().to_vec();
    for (id, _, number, size, parameters) in CAMERAS {
        bytes.extend(id.to_le_bytes());
        bytes.extend(number.to_le_bytes());
        bytes.extend(size.iter().flat_map(|side| side.to_le_bytes()));
        bytes.extend(floats(parameters));
    }
    fs::write(model.join("cameras.bin"), bytes).expect("writable");
    let mut bytes = (IMAGES.len() as u64).to_le_bytes().to_vec();
    for (id, name, camera, rotation, translation, observed) in IMAGES {
        bytes.extend(id.to_le_bytes());
        bytes.extend(floats(&rotation));
        bytes.extend(floats(&translation));
        bytes.extend(camera.to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.push(0);
        bytes.extend((observed.len() as u64).to_le_bytes());
        for id in observed {
            bytes.extend(floats(&[1.5, 2.5]));
            bytes.extend(id.to_le_bytes());
        }
    }
    fs::write(model.join("images.bin"), bytes).expect("writable");
    let mut bytes = (POINTS.len() as u64).to_le_bytes().to_vec();
    for (id, position) in POINTS {
        bytes.extend(id.to_le_bytes());
        bytes.extend(floats(&position));
        bytes.extend([1, 2, 3]);
        bytes.extend(floats(&[0.5]));
        bytes.extend(2_u64.to_le_bytes());
        for value in [2_u32, 0, 4, 1] {
            bytes.extend(value.to_le_bytes());
        }
    }
    fs::write(model.join("points3D.bin"), bytes).expect("writable");
}

fn error_of(path: &Path) -> String {
    let opened = scene::open(arg(path), None);
    opened.err().expect("it is damaged").to_string()
}

#[test]
fn both_forms_say_the_same() {
    for form in [Form::Text, Form::Binary] {
        let folder = TempDir::new().expect("a folder");
        let project = folder.path().join("yard");
        write(&project, form);
        let scene = open(&project);
        assert_eq!(scene.name(), "colmap/yard");
        assert_eq!(scene.frames(), ["a/1", "b side/2"]);

        // The centre of the first pixel is at (0.5, 0.5) of the model.
        let camera = scene.intrinsics(0);
        assert_eq!((camera.fx, camera.fy), (100.0, 101.0));
        assert_eq!((camera.cx, camera.cy), (80.0, 32.0));
        assert_eq!((camera.width, camera.height), (160, 64));
        let other = scene.intrinsics(1);
        assert_eq!((other.width, other.height), (96, 80));
        assert_eq!((other.cx, other.cy), (47.5, 39.5));
        for frame in 0..2 {
            let camera = scene.intrinsics(frame);
            let size = scene.photo(frame).expect("readable").dimensions();
            assert_eq!(size, (camera.width, camera.height), "{form:?}");
        }

        // Poses are the inverse of what the model says.
        let pose = scene.pose(0).expect("is known");
        assert!((pose.translation.vector - Vector3::new(-0.5, 0.0, -4.0)).norm() < 1e-12);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(
            0.923_879_533,
            0.0,
            0.382_683_432,
            0.0,
        ));
        let camera_from_world = Pose::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), turn);
        let error =
            PoseError::between(&camera_from_world.inverse(), &scene.pose(1).expect("known"));
        assert!(error.translation_m < 1e-9 && error.rotation_deg < 1e-6);

        // The points that the image observes, in its camera's frame.
        let cloud = scene.cloud(0).expect("has one");
        let expected = [[-1.5, 0.25, 20.0], [0.5, 0.0, 10.0], [1.5, -0.5, 11.0]];
        assert_eq!(cloud.points, expected.map(Point3::from));
        assert!(!scene.has_cloud(1));
        let error = scene.reference(1).expect_err("observes nothing").to_string();
        has(&error, "frame a/1 has one");
    }
}

/// A model of two cameras whose photos have the same number.
pub fn write_rig(folder: &Path) {
    write(folder, Form::Text);
    let images = folder.join("images");
    for (name, renamed) in [("a/1.png", "cam0/000001.png"), ("b side/2.png", "cam1/000001.png")] {
        let renamed = images.join(renamed);
        fs::create_dir_all(renamed.parent().expect("has one")).expect("writable");
        fs::rename(images.join(name), renamed).expect("is there");
    }
    let listed = folder.join("sparse/0/images.txt");
    let text = fs::read_to_string(&listed).expect("just written");
    let text =
        text.replace("a/1.png", "cam0/000001.png").replace("b side/2.png", "cam1/000001.png");
    fs::write(listed, text).expect("writable");
}

#[test]
fn photos_of_a_rig_are_told_apart_by_their_folders() {
    let folder = TempDir::new().expect("a folder");
    write_rig(folder.path());
    let scene = open(folder.path());
    assert_eq!(scene.frames(), ["cam0/000001", "cam1/000001"]);
    assert_eq!(scene.find("cam1/000001.png").expect("is there"), 1);
    let error = scene.find("1").expect_err("either").to_string();
    has(&error, "`1` may be cam0/000001, cam1/000001");
    // The model's own images, and the names of hloc.
    let file = folder.path().join("poses.txt");
    let line = |name: &str| format!("{name} 1 0 0 0 0 0 0\n");
    let keys = |path: &Path| -> Vec<String> {
        let read = scene::read_estimates(path, scene.as_ref());
        read.unwrap_or_else(|error| panic!("{error}")).into_keys().collect()
    };
    let both = ["cam0/000001", "cam1/000001"];
    assert_eq!(keys(&folder.path().join("sparse/0")), both);
    for names in [["cam0/000001.png", "cam1/000001.png"], ["cam0-000001.png", "cam1-000001"]] {
        fs::write(&file, names.map(line).concat()).expect("writable");
        assert_eq!(keys(&file), both);
    }
    // A name that both share, and one of a third camera, mean neither.
    for name in ["000001.png", "1", "cam2/000001.png"] {
        fs::write(&file, line(name)).expect("writable");
        let error = scene::read_estimates(&file, scene.as_ref()).expect_err(name).to_string();
        damage::expect_words(
            &error,
            &format!("with names like `cam0/000001`; the file has names like `{name}`"),
        );
    }
    // Files of ours have no folders.
    let line = "run . --all --reference cam0/000001 --method fb --export-matches matches";
    run_in(folder.path(), line).ok();
    assert!(folder.path().join("matches/cam1-000001_cam0-000001_matches.txt").is_file());
}

#[test]
fn a_model_opens_by_its_own_folder_too() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), Form::Binary);
    for place in ["sparse/0", ""] {
        assert_eq!(open(folder.path().join(place)).frames().len(), 2);
    }
}

#[test]
fn a_camera_that_cannot_be_read_costs_its_own_images_alone() {
    for form in [Form::Text, Form::Binary] {
        let folder = TempDir::new().expect("a folder");
        write(folder.path(), form);
        let model = folder.path().join("sparse/0");
        match form {
            Form::Text => {
                let text = "1 PINHOLE 160 64 100 101 80.5 32.5\n7 PERSPECTIVE 96 80 90 90 48 40\n";
                fs::write(model.join("cameras.txt"), text).expect("writable");
            }
            Form::Binary => {
                // A focal length of no size.
                let path = model.join("cameras.bin");
                let mut bytes = fs::read(&path).expect("just written");
                let at = bytes.len() - 64;
                bytes[at..at + 8].copy_from_slice(&0.0_f64.to_le_bytes());
                fs::write(&path, bytes).expect("writable");
            }
        }
        assert_eq!(open(folder.path()).frames(), ["a/1"], "{form:?}");
    }
}

/// Moves an image to a model of its own.
fn write_two_models(folder: &Path) {
    write(folder, Form::Text);
    let [first, second] = ["sparse/0", "sparse/1"].map(|model| folder.join(model));
    fs::create_dir(&second).expect("writable");
    for file in ["cameras.txt", "images.txt", "points3D.txt"] {
        fs::copy(first.join(file), second.join(file)).expect("readable");
    }
    let text = fs::read_to_string(first.join("images.txt")).expect("just written");
    let only: Vec<&str> = text.lines().take(3).collect();
    fs::write(first.join("images.txt"), only.join("\n") + "\n").expect("writable");
}

#[test]
fn of_several_models_the_largest_is_read_and_the_others_by_their_names() {
    let folder = TempDir::new().expect("a folder");
    write_two_models(folder.path());
    // What newer versions of COLMAP write besides.
    for file in ["rigs.bin", "frames.bin", "rigs.txt", "frames.txt"] {
        fs::write(folder.path().join("sparse/1").join(file), "?").expect("writable");
    }
    for place in ["", "sparse", "sparse/1"] {
        assert_eq!(open(folder.path().join(place)).frames(), ["a/1", "b side/2"], "{place}");
    }
    assert_eq!(open(folder.path().join("sparse/0")).frames(), ["b side/2"]);
    let said = run_in(folder.path(), "doctor .");
    has(&said.err, "sparse/1 (2 images) is read, the largest of 2 models ~ sparse/0 (1 images)");
}

#[cfg(unix)]
#[test]
fn a_model_whose_photos_are_a_link_is_called_by_its_folder() {
    let folder = TempDir::new().expect("a folder");
    let (model, photos) = (folder.path().join("project"), folder.path().join("elsewhere"));
    write(&model, Form::Binary);
    fs::rename(model.join("images"), &photos).expect("just written");
    std::os::unix::fs::symlink(&photos, model.join("images")).expect("writable");
    assert_eq!(open(&model).name(), "colmap/project");
}

#[test]
fn points_that_no_image_observes_are_given_to_the_frames_that_see_them() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), Form::Text);
    let path = folder.path().join("sparse/0/images.txt");
    let text = fs::read_to_string(&path).expect("just written");
    let bare: Vec<&str> = text.lines().filter(|line| line.ends_with(".png")).collect();
    fs::write(&path, bare.join("\n") + "\n").expect("writable");
    let scene = open(folder.path());
    // The camera of `a/1` is at (−0.5, 0, −4) and sees all three points.
    let frame = scene.find("a/1").expect("is there");
    let mut depths: Vec<f32> =
        scene.cloud(frame).expect("has points").points.iter().map(|point| point.z).collect();
    depths.sort_by(f32::total_cmp);
    assert_eq!(depths, [10.0, 11.0, 20.0]);
    fs::write(folder.path().join("sparse/0/points3D.txt"), "# none\n").expect("writable");
    let scene = open(folder.path());
    assert!(!scene.has_cloud(frame));
    has(&run_in(folder.path(), "doctor .").out, "no frame has a cloud (points3D has no points)");
}

#[test]
fn keypoints_of_other_systems_are_in_the_pixels_of_the_file() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), Form::Binary);
    let scene = open(folder.path());
    let frame = scene.find("b side/2").expect("is there");
    let map = scene.pixel_map(frame).expect("its camera has a distortion");
    let in_file = Point2::new(10.0, 70.0);
    let in_photo = map.to_photo(in_file).expect("is in front of the camera");
    assert!((in_photo - in_file).norm() > 0.5);
    assert!((map.to_file(in_photo) - in_file).norm() < 1e-6);
    assert!(scene.pixel_map(scene.find("a/1").expect("is there")).is_none());
    let matches = folder.path().join("matches");
    fs::create_dir(&matches).expect("writable");
    fs::write(matches.join("b side-2_a-1_matches.txt"), "10 70 5 6\n").expect("writable");
    let source = scene::MatchFolder::open(&matches).expect("a folder of matches");
    let source = source.between(scene.as_ref(), scene.as_ref());
    let found = posescope::foreign::MatchSource::matches(&source, "b side/2", "a/1");
    let Ok(Some(posescope::features::PairMatches::Found(found))) = found else {
        panic!("one pair");
    };
    let (at, other) = (found.query.keypoints[0], found.reference.keypoints[0]);
    assert!((at.pixel() - in_photo).norm() < 1e-4, "{}", at.pixel());
    assert_eq!((other.x, other.y), (5.0, 6.0));
}

#[test]
fn photos_that_are_not_there_are_left_out() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), Form::Text);
    let images = folder.path().join("images");
    fs::remove_file(images.join("b side/2.png")).expect("just written");
    assert_eq!(open(folder.path()).frames(), ["a/1"]);
    fs::remove_dir_all(images).expect("just written");
    let error = error_of(folder.path());
    has(&error, "`images` ~ a/1.png");
}

#[test]
fn what_is_wrong_with_a_text_model_is_named_with_its_line() {
    let write = |folder: &Path| {
        write(folder, Form::Text);
        arg(folder).to_owned()
    };
    damage::expect(
        write,
        r#"
        sparse/0/cameras.txt | text 1 LENS 160 64 9\n7 PINHOLE 96 80 9\n | cameras.txt:1 ~ `LENS`
        sparse/0/cameras.txt | text 1 PINHOLE 160 64 9 9 9\n7 LENS 96 80 9\n | cameras.txt:1 ~ 4 parameters of PINHOLE
        sparse/0/cameras.txt | 7 OPENCV -> 8 OPENCV | images.txt ~ b side/2.png ~ 7 found
        sparse/0/images.txt | 4 0.92 -> 4 2.92 | images.txt:2 ~ length
        sparse/0/images.txt | a/1.png -> ../1.png | images.txt ~ scene's folder
        sparse/0/images.txt | 1.5 2.5 30 -> 1.5 30 | images.txt:5 ~ `x y point`
        sparse/0/images.txt | 2.5 30 -> 2.5 31 | images.txt:5 ~ 31 found
        sparse/0/points3D.txt | 10 0 0 -> 10 0 nan | points3D.txt:2 ~ nan
        "#,
    );
}

#[test]
fn a_binary_model_that_promises_more_than_it_has_is_refused_before_anything_is_made() {
    for file in ["cameras.bin", "images.bin", "points3D.bin"] {
        let folder = TempDir::new().expect("a folder");
        write(folder.path(), Form::Binary);
        let path = folder.path().join("sparse/0").join(file);
        let whole = fs::read(&path).expect("just written");
        let mut promising = whole.clone();
        promising[..8].copy_from_slice(&(u64::MAX / 2).to_le_bytes());
        fs::write(&path, promising).expect("writable");
        let error = error_of(folder.path());
        has(&error, file);
        has(&error, "cut off");
        for length in [0, 4, 20, whole.len() / 2, whole.len() - 1] {
            fs::write(&path, &whole[..length]).expect("writable");
            has(&error_of(folder.path()), file);
        }
    }
}

#[test]
fn a_name_that_would_break_a_line_is_refused_in_one() {
    // After the count, the number, seven of the pose, and the camera.
    let name = 8 + 4 + 7 * 8 + 4;
    let write = |folder: &Path| {
        write(folder, Form::Binary);
        arg(folder).to_owned()
    };
    let words = "the name of an image expected";
    let row = format!("sparse/0/images.bin | at {name} \\n | {words}");
    damage::expect(write, &row);
}

/// What `images.txt` says of the features of an image: pixel and point.
fn features(model: &Path, name: &str) -> Vec<(Point2<f64>, u64)> {
    let text = fs::read_to_string(model.join("images.txt")).expect("readable");
    let mut lines = text.lines().skip_while(|line| !line.ends_with(name));
    let numbers: Vec<f64> = lines
        .nth(1)
        .expect("a line of features")
        .split_whitespace()
        .map(|word| word.parse().expect("a number"))
        .collect();
    let features = numbers.chunks_exact(3).filter(|feature| feature[2] >= 0.0);
    features.map(|f| (Point2::new(f[0] - 0.5, f[1] - 0.5), f[2] as u64)).collect()
}

#[test]
fn the_points_of_the_real_door_are_seen_where_its_features_are() {
    let Some(folder) = data::sample("colmap/lund_door") else {
        return;
    };
    let scene = open(&folder);
    assert_eq!(scene.name(), "colmap/lund_door");
    assert_eq!(scene.frames().len(), 12);
    let frame = scene.find("DSC_0005").expect("is there");
    let camera = scene.intrinsics(frame);
    let cloud = scene.cloud(frame).expect("readable");
    let features = features(&folder.join("sparse/0"), "DSC_0005.JPG");
    assert_eq!(cloud.len(), features.len());
    let k = -0.0336422;
    let mut errors: Vec<f64> = cloud
        .points
        .iter()
        .zip(&features)
        .map(|(point, (seen, _))| {
            // Through the lens of the model again.
            let point: Point3<f64> = point.cast();
            let (x, y) = (point.x / point.z, point.y / point.z);
            let radial = 1.0 + k * (x * x + y * y);
            let f = 2435.38 * radial;
            (Point2::new(f * x + 647.5, f * y + 967.5) - seen).norm()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    println!("{} points, median {median:.3} px", errors.len());
    assert!(median < 0.3, "{median}");
    assert_eq!((camera.cx, camera.cy), (647.5, 967.5));
}

#[test]
fn fb_localises_at_the_real_door() {
    let Some(folder) = data::sample("colmap/lund_door") else {
        return;
    };
    let scene = open(&folder);
    let frame = |name| scene.find(name).expect("is there");
    let (query, reference) = (frame("DSC_0006"), frame("DSC_0005"));
    let problem = Problem::new(
        scene.query(query).expect("readable"),
        scene.reference(reference).expect("readable"),
        5.0,
    )
    .expect("a radius");
    let outcome = localize(&problem, Method::FB, &Params::default());
    let pose = outcome.pose.unwrap_or_else(|failure| panic!("{failure}"));
    let error = PoseError::between(&scene.pose(query).expect("is known"), &pose);
    println!("{error}");
    assert!(error.translation_m < 0.1 && error.rotation_deg < 0.5);
}
