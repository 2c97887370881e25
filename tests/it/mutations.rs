//! Damaged files of every kind that is read: one clear line each, and no panic, however they are damaged.
//!
//! `POSESCOPE_MUTATIONS=1000000 cargo test --release --test it -- --nocapture mutations::` asks for more
//! than each test does by itself; `mutations::a_table` and such for one of them, and `POSESCOPE_MUTATED=tum` for
//! what is called so alone.

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use posescope::foreign::MatchSource as _;
use posescope::params::Params;
use posescope::run::{FolderError, RunFolder, read_results, read_run};
use posescope::scene::{
    self, IndexOptions, LoosePhotos, MatchFolder, Retriever, Scene, SceneError,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use tempfile::TempDir;

use crate::scene_formats::{Sample, samples};
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};
use crate::{colmap, pair_matches, scene_toml};

/// No damaged file takes as long, wherever it is read: longer is a hang.
const LONGEST: Duration = Duration::from_secs(60);

/// How many times the files of a reader are damaged, unless `POSESCOPE_MUTATIONS` asks for more.
const MUTATIONS: usize = 50;

fn mutations() -> usize {
    let asked = std::env::var("POSESCOPE_MUTATIONS").ok();
    asked.and_then(|count| count.parse().ok()).unwrap_or(MUTATIONS)
}

/// A file as it may arrive: cut off, with bytes or pieces of another, doubled, or not there.
fn damaged(whole: &[u8], random: &mut Pcg64Mcg) -> Option<Vec<u8>> {
    let mut bytes = whole.to_vec();
    match random.random_range(0..9) {
        0 => return None,
        1 => bytes.truncate(random.random_range(0..=whole.len())),
        2 => bytes.extend_from_slice(whole),
        3 if !whole.is_empty() => {
            // A piece of it somewhere else in it.
            let from = random.random_range(0..whole.len());
            let piece = whole[from..whole.len().min(from + 40)].to_vec();
            let at = random.random_range(0..=whole.len());
            bytes.splice(at..at, piece);
        }
        4 if whole.len() >= 8 => {
            // A length or a number that is too large.
            let at = random.random_range(0..=whole.len() - 8);
            let value = [u64::MAX, 1 << 31, 1 << 40, 1 << 63, 0x7ff0_0000_0000_0000]
                [random.random_range(0..5)];
            let width = [2, 4, 8][random.random_range(0..3)];
            bytes[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
        }
        5 => hostile_number(&mut bytes, random),
        _ => {
            for _ in 0..random.random_range(1..8) {
                if bytes.is_empty() {
                    break;
                }
                let at = random.random_range(0..bytes.len());
                bytes[at] = match random.random_range(0..4) {
                    0 => 0xff,
                    1 => 0,
                    2 => b"0123456789-. \n#/e\"[]="[random.random_range(0..21)],
                    _ => random.random(),
                };
            }
        }
    }
    Some(bytes)
}

/// Replaces a number that is written as text, often a count or a size of a header, with one that has no place there.
fn hostile_number(bytes: &mut Vec<u8>, random: &mut Pcg64Mcg) {
    const NUMBERS: [&str; 10] = [
        "0",
        "-1",
        "1e308",
        "1e155",
        "nan",
        "4294967296",
        "9223372036854775808",
        "18446744073709551615",
        "99999999999999999999999",
        "0.0000000000000000000001",
    ];
    let is_digit = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_digit);
    // Headers are at the beginning.
    let end = if random.random() { bytes.len().min(400) } else { bytes.len() };
    let starts: Vec<usize> = (0..end)
        .filter(|&at| is_digit(bytes.get(at)) && (at == 0 || !is_digit(bytes.get(at - 1))))
        .collect();
    if starts.is_empty() {
        return;
    }
    let start = starts[random.random_range(0..starts.len())];
    let length = bytes[start..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let number = NUMBERS[random.random_range(0..NUMBERS.len())];
    bytes.splice(start..start + length, number.bytes());
}

/// With right check sums where a format has some: without, no reader looks at what is damaged.
fn summed(mut bytes: Vec<u8>) -> Vec<u8> {
    const PNG: u32 = 0xedb8_8320;
    const E57: u32 = 0x82f6_3b78;
    if bytes.starts_with(b"ASTM-E57") {
        for page in bytes.chunks_exact_mut(1024) {
            let (content, sum) = page.split_at_mut(1020);
            sum.copy_from_slice(&check_sum(content, E57));
        }
    }
    if bytes.starts_with(b"\x89PNG") {
        let mut at = 8;
        while let Some(&[a, b, c, d]) = bytes.get(at..at + 4) {
            let length = u32::from_be_bytes([a, b, c, d]) as usize;
            let (start, end) = (at + 4, at + 8 + length);
            let Some(sum) = bytes.get(start..end).map(|chunk| check_sum(chunk, PNG)) else { break };
            let Some(place) = bytes.get_mut(end..end + 4) else { break };
            place.copy_from_slice(&sum);
            at = end + 4;
        }
    }
    bytes
}

/// The cyclic check of 32 bits by a polynomial whose bits are reversed.
fn check_sum(bytes: &[u8], polynomial: u32) -> [u8; 4] {
    let sum = bytes.iter().fold(u32::MAX, |sum, &byte| {
        (0..8).fold(sum ^ u32::from(byte), |sum, _| {
            if sum & 1 == 1 { sum >> 1 ^ polynomial } else { sum >> 1 }
        })
    });
    (!sum).to_be_bytes()
}

#[test]
fn check_sums_are_those_of_sound_files() {
    let folder = TempDir::new().expect("a folder");
    scene_toml::write(folder.path());
    scene_toml::write_clouds(folder.path());
    for name in ["map.e57", "photos/img0.png"] {
        let sound = fs::read(folder.path().join(name)).expect("just written");
        assert!(summed(sound.clone()) == sound, "{name}");
    }
}

/// Damages one file after the other, reads, and mends it. `read` says what it was told.
fn mutate<E: Display>(name: &str, files: &[PathBuf], mut read: impl FnMut() -> Result<(), Vec<E>>) {
    if is_left_out(name) {
        return;
    }
    let count = mutations();
    let begun = Instant::now();
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let (mut refused, mut slowest) = (0, Duration::ZERO);
    let whole: Vec<Vec<u8>> = files.iter().map(|path| fs::read(path).expect("readable")).collect();
    for _ in 0..count {
        let which = random.random_range(0..files.len());
        let path = &files[which];
        match damaged(&whole[which], &mut random) {
            Some(bytes) if random.random() => fs::write(path, summed(bytes)).expect("writable"),
            Some(bytes) => fs::write(path, bytes).expect("writable"),
            None => fs::remove_file(path).expect("is there"),
        }
        let since = Instant::now();
        if let Err(errors) = read() {
            refused += 1;
            for error in errors {
                let line = error.to_string();
                assert_eq!(line.lines().count(), 1, "{name}: {line}");
            }
        }
        slowest = slowest.max(since.elapsed());
        assert!(slowest < LONGEST, "{name}: {}", path.display());
        fs::write(path, &whole[which]).expect("writable");
    }
    println!(
        "{name}: {refused} of {count} refused, {:.1} s in all, {:.0} ms at most, {} MB at most so far",
        begun.elapsed().as_secs_f64(),
        slowest.as_secs_f64() * 1e3,
        peak_mb()
    );
    assert!(refused * 20 > count, "{name}: {refused} of {count}");
}

/// The most memory that this process had at a time \[MB\]; 0 where nobody says.
fn peak_mb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) / 1024
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn text(path: &Path) -> String {
    path.to_str().expect("a plain path").to_owned()
}

/// What is said of the frames of a scene, those that have no cloud to begin with left out.
fn read_all(argument: &str, format: &str, sound: usize) -> Result<(), Vec<SceneError>> {
    let scene = scene::open(argument, Some(format)).map_err(|error| vec![error])?;
    let frames = 0..scene.frames().len();
    let of_frame = |frame| [scene.query(frame).err(), scene.reference(frame).err()];
    let errors: Vec<_> = frames.flat_map(of_frame).flatten().collect();
    if errors.len() <= sound { Ok(()) } else { Err(errors) }
}

/// Whether `POSESCOPE_MUTATED` asks for something else than this.
fn is_left_out(name: &str) -> bool {
    std::env::var("POSESCOPE_MUTATED").is_ok_and(|asked| asked != name)
}

fn mutate_scene(name: &str, format: &str, sample: &Sample) {
    let sound = read_all(&sample.argument, format, 0).map_or_else(|errors| errors.len(), |()| 0);
    mutate(name, &files(&sample.root), || read_all(&sample.argument, format, sound));
}

#[test]
fn no_damage_to_a_scene_makes_its_reader_panic() {
    for (name, sample) in samples().filter(|(name, _)| *name != "street") {
        mutate_scene(name, name, &sample);
    }
    let folder = TempDir::new().expect("a folder");
    colmap::write(folder.path(), colmap::Form::Text);
    let model = Sample::of(folder.path());
    mutate_scene("colmap as text", "colmap", &model);
}

#[test]
fn no_damage_to_a_cloud_makes_its_reader_panic() {
    let folder = TempDir::new().expect("a folder");
    scene_toml::write(folder.path());
    for name in scene_toml::write_clouds(folder.path()) {
        scene_toml::with(folder.path(), "map.xyz", &name);
        let path = folder.path().join(&name);
        let argument = text(folder.path());
        let read = || {
            let scene = scene::open(&argument, None).map_err(|error| vec![error])?;
            scene.cloud(0).map(drop).map_err(|error| vec![error])
        };
        assert!(read().is_ok(), "{name}");
        let small = fs::metadata(&path).expect("is there").len() < 1 << 20;
        assert!(small, "{name} makes this slow");
        mutate(&name, std::slice::from_ref(&path), read);
        scene_toml::write(folder.path());
    }
}

#[test]
fn no_damage_to_matches_makes_a_reader_panic() {
    for (form, write) in pair_matches::FORMS {
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        let read = || {
            let found = MatchFolder::open(folder.path())
                .and_then(|source| source.matches("000070", "000062"));
            found.map(drop).map_err(|error| vec![error])
        };
        assert!(read().is_ok(), "{form}");
        mutate(form, &files(folder.path()), read);
    }
}

#[test]
fn no_damage_to_a_run_folder_makes_its_reader_panic() {
    let sequence = SmallSequence::write();
    sequence.run("eval sequences/42 --method fb,mi -q --out run").ok();
    let out = sequence.path().join("run");
    let run = read_run(&out).expect("our own");
    let names = ["run.toml", "results.jsonl", "timings.jsonl"];
    let files = names.map(|name| out.join(name));
    mutate("a run folder", &files, || {
        let read = || -> Result<(), FolderError> {
            read_results(&out, &read_run(&out)?)?;
            posescope::measure::read_rows(&out)?;
            Ok(())
        };
        let whole = read();
        // Going on cuts off what is damaged; both files are mended then.
        let kept = files[1..].iter().map(|path| fs::read(path).ok());
        let kept: Vec<_> = kept.collect();
        let resumed = RunFolder::resume(&out, &run).map(drop);
        for (path, bytes) in files[1..].iter().zip(kept) {
            match bytes {
                Some(bytes) => fs::write(path, bytes).expect("writable"),
                None => fs::write(path, "").expect("writable"),
            }
        }
        whole.and(resumed).map_err(|error| vec![error])
    });
}

#[test]
fn no_damage_to_an_index_makes_its_reader_panic() {
    let sequence = SmallSequence::write();
    let scene = scene::open(&text(&sequence.folder()), None).expect("our own");
    let params = Params::default();
    let path = sequence.path().join("an.posescope-index");
    let options = IndexOptions { words: 16, every: 1, seed: 0 };
    let request = Retriever::request(scene.as_ref(), &options, &Default::default(), &params);
    Retriever::build(scene.as_ref(), &path, &request, &params, |_| {}).expect("enough features");
    let query = scene.query(1).expect("readable");
    let read = || {
        let index = Retriever::open(&path, scene.as_ref(), &params).map_err(|error| vec![error])?;
        index.retrieve(&query, |_| true);
        Ok(())
    };
    assert!(read().is_ok());
    mutate("an index", std::slice::from_ref(&path), read);
}

#[test]
fn no_damage_to_a_table_of_poses_or_positions_makes_its_reader_panic() {
    let sequence = SmallSequence::write();
    let scene: Arc<dyn Scene> =
        scene::open(&text(&sequence.folder()), None).expect("our own").into();
    let at = |name: &str| sequence.path().join(name);
    for (name, content) in [
        ("tum.txt", "0.4 0 0 4 0 0 0 1\n0.5 0 0 5.25 0 0.6 0 0.8\n0.7 1e1 0 7 0 0 0 1\n"),
        (
            "kitti.txt",
            "1 0 0 0 0 1 0 0 0 0 1 4\n1 0 0 0 0 1 0 0 0 0 1 5\n0 0 1 0 0 1 0 0 -1 0 0 7\n",
        ),
        (
            "images.txt",
            "# list\n1 1 0 0 0 0 0 -4 1 image_0/000004.png\n1 2 -1\n2 1 0 0 0 0 0 -5 1 000005.png\n\n",
        ),
        (
            "vloc.txt",
            "000004.png 1 0 0 0 0 0 -4\n000005.png 0.6 0 0.8 0 1 2 -5\n7 1 0 0 0 0 0 -7\n",
        ),
        ("one-line.txt", "1 1 0 0 0 0 0 -4 1 000004.png\n2 1 0 0 0 0 0 -5 1 000005.png\n"),
        (
            "euroc.csv",
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n\
             400000000,0,0,4,1,0,0,0\n500000000,0,0,5.25,0.8,0,0.6,0\n",
        ),
        (
            "kitti-360.txt",
            "4 1 0 0 0 0 1 0 0 0 0 1 4\n5 1 0 0 0 0 1 0 0 0 0 1 5\n7 0 0 1 0 0 1 0 0 -1 0 0 7\n",
        ),
        ("ace.txt", "000004.png 1 0 0 0 0 0 -4 0.5 1.5 61\n000005.png 0.6 0 0.8 0 1 2 -5 0 1 62\n"),
        (
            "ace0.txt",
            "000004.png 1 0 0 0 0 0 -4 525.5 0.9\n000005.png 0.6 0 0.8 0 1 2 -5 525.5 1\n",
        ),
        (
            "kapture.txt",
            "# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz\n0.4, cam0, 1, 0, 0, 0, 0, 0, -4\n\
             0.5, cam0, 0.6, 0, 0.8, 0, 1, 2, -5\n",
        ),
    ] {
        fs::write(at(name), content).expect("writable");
        let read = || scene::read_estimates(&at(name), scene.as_ref()).map(drop);
        assert!(read().is_ok(), "{name}: {:?}", read());
        mutate(name, &[at(name)], || read().map_err(|error| vec![error]));
    }
    for (name, content) in [
        ("local.csv", "name,x,y,z\n000004,0.5,0,4\n5,1e0,0,5\n000007.png,0,-0,7\n"),
        ("gps.csv", "name lat lon alt\n4 48.1 11.5 300\n5 48.2 11.6 301\n7 48.3 11.5 302.5\n"),
    ] {
        fs::write(at(name), content).expect("writable");
        let read = || scene::located(Arc::clone(&scene), scene.as_ref(), &at(name)).map(drop);
        assert!(read().is_ok(), "{name}");
        mutate(name, &[at(name)], || read().map_err(|error| vec![error]));
    }
}

#[test]
fn no_damage_to_a_photo_or_its_camera_makes_their_reader_panic() {
    let folder = TempDir::new().expect("a folder");
    let photo = folder.path().join("a.jpg");
    let focal = crate::loose_photo::focal_length(28);
    crate::loose_photo::jpeg(&photo, &wall(WIDTH, HEIGHT), &focal);
    let cameras = folder.path().join("cameras.txt");
    fs::write(&cameras, "1 OPENCV 160 64 100 100 80 32 0.01 0 0 0\n2 RADIAL 64 48 50 32 24 0 0\n")
        .expect("writable");
    for camera in [None, Some(scene::CameraArgument::File(cameras.clone()))] {
        let read = || {
            let photos = LoosePhotos { paths: vec![photo.clone()], camera: camera.clone() };
            let scene = photos.open(None)?;
            scene.photo(0).map(drop)
        };
        assert!(read().is_ok(), "{:?}", read());
        let (name, file) = match &camera {
            None => ("a photo with EXIF", &photo),
            Some(_) => ("cameras.txt", &cameras),
        };
        mutate(name, std::slice::from_ref(file), || read().map_err(|error| vec![error]));
    }
    for ending in ["png", "tif", "webp"] {
        let path = folder.path().join(format!("a.{ending}"));
        wall(WIDTH, HEIGHT).save(&path).expect("writable");
        let camera = Some(scene::CameraArgument::File(cameras.clone()));
        fs::write(&cameras, "1 PINHOLE 160 64 100 100 80 32\n").expect("writable");
        let photos = LoosePhotos { paths: vec![path.clone()], camera };
        let read = || photos.open(None)?.photo(0).map(drop);
        assert!(read().is_ok(), "{:?}", read());
        mutate(ending, &[path], || read().map_err(|error| vec![error]));
    }
}
