//! Reads what libFuzzer makes up, by the reader that the environment's `TARGET` names.
//!
//! A panic, 10 s or more than [`MOST_MEMORY`] is a finding. Panics of other crates' decoders that the readers catch
//! are none.

#![no_main]

use std::alloc::System;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use cap::Cap;
use libfuzzer_sys::{Corpus, fuzz_target};
use posescope::foreign::MatchSource as _;
use posescope::run::{read_results, read_run};
use posescope::scene::{self, MatchFolder};

/// What a reader may take for an input of at most 64 kB \[bytes\]. Photos may have 67 million pixels.
const MOST_MEMORY: usize = 512 << 20;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, MOST_MEMORY);

/// A scene with one frame.
const DESCRIPTION: &str = "images = \"photos/*.png\"\nposes = \"poses.txt\"\ncloud = \"map.xyz\"\n\
     [camera]\nfx = 10.0\nfy = 10.0\ncx = 7.5\ncy = 3.5\n";

/// What `TARGET` reads.
#[derive(Clone, Copy)]
enum Reader {
    /// A scene in which one file is made up, of which only files that begin so are tried.
    Scene(&'static str, &'static [&'static [u8]]),
    /// A COLMAP model in files of this kind, their lengths before them.
    Model(&'static str),
    /// A folder of matches in which one file is made up.
    Matches(&'static str),
    /// `run.toml` and `results.jsonl`, the first one's length before them.
    Run,
}

struct Target {
    reader: Reader,
    folder: PathBuf,
}

impl Target {
    /// The target of the environment, in a folder of its own with what the made-up file needs beside it.
    fn new() -> Self {
        std::panic::set_hook(Box::new(|panic| {
            if !scene::is_decoding() {
                eprintln!("{panic}");
                std::process::abort();
            }
        }));
        let name = std::env::var("TARGET").expect("TARGET");
        let cloud = |starts| Reader::Scene("map.xyz", starts);
        let reader = match name.as_str() {
            "las" | "laz" => cloud(&[b"LASF"]),
            "ply" => cloud(&[b"ply\n", b"ply\r"]),
            "pcd" => cloud(&[b"# .PCD", b"VERSION "]),
            "e57" => cloud(&[b"ASTM-E57"]),
            "text-cloud" => cloud(&[]),
            "toml" => Reader::Scene("scene.toml", &[]),
            "poses" => Reader::Scene("poses.txt", &[]),
            "photo" => Reader::Scene("photos/a.png", &[]),
            "colmap" => Reader::Model("bin"),
            "colmap-text" => Reader::Model("txt"),
            "hdf5" => Reader::Matches("features.h5"),
            "hdf5-matches" => Reader::Matches("matches.h5"),
            "npz" => Reader::Matches("a_b_matches.npz"),
            "run" => Reader::Run,
            _ => panic!("no target {name}"),
        };
        let folder = std::env::temp_dir().join(format!("fuzz-{name}-{}", std::process::id()));
        let target = Self { reader, folder };
        match reader {
            Reader::Scene(..) => {
                target.write("scene.toml", DESCRIPTION.as_bytes());
                target.write("poses.txt", b"1 0 0 0 0 1 0 0 0 0 1 0\n");
                target.write("map.xyz", b"1 2 3\n");
                target.write_photo("photos/a.png");
            }
            Reader::Model(_) => target.write_photo("images/a.png"),
            Reader::Matches("features.h5") => {
                let mut pair = hdf5_pure::FileBuilder::new();
                let mut first = pair.create_group("a.png");
                let mut second = first.create_group("b.png");
                let matches = second.create_dataset("matches0");
                matches.with_i16_data(&[-1, 1, -1]).with_shape(&[3]);
                first.add_group(second.finish());
                pair.add_group(first.finish());
                target.write("x", b"");
                pair.write(target.folder.join("matches.h5")).expect("writable");
            }
            Reader::Matches("matches.h5") => {
                let mut features = hdf5_pure::FileBuilder::new();
                for name in ["a.png", "b.png"] {
                    let mut group = features.create_group(name);
                    let keypoints = group.create_dataset("keypoints");
                    keypoints.with_f32_data(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]).with_shape(&[3, 2]);
                    features.add_group(group.finish());
                }
                target.write("x", b"");
                features.write(target.folder.join("features.h5")).expect("writable");
            }
            Reader::Matches(_) | Reader::Run => target.write("x", b""),
        }
        target
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        fs::write(path, bytes).expect("writable");
    }

    fn write_photo(&self, name: &str) {
        self.write(name, b"");
        image::GrayImage::new(16, 8).save(self.folder.join(name)).expect("writable");
    }

    fn read(&self, bytes: &[u8]) -> Corpus {
        match self.reader {
            Reader::Scene(file, starts) => {
                if !starts.is_empty() && !starts.iter().any(|start| bytes.starts_with(start)) {
                    return Corpus::Reject;
                }
                self.write(file, bytes);
                read_scene(&self.folder, "toml");
            }
            Reader::Model(ending) => {
                let Some((cameras, rest)) = split(bytes) else { return Corpus::Reject };
                let Some((images, points)) = split(rest) else { return Corpus::Reject };
                for (name, part) in [("cameras", cameras), ("images", images), ("points3D", points)]
                {
                    self.write(&format!("{name}.{ending}"), part);
                }
                read_scene(&self.folder, "colmap");
            }
            Reader::Matches(file) => {
                self.write(file, bytes);
                if let Ok(source) = MatchFolder::open(&self.folder) {
                    source.matches("a", "b").ok();
                }
            }
            Reader::Run => {
                let Some((run, results)) = split(bytes) else { return Corpus::Reject };
                self.write("run.toml", run);
                self.write("results.jsonl", results);
                if let Ok(run) = read_run(&self.folder) {
                    read_results(&self.folder, &run).ok();
                    posescope::measure::read_rows(&self.folder).ok();
                }
            }
        }
        Corpus::Keep
    }
}

/// A part of as many bytes as the first two say, and what follows it.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<2>()?;
    Some(rest.split_at(usize::from(u16::from_le_bytes(*length)).min(rest.len())))
}

fn read_scene(folder: &Path, format: &str) {
    let argument = folder.to_str().expect("a plain path");
    if let Ok(scene) = scene::open(argument, Some(format)) {
        for frame in 0..scene.frames().len().min(3) {
            scene.query(frame).ok();
            scene.reference(frame).ok();
        }
    }
}

fuzz_target!(|bytes: &[u8]| -> Corpus {
    static TARGET: OnceLock<Target> = OnceLock::new();
    TARGET.get_or_init(Target::new).read(bytes)
});
