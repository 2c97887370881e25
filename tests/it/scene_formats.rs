//! What every scene format must keep. It walks over the registry: a new entry needs a sample here.

use std::any::Any;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use posescope::scene::{self, Scene, SceneError};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use tempfile::TempDir;

use crate::small_sequence::SmallSequence;
use crate::{colmap, kitti_raw, rgbd, robotcar, scene_toml};

/// A small scene of a format on disk, and its argument.
struct Sample {
    root: PathBuf,
    argument: String,
    /// Removes the folder when it is dropped.
    _folder: Box<dyn Any>,
}

fn sample(format: &str) -> Sample {
    let folder = TempDir::new().expect("a folder");
    let root = folder.path().join("data");
    fs::create_dir_all(&root).expect("writable");
    let written = root.clone();
    let place = match format {
        "street" => PathBuf::from("street"),
        "kitti" => {
            let sequence = SmallSequence::write();
            return Sample {
                root: sequence.path().to_owned(),
                argument: text(&sequence.folder()),
                _folder: Box::new(sequence),
            };
        }
        "tum" => {
            rgbd::write_tum(&root);
            root
        }
        "7scenes" => {
            rgbd::write_seven_scenes(&root);
            root
        }
        "colmap" => {
            colmap::write(&root, colmap::Form::Binary);
            root
        }
        "toml" => {
            scene_toml::write(&root);
            root
        }
        "kitti-raw" => kitti_raw::write(&root),
        "robotcar" => {
            let traversal = robotcar::write_part(&root, 40..46);
            return Sample {
                root: written,
                argument: format!("{}:all", text(&traversal)),
                _folder: Box::new(folder),
            };
        }
        other => panic!("a small scene of the format {other} is wanted here"),
    };
    Sample {
        root: written,
        argument: text(&place),
        _folder: Box::new(folder),
    }
}

fn text(path: &Path) -> String {
    path.to_str().expect("a plain path").to_owned()
}

fn samples() -> impl Iterator<Item = (&'static str, Sample)> {
    let entries = scene::ALL.iter();
    entries.map(|entry| (entry.name, sample(entry.name)))
}

fn open(argument: &str) -> Box<dyn Scene> {
    scene::open(argument, None).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_format_is_recognised_by_itself_alone() {
    for (name, sample) in samples() {
        for entry in scene::ALL {
            let is_recognized = (entry.recognizes)(&sample.argument);
            assert_eq!(
                is_recognized,
                entry.name == name,
                "{} by {}",
                name,
                entry.name
            );
        }
        assert!(
            !scene::ALL
                .iter()
                .any(|entry| (entry.recognizes)(&format!("{name}-not-there")))
        );
    }
    let empty = TempDir::new().expect("a folder");
    let argument = empty.path().to_str().expect("a plain path");
    assert!(!scene::ALL.iter().any(|entry| (entry.recognizes)(argument)));
}

#[test]
fn every_format_yields_frames_that_fit_together() {
    for (name, sample) in samples() {
        let scene = open(&sample.argument);
        assert!(
            !scene.name().contains(&*sample.root.to_string_lossy()),
            "{name}"
        );
        let frames = scene.frames();
        assert!(frames.len() > 1, "{name}");
        let unique: BTreeSet<&String> = frames.iter().collect();
        assert_eq!(unique.len(), frames.len(), "{name}");
        // Recordings are called by them.
        assert!(
            frames.iter().all(|frame| !frame.contains(['/', '\\'])),
            "{name}"
        );
        let mut references = 0;
        for frame in (0..frames.len()).take(3) {
            assert_eq!(scene.find(&frames[frame]).expect("is there"), frame);
            let camera = scene.intrinsics(frame);
            let query = scene.query(frame).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(query.photo.dimensions(), (camera.width, camera.height));
            assert!(camera.fx > 0.0 && camera.fy > 0.0, "{name}");
            if scene.pose(frame).is_some() && scene.has_cloud(frame) {
                let tuple = scene
                    .reference(frame)
                    .unwrap_or_else(|error| panic!("{error}"));
                let in_view = |point: &&nalgebra::Point3<f32>| {
                    let pixel = camera.project(&point.cast());
                    pixel.is_some_and(|pixel| camera.contains(&pixel))
                };
                assert!(
                    tuple.cloud.points.iter().any(|point| in_view(&point)),
                    "{name}"
                );
                references += 1;
            } else {
                assert!(scene.reference(frame).is_err(), "{name}");
            }
        }
        assert!(references > 0, "{name}");
    }
}

#[test]
fn every_scene_is_the_same_when_it_is_opened_again() {
    for (name, sample) in samples() {
        let [a, b] = [0, 1].map(|_| open(&sample.argument));
        assert_eq!(a.name(), b.name());
        assert_eq!(a.frames(), b.frames());
        assert_eq!(a.fingerprint(), b.fingerprint(), "{name}");
        assert_eq!(a.pose(0), b.pose(0));
        let [a, b] = [a, b].map(|scene| scene.cloud(0).map(|cloud| cloud.points).ok());
        assert_eq!(a, b, "{name}");
    }
}

/// All files below a folder.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).expect("readable");
    for entry in entries {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
    found.sort();
}

/// A file as it may arrive: cut off, with bytes of another, doubled, or not there.
fn damaged(whole: &[u8], random: &mut Pcg64Mcg) -> Option<Vec<u8>> {
    let mut bytes = whole.to_vec();
    match random.random_range(0..6) {
        0 => return None,
        1 => bytes.truncate(random.random_range(0..=whole.len())),
        2 => bytes.extend_from_slice(whole),
        _ => {
            for _ in 0..random.random_range(1..8) {
                if bytes.is_empty() {
                    break;
                }
                let at = random.random_range(0..bytes.len());
                bytes[at] = match random.random_range(0..4) {
                    0 => 0xff,
                    1 => 0,
                    2 => b"0123456789-. \n#/e"[random.random_range(0..17)],
                    _ => random.random(),
                };
            }
        }
    }
    Some(bytes)
}

/// What is said of the frames of a scene that opens; a frame that has no cloud is no reference.
fn errors(argument: &str, format: &str) -> Result<Vec<SceneError>, SceneError> {
    let scene = scene::open(argument, Some(format))?;
    let frames = 0..scene.frames().len();
    let of_frame = |frame| [scene.query(frame).err(), scene.reference(frame).err()];
    Ok(frames.flat_map(of_frame).flatten().collect())
}

#[test]
fn no_damage_to_a_file_makes_a_reader_panic() {
    for (name, sample) in samples().filter(|(name, _)| *name != "street") {
        let mut all = Vec::new();
        files(&sample.root, &mut all);
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let sound = errors(&sample.argument, name);
        let sound = sound.unwrap_or_else(|error| panic!("{error}")).len();
        let mut refused = 0;
        for _ in 0..100 {
            let path = &all[random.random_range(0..all.len())];
            let whole = fs::read(path).expect("readable");
            match damaged(&whole, &mut random) {
                Some(bytes) => fs::write(path, bytes).expect("writable"),
                None => fs::remove_file(path).expect("is there"),
            }
            let found = errors(&sample.argument, name);
            let is_sound = found.as_ref().is_ok_and(|found| found.len() <= sound);
            refused += usize::from(!is_sound);
            let errors = found.unwrap_or_else(|error| vec![error]);
            for error in errors {
                assert_eq!(error.to_string().lines().count(), 1, "{name}: {error}");
            }
            fs::write(path, whole).expect("writable");
        }
        println!("{name}: {refused} of 100 refused");
        assert!(refused > 10, "{name}: {refused}");
    }
}
