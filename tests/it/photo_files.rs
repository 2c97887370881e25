//! Photo files as they come: turned by EXIF, of 16 bits, with a wrong extension, beside hidden files, or broken.

use std::fs;
use std::path::Path;

use exif::{Field, In, Tag, Value};
use image::{GrayImage, ImageBuffer, Luma};
use tempfile::TempDir;

use crate::binary::{has, run_in};
use crate::damage::{expect_words, open};
use crate::loose_photo::jpeg;
use crate::scene_toml::{ORIGIN, with, write};
use crate::small_sequence::wall;

fn orientation(number: u16) -> Field {
    Field { tag: Tag::Orientation, ifd_num: In::PRIMARY, value: Value::Short(vec![number]) }
}

/// The photos of a scene as JPEG files that are turned by EXIF.
fn turned(folder: &Path, stored: &GrayImage, number: u16, centre: (f64, f64)) {
    write(folder);
    for frame in 0..3 {
        let path = |ending: &str| folder.join(format!("photos/img{frame}.{ending}"));
        fs::remove_file(path("png")).expect("just written");
        jpeg(&path("jpg"), stored, &[orientation(number)]);
    }
    with(folder, "*.png", "*.jpg");
    let toml = folder.join("scene.toml");
    let text = fs::read_to_string(&toml).expect("just written");
    let text = text.replace("cx = 79.5", &format!("cx = {}", centre.0));
    let text = text.replace("cy = 31.5", &format!("cy = {}", centre.1));
    fs::write(toml, text).expect("writable");
}

/// Whether two photos differ no more than a JPEG file makes them.
fn are_alike(a: &GrayImage, b: &GrayImage) -> bool {
    let apart = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b)));
    a.dimensions() == b.dimensions() && apart.sum::<u64>() < 8 * a.as_raw().len() as u64
}

#[test]
fn the_camera_says_whether_photos_are_turned_as_exif_says() {
    let folder = TempDir::new().expect("a folder");
    let upright = wall(64, 160);
    let stored = image::imageops::rotate270(&upright);
    assert_eq!(stored.dimensions(), (160, 64));
    let photo = |number: u16, centre: (f64, f64), stored: &GrayImage| {
        let _ = fs::remove_dir_all(folder.path().join("photos"));
        turned(folder.path(), stored, number, centre);
        let scene = open(folder.path());
        let said = run_in(folder.path(), "doctor .").err;
        let camera = scene.intrinsics(0);
        let photo = scene.photo(0).expect("readable").gray;
        assert_eq!(photo.dimensions(), (camera.width, camera.height));
        (photo, said.contains("EXIF orientation is ignored"))
    };
    // Calibrated on turned photos, and on stored ones.
    let (found, is_warned) = photo(6, (31.5, 79.5), &stored);
    assert!(are_alike(&found, &upright) && !is_warned);
    let (found, is_warned) = photo(6, (79.5, 31.5), &stored);
    assert!(are_alike(&found, &stored) && !is_warned);
    let (found, is_warned) = photo(1, (79.5, 31.5), &stored);
    assert!(are_alike(&found, &stored) && !is_warned);
    // Both fit.
    let square = wall(100, 100);
    for number in [3, 6] {
        let (found, is_warned) = photo(number, (49.5, 49.5), &square);
        assert!(are_alike(&found, &square) && is_warned, "{number}");
    }
    let (_, is_warned) = photo(1, (49.5, 49.5), &square);
    assert!(!is_warned);
}

#[test]
fn photos_of_16_bits_use_all_grey_values() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let eight = open(folder.path()).photo(0).expect("readable").gray;
    for (low, high) in [(0.0, 4095.0), (29_000.0, 30_500.0), (0.0, 65_535.0)] {
        for frame in 0..3 {
            let path = folder.path().join(format!("photos/img{frame}.png"));
            let value = |x, y| low + f64::from(eight.get_pixel(x, y).0[0]) / 255.0 * (high - low);
            let image: ImageBuffer<Luma<u16>, Vec<u16>> =
                ImageBuffer::from_fn(160, 64, |x, y| Luma([value(x, y).round() as u16]));
            image.save(path).expect("writable");
        }
        let photo = open(folder.path()).photo(0).expect("readable").gray;
        let spread = |image: &GrayImage| {
            let values = || image.as_raw().iter().copied();
            (values().min().unwrap_or(0), values().max().unwrap_or(0))
        };
        if low == 0.0 {
            let apart = photo.as_raw().iter().zip(eight.as_raw()).map(|(a, b)| a.abs_diff(*b));
            assert!(apart.max() <= Some(1), "{high}");
        } else {
            assert_eq!(spread(&photo), (0, 255));
        }
        let is_said = run_in(folder.path(), "doctor .").err.contains("photos of 16 bits");
        assert_eq!(is_said, high < 65_535.0);
    }
}

#[test]
fn the_content_of_a_photo_decides_its_format() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let path =
        |frame: usize, ending: &str| folder.path().join(format!("photos/img{frame}.{ending}"));
    for frame in 0..3 {
        fs::rename(path(frame, "png"), path(frame, "jpg")).expect("just written");
    }
    with(folder.path(), "*.png", "*.jpg");
    let scene = open(folder.path());
    assert_eq!(scene.photo(2).expect("readable").gray, wall(160, 64));
    for (content, words) in [
        (b"\0\0\0\x24ftypheic\0\0\0\0mif1heic".as_slice(), "HEIC found ~ heif-convert"),
        (b"\0\0\0\x20ftypavif\0\0\0\0", "AVIF found"),
        (b"no photo", "other content found"),
    ] {
        fs::write(path(1, "jpg"), content).expect("writable");
        // It costs itself alone.
        let scene = open(folder.path());
        scene.photo(0).expect("readable");
        let error = scene.photo(1).expect_err("no photo").to_string();
        expect_words(
            &error,
            &format!("img1.jpg: a photo in PNG, JPEG, TIFF or WebP format expected ~ {words}"),
        );
    }
    // Without loss all formats give the same photo, and a cut one costs itself alone.
    for ending in ["tif", "webp", "png"] {
        let kept = folder.path().join(format!("kept.{ending}"));
        wall(160, 64).save(&kept).expect("writable");
        let bytes = fs::read(kept).expect("just written");
        fs::write(path(1, "jpg"), &bytes).expect("writable");
        assert_eq!(open(folder.path()).photo(1).expect("readable").gray, wall(160, 64), "{ending}");
        fs::write(path(1, "jpg"), &bytes[..bytes.len() / 2]).expect("writable");
        let error = open(folder.path()).photo(1).expect_err("it is cut").to_string();
        expect_words(&error, "img1.jpg");
    }
    let float = image::Rgb32FImage::from_pixel(160, 64, image::Rgb([0.5; 3]));
    let kept = folder.path().join("kept.tif");
    image::DynamicImage::ImageRgb32F(float).save(&kept).expect("writable");
    fs::copy(kept, path(1, "jpg")).expect("writable");
    let error = open(folder.path()).photo(1).expect_err("not 8 or 16 bits").to_string();
    expect_words(&error, "img1.jpg ~ 8 or 16 bits expected ~ floating-point");
}

#[test]
fn hidden_files_are_no_photos() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    for name in ["._img0.png", ".hidden.png", ".DS_Store"] {
        fs::write(folder.path().join("photos").join(name), [0, 5, 22, 7]).expect("writable");
    }
    assert_eq!(open(folder.path()).frames(), ["img0", "img1", "img2"]);
}

#[test]
fn one_broken_photo_costs_itself_alone() {
    for at in 0..3 {
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        // All photos are alike, so the camera hardly moves.
        let poses = (0..3).map(|frame| {
            let [x, y, z] = ORIGIN;
            format!("1 0 0 {x} 0 1 0 {y} 0 0 1 {}\n", z + 0.01 * f64::from(frame))
        });
        fs::write(folder.path().join("poses.txt"), poses.collect::<String>()).expect("writable");
        let path = folder.path().join(format!("photos/img{at}.png"));
        run_in(folder.path(), "doctor .").ok();
        wall(80, 32).save(&path).expect("writable");
        let said = run_in(folder.path(), "doctor .").ok();
        has(&said.out, "odd ~ 160x64 pixels expected by its camera, 80x32 found ~ agreement");
        fs::write(&path, "broken").expect("writable");
        let said = run_in(folder.path(), "doctor .").ok();
        has(&said.out, "odd ~ other content found");
    }
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    for at in 0..3 {
        fs::write(folder.path().join(format!("photos/img{at}.png")), "broken").expect("writable");
    }
    run_in(folder.path(), "doctor .").fails_with(3, "other content found");
}
