//! `posescope doctor`: it names planted mistakes, and finds nothing wrong with good scenes.

use std::fs;
use std::path::Path;

use posescope::doctor::{Correction, Fit, Mistake, Place, examine};
use posescope::scene::street::{Size, Street};
use posescope::scene::{self, Scene};
use tempfile::TempDir;

use crate::binary::{has, run_in};
use crate::damage::open;
use crate::data;
use crate::planted::{FAULTS, Fault, Planted};
use crate::scene_toml;
use crate::small_sequence::SmallSequence;
use crate::written::Written as _;

/// What mends those that one word names as others are named.
const REMEDIES: [(Fault, &str); 10] = [
    (Fault::OnTheirSide, "turn the photos by 90° clockwise"),
    (Fault::InversePose, "invert each pose"),
    (Fault::InverseRotation, "invert the rotation of each pose, and leave its position"),
    (
        Fault::ResizedPhotos,
        "halve the camera parameters, which are those of photos of twice the size",
    ),
    (Fault::OpenGlAxes, "read the poses with camera axes (x, -y, -z), those of OpenGL"),
    (
        Fault::FiveTimesTheDepth,
        "divide the coordinates of clouds by 5; if these are depth images that are read with 1000 for one metre, 5000 \
         is one metre",
    ),
    (Fault::FootPoses, "multiply the positions of poses by 0.3048"),
    (Fault::MillimetrePoses, "divide the positions of poses by 1000"),
    (Fault::MillimetreClouds, "divide the coordinates of clouds by 1000"),
    (Fault::CentimetreClouds, "divide the coordinates of clouds by 100"),
];

/// The faults that every change is held to: of a pose, a cloud and a camera, of nothing, and of too little.
const FEW: [Fault; 7] = [
    Fault::Nothing,
    Fault::InversePose,
    Fault::OpenGlAxes,
    Fault::MirroredCloud,
    Fault::TurnedCloud,
    Fault::WrongCamera,
    Fault::HalfPixel,
];

#[test]
fn planted_mistakes_are_named() {
    are_named(|fault| FEW.contains(&fault));
}

#[test]
#[ignore = "takes a minute; .ci/nightly runs it"]
fn all_planted_mistakes_are_named() {
    are_named(|fault| !FEW.contains(&fault));
}

/// The line that the doctor offers, written where it says, makes the scene fit.
#[test]
fn what_is_to_be_written_mends_the_poses_axes() {
    are_mended(&[Fault::OpenGlAxes]);
}

#[test]
#[ignore = "takes a minute; .ci/nightly runs it"]
fn what_is_to_be_written_mends_the_scene() {
    are_mended(&[
        Fault::InversePose,
        Fault::PoseAxes,
        Fault::CloudAxes,
        Fault::OpenGlClouds,
        Fault::UprightClouds,
        Fault::UpsideDown,
        Fault::WrongCamera,
        Fault::ResizedPhotos,
        Fault::ThreeQuarterPhotos,
        Fault::FootPoses,
        Fault::MillimetrePoses,
        Fault::MillimetreClouds,
        Fault::CentimetreClouds,
        Fault::QuaternionOrder,
    ]);
}

fn are_mended(faults: &[Fault]) {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    for &fault in faults {
        let folder = TempDir::new().expect("a folder");
        Planted::every(&street, fault, 0..40, 1).write_to(folder.path());
        let found = examine(open(folder.path()).as_ref());
        let finding = found.finding.unwrap_or_else(|| panic!("{fault:?} is not named"));
        let Correction { lines, place } =
            finding.correction.unwrap_or_else(|| panic!("{fault:?}: {}", finding.remedy));
        let [scene, poses] = ["scene.toml", "poses.txt"].map(|name| folder.path().join(name));
        let text = fs::read_to_string(&scene).expect("written");
        let lines = lines.join("\n") + "\n";
        let text = match place {
            Place::Description => lines + &text,
            Place::Clouds => text + &lines,
            Place::Camera => {
                let is_other = |line: &&str| {
                    !["fx ", "fy ", "cx ", "cy "].iter().any(|of| line.starts_with(of))
                };
                let others = text.lines().filter(is_other).map(|line| line.to_owned() + "\n");
                others.collect::<String>().replace("[camera]\n", &format!("[camera]\n{lines}"))
            }
            Place::PosesHeader => {
                let known = fs::read_to_string(&poses).expect("written");
                let (_, rest) = known.split_once('\n').expect("a header");
                fs::write(&poses, lines + rest).expect("writable");
                text
            }
            Place::DepthPerMetre => panic!("{fault:?} has no depth images"),
        };
        fs::write(&scene, text).expect("writable");
        let mended = examine(open(folder.path()).as_ref());
        println!("{fault:?}: {:?} {:?}", mended.fit, mended.agreement);
        let named = mended.finding.map(|one| (one.mistake, one.remedy));
        assert_eq!((mended.fit, named), (Some(Fit::Fits), None), "{fault:?}");
    }
}

fn are_named(is_planted: impl Fn(Fault) -> bool) {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    for (fault, expected) in FAULTS.into_iter().filter(|(fault, _)| is_planted(*fault)) {
        let planted = Planted::every(&street, fault, 0..40, 1);
        let found = examine(&planted);
        let named = found.finding.as_ref().map(|finding| finding.mistake);
        println!("{fault:?}: {named:?} {:?}", found.remarks);
        assert_eq!(named, expected, "{fault:?}");
        if let Some((_, remedy)) = REMEDIES.iter().find(|(of, _)| *of == fault) {
            assert_eq!(found.finding.as_ref().expect("one was named").remedy, *remedy, "{fault:?}");
        }
        assert_eq!(found.is_broken(), expected.is_some(), "{fault:?}");
    }
}

/// The poses decide what of a map is seen, so it is cut anew for each reading.
#[test]
#[ignore = "takes half a minute; .ci/nightly runs it"]
fn mistakes_of_poses_are_named_with_one_map_for_all_frames() {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    let faults = [
        Fault::Nothing,
        Fault::InversePose,
        Fault::OpenGlAxes,
        Fault::PoseAxes,
        Fault::QuaternionOrder,
        Fault::ReversedPoses,
    ];
    for fault in faults {
        let folder = TempDir::new().expect("a folder");
        Planted::every(&street, fault, 0..40, 1).write_with_map(folder.path());
        let found = examine(open(folder.path()).as_ref());
        let named = found.finding.as_ref().map(|finding| finding.mistake);
        println!("{fault:?}: {named:?} {:?}", found.agreement);
        let expected = FAULTS.iter().find(|(of, _)| *of == fault).and_then(|(_, named)| *named);
        assert_eq!(named, expected, "{fault:?}");
    }
}

/// It takes photos that are sharp enough, and a speed that changes.
#[test]
#[ignore = "takes half a minute; .ci/nightly runs it"]
fn poses_that_are_one_line_off_are_named() {
    let street = Street::new("overcast", Size::Full).expect("is built in");
    let found = examine(&Planted::every(&street, Fault::PoseOneLineOff, 0..40, 1));
    let named = found.finding.map(|one| (one.mistake, one.remedy));
    let remedy = "give each frame the pose of the next line".to_owned();
    assert_eq!(named, Some((Mistake::PoseOfNeighbour, remedy)));
}

#[test]
fn two_mistakes_are_found_one_after_the_other() {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    let cloud = Planted::every(&street, Fault::CloudAxes, 0..40, 1);
    let both = Planted::every(&cloud, Fault::OpenGlAxes, 0..40, 1);
    let found = examine(&both);
    let first = found.finding.expect("a mistake");
    let second = first.then.as_ref().expect("another");
    assert_eq!([first.mistake, second.mistake], [Mistake::CloudAxes, Mistake::PoseAxes]);
}

/// Where no two photos share a view, numbers that are chosen fit by chance.
/// Of clouds in millimetres and inverted poses, neither shows alone.
#[test]
fn two_mistakes_that_hide_each_other_are_found_together() {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    for (fault, mistake, of_poses, other) in [
        (Fault::MillimetreClouds, Mistake::Units, Fault::InversePose, Mistake::InversePose),
        (Fault::UpsideDown, Mistake::TurnedPhotos, Fault::OpenGlAxes, Mistake::PoseAxes),
    ] {
        let one = Planted::every(&street, fault, 0..40, 1);
        let both = Planted::every(&one, of_poses, 0..40, 1);
        let found = examine(&both);
        let first = found.finding.as_ref();
        let chain = std::iter::successors(first, |finding| finding.then.as_deref());
        let named: Vec<Mistake> = chain.map(|finding| finding.mistake).collect();
        assert_eq!((found.fit, named), (Some(Fit::Fits), vec![mistake, other]), "{fault:?}");
    }
}

#[test]
fn frames_far_apart_are_not_accused() {
    for condition in ["overcast", "snow"] {
        let street = Street::new(condition, Size::Half).expect("is built in");
        for step in [20, 40] {
            let thinned = Planted::every(&street, Fault::Nothing, 0..16 * step, step);
            let found = examine(&thinned);
            let named = found.finding.map(|one| (one.mistake, one.remedy));
            assert_eq!(named, None, "{condition}, every {step}th frame");
            assert_eq!(found.fit, Some(Fit::NoSharedView), "{condition}, every {step}th frame");
        }
    }
}

/// No reading makes depths fit that are noise.
/// Facades look alike, so that some photos seem to share a view that they do not share.
#[test]
fn photos_of_different_places_are_no_misfit() {
    let street = Street::new("overcast", Size::Full).expect("is built in");
    let found = examine(&Planted::every(&street, Fault::Nothing, 0..720, 30));
    assert_eq!((found.fit, found.is_broken()), (Some(Fit::NoSharedView), false));
}

#[test]
fn depths_of_noise_are_a_misfit_that_nothing_explains() {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    let noise = Planted::every(&street, Fault::DepthsOfNoise, 0..24, 1);
    let found = examine(&noise);
    println!("{:?}", found.agreement);
    let named = found.finding.as_ref().map(|one| (one.mistake, &one.remedy, one.otherwise));
    assert_eq!(named, None);
    assert_eq!(found.fit, Some(Fit::Unexplained));
    assert!(found.is_broken());
}

/// In a dark street, edges on the photos are few, and grey values agree wherever clouds are.
#[test]
fn outlines_name_what_is_off_at_night() {
    let street = scene::open("street:night", None).unwrap();
    for (fault, mistake) in [
        (Fault::LeftForRight, Mistake::OtherStereoCamera),
        (Fault::TurnedCloud, Mistake::MovedCloud),
        (Fault::CloudOneFrameOff, Mistake::CloudOfNeighbour),
    ] {
        let found = examine(&Planted::every(street.as_ref(), fault, 300..340, 1)).finding;
        let found = found.map(|one| (one.mistake, one.then.is_some()));
        assert_eq!(found, Some((mistake, false)), "{fault:?}");
    }
}

/// Nothing is wrong with it.
fn healthy(scene: &dyn Scene) {
    let found = examine(scene);
    let finding = found.finding.as_ref().map(|finding| (finding.mistake, &finding.remedy));
    println!("{}: {:?} {:?}", scene.name(), found.agreement, found.remarks);
    assert_eq!(finding, None, "{}", scene.name());
    assert_eq!(found.fit, Some(Fit::Fits), "{}", scene.name());
    assert!(!found.is_broken(), "{}: {:?}", scene.name(), found.remarks);
}

#[test]
fn nothing_is_wrong_with_the_street_at_night() {
    let street = scene::open("street:night", None).expect("is built in");
    healthy(&Planted::every(street.as_ref(), Fault::Nothing, 300..340, 1));
}

#[test]
#[ignore = "takes a minute; .ci/nightly runs it"]
fn nothing_is_wrong_with_the_street_in_rain() {
    let street = scene::open("street:rain", None).expect("is built in");
    healthy(&Planted::every(street.as_ref(), Fault::Nothing, 300..340, 1));
}

/// Frames so far apart share few features, and a wrong camera may seem to explain more of them.
#[test]
fn nothing_is_wrong_with_frames_of_the_street_that_are_far_apart() {
    let street = Street::new("overcast", Size::Half).expect("is built in");
    for step in [8, 12] {
        healthy(&Planted::every(&street, Fault::Nothing, 0..101 * 8, step));
    }
}

#[test]
fn nothing_is_wrong_with_a_real_drive() {
    healthy_sample("kitti_raw/2011_09_26/2011_09_26_drive_0013_sync");
}

#[test]
#[ignore = "takes half a minute; .ci/nightly runs it"]
fn nothing_is_wrong_with_other_real_scenes() {
    healthy_sample("kitti/sequences/00");
    healthy_sample("colmap/lund_door");
    // As a file says, its depth images are registered; without it, the two cameras are what they are.
    if let Some(path) = data::sample("7scenes/redkitchen") {
        let copy = without(&path, "camera-intrinsics.txt");
        healthy(open(copy.path()).as_ref());
    }
}

fn healthy_sample(folder: &str) {
    if let Some(path) = data::sample(folder) {
        healthy(open(path).as_ref());
    }
}

/// A folder with links to all that another has, but one file.
fn without(folder: &Path, file: &str) -> TempDir {
    let copy = TempDir::new().expect("a folder");
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        let name = path.file_name().expect("a name");
        if name != file {
            copied(&path, &copy.path().join(name));
        }
    }
    copy
}

fn copied(from: &Path, to: &Path) {
    if !from.is_dir() {
        fs::copy(from, to).expect("writable");
        return;
    }
    fs::create_dir(to).expect("writable");
    for entry in fs::read_dir(from).expect("readable") {
        let path = entry.expect("readable").path();
        copied(&path, &to.join(path.file_name().expect("a name")));
    }
}

#[test]
fn depth_images_that_are_not_registered_as_a_file_says_are_found_out() {
    let Some(path) = data::sample("7scenes/redkitchen") else {
        return;
    };
    // With this file the reader takes depth and colour for one camera, of 585 px.
    let found = examine(open(&path).as_ref());
    let finding = found.finding.expect("the colour camera has 525 px");
    assert_eq!(finding.mistake, Mistake::WrongCamera);
    has(&finding.remedy, "of 529 px instead of 585");
}

#[test]
fn a_scene_without_clouds_cannot_be_localised_against() {
    let Some(path) = data::sample("kitti/sequences/06") else {
        return;
    };
    let said = run_in(&path, "doctor .");
    said.fails_with(3, "no frame has a cloud ~ --query-scene");
}

#[test]
fn the_command_reports_and_draws() {
    let sequence = SmallSequence::write();
    let table = sequence.run("doctor sequences/42 --picture a.png --save a.rrd").out;
    has(&table, "frames     3, 3 with a pose, 3 with a cloud");
    assert!(table.lines().all(|line| line.chars().count() <= 120), "{table}");
    let at = |name: &str| sequence.path().join(name);
    assert_eq!(image::open(at("a.png")).expect("a picture").width(), 160);
    assert!(fs::metadata(at("a.rrd")).expect("a recording").len() > 1000);
    assert_eq!(sequence.run("doctor nowhere").code, Some(3));
}

#[test]
fn a_map_out_of_view_is_named_where_localisation_fails() {
    let folder = TempDir::new().expect("a folder");
    scene_toml::write(folder.path());
    // The poses of a local frame.
    let row = |at: u32| format!("1 0 0 0.5 0 1 0 0 0 0 1 {at}\n");
    let rows: String = (0..3).map(row).collect();
    fs::write(folder.path().join("poses.txt"), rows).expect("writable");
    let words = "none of the 429 points of the map is in view ~ the map spans ~ the poses";
    has(&run_in(folder.path(), "doctor .").out, words);
    for line in [
        "run . --query img1 --reference nearest:1 --method fb,mi",
        "eval . --reference nearest:1 --method fb,mi --out run",
    ] {
        has(&run_in(folder.path(), line).err, words);
    }
    // Where the map is in view, nothing is said of it.
    scene_toml::write(folder.path());
    let line = "run . --query img1 --reference nearest:1 --method fb,mi";
    assert!(!run_in(folder.path(), line).err.contains("spans"));
}
