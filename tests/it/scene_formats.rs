//! What every scene format must keep. It walks over the registry: a new entry needs a sample here.

use std::any::Any;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use posescope::scene::{self, Scene};
use tempfile::TempDir;

use crate::small_sequence::SmallSequence;
use crate::{colmap, frame_list, kitti_raw, rgbd, robotcar, scene_toml, transforms};

/// A small scene of a format on disk, and its argument.
pub struct Sample {
    pub root: PathBuf,
    pub argument: String,
    /// Removes the folder when it is dropped.
    _folder: Box<dyn Any>,
}

impl Sample {
    /// A scene that lies in a folder which somebody else removes.
    pub fn of(folder: &Path) -> Self {
        Self { root: folder.to_owned(), argument: text(folder), _folder: Box::new(()) }
    }
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
        "transforms" => {
            transforms::write(&root);
            root
        }
        "frames" => {
            frame_list::write(&root);
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
    Sample { root: written, argument: text(&place), _folder: Box::new(folder) }
}

fn text(path: &Path) -> String {
    path.to_str().expect("a plain path").to_owned()
}

pub fn samples() -> impl Iterator<Item = (&'static str, Sample)> {
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
            assert_eq!(is_recognized, entry.name == name, "{} by {}", name, entry.name);
        }
        assert!(!scene::ALL.iter().any(|entry| (entry.recognizes)(&format!("{name}-not-there"))));
    }
    let empty = TempDir::new().expect("a folder");
    let argument = empty.path().to_str().expect("a plain path");
    assert!(!scene::ALL.iter().any(|entry| (entry.recognizes)(argument)));
}

#[test]
fn every_format_yields_frames_that_fit_together() {
    for (name, sample) in samples() {
        let scene = open(&sample.argument);
        assert!(!scene.name().contains(&*sample.root.to_string_lossy()), "{name}");
        let frames = scene.frames();
        assert!(frames.len() > 1, "{name}");
        let unique: BTreeSet<&String> = frames.iter().collect();
        assert_eq!(unique.len(), frames.len(), "{name}");
        let is_plain = |frame: &String| !frame.contains('\\') && !frame.starts_with('/');
        assert!(frames.iter().all(is_plain), "{name}");
        let mut references = 0;
        for frame in (0..frames.len()).take(3) {
            assert_eq!(scene.find(&frames[frame]).expect("is there"), frame);
            let camera = scene.intrinsics(frame);
            let query = scene.query(frame).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(query.photo().dimensions(), (camera.width, camera.height));
            assert!(camera.fx > 0.0 && camera.fy > 0.0, "{name}");
            if scene.pose(frame).is_some() && scene.has_cloud(frame) {
                let tuple = scene.reference(frame).unwrap_or_else(|error| panic!("{error}"));
                let in_view = |point: &&nalgebra::Point3<f32>| {
                    let pixel = camera.project(&point.cast());
                    pixel.is_some_and(|pixel| camera.contains(&pixel))
                };
                assert!(tuple.cloud().points.iter().any(|point| in_view(&point)), "{name}");
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
