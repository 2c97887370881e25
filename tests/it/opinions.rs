//! Second opinions on the poses of other systems, and maps that cannot be believed.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use posescope::diagnosis::{Code, Grade};
use posescope::features::{FoundMatches, PairMatches};
use posescope::foreign::{Foreign, MatchSource};
use posescope::fusion::Fusion;
use posescope::geometry::Pose;
use posescope::localize::{LocalizeError, Localizer, NoObserver, QueryResult, Request};
use posescope::method::Method;
use posescope::opinion::{Opinion, Standing};
use posescope::params::Params;
use posescope::scene::street::{Size, Street};
use posescope::scene::{Scene, SceneError};
use tempfile::TempDir;

use crate::binary::{Said, command_in, has, text, write};
use crate::data;

/// The results for a pose beside the true one of a frame of the street. The truth is withheld unless `truth_is_known`.
fn results(
    off: Pose,
    references: &[usize],
    fusions: Vec<Fusion>,
    truth_is_known: bool,
) -> Vec<QueryResult> {
    const QUERY: usize = 70;
    let street = street();
    let truth = street.pose(QUERY).expect("a pose");
    let other = Method::called("other").expect("a plain name");
    let name = street.frames()[QUERY].clone();
    let foreign = Foreign::default().with_estimates(other, [(name, truth * off)].into());
    let hidden = Hidden { scene: &street, shows_truth: truth_is_known };
    let params = Params::default();
    let localizer = Localizer::new(&street, &hidden, &params, 0).with_foreign(foreign);
    let request =
        Request { radius_m: 12.0, references: references.to_vec().into(), fusions, setting: None };
    let mut results = Vec::new();
    let keep = |result, _| {
        results.push(result);
        Ok::<(), LocalizeError>(())
    };
    localizer.localize(0, QUERY, &[request], &[other], &mut NoObserver, keep).expect("localised");
    results
}

fn street() -> Street {
    Street::new("overcast", Size::Half).expect("a condition")
}

/// A scene that may keep its poses to itself.
struct Hidden<'a> {
    scene: &'a Street,
    shows_truth: bool,
}

impl Scene for Hidden<'_> {
    posescope::inner_scene!(scene: name, frames, intrinsics, time_s, has_cloud, photo, cloud);

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.scene.pose(frame).filter(|_| self.shows_truth)
    }
}

fn opinion(result: &QueryResult) -> &Opinion {
    result.opinion.as_ref().expect("an opinion of another system's pose")
}

#[test]
fn a_right_pose_is_confirmed_and_one_elsewhere_is_contradicted_with_where_the_photos_agree() {
    let [right] = results(Pose::identity(), &[66], vec![], false).try_into().expect("one");
    assert_eq!(opinion(&right).standing, Standing::Confirmed, "{}", opinion(&right).because);
    assert!(right.diagnosis.is_empty(), "{:?}", right.diagnosis);
    assert!(right.evidence().starts_with("✓ confirmed"), "{}", right.evidence());

    let off = Pose::translation(2.0, 0.0, 0.0);
    let [wrong] = results(off, &[66], vec![], false).try_into().expect("one");
    let found = opinion(&wrong);
    assert_eq!((found.standing, wrong.grade), (Standing::Contradicted, Grade::Unmeasured));
    assert_eq!(wrong.diagnosis[0].code, Code::E3);
    let [right_m, down_m, forward_m] = found.offset_m.expect("an offset");
    assert!((right_m - 2.0).abs() < 0.15 && down_m.abs() < 0.15 && forward_m.abs() < 0.15);
    let [least, most] = found.interval_m.expect("an interval");
    assert!(least <= 2.0 && 2.0 <= most, "{least} to {most}");
    let better = found.better.as_ref().and_then(|better| better.to_pose()).expect("a pose");
    let truth = street().pose(70).expect("a pose");
    assert!((better.translation.vector - truth.translation.vector).norm() < 0.15);
}

#[test]
fn the_truth_changes_no_opinion_and_no_verdict_is_about_a_search() {
    let off = Pose::translation(0.0, 0.0, 3.0);
    let [hidden] = results(off, &[66], vec![], false).try_into().expect("one");
    let [known] = results(off, &[66], vec![], true).try_into().expect("one");
    assert_eq!(hidden.opinion, known.opinion);
    assert_eq!(known.grade, Grade::Wrong);
    let codes: Vec<Code> = known.diagnosis.iter().map(|one| one.code).collect();
    assert_eq!(codes, [Code::E3]);
}

#[test]
fn a_truth_that_a_confirmed_pose_contradicts_is_suspect() {
    let street = street();
    let pose = street.pose(70).expect("a pose");
    let [other, truth] = [Method::called("other").expect("a plain name"), Foreign::TRUTH];
    let results = |truth_is_off_m: f64| -> [QueryResult; 2] {
        let name = || street.frames()[70].clone();
        let stated = pose * Pose::translation(truth_is_off_m, 0.0, 0.0);
        let foreign = Foreign::default()
            .with_estimates(other, [(name(), pose)].into())
            .with_estimates(truth, [(name(), stated)].into());
        let params = Params::default();
        let localizer = Localizer::new(&street, &street, &params, 0).with_foreign(foreign);
        let references = vec![66].into();
        let request = Request { radius_m: 12.0, references, fusions: vec![], setting: None };
        let mut results = Vec::new();
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        localizer
            .localize(0, 70, &[request], &[other, truth], &mut NoObserver, keep)
            .expect("localised");
        results.try_into().expect("two")
    };
    let [estimate, stated] = results(3.0);
    assert_eq!((estimate.grade, estimate.diagnosis[0].code), (Grade::Wrong, Code::X1));
    let text = &estimate.diagnosis[0].text;
    assert!(text.starts_with("The ground truth is suspect"), "{text}");
    // Nothing measures the truth, and the photos contradict it.
    assert_eq!((stated.grade, stated.error), (Grade::Unmeasured, None));
    assert_eq!(opinion(&stated).standing, Standing::Contradicted);
    assert_eq!(stated.diagnosis[0].code, Code::E3);

    let [estimate, stated] = results(0.0);
    assert_eq!((estimate.grade, estimate.diagnosis.len()), (Grade::Right, 0));
    assert_eq!(opinion(&stated).standing, Standing::Confirmed);
}

/// Matches as if the photo had been taken at a wrong pose.
struct Misleading {
    query_from_reference: Pose,
}

impl MatchSource for Misleading {
    fn matches(&self, _: &str, reference: &str) -> Result<Option<PairMatches>, SceneError> {
        let street = street();
        let camera = street.intrinsics(0);
        let scene: &dyn Scene = &street;
        let cloud = scene.cloud(scene.find(reference)?)?;
        let sees = |point: &nalgebra::Point3<f64>| {
            let at = camera.project(point)?;
            let is_inside = at.x > 0.0 && at.y > 0.0;
            let is_within =
                at.x < f64::from(camera.width - 1) && at.y < f64::from(camera.height - 1);
            (is_inside && is_within).then_some([at.x as f32, at.y as f32])
        };
        let points = cloud.points.iter().step_by(97).map(|point| point.cast::<f64>());
        let seen = points
            .filter_map(|point| Some((sees(&(self.query_from_reference * point))?, sees(&point)?)));
        let (query, reference): (Vec<_>, Vec<_>) = seen.take(300).unzip();
        let matched: Vec<Option<usize>> = (0..query.len()).map(Some).collect();
        Ok(Some(PairMatches::Found(FoundMatches::new(&query, &reference, &matched))))
    }
}

/// What FB makes of matches as if the photo had been taken at one pose, and the result for another system's pose. Both
/// are stated beside the truth.
fn by_matches_and_given(
    matched_at: Pose,
    given_at: Pose,
    shows_truth: bool,
) -> (Pose, [QueryResult; 2]) {
    let street = street();
    let other = Method::called("other").expect("a plain name");
    let pose = |frame: usize| street.pose(frame).expect("a pose");
    let (matched, given) = (pose(70) * matched_at, pose(70) * given_at);
    let matches = Misleading { query_from_reference: matched.inverse() * pose(66) };
    let foreign = Foreign::default()
        .with_estimates(other, [(street.frames()[70].clone(), given)].into())
        .with_matches(Arc::new(matches));
    let hidden = Hidden { scene: &street, shows_truth };
    let params = Params::default();
    let localizer = Localizer::new(&street, &hidden, &params, 0).with_foreign(foreign);
    let references = vec![66].into();
    let request = Request { radius_m: 12.0, references, fusions: vec![], setting: None };
    let mut results = Vec::new();
    let keep = |result: QueryResult, _| {
        results.push(result);
        Ok::<(), LocalizeError>(())
    };
    let methods = [Method::FB, other];
    localizer.localize(0, 70, &[request], &methods, &mut NoObserver, keep).expect("localised");
    (matched, results.try_into().expect("two"))
}

#[test]
fn matches_of_the_other_system_confirm_no_pose_that_they_lead_to() {
    let off = || Pose::translation(3.0, 0.0, 0.0);
    let (wrong, [by_matches, given]) = by_matches_and_given(off(), off(), false);
    let found = by_matches.pose.expect("the matches agree").to_pose().expect("a pose");
    assert!((found.translation.vector - wrong.translation.vector).norm() < 0.3);
    assert_eq!(opinion(&given).standing, Standing::Contradicted, "{}", opinion(&given).because);
    let of_matches = opinion(&given).matches.as_ref().expect("matches");
    assert!(10 * of_matches.by_pose > 9 * of_matches.with_depth, "{of_matches:?}");
    // The truth says that their consensus is wrong.
    let (_, [_, given]) = by_matches_and_given(off(), off(), true);
    let codes: Vec<Code> = given.diagnosis.iter().map(|one| one.code).collect();
    assert!(codes[0] == Code::E3 && codes.contains(&Code::R8), "{codes:?}");
}

#[test]
fn an_opinion_says_how_many_of_its_matches_a_pose_explains() {
    let (off, none) = (Pose::translation(3.0, 0.0, 0.0), Pose::identity());
    let (_, [_, given]) = by_matches_and_given(none, off, false);
    let said = opinion(&given);
    let of_matches = said.matches.as_ref().expect("matches");
    assert!(10 * of_matches.by_pose < of_matches.with_depth, "{of_matches:?}");
    assert!(10 * of_matches.at_most > 9 * of_matches.with_depth, "{of_matches:?}");
    let apart = of_matches.apart.expect("a pose for the matches");
    assert!((apart.translation_m - 3.0).abs() < 0.1, "{apart}");
    has(&said.because, &format!("It explains {} of the", of_matches.by_pose));
    has(&said.because, &format!("explains {}.", of_matches.at_most));
    // Nothing is wrong with the matches.
    assert_eq!(given.diagnosis.len(), 1, "{:?}", given.diagnosis);

    // A right pose gets no verdict on its matches.
    let (_, [_, given]) = by_matches_and_given(none, none, true);
    assert_eq!((given.grade, given.diagnosis.len()), (Grade::Right, 0));
    let of_matches = opinion(&given).matches.as_ref().expect("matches");
    assert!(10 * of_matches.by_pose > 9 * of_matches.with_depth, "{of_matches:?}");
}

#[test]
fn every_own_answer_of_an_opinion_is_an_event() {
    let folder = TempDir::new().expect("a folder");
    let poses = "000070 1 0 0 40  0 1 0 0  0 0 1 40\n";
    write(folder.path().join("poses.txt"), poses);
    let asked = "run street --query 70 --reference 62 --method mine --estimates mine=poses.txt \
                 --events events.jsonl";
    command_in(folder.path(), asked).output().expect("it runs");
    let events = text(folder.path().join("events.jsonl"));
    let events: Vec<serde_json::Value> =
        events.lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
    let of_kind = |kind: &str| events.iter().filter(|one| one["kind"] == kind).collect::<Vec<_>>();
    let own = of_kind("OwnAnswered");
    assert!(!own.is_empty() && own.iter().all(|one| one["method"] == "mine"), "{own:?}");
    assert!(own[0]["apart"]["translation_m"].as_f64().expect("a distance") > 5.0);
    let [formed] = of_kind("OpinionFormed")[..] else { panic!("one opinion") };
    assert_eq!(formed["standing"], "contradicted");
    assert!(formed["depth"].as_u64() > Some(1), "inside of the stage `opinion`");
    assert!(of_kind("StageStarted").iter().any(|one| one["stage"] == "opinion"));
    // An observer of the other system does not get the events of the own methods.
    assert!(of_kind("FeaturesDetected").is_empty());
}

#[test]
fn several_references_vote_on_a_fused_pose() {
    let fusions = || Fusion::all().filter(|fusion| fusion.name == "r-wavg").collect();
    let [fused] = results(Pose::translation(-3.0, 0.0, 0.0), &[66, 74], fusions(), false)
        .try_into()
        .expect("one");
    assert_eq!(opinion(&fused).standing, Standing::Contradicted);
    let alone = fused.per_reference.as_ref().expect("two references");
    assert!(alone.iter().all(|one| one.opinion.is_some()));
    assert_eq!(fused.diagnosis[0].code, Code::E3);
}

/// A folder with a real drive, and a cache of its own.
struct Drive {
    root: TempDir,
}

const DRIVE: &str = "2011_09_26/2011_09_26_drive_0013_sync";

impl Drive {
    fn copied() -> Option<Self> {
        let from = data::sample("kitti_raw/2011_09_26")?;
        let root = TempDir::new().expect("a folder");
        copy(&from, &root.path().join("2011_09_26"));
        Some(Self { root })
    }

    fn run(&self, line: &str) -> Said {
        let cache = self.root.path().join("cache");
        Said::by(command_in(self.root.path(), line).env("POSESCOPE_CACHE", cache)).ok()
    }

    /// Gives the camera a focal length that is a fifth too short.
    fn spoil_camera(&self) {
        let path = self.root.path().join("2011_09_26/calib_cam_to_cam.txt");
        let stated = text(&path);
        let spoilt = stated.lines().map(|line| match line.strip_prefix("P_rect_02: ") {
            None => format!("{line}\n"),
            Some(numbers) => {
                let numbers = numbers.split_whitespace().enumerate().map(|(at, number)| {
                    let number: f64 = number.parse().expect("a number");
                    if [0, 3, 5].contains(&at) { 0.8 * number } else { number }.to_string()
                });
                format!("P_rect_02: {}\n", numbers.collect::<Vec<_>>().join(" "))
            }
        });
        let spoilt: String = spoilt.collect();
        write(&path, spoilt);
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("writable");
        for entry in fs::read_dir(from).expect("readable").flatten() {
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::copy(from, to).expect("writable");
    }
}

#[test]
fn poses_of_a_map_with_a_mistake_have_no_confidence_until_it_is_mended() {
    let Some(drive) = Drive::copied() else { return };
    let line = format!("run {DRIVE} --query 12 --reference 16 --method fb2 --json -");
    let known = |said: Said| said.results()[0].confidence.clone();
    assert!(known(drive.run(&line)).is_some());

    drive.spoil_camera();
    let said = drive.run(&line);
    has(&said.err, "the camera parameters ~ poses have no confidence");
    assert_eq!(known(said), None);
    // What was found stays known, and a whole run follows it too.
    let kept = fs::read_dir(drive.root.path().join("cache/map-check")).expect("a folder").count();
    assert_eq!(kept, 1);
    has(&drive.run(&line).err, "poses have no confidence");
    let eval = format!("eval {DRIVE} --query 12 --reference nearest:1 --method fb2 --out run");
    has(&drive.run(&eval).err, "poses have no confidence");
    has(&text(drive.root.path().join("run/run.toml")), "mistake_of_map = ");
    assert!(text(drive.root.path().join("run/results.jsonl")).contains("\"confidence\":null"));
}

/// A map of the street, and photos between its frames in a folder of their own, without poses.
struct Photos {
    root: TempDir,
    names: Vec<String>,
    poses: Vec<Pose>,
}

impl Photos {
    const FIRST: usize = 63;
    const EVERY: usize = 6;

    fn written(count: usize) -> Self {
        let root = TempDir::new().expect("a folder");
        let street = street();
        let synth = "synth map --layout toml --size half --condition overcast --every 6 -q";
        Said::by(&mut command_in(root.path(), synth)).ok();
        fs::create_dir_all(root.path().join("photos")).expect("writable");
        let camera = street.intrinsics(0);
        let mut gps = "name x y z\n".to_owned();
        let (mut names, mut poses) = (Vec::new(), Vec::new());
        for at in 0..count {
            let frame = Self::FIRST + Self::EVERY * at;
            let name = format!("IMG_{at:04}");
            let path = root.path().join(format!("photos/{name}.png"));
            street.photo(frame).expect("a photo").gray.save(path).expect("writable");
            let pose = street.pose(frame).expect("a pose");
            let at = pose.translation;
            gps += &format!("{name} {} {} {}\n", at.x + 1.0, at.y, at.z - 1.0);
            names.push(name);
            poses.push(pose);
        }
        write(root.path().join("gps.txt"), gps);
        let scene = format!(
            "images = \"*.png\"\n[camera]\nfx = {}\nfy = {}\ncx = {}\ncy = {}\n",
            camera.fx, camera.fy, camera.cx, camera.cy
        );
        write(root.path().join("photos/scene.toml"), scene);
        Self { root, names, poses }
    }

    /// A file of poses, as hloc writes them.
    fn estimated(&self, file: &str, meant: impl Fn(usize, &Pose) -> Pose) {
        let mut lines = String::new();
        for (at, (name, pose)) in self.names.iter().zip(&self.poses).enumerate() {
            let camera_from_world = meant(at, pose).inverse();
            let q = camera_from_world.rotation.into_inner().coords;
            let t = camera_from_world.translation.vector;
            lines +=
                &format!("{name}.png {} {} {} {} {} {} {}\n", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
        }
        write(self.root.path().join(file), lines);
    }

    fn said(&self, line: &str) -> Said {
        Said::by(command_in(self.root.path(), line).env_remove("GITHUB_STEP_SUMMARY"))
    }
}

#[test]
fn a_file_of_poses_is_judged_where_no_query_has_a_true_one() {
    let photos = Photos::written(12);
    // One pose is 3 m off, one is that of the map's nearest frame, and all are those of an antenna above the camera.
    let map = street();
    photos.estimated("poses.txt", |at, pose| {
        let pose = match at {
            4 => pose * Pose::translation(3.0, 0.0, 0.0),
            7 => map.pose(Photos::FIRST + 7 * Photos::EVERY + 3).expect("a pose"),
            _ => *pose,
        };
        if at == 7 { pose } else { pose * Pose::translation(0.0, -1.6, 0.0) }
    });
    let eval = "eval map/overcast --query-scene photos --estimates mine=poses.txt --method mine";
    let said = photos.said(&format!("{eval} --out run"));
    assert_eq!(said.code, Some(2), "{}", said.err);
    has(&said.err, "the position of query IMG_0000 is not known ~ --gps");

    let near = "--gps gps.txt --reference nearest:1 --radius 8";
    let gate = "--gate \"contradicted@mine <= 0.02\"";
    let said = photos.said(&format!("{eval} {near} --out run {gate}"));
    assert_eq!(said.code, Some(1), "{}", said.err);
    has(&said.out, "12 of 12 queries: by a second opinion ~ contradicted. The truth is not known.");
    has(&said.out, "Finding: The poses of mine are shifted by 1.6");
    has(&said.out, "All failures: ~ opinion = contradicted");
    let summary = text(photos.root.path().join("run/summary.json"));
    has(&summary, "\"E5\" ~ \"shift_m\"");
    let report = text(photos.root.path().join("run/report.html"));
    has(
        &report,
        "Where poses seem off ~ Worst failures ~ Map seen from the pose where posescope has it",
    );
    let failed = fs::read_dir(photos.root.path().join("run/failures")).expect("recordings");
    assert!(failed.count() >= 10);
    assert!(text(photos.root.path().join("run/results.jsonl")).contains("\"copied_from\":\"0001"));
    photos.said("eval --rerun-failed run --out again").ok();
    let again = text(photos.root.path().join("again/results.jsonl"));
    assert!(again.lines().count() >= 10, "{again}");

    // Poses that are right have no finding, and the photos tell them from their rivals.
    photos.estimated("poses.txt", |_, pose| *pose);
    photos.estimated("other.txt", |at, pose| match at {
        3 | 8 => pose * Pose::translation(0.25, 0.0, 0.0),
        _ => *pose,
    });
    let eval = eval.replace("--method mine", "--estimates other=other.txt --method mine,other");
    let said = photos.said(&format!("{eval} {near} --out sound {gate}")).ok();
    assert!(!said.out.contains("Finding") && !said.out.contains("Failures"), "{}", said.out);
    has(&said.out, "No mistake is common to the poses of mine: 12 were compared");
    has(&said.out, "the photos support mine in 2 and other in 0; 10 stay");
    let rivals = photos.said("results sound --table rivals --as csv").ok().out;
    has(&rivals, "IMG_0002,open ~ IMG_0003,mine ~ IMG_0008,mine");
}
