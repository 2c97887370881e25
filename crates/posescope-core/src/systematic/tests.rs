use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::*;
use crate::geometry::yaw;

const RIGHT: Tolerance = Tolerance { translation_m: 1.0, rotation_deg: 5.0 };

/// A drive with bends and changes of speed, far from the origin.
fn drive(queries: usize) -> Vec<Pose> {
    let (mut heading, mut at) = (0.4_f64, Vector3::new(120.0, 2.0, -340.0));
    let poses = (0..queries).map(|query| {
        let along = query as f64;
        heading += 0.03 * (along / 7.0).sin();
        let speed = 1.2 + 0.7 * (along / 11.0).cos();
        let turn = yaw(heading);
        at += turn * Vector3::z() * speed;
        Pose::from_parts(at.into(), turn)
    });
    poses.collect()
}

/// The file of a system that has noise, is now and then far off, and has a mistake; and posescope's own poses, where they
/// are trusted.
fn found(meant: impl Fn(&[Pose], usize) -> Pose, seed: u64) -> Option<Systematic> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut beside = |pose: &Pose, metres: f64, degrees: f64| {
        let mut some =
            |most: f64| -> Vector3<f64> { Vector3::from_fn(|_, _| rng.random_range(-most..most)) };
        let turn = UnitQuaternion::from_scaled_axis(some(degrees.to_radians()));
        pose * Pose::from_parts(some(metres).into(), turn)
    };
    let truth = drive(64);
    let noise = |at: usize| if at % 7 == 3 { (8.0, 20.0) } else { (0.05, 0.2) };
    let estimates: Vec<Pose> =
        truth.iter().enumerate().map(|(at, pose)| beside(pose, noise(at).0, noise(at).1)).collect();
    let queries = truth.iter().enumerate().map(|(at, truth)| {
        let own = (at % 4 != 1).then(|| beside(truth, 0.04, 0.1));
        Answered { given: Some(meant(&estimates, at)), own }
    });
    systematic(&queries.collect::<Vec<_>>(), RIGHT)
}

/// The same where the mistake is one of each pose alone.
fn found_of(meant: impl Fn(&Pose) -> Pose, seed: u64) -> Option<Systematic> {
    found(|poses, at| meant(&poses[at]), seed)
}

fn turned(axis: Vector3<f64>, degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis.normalize() * degrees.to_radians())
}

fn is_close(found: f64, planted: f64) -> bool {
    (found - planted).abs() <= 0.1 * planted.abs()
}

#[test]
fn poses_without_a_common_mistake_have_none() {
    for seed in 0..20 {
        assert_eq!(found_of(|pose| *pose, seed), None, "{seed}");
    }
    // A quarter of wild poses is no mistake of the file.
    let wild = |poses: &[Pose], at: usize| {
        let off = if at.is_multiple_of(4) { 5.0 } else { 0.0 };
        poses[at] * Pose::translation(off, 0.0, off * (at as f64).sin())
    };
    assert_eq!(found(wild, 0), None);
    assert_eq!(systematic(&[Answered::default(); 50], RIGHT), None);
}

#[test]
fn other_conventions_are_named() {
    let axes = turned(Vector3::x(), 180.0);
    let z_up = turned(Vector3::x(), 90.0);
    let misread = |pose: &Pose| {
        let q = pose.rotation.into_inner().coords;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q.z, q.w, q.x, q.y));
        Pose::from_parts(pose.translation, rotation)
    };
    let scaled = |pose: &Pose| {
        Pose::from_parts(Translation3::from(pose.translation.vector * 1000.0), pose.rotation)
    };
    let name = |found: Option<Systematic>| match found.map(|found| (found.mistake, found.or)) {
        Some((Mistake::Reading(name), None)) => name,
        other => format!("{other:?}"),
    };
    assert_eq!(name(found_of(|pose| pose.inverse(), 1)), "camera_from_world (inverted)");
    assert_eq!(name(found_of(|pose| pose * axes, 2)), "camera axes (x, -y, -z)");
    assert_eq!(name(found_of(|pose| z_up * pose, 3)), "world axes (x, z, -y)");
    assert_eq!(name(found_of(|pose| misread(pose), 4)), "quaternions with w first");
    assert_eq!(name(found_of(|pose| scaled(pose), 5)), "millimetres");
}

#[test]
fn another_focal_length_shifts_poses_by_a_share_of_the_depths() {
    // What the cameras see is 7 to 15 m away.
    let back = |at: usize| 0.1 * (11.0 + 4.0 * (at as f64 * 1.7).sin());
    let shifted = |poses: &[Pose], at: usize| poses[at] * Pose::translation(0.0, 0.0, -back(at));
    let found_one = found(shifted, 4).expect("a mistake");
    let Mistake::Mounting { shift_m, varies: true, .. } = found_one.mistake.clone() else {
        panic!("{found_one:?}");
    };
    assert!((shift_m[2] + 1.1).abs() < 0.25, "{shift_m:?}");
    assert!(found_one.mistake.words().contains("about"), "{}", found_one.mistake.words());
    // Errors of that size in all directions are no mistake of the camera.
    let scattered = |poses: &[Pose], at: usize| {
        let along = at as f64 * 2.399;
        poses[at] * Pose::translation(1.2 * along.cos(), 0.2, 1.2 * along.sin())
    };
    assert_eq!(found(scattered, 5), None);
}

#[test]
fn a_shifted_or_turned_camera_has_its_size() {
    let arm = found_of(|pose| pose * Pose::translation(0.3, -1.2, 0.6), 1).expect("a mistake");
    let Mistake::Mounting { shift_m, turn_deg, varies: false } = arm.mistake.clone() else {
        panic!("{arm:?}");
    };
    assert!(is_close(shift_m[0], 0.3) && is_close(shift_m[1], -1.2) && is_close(shift_m[2], 0.6));
    assert_eq!(turn_deg, [0.0; 3]);
    assert!(arm.right_if_mended > 35 && arm.right_as_given < 5, "{arm:?}");
    assert!(arm.mistake.words().contains("up"), "{}", arm.mistake.words());

    let turn = turned(Vector3::y(), 7.0);
    let turn = found_of(|pose| pose * turn, 2).expect("a mistake");
    let Mistake::Mounting { shift_m, turn_deg, varies: false } = turn.mistake.clone() else {
        panic!("{turn:?}");
    };
    assert_eq!(shift_m, [0.0; 3]);
    assert!(is_close(turn_deg[1], 7.0) && turn_deg[0].abs() < 0.2, "{turn_deg:?}");
    assert!(turn.mistake.words().contains("right"), "{}", turn.mistake.words());

    // Errors that are small beside what counts as right are a mistake too, if all poses have them.
    let small = found_of(|pose| pose * Pose::translation(0.0, -0.35, 0.0), 3).expect("a mistake");
    assert!(matches!(small.mistake, Mistake::Mounting { .. }), "{small:?}");
}

#[test]
fn another_world_has_its_scale_and_turn() {
    let pose = Pose::from_parts(Translation3::new(3.0, 1.0, 8.0), turned(Vector3::y(), 4.0));
    let moved = |scale: f64| {
        move |own: &Pose| {
            let moved = pose * own;
            let at = Translation3::from(moved.translation.vector * scale);
            Pose::from_parts(at, moved.rotation)
        }
    };
    for planted in [1.0, 0.83] {
        let found = found_of(moved(planted), 1).expect("a mistake");
        let Mistake::World { scale, turn_deg, .. } = found.mistake else {
            panic!("{found:?}");
        };
        assert!((scale - planted).abs() < 0.01 && is_close(turn_deg, 4.0), "{scale} {turn_deg}");
        assert!(found.right_if_mended > 35, "{found:?}");
    }
}

#[test]
fn names_that_are_shifted_and_late_clocks_are_told_apart() {
    let at = |poses: &[Pose], place: f64| {
        let place = place.clamp(0.0, 62.0);
        let (before, share) = (place.floor() as usize, place.fract());
        let [from, to] = [poses[before], poses[before + 1]];
        let at = from.translation.vector.lerp(&to.translation.vector, share);
        Pose::from_parts(at.into(), from.rotation.slerp(&to.rotation, share))
    };
    for by in [-3_i64, 1, 7] {
        let found =
            found(|poses, query| at(poses, query as f64 - by as f64), 1).expect("a mistake");
        assert_eq!(found.mistake, Mistake::Lines(by));
    }
    for by in [-0.6, 1.4] {
        let found = found(|poses, query| at(poses, query as f64 - by), 2).expect("a mistake");
        let Mistake::Delay(queries) = found.mistake else {
            panic!("{found:?}");
        };
        assert!(is_close(queries, by), "{queries}");
    }
}

#[test]
fn an_error_that_grows_is_a_drift() {
    let drifting = |poses: &[Pose], at: usize| {
        let pose = poses[at];
        let far = 0.08 * at as f64;
        Pose::from_parts(
            Translation3::from(pose.translation.vector + Vector3::new(far, 0.0, 0.3 * far)),
            turned(Vector3::y(), 0.02 * at as f64) * pose.rotation,
        )
    };
    let found = found(drifting, 1).expect("a mistake");
    let Mistake::Drift { at_end_m, share } = found.mistake else {
        panic!("{found:?}");
    };
    assert!(at_end_m > 3.0 && share > 0.0, "{at_end_m} {share}");
}
