//! Photos of no scene, localised in one.

use std::path::{Path, PathBuf};

use exif::experimental::Writer;
use exif::{Field, In, Tag, Value};
use image::{DynamicImage, GrayImage, Luma, imageops};
use posescope::camera::Intrinsics;
use posescope::diagnosis::{Code, Confidence};
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::scene::{LoosePhotos, Scene};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::Value as Json;
use tempfile::TempDir;

use crate::binary::{has, objects, refused, run_in, write};
use crate::damage;
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};

const CAMERA: &str = "100,100,80,32";

fn photo(folder: &Path) -> PathBuf {
    let path = folder.join("IMG_1.png");
    wall(WIDTH, HEIGHT).save(&path).expect("writable");
    path
}

#[test]
fn a_photo_of_its_own_has_the_pose_of_the_frame_that_it_is_and_no_error() {
    let folder = TempDir::new().expect("a folder");
    let street = damage::open("street:overcast");
    let frame = street.find("70").expect("is there");
    let color = street.photo(frame).expect("is made").color;
    let path = folder.path().join("000070.png");
    color.expect("in colour").save(path).expect("writable");
    let Intrinsics { fx, fy, cx, cy, width, height } = street.intrinsics(frame);
    let line = format!("1 PINHOLE {width} {height} {fx} {fy} {} {}", cx + 0.5, cy + 0.5);
    let cameras = format!("# cameras\n2 SIMPLE_PINHOLE 64 48 50 32 24\n{line}\n");
    write(folder.path().join("cameras.txt"), cameras);
    let query = |words: &str| -> Json {
        let line = format!("run street --reference 62 --method fb --json - -q --query {words}");
        objects(&run_in(folder.path(), &line).ok().out).remove(0)
    };
    let frame = query("70");
    for camera in [&format!("{fx},{fy},{cx},{cy}"), &line, "cameras.txt"] {
        let loose = query(&format!("000070.png --camera '{camera}'"));
        // Random choices are seeded by the name.
        assert_eq!(loose["query_scene"], "photo");
        assert_eq!(loose["pose"], frame["pose"], "{camera}");
        assert_eq!(loose["counts"], frame["counts"]);
        assert!(loose["error"].is_null() && !frame["error"].is_null());
    }
    // Against itself, any photo is localised.
    let itself = "run street --reference 70 --query 000070.png --method fb";
    let line = format!("{itself} --camera {fx},{fy},{cx},{cy}");
    let warned = run_in(folder.path(), &line).ok().err;
    has(&warned, "000070 is the same photo as the reference 000070");
    let itself = run_in(folder.path(), "run street --reference 70 --query 70 --method fb").ok().err;
    has(&itself, "000070 is its own reference: the result says nothing");
    let other = run_in(folder.path(), "run street --reference 62 --query 70 --method fb").ok().err;
    assert!(!other.contains("its own reference"), "{other}");
}

#[test]
fn a_photo_of_another_place_is_said_to_be_one_and_a_photo_of_this_place_is_not() {
    let folder = TempDir::new().expect("a folder");
    let street = damage::open("street:overcast");
    let frame = street.find("70").expect("is there");
    let color = street.photo(frame).expect("is made").color.expect("in colour");
    color.save(folder.path().join("here.png")).expect("writable");
    imageops::flip_horizontal(&color).save(folder.path().join("mirrored.png")).expect("writable");
    let mut rng = Pcg64::seed_from_u64(0);
    let noise = GrayImage::from_fn(color.width(), color.height(), |_, _| Luma([rng.random()]));
    noise.save(folder.path().join("noise.png")).expect("writable");
    let Intrinsics { fx, fy, cx, cy, .. } = street.intrinsics(frame);
    let said_by = |photo: &str, from: &str| -> Vec<(Method, Vec<Code>, bool)> {
        let line = format!(
            "run {from} --radius 10 --json - -q --query {photo}.png --camera {fx},{fy},{cx},{cy}"
        );
        let results = run_in(folder.path(), &line).results();
        let of = |result: &QueryResult| result.diagnosis.iter().map(|one| one.code).collect();
        let is_trusted = |result: &QueryResult| {
            result.confidence.as_ref().is_some_and(|one| one.word == Confidence::Trusted)
        };
        results.iter().map(|result| (result.method, of(result), is_trusted(result))).collect()
    };
    let said = |photo: &str| said_by(photo, "street --reference 62 --method fb,fb2,mi,robust");
    let here = said("here");
    assert!(here.iter().all(|(_, codes, _)| codes.is_empty()), "{here:?}");
    // MI alone is less sure.
    let trusted = here.iter().filter(|(.., is_trusted)| *is_trusted);
    assert!(trusted.count() >= 3, "{here:?}");
    for (photo, named) in [("mirrored", ["fb2", "robust"]), ("noise", ["fb2", "robust"])] {
        for (method, codes, is_trusted) in said(photo) {
            let is_named = codes.contains(&Code::N1);
            assert!(is_named || !named.contains(&method.name()), "{photo}, {method}: {codes:?}");
            // A mirrored street looks much like one, so not all is named, but nothing is trusted.
            assert!(!is_trusted, "{photo}, {method}: {codes:?}");
        }
    }
    // In other light less agrees, and still it is this place. FB and fb2 have too few matches to tell.
    let night = damage::open("street:night");
    let color = night.photo(frame).expect("is made").color.expect("in colour");
    color.save(folder.path().join("night.png")).expect("writable");
    let searched = ["mi", "robust"].map(Method::named);
    for (method, codes, _) in said("night").into_iter().filter(|said| searched.contains(&said.0)) {
        assert!(!codes.contains(&Code::N1), "{method}: {codes:?}");
    }
    // By chance, it matches most where the sky is as noisy, and the sky has no depth.
    for reference in ["50", "300", "611"] {
        let from = format!("street:snow --reference {reference} --method fb,fb2");
        for (method, codes, _) in said_by("noise", &from) {
            assert_eq!(codes.first(), Some(&Code::N1), "{reference}, {method}: {codes:?}");
        }
    }
}

#[test]
fn without_a_position_the_reference_that_looks_most_alike_is_taken() {
    let sequence = SmallSequence::write();
    photo(sequence.path());
    let line = "run sequences/42 --query IMG_1.png --method mi --json - -q";
    let results: Vec<Json> = objects(&sequence.run(&format!("{line} --camera {CAMERA}")).ok().out);
    assert_eq!(results.len(), 1);
    assert_eq!(results[0]["references"].as_array().map(Vec::len), Some(1));
    let position = results[0]["pose"]["position_m"].as_array().expect("a pose");
    let position: Vec<String> =
        position.iter().map(|axis| format!("{:.3}", axis.as_f64().expect("a number"))).collect();
    let line_of_words = line.replace(" --json - -q", "");
    let shown = sequence.run(&format!("{line_of_words} --camera {CAMERA}")).ok().out;
    has(
        &shown,
        &format!("IMG_1 mi: world_from_camera: position {} m, quaternion", position.join(" ")),
    );
    let table = format!(
        "
        2 | {line} --camera {CAMERA} --reference random:1 | IMG_1 ~ --gps ~ retrieve:K
        3 | {line} --reference 4 | EXIF
        2 | {line} --reference 4 --query 5 | some queries are frames
        "
    );
    refused(sequence.path(), &table);
    let said = sequence.run(&format!("{line} --camera 100,100"));
    said.fails_with(2, "2 numbers found");
}

#[test]
fn what_is_no_photo_or_no_camera_of_it_is_told() {
    let folder = TempDir::new().expect("a folder");
    let path = photo(folder.path());
    let [broken, gone] = ["broken.png", "gone.png"].map(|name| folder.path().join(name));
    write(&broken, "no image");
    let pinhole = "1 SIMPLE_PINHOLE 320 128 100 160 64";
    for (paths, camera, words) in [
        (vec![&path], None, "IMG_1.png ~ EXIF ~ --camera fx,fy,cx,cy"),
        (vec![&path], Some("900,900,640,480"), "IMG_1.png ~ 160x64 ~ 640,480"),
        (vec![&path], Some(pinhole), "IMG_1.png ~ 320x128 ~ 160x64"),
        (vec![&path, &path], Some(CAMERA), "IMG_1.png ~ photos with different names"),
        (vec![&gone], Some(CAMERA), "gone.png"),
        (vec![&broken], Some(CAMERA), "broken.png"),
    ] {
        let photos = LoosePhotos {
            paths: paths.into_iter().cloned().collect(),
            camera: camera.map(|camera| camera.parse().expect("a camera")),
        };
        let error = photos.open(None).err().expect("it is refused").to_string();
        damage::expect_words(&error, words);
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
    write(path, bytes);
}

fn field(tag: Tag, value: Value) -> Field {
    Field { tag, ifd_num: In::PRIMARY, value }
}

/// What EXIF says of a lens, on 35 mm film.
pub fn focal_length(millimetres: u16) -> Vec<Field> {
    vec![field(Tag::FocalLengthIn35mmFilm, Value::Short(vec![millimetres]))]
}

fn rational(number: u32, through: u32) -> Value {
    let value = exif::Rational { num: number, denom: through };
    Value::Rational(vec![value])
}

fn opened(path: &Path) -> std::sync::Arc<dyn Scene> {
    let photos = LoosePhotos { paths: vec![path.to_owned()], camera: None };
    photos.open(None).unwrap_or_else(|error| panic!("{error}"))
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
    assert!((camera.fx - 28.0 * diagonal / 43.2666).abs() < 0.01);
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
    jpeg(&path, &image, &[film, field(Tag::Orientation, Value::Short(vec![6]))]);
    let scene = opened(&path);
    let camera = scene.intrinsics(0);
    assert_eq!((camera.width, camera.height), (HEIGHT, WIDTH));
    let upright = scene.photo(0).expect("readable").gray;
    let stored = image::open(&path).expect("readable").into_luma8();
    assert_eq!(upright.dimensions(), (HEIGHT, WIDTH));
    assert_eq!(upright.get_pixel(HEIGHT - 1, 0), stored.get_pixel(0, 0));
    assert_eq!(upright.get_pixel(0, WIDTH - 1), stored.get_pixel(WIDTH - 1, HEIGHT - 1));
}
