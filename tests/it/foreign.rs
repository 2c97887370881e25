//! What other systems answered: their poses as methods beside ours.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use posescope::diagnosis::Code;
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::scene;
use tempfile::TempDir;

use crate::binary::{arg, has, refused, run_in, write};
use crate::damage;
use crate::scene_toml;
use crate::small_sequence::SmallSequence;

/// The results that a run prints.
fn results(folder: &Path, words: &str) -> Vec<QueryResult> {
    // A program knows the names that it was given.
    for name in ["other", "tum", "kitti", "model", "vloc"] {
        Method::called(name).expect("a plain name");
    }
    run_in(folder, &format!("run {words} --json - -q")).results()
}

/// The poses of a method as visuallocalization.net takes them.
fn named_poses(results: &[QueryResult], method: Method) -> String {
    let of_method = results.iter().filter(|result| result.method == method);
    let line = |result: &QueryResult| {
        let pose = result.pose.as_ref()?.to_pose()?.inverse();
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        Some(format!("{} {} {} {} {} {} {} {}\n", result.query, q.w, q.x, q.y, q.z, t.x, t.y, t.z))
    };
    of_method.filter_map(line).collect()
}

fn codes(result: &QueryResult) -> BTreeSet<Code> {
    let verdicts = result.diagnosis.iter();
    verdicts.map(|verdict| verdict.code).collect()
}

#[test]
fn an_estimate_that_is_our_own_pose_gets_no_verdicts_on_a_search() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("poses.txt");
    // Night and rain against an overcast reference: MI is wrong in many ways.
    for (queries, wanted) in
        [("street:night", "--query 70 --query 300"), ("street:snow", "--query 160 --query 610")]
    {
        let street = format!("street:overcast --query-scene {queries} --radius 8");
        let asked = format!("{street} {wanted} --reference nearest:2 --method mi");
        for ours in results(folder.path(), &asked) {
            let Some(pose) = ours.pose.clone() else {
                continue;
            };
            write(&file, named_poses(std::slice::from_ref(&ours), Method::MI));
            let (query, reference) = (&ours.query, &ours.references[0]);
            let pair = format!("{street} --query {query} --reference {reference}");
            let given = format!("{pair} --method other --estimates other=poses.txt");
            let [other] = results(folder.path(), &given).try_into().expect("one result");
            assert_eq!(other.method.name(), "other");
            let [a, b] = [&pose, other.pose.as_ref().expect("a pose")].map(|pose| pose.position_m);
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9));
            let costs = ours.cost.as_ref().expect("MI has a cost");
            let mut at_pose = other.costs_at_pose.iter();
            let at_pose = at_pose.find(|at| at.method == Method::MI);
            let at_pose = at_pose.expect("every cost is asked");
            assert!((at_pose.cost.expect("is covered") - costs.best).abs() < 1e-6);
            assert_eq!(at_pose.truth, costs.truth);
            // Another system searches no cost, so no verdict is about one.
            let (needed, said) = (codes(&ours), codes(&other));
            println!("{queries} {query} {reference}: {needed:?} → {said:?}");
            assert!(!said.iter().any(|code| code.name().starts_with('D')), "{query}: {said:?}");
            let is_wrong = needed.iter().any(|code| code.is_failure());
            assert_eq!(is_wrong, !said.is_empty(), "{query}");
        }
    }
}

/// Our own MI poses of the small sequence, and the arguments that ask for them.
fn small() -> (SmallSequence, Vec<QueryResult>) {
    let sequence = SmallSequence::write();
    let found = results(sequence.path(), ALL);
    (sequence, found)
}

const ALL: &str = "sequences/42 --all --reference 4 --method mi";

#[test]
fn an_inverted_pose_is_told_by_its_convention() {
    let sequence = SmallSequence::write();
    let poses = fs::read_to_string(sequence.poses()).expect("readable");
    let inverted: String = poses
        .lines()
        .map(|line| {
            let m: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
            let back = |i: usize| -(m[i] * m[3] + m[4 + i] * m[7] + m[8 + i] * m[11]);
            let row = |i: usize| format!("{} {} {} {}", m[i], m[4 + i], m[8 + i], back(i));
            [0, 1, 2].map(row).join(" ") + "\n"
        })
        .collect();
    write(sequence.path().join("poses.txt"), inverted);
    let all = "sequences/42 --all --reference 4 --method other --estimates other=poses.txt";
    let found = results(sequence.path(), all);
    assert!(!found.is_empty());
    for result in found {
        let first = &result.diagnosis[0];
        let reading = "read as camera_from_world (inverted), it is 0.00 m and 0.0° off";
        assert_eq!(first.code, Code::X1, "{}: {}", result.query, first.text);
        assert!(first.text.contains(reading), "{}", first.text);
    }
    let eval = "eval sequences/42 --reference nearest:1 --radius 3 --method other --estimates other=poses.txt --out run";
    let said = sequence.run(eval);
    let finding =
        "The poses of other are in another convention: read as camera_from_world (inverted)";
    has(&said.out, &format!("Finding: {finding}"));
    has(&sequence.text("run/summary.json"), finding);
    has(&sequence.text("run/report.html"), finding);
}

/// Axes forward, left and up. The place is right, so the heading alone tells.
#[test]
fn camera_axes_of_a_robot_are_told_by_their_convention() {
    let sequence = SmallSequence::write();
    let poses = fs::read_to_string(sequence.poses()).expect("readable");
    let turned: String = poses
        .lines()
        .map(|line| {
            let m: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
            let row = |i: usize| format!("{} {} {} {}", m[i + 2], -m[i], -m[i + 1], m[i + 3]);
            [0, 4, 8].map(row).join(" ") + "\n"
        })
        .collect();
    write(sequence.path().join("poses.txt"), turned);
    let all = "sequences/42 --all --reference 4 --method other --estimates other=poses.txt";
    let found = results(sequence.path(), all);
    assert!(!found.is_empty());
    for result in found {
        let first = &result.diagnosis[0];
        let reading =
            "read as camera axes (z, -x, -y), it is 0.00 m and 0.0° off, not 0.00 m and 120.0°";
        assert_eq!(first.code, Code::X1, "{}: {}", result.query, first.text);
        assert!(first.text.contains(reading), "{}", first.text);
        assert_eq!(result.off().as_deref(), Some("120.00°"), "{}", result.query);
    }
}

#[test]
fn all_four_texts_say_the_same() {
    let (sequence, found) = small();
    let at = |name: &str| sequence.path().join(name);
    let numbers = |values: &[f64]| -> String {
        let words: Vec<String> = values.iter().map(ToString::to_string).collect();
        words.join(" ")
    };
    let (mut tum, mut kitti, mut colmap) = (String::new(), String::new(), "# images\n".to_owned());
    for result in &found {
        let estimate = result.pose.as_ref().expect("a pose");
        let pose = estimate.to_pose().expect("a pose");
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let frame: f64 = result.query.parse().expect("a number");
        let values = numbers(&[t.x, t.y, t.z, q.x, q.y, q.z, q.w]);
        tum += &format!("{} {values}\n", frame / 10.0);
        kitti += &format!("{}\n", numbers(&estimate.world_from_camera.concat()));
        let inverse = pose.inverse();
        let (t, q) = (inverse.translation.vector, inverse.rotation.coords);
        let inverse = numbers(&[q.w, q.x, q.y, q.z, t.x, t.y, t.z]);
        colmap += &format!("7 {inverse} 1 image_0/{}.png\n1.5 2.5 -1\n", result.query);
    }
    write(at("tum.txt"), tum);
    write(at("kitti.txt"), kitti);
    fs::create_dir(at("model")).expect("writable");
    write(at("model/images.txt"), colmap);
    write(at("vloc.txt"), named_poses(&found, Method::MI));
    let given = ["tum=tum.txt", "kitti=kitti.txt", "model=model", "vloc=vloc.txt"];
    let given = given.map(|given| format!(" --estimates {given}")).concat();
    let results = results(sequence.path(), &(ALL.to_owned() + &given));
    assert_eq!(results.len(), 5 * found.len());
    for of_query in results.chunks(5) {
        let order: Vec<&str> = of_query.iter().map(|result| result.method.name()).collect();
        assert_eq!(order, ["mi", "tum", "kitti", "model", "vloc"]);
        let ours = &of_query[0];
        let ours = ours.error.expect("the truth is known");
        for other in &of_query[1..] {
            let error = other.error.expect("the truth is known");
            assert!((error.translation_m - ours.translation_m).abs() < 1e-9);
            assert!((error.rotation_deg - ours.rotation_deg).abs() < 1e-5);
        }
    }
}

#[test]
fn a_run_folder_knows_the_other_system_and_all_that_reads_it_does_too() {
    let (sequence, found) = small();
    // One query has no pose.
    write(sequence.path().join("poses.txt"), named_poses(&found[1..], Method::MI));
    let eval =
        "eval sequences/42 --out run --method mi --radius 3 --estimates super-glue=poses.txt";
    let said = sequence.run(&format!("{eval} --gate 'success@super-glue >= 0.9'"));
    assert_eq!(said.code, Some(1), "one of three has no pose");
    has(&said.out, "super-glue");
    has(&sequence.text("run/results.jsonl"), "super-glue has no pose of 000004");
    sequence.run(&format!("{eval} --resume")).ok();
    let said = sequence.run("results run --as vloc --where 'method = super-glue'");
    assert_eq!(said.ok().out.lines().count(), 2);
    sequence.run("compare run run").ok();
    // A run that names a method which nobody brought is not read.
    let run = sequence.text("run/run.toml");
    let without = run.split_inclusive('\n').filter(|line| !line.starts_with("estimates"));
    write(sequence.path().join("run/run.toml"), without.collect::<String>());
    sequence.run("compare run run").fails(3, "run.toml: ~ `super-glue` is no method");
}

#[test]
fn poses_that_cannot_be_read_are_named_with_their_line() {
    let sequence = SmallSequence::write();
    let scene = damage::open(sequence.folder());
    let file = sequence.path().join("poses.txt");
    for (content, words) in [
        ("", "poses expected, none found"),
        ("1 2 3\n", "poses.txt:1: ~ TUM"),
        ("a.png 1 0 0 0 0 0 0\n", "with names like `000004`; the file has names like `a.png`"),
        (
            "5 1 0 0 0 0 0 0\n5.png 1 0 0 0 0 0 0\n",
            "poses.txt:2: one pose per frame expected, frame 000005",
        ),
        (
            "0.4 0 0 0 0 0 0 1\n0.5 0 0 0 0 0 9 1\n",
            "poses.txt:2: ~ a quaternion of length 1 expected",
        ),
        ("a.png 2 0 0 0 0 0 0\n", "poses.txt:1: ~ a quaternion of length 1 expected"),
        ("77.4 0 0 0 0 0 0 1\n", "the frames' times are 0.4 … 0.7, the poses' times 77.4"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n", "1 lines found. Poses of some frames need names"),
        ("x,y\n", "poses.txt:1: a header with the columns `name` or `time`"),
        ("1 0 0 0 0 1 0 0 0 0 1 x\n", "poses.txt:1: ~ a number expected, `x` found"),
        ("1 1 0 0 0 0 0 0 1 5.png\n\n2 1 0 0 0 0 0 0 1\n", "poses.txt:3: ~ a line `id qw"),
    ] {
        write(&file, content);
        let read = scene::read_estimates(&file, scene.as_ref());
        let error = read.expect_err(content).to_string();
        damage::expect_words(&error, words);
    }
}

#[test]
fn a_number_that_is_a_frame_and_a_time_is_told_by_its_quaternion_and_then_as_a_frame() {
    let sequence = SmallSequence::write();
    let scene = damage::open(sequence.folder());
    let file = sequence.path().join("poses.txt");
    let frames = |content: &str| -> Vec<String> {
        write(&file, content);
        let read = scene::read_estimates(&file, scene.as_ref());
        let estimates = read.unwrap_or_else(|error| panic!("{error}"));
        estimates.into_keys().collect()
    };
    // Frame 5 was taken at 0.5 s, and no frame at 5 s.
    assert_eq!(frames("5 1 0 0 0 7 8 9\n"), ["000005"]);
    assert_eq!(frames("5 1 0 0 0 0 0 1\n"), ["000005"]);
    assert_eq!(frames("4 0 0 9 0 0 0 1\n0.5 0 0 9 0 0 0 1\n"), ["000005"]);
    assert_eq!(frames("0.5 1 0 0 0 0 0 1\n"), ["000005"]);
}

#[test]
fn an_unreadable_file_of_poses_is_bad_data() {
    let sequence = SmallSequence::write();
    write(sequence.path().join("poses.txt"), "1 2 3\n");
    refused(
        sequence.path(),
        "3 | run sequences/42 --query 5 --reference 4 --estimates other=poses.txt | poses.txt:1: ~ TUM",
    );
}

#[test]
fn poses_of_euroc_are_those_of_a_body() {
    let folder = TempDir::new().expect("a folder");
    scene_toml::write(folder.path());
    for (at, name) in ["1.5", "2.5", "3.5"].iter().enumerate() {
        let from = folder.path().join(format!("photos/img{at}.png"));
        fs::rename(from, folder.path().join(format!("photos/{name}.png"))).expect("is there");
    }
    let [x, y, z] = scene_toml::ORIGIN;
    let header = "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []";
    let row = |at: u32| format!("{at}500000000,{x},{y},{},1,0,0,0\n", z + f64::from(at));
    let rows: String = (1..4).map(row).collect();
    fs::write(folder.path().join("poses.txt"), format!("{header}\n{rows}")).expect("writable");
    let scene = damage::open(folder.path());
    assert_eq!(scene.pose(0).expect("a pose").translation.vector.z, z + 1.0);
    let said = run_in(folder.path(), "doctor .").err;
    has(
        &said,
        "poses of an EuRoC file are those of the body ~ T_BS ~ `body_from_camera = [12 numbers]`",
    );
    let line = "run . --query 2.5 --reference nearest:1 --method x --estimates x=poses.txt";
    has(&run_in(folder.path(), line).err, "poses.txt: the poses of an EuRoC file ~ T_BS");
    // Its rotation is by 90° about z.
    let offset = "body_from_camera = [0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, -0.125]";
    scene_toml::with(folder.path(), "poses =", &format!("{offset}\nposes ="));
    let camera = damage::open(folder.path()).pose(0).expect("a pose");
    let expected = nalgebra::Vector3::new(x + 0.5, y + 0.25, z + 1.0 - 0.125);
    assert!((camera.translation.vector - expected).norm() < 1e-9, "{camera}");
    let right = camera.rotation * nalgebra::Vector3::x();
    assert!((right - nalgebra::Vector3::y()).norm() < 1e-9, "{right}");
    assert!(!run_in(folder.path(), "doctor .").err.contains("EuRoC"));
    scene_toml::with(folder.path(), "poses =", "body_from_camera = [1, 2]\nposes =");
    let error = scene::open(arg(folder.path()), None).err().expect("two numbers");
    damage::expect_words(&error.to_string(), "scene.toml:2");
}
