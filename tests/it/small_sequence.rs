//! A small KITTI odometry sequence on disk, to be damaged.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma};
use tempfile::TempDir;

use crate::binary::{Said, run_in, text};

pub const WIDTH: u32 = 160;
pub const HEIGHT: u32 = 64;
const CALIBRATION: &str = "\
P0: 100 0 80 0 0 100 32 0 0 0 1 0
P2: 100 0 80 6 0 100 32 0 0 0 1 0
Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0
";

/// Frames 000004, 000005 and 000007 of a wall with random texture, 1 m apart.
pub struct SmallSequence {
    root: TempDir,
}

impl SmallSequence {
    pub fn write() -> Self {
        Self::of(&[4, 5, 7])
    }

    /// With these frames; each stands 1 m per frame number along the road.
    pub fn of(frames: &[usize]) -> Self {
        let root = TempDir::new().expect("a temporary folder");
        write(root.path(), frames);
        Self { root }
    }

    pub fn folder(&self) -> PathBuf {
        self.root.path().join("sequences/42")
    }
    pub fn poses(&self) -> PathBuf {
        self.root.path().join("poses/42.txt")
    }
    pub fn image(&self, name: &str) -> PathBuf {
        self.folder().join(format!("image_0/{name}.png"))
    }
    pub fn scan(&self, name: &str) -> PathBuf {
        self.folder().join(format!("velodyne/{name}.bin"))
    }
    pub fn path(&self) -> &Path {
        self.root.path()
    }

    /// Runs the binary with the arguments of a line, where the scene is called `sequences/42`.
    pub fn run(&self, line: &str) -> Said {
        run_in(self.path(), line)
    }

    /// What a file says, by its path from there.
    #[track_caller]
    pub fn text(&self, file: &str) -> String {
        text(self.path().join(file))
    }

    /// Nothing finds a black photo.
    pub fn blacken(&self, name: &str) {
        let black = GrayImage::new(WIDTH, HEIGHT);
        black.save(self.image(name)).expect("writable");
    }
}

/// Writes the sequence 42 with these frames below a folder.
pub fn write(root: &Path, frames: &[usize]) {
    let folder = root.join("sequences/42");
    for sub in ["image_0", "velodyne"] {
        fs::create_dir_all(folder.join(sub)).expect("writable");
    }
    fs::create_dir_all(root.join("poses")).expect("writable");
    fs::write(folder.join("calib.txt"), CALIBRATION).expect("writable");
    let count = frames.iter().max().map_or(0, |last| last + 1);
    let times: String = (0..count).map(|f| format!("{:.1}\n", f as f64 / 10.0)).collect();
    fs::write(folder.join("times.txt"), times).expect("writable");
    let poses: String =
        (0..count).map(|frame| format!("1 0 0 0 0 1 0 0 0 0 1 {frame}\n")).collect();
    fs::write(root.join("poses/42.txt"), poses).expect("writable");
    for frame in frames {
        let image = folder.join(format!("image_0/{frame:06}.png"));
        wall(WIDTH, HEIGHT).save(image).expect("writable");
        let scan = folder.join(format!("velodyne/{frame:06}.bin"));
        fs::write(scan, scan_of_the_wall()).expect("writable");
    }
}

/// Blocks of random grey, the same in every frame.
pub fn wall(width: u32, height: u32) -> GrayImage {
    GrayImage::from_fn(width, height, |x, y| {
        let block = (x / 5).wrapping_mul(0x9E37_79B9) ^ (y / 5).wrapping_mul(0x85EB_CA6B);
        let mixed = (block ^ (block >> 15)).wrapping_mul(0x2C1B_3C6D);
        Luma([(mixed >> 24) as u8])
    })
}

/// Points of a wall 10 m ahead, in the scanner's frame (x forward, y left, z up).
pub fn scan_of_the_wall() -> Vec<u8> {
    let mut bytes = Vec::new();
    for row in -15..=15 {
        for column in -40..=40 {
            let point = [10.0, column as f32 * 0.19, row as f32 * 0.19, 0.5];
            bytes.extend(point.iter().flat_map(|value: &f32| value.to_le_bytes()));
        }
    }
    bytes
}
