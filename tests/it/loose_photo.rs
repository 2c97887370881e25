//! Photos of no scene, localised in one.

use std::fs;
use std::path::{Path, PathBuf};

use exif::experimental::Writer;
use exif::{Field, In, Tag, Value};
use image::{DynamicImage, GrayImage};
use posescope::scene::{self, LoosePhotos, Scene};
use serde_json::Value as Json;
use tempfile::TempDir;

use crate::binary::posescope;
use crate::damage;
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};

const CAMERA: &str = "100,100,80,32";

fn photo(folder: &Path) -> PathBuf {
    let path = folder.join("IMG_1.png");
    wall(WIDTH, HEIGHT).save(&path).expect("writable");
    path
}

/// Runs, and hands out the results, or what was said and the exit code.
fn run(scene: &Path, words: &[&str]) -> Result<Vec<Json>, (String, i32)> {
    let output = posescope()
        .arg("run")
        .arg(scene)
        .args(words)
        .args(["--json", "-", "-q"])
        .output()
        .expect("the binary starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    match output.status.code() {
        Some(0) => Ok(String::from_utf8_lossy(&output.stdout)
            .lines()
            .map(|line| serde_json::from_str(line).expect("one object per line"))
            .collect()),
        code => Err((said, code.expect("an exit code"))),
    }
}

/// The exit code and all of the words in one line.
#[track_caller]
fn refused(scene: &Path, words: &[&str], code: i32, parts: &[&str]) {
    let (said, found) = run(scene, words).expect_err("it is refused");
    assert_eq!(found, code, "{said}");
    for part in parts {
        assert!(said.contains(part), "`{part}` is missing in: {said}");
    }
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

#[test]
fn a_photo_of_its_own_has_the_pose_of_the_frame_that_it_is_and_no_error() {
    let folder = TempDir::new().expect("a folder");
    let street = scene::open("street:overcast", None).expect("is built in");
    let frame = street.find("70").expect("is there");
    let path = folder.path().join("000070.png");
    let color = street.photo(frame).expect("is made").color;
    color.expect("in colour").save(&path).expect("writable");
    let camera = street.intrinsics(frame);
    let numbers = format!("{},{},{},{}", camera.fx, camera.fy, camera.cx, camera.cy);
    let line = format!(
        "1 PINHOLE {} {} {} {} {} {}",
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx + 0.5,
        camera.cy + 0.5
    );
    let cameras = folder.path().join("cameras.txt");
    let other = "2 SIMPLE_PINHOLE 64 48 50 32 24";
    fs::write(&cameras, format!("# cameras\n{other}\n{line}\n")).expect("writable");
    let scene = Path::new("street");
    let against = ["--reference", "62", "--method", "fb"];
    let query = |words: &[&str]| {
        let results = run(scene, &[words, &against[..]].concat());
        results.expect("it runs").remove(0)
    };
    let frame = query(&["--query", "70"]);
    for camera in [numbers.as_str(), &line, text(&cameras)] {
        let loose = query(&["--query", text(&path), "--camera", camera]);
        // Random choices are seeded by the name.
        assert_eq!(loose["query_scene"], "photo");
        assert_eq!(loose["pose"], frame["pose"], "{camera}");
        assert_eq!(loose["counts"], frame["counts"]);
        assert!(loose["error"].is_null() && !frame["error"].is_null());
    }
}

#[test]
fn without_a_position_the_reference_that_looks_most_alike_is_taken() {
    let sequence = SmallSequence::write();
    let path = photo(sequence.path());
    let words = ["--query", text(&path), "--camera", CAMERA, "--method", "mi"];
    let results = run(&sequence.folder(), &words).expect("it runs");
    assert_eq!(results.len(), 1);
    assert_eq!(results[0]["references"].as_array().map(Vec::len), Some(1));
    assert!(!results[0]["pose"].is_null());
    let random = [&words[..], &["--reference", "random:1"]].concat();
    refused(
        &sequence.folder(),
        &random,
        2,
        &["IMG_1", "--gps", "retrieve:K"],
    );
}

#[test]
fn what_is_no_photo_or_no_camera_of_it_is_told() {
    let folder = TempDir::new().expect("a folder");
    let path = photo(folder.path());
    let (broken, gone) = (
        folder.path().join("broken.png"),
        folder.path().join("gone.png"),
    );
    fs::write(&broken, "no image").expect("writable");
    for (paths, camera, words) in [
        (
            vec![&path],
            None,
            &["IMG_1.png", "EXIF", "--camera fx,fy,cx,cy"][..],
        ),
        (
            vec![&path],
            Some("900,900,640,480"),
            &["IMG_1.png", "160x64", "640,480"],
        ),
        (
            vec![&path],
            Some("1 SIMPLE_PINHOLE 320 128 100 160 64"),
            &["IMG_1.png", "320x128", "160x64"],
        ),
        (
            vec![&path, &path],
            Some(CAMERA),
            &["IMG_1.png", "a name of its own"],
        ),
        (vec![&gone], Some(CAMERA), &["gone.png"]),
        (vec![&broken], Some(CAMERA), &["broken.png"]),
    ] {
        let photos = LoosePhotos {
            paths: paths.into_iter().cloned().collect(),
            camera: camera.map(|camera| camera.parse().expect("a camera")),
        };
        let error = photos.open().err().expect("it is refused").to_string();
        damage::expect_words(&error, words);
    }
}

#[test]
fn photos_without_a_camera_and_words_that_are_none_have_their_exit_codes() {
    let sequence = SmallSequence::write();
    let path = photo(sequence.path());
    let (scene, query) = (sequence.folder(), text(&path));
    let against = ["--reference", "4", "--method", "mi", "--query", query];
    for (words, code, part) in [
        (&[][..], 3, "EXIF"),
        (&["--camera", "100,100"], 2, "4 numbers expected, 2 found"),
        (&["--query", "5"], 2, "some queries are frames"),
    ] {
        refused(&scene, &[&against[..], words].concat(), code, &[part]);
    }
}

/// A JPEG whose EXIF says these.
pub fn jpeg(path: &Path, image: &GrayImage, fields: &[Field]) {
    let mut tiff = std::io::Cursor::new(Vec::new());
    let mut writer = Writer::new();
    for field in fields {
        writer.push_field(field);
    }
    writer.write(&mut tiff, false).expect("in memory");
    let tiff = tiff.into_inner();
    let mut plain = std::io::Cursor::new(Vec::new());
    DynamicImage::ImageLuma8(image.clone())
        .write_to(&mut plain, image::ImageFormat::Jpeg)
        .expect("in memory");
    let plain = plain.into_inner();
    let length = u16::try_from(tiff.len() + 8).expect("short");
    let mut bytes = plain[..2].to_vec();
    bytes.extend([0xff, 0xe1]);
    bytes.extend(length.to_be_bytes());
    bytes.extend(b"Exif\0\0");
    bytes.extend(&tiff);
    bytes.extend(&plain[2..]);
    fs::write(path, bytes).expect("writable");
}

fn field(tag: Tag, value: Value) -> Field {
    Field {
        tag,
        ifd_num: In::PRIMARY,
        value,
    }
}

/// What EXIF says of a lens, on 35 mm film.
pub fn focal_length(millimetres: u16) -> Vec<Field> {
    vec![field(
        Tag::FocalLengthIn35mmFilm,
        Value::Short(vec![millimetres]),
    )]
}

fn rational(number: u32, through: u32) -> Value {
    let value = exif::Rational {
        num: number,
        denom: through,
    };
    Value::Rational(vec![value])
}

fn opened(path: &Path) -> std::sync::Arc<dyn Scene> {
    let photos = LoosePhotos {
        paths: vec![path.to_owned()],
        camera: None,
    };
    photos.open().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn exif_tells_the_focal_length_and_which_side_is_up() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("a.jpg");
    let image = wall(WIDTH, HEIGHT);
    let diagonal = f64::from(WIDTH).hypot(f64::from(HEIGHT));
    let film = field(Tag::FocalLengthIn35mmFilm, Value::Short(vec![28]));
    jpeg(&path, &image, std::slice::from_ref(&film));
    let camera = opened(&path).intrinsics(0);
    assert!(
        (camera.fx - 28.0 * diagonal / 43.2666).abs() < 0.01,
        "{camera:?}"
    );
    assert_eq!((camera.cx, camera.cy), (79.5, 31.5));
    // 5 mm on a sensor of 32 px/mm, of a photo that was twice as large.
    let sensor = [
        film.clone(),
        field(Tag::FocalLength, rational(50, 10)),
        field(Tag::FocalPlaneXResolution, rational(320, 1)),
        field(Tag::FocalPlaneResolutionUnit, Value::Short(vec![3])),
        field(Tag::PixelXDimension, Value::Long(vec![2 * WIDTH])),
    ];
    jpeg(&path, &image, &sensor);
    let camera = opened(&path).intrinsics(0);
    assert!((camera.fx - 5.0 * 32.0 / 2.0).abs() < 1e-9, "{camera:?}");
    // Taken upright: the first row is the right side.
    jpeg(
        &path,
        &image,
        &[film, field(Tag::Orientation, Value::Short(vec![6]))],
    );
    let scene = opened(&path);
    let camera = scene.intrinsics(0);
    assert_eq!((camera.width, camera.height), (HEIGHT, WIDTH));
    let upright = scene.photo(0).expect("readable").gray;
    let stored = image::open(&path).expect("readable").into_luma8();
    assert_eq!(upright.dimensions(), (HEIGHT, WIDTH));
    assert_eq!(upright.get_pixel(HEIGHT - 1, 0), stored.get_pixel(0, 0));
    assert_eq!(
        upright.get_pixel(0, WIDTH - 1),
        stored.get_pixel(WIDTH - 1, HEIGHT - 1)
    );
}
