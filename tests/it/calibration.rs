//! `posescope doctor --calibration`: it finds turns, shifts, focal lengths and delays that are planted, and none where all
//! is as stated.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::doctor::{Calibration, NotJudged, calibration};
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::scene::street::{Size, Street};
use posescope::scene::{Scene, SceneError};
use tempfile::TempDir;

use crate::binary::{has, run_in, text, write};
use crate::damage::open;
use crate::data;
use crate::small_sequence::SmallSequence;

/// Every so many frames of the street are taken, so many of them.
const EVERY: usize = 40;
const FRAMES: usize = 12;

/// Frames of a scene, with another calibration than stated.
struct Misplaced<'a> {
    scene: &'a dyn Scene,
    names: Vec<String>,
    every: usize,
    change: Pose,
    focal_length: f64,
    /// How much later the photos are \[s\].
    delay_s: f64,
}

impl<'a> Misplaced<'a> {
    fn new(scene: &'a dyn Scene, every: usize, frames: usize) -> Self {
        let names = scene.frames().iter().step_by(every).take(frames).cloned().collect();
        Self { scene, names, every, change: Pose::identity(), focal_length: 1.0, delay_s: 0.0 }
    }

    fn judged(&self) -> Calibration {
        calibration(self, &|_| ()).expect("enough depth edges")
    }
}

impl Scene for Misplaced<'_> {
    fn name(&self) -> &str {
        self.scene.name()
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        let camera = self.scene.intrinsics(frame * self.every);
        Intrinsics {
            fx: camera.fx * self.focal_length,
            fy: camera.fy * self.focal_length,
            ..camera
        }
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.scene.pose(frame * self.every)
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.scene.time_s(frame * self.every)
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.scene.has_cloud(frame * self.every)
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        self.scene.photo(frame * self.every)
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let at = frame * self.every;
        let mut change = self.change;
        if self.delay_s != 0.0 {
            let (before, after) = (at.max(1) - 1, at.max(1));
            let time = |at: usize| self.scene.time_s(at).expect("has a time");
            let pose = |at: usize| self.scene.pose(at).expect("has a pose");
            let moved = (pose(before).inverse() * pose(after)).translation.vector;
            // The cloud was taken where the camera was before.
            let by = moved / (time(after) - time(before)) * self.delay_s;
            change *= Pose::from_parts(Translation3::from(by), UnitQuaternion::identity());
        }
        let change = change.cast::<f32>();
        let points = self.scene.cloud(at)?.points;
        Ok(Cloud { points: points.iter().map(|point| change * point).collect() })
    }
}

fn street() -> Street {
    Street::new("overcast", Size::Half).expect("is built in")
}

/// How far the found calibration is from the true one \[°, m\].
fn off(found: &Calibration, planted: &Pose) -> (f64, f64) {
    let rest = found.camera_from_stated() * planted;
    (rest.rotation.angle().to_degrees(), rest.translation.vector.norm())
}

#[test]
fn what_is_as_stated_is_consistent() {
    let street = street();
    let found = Misplaced::new(&street, EVERY, FRAMES).judged();
    assert!(!found.is_off(), "{found:?}");
    assert_eq!(found.frames, FRAMES);
}

#[test]
fn a_planted_turn_and_shift_are_found() {
    let street = street();
    for (turn_deg, shift_m) in [
        (Vector3::new(0.0, 1.0, 0.0), Vector3::zeros()),
        (Vector3::new(0.8, -1.2, 0.9), Vector3::new(0.15, -0.05, 0.2)),
        (Vector3::zeros(), Vector3::new(-0.2, 0.0, 0.0)),
    ] {
        let turn = UnitQuaternion::from_scaled_axis(turn_deg.map(f64::to_radians));
        let change = Pose::from_parts(Translation3::from(shift_m), turn);
        let found = Misplaced { change, ..Misplaced::new(&street, EVERY, FRAMES) }.judged();
        let (off_deg, off_m) = off(&found, &change);
        assert!(off_deg < 0.3 && off_m < 0.06, "{turn_deg:?} {shift_m:?}: {off_deg}° {off_m} m");
        assert!(found.is_off());
    }
}

#[test]
fn a_wrong_focal_length_is_found() {
    let street = street();
    for times in [0.95, 1.05] {
        let wrong = Misplaced { focal_length: times, ..Misplaced::new(&street, EVERY, FRAMES) };
        let found = wrong.judged();
        let rest = (1.0 + found.focal_length.value) * times - 1.0;
        assert!(rest.abs() < 0.01, "{times}: {rest}");
        assert!(found.focal_length.is_off());
    }
}

#[test]
fn a_delay_is_found_and_told_from_nothing() {
    let street = street();
    for delay_s in [-0.06, 0.0, 0.04] {
        let late = Misplaced { delay_s, ..Misplaced::new(&street, 1, 2 * FRAMES) };
        let found = late.judged();
        let delay = found.delay.expect("the car drives");
        assert!((delay.value - delay_s).abs() < 0.012, "{delay_s}: {delay:?}");
        assert_eq!(delay.is_off(), delay_s != 0.0);
        assert_eq!(found.may_be_delay, delay_s != 0.0);
    }
}

#[test]
fn the_same_scene_has_the_same_calibration_on_any_number_of_threads() {
    let street = street();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| format!("{:?}", Misplaced::new(&street, EVERY, 4).judged().turn))
    };
    assert_eq!(on(1), on(3));
}

/// The binary's answer on a data set as it was written, and after the scanner was moved in its `calib.txt`.
#[test]
fn the_exit_code_and_the_picture_are_those_of_the_answer() {
    let folder = TempDir::new().expect("a folder");
    run_in(folder.path(), "synth . --size half --every 40 --condition overcast -q").ok();
    let line = "doctor sequences/overcast --calibration --picture edges.png";
    let said = run_in(folder.path(), line).ok();
    has(&said.out, "Answer: consistent with the stated calibration");
    assert!(!said.out.contains("Multiply"));
    let (width, height) =
        image::image_dimensions(folder.path().join("edges.png")).expect("a picture");
    assert!(width == 1400 && height > 500, "{width}x{height}");
    let file = folder.path().join("sequences/overcast/calib.txt");
    let stated = text(&file);
    let moved = stated.lines().map(|line| {
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        if words[0] == "Tr:" {
            let shift: f64 = words[4].parse().expect("a number");
            words[4] = format!("{:.6}", shift + 0.2);
        }
        words.join(" ") + "\n"
    });
    let moved: String = moved.collect();
    assert_ne!(moved, stated);
    write(&file, moved);
    let said = run_in(folder.path(), line).fails(3, "shift along x (right) by -0.");
    has(&said.out, "Multiply the stated camera_from_cloud from the left");

    // What --out writes mends it, and no file is replaced.
    let line = "doctor sequences/overcast --calibration --out better.txt";
    let said = run_in(folder.path(), line).fails(3, "shift along x");
    has(&said.err, "better.txt: in place of");
    run_in(folder.path(), line).fails(2, "better.txt: the file exists");
    std::fs::copy(folder.path().join("better.txt"), &file).expect("writable");
    let line = "doctor sequences/overcast --calibration --out again.txt";
    has(&run_in(folder.path(), line).ok().err, "nothing is written");
    assert!(!folder.path().join("again.txt").exists());
}

#[test]
fn too_little_is_not_judged() {
    let street = street();
    let found = calibration(&Misplaced::new(&street, EVERY, 2), &|_| ());
    assert_eq!(found.expect_err("two frames"), NotJudged::FewFrames { found: 2 });
    let sequence = SmallSequence::write();
    let said = sequence.run("doctor sequences/42 --calibration").ok();
    has(&said.out, "the calibration cannot be judged");
}

#[test]
fn a_real_drive_is_consistent_and_a_turned_camera_is_not() {
    let drive = "kitti_raw_dense/2011_09_26/2011_09_26_drive_0013_sync";
    let Some(path) = data::sample(drive) else { return };
    let scene = open(path);
    let sound = Misplaced::new(scene.as_ref(), 1, 25);
    assert!(!sound.judged().is_off());
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.6_f64.to_radians());
    let change = Pose::from_parts(Translation3::new(0.12, 0.0, 0.0), turn);
    let found = Misplaced { change, ..Misplaced::new(scene.as_ref(), 1, 25) }.judged();
    let (off_deg, off_m) = off(&found, &change);
    assert!(found.is_off() && off_deg < 0.2 && off_m < 0.08, "{off_deg}° {off_m} m");
}
