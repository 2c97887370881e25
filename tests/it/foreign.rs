//! What other systems answered: their poses as methods beside ours.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use posescope::diagnosis::Code;
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::scene;
use tempfile::TempDir;

use crate::binary::posescope;
use crate::damage;
use crate::small_sequence::SmallSequence;

fn results(output: &Output) -> Vec<QueryResult> {
    // A program knows the names that it was given.
    for name in ["other", "tum", "kitti", "model", "vloc"] {
        Method::called(name).expect("a plain name");
    }
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let lines = String::from_utf8_lossy(&output.stdout);
    let read = |line: &str| serde_json::from_str(line).expect("a result");
    lines.lines().map(read).collect()
}

fn run(scene: &str, arguments: &[&str]) -> Output {
    let mut command = posescope();
    command
        .args(["run", scene, "--json", "-", "-q"])
        .args(arguments);
    command.output().expect("the binary starts")
}

/// The poses of a method as visuallocalization.net takes them.
fn named_poses(results: &[QueryResult], method: Method) -> String {
    let of_method = results.iter().filter(|result| result.method == method);
    let line = |result: &QueryResult| {
        let pose = result.pose.as_ref()?.to_pose()?.inverse();
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        Some(format!(
            "{} {} {} {} {} {} {} {}\n",
            result.query, q.w, q.x, q.y, q.z, t.x, t.y, t.z
        ))
    };
    of_method.filter_map(line).collect()
}

fn codes(result: &QueryResult) -> BTreeSet<Code> {
    result
        .diagnosis
        .iter()
        .map(|verdict| verdict.code)
        .collect()
}

#[test]
fn an_estimate_that_is_our_own_pose_gets_the_verdicts_that_need_a_pose_alone() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("poses.txt");
    // Night and rain against an overcast reference: MI is wrong in many ways.
    for (queries, wanted) in [
        (
            "street:night",
            ["--query", "70", "--query", "300", "--query", "450"],
        ),
        (
            "street:snow",
            ["--query", "20", "--query", "160", "--query", "610"],
        ),
    ] {
        let asked = |extra: &[&str]| {
            let mut arguments = vec!["--query-scene", queries, "--reference", "nearest:2"];
            arguments.extend(["--radius", "8", "--method", "mi"]);
            arguments.extend(wanted.iter().chain(extra));
            results(&run("street:overcast", &arguments))
        };
        for ours in asked(&[]) {
            let Some(pose) = ours.pose.clone() else {
                continue;
            };
            fs::write(&file, named_poses(std::slice::from_ref(&ours), Method::MI))
                .expect("writable");
            let given = format!("other={}", file.display());
            let (query, reference) = (ours.query.as_str(), ours.references[0].as_str());
            let output = run(
                "street:overcast",
                &[
                    "--query-scene",
                    queries,
                    "--query",
                    query,
                    "--reference",
                    reference,
                    "--radius",
                    "8",
                    "--method",
                    "other",
                    "--estimates",
                    &given,
                ],
            );
            let [other] = results(&output).try_into().expect("one result");
            assert_eq!(other.method.name(), "other");
            let [a, b] = [&pose, other.pose.as_ref().expect("a pose")].map(|pose| pose.position_m);
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9));
            let costs = ours.cost.as_ref().expect("MI has a cost");
            let at_pose = other
                .costs_at_pose
                .iter()
                .find(|at| at.method == Method::MI);
            let at_pose = at_pose.expect("every cost is asked");
            assert!((at_pose.cost.expect("is covered") - costs.best).abs() < 1e-6);
            assert_eq!(at_pose.truth, costs.truth);
            // What MI found beside its result it alone can say: other minima (D2 for D3), the grid
            // (D4, D8), and how far it is to be believed (L1 and X1 that rests on it).
            let alone = [Code::D1, Code::D5, Code::D6, Code::D7];
            let needed: BTreeSet<Code> = codes(&ours)
                .into_iter()
                .filter(|code| alone.contains(code))
                .collect();
            let said: BTreeSet<Code> = codes(&other)
                .into_iter()
                .filter(|code| alone.contains(code))
                .collect();
            println!(
                "{queries} {query} {reference}: {:?} → {:?}",
                codes(&ours),
                codes(&other)
            );
            assert!(needed.is_subset(&said), "{query}: {needed:?} {said:?}");
            let is_wrong = codes(&ours).iter().any(|code| code.is_failure());
            assert_eq!(is_wrong, !codes(&other).is_empty(), "{query}");
        }
    }
}

/// Our own MI poses of the small sequence, and the arguments that ask for them.
fn small() -> (SmallSequence, Vec<QueryResult>) {
    let sequence = SmallSequence::write();
    let scene = sequence.folder();
    let output = run(
        text(&scene),
        &["--all", "--reference", "4", "--method", "mi"],
    );
    let found = results(&output);
    (sequence, found)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

#[test]
fn all_four_texts_say_the_same() {
    let (sequence, found) = small();
    let poses: Vec<_> = found
        .iter()
        .map(|result| {
            result
                .pose
                .as_ref()
                .expect("a pose")
                .to_pose()
                .expect("a pose")
        })
        .collect();
    let folder = TempDir::new().expect("a folder");
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    let numbers = |values: &[f64]| -> String {
        let words: Vec<String> = values.iter().map(ToString::to_string).collect();
        words.join(" ")
    };
    let (mut tum, mut kitti, mut colmap) = (String::new(), String::new(), "# images\n".to_owned());
    for (result, pose) in found.iter().zip(&poses) {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let frame: f64 = result.query.parse().expect("a number");
        tum += &format!(
            "{} {}\n",
            frame / 10.0,
            numbers(&[t.x, t.y, t.z, q.x, q.y, q.z, q.w])
        );
        let rows = result.pose.as_ref().expect("a pose").world_from_camera;
        kitti += &format!("{}\n", numbers(&rows.concat()));
        let inverse = pose.inverse();
        let (t, q) = (inverse.translation.vector, inverse.rotation.coords);
        let inverse = numbers(&[q.w, q.x, q.y, q.z, t.x, t.y, t.z]);
        colmap += &format!("7 {inverse} 1 image_0/{}.png\n1.5 2.5 -1\n", result.query);
    }
    fs::write(at("tum.txt"), tum).expect("writable");
    fs::write(at("kitti.txt"), kitti).expect("writable");
    fs::create_dir(at("model")).expect("writable");
    fs::write(at("model/images.txt"), colmap).expect("writable");
    fs::write(at("vloc.txt"), named_poses(&found, Method::MI)).expect("writable");
    let given: Vec<String> = ["tum.txt", "kitti.txt", "model", "vloc.txt"]
        .map(|name| format!("{}={}", name.trim_end_matches(".txt"), at(name).display()))
        .into();
    let mut arguments = vec!["--all", "--reference", "4", "--method", "mi"];
    arguments.extend(given.iter().flat_map(|given| ["--estimates", given]));
    let output = run(text(&sequence.folder()), &arguments);
    let results = results(&output);
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
    let file = sequence.path().join("poses.txt");
    // One query has no pose.
    fs::write(&file, named_poses(&found[1..], Method::MI)).expect("writable");
    let out = sequence.path().join("run");
    let given = format!("super-glue={}", file.display());
    let eval = |extra: &[&str]| {
        let mut command = posescope();
        command
            .arg("eval")
            .arg(sequence.folder())
            .arg("--out")
            .arg(&out);
        command.args(["--method", "mi", "--radius", "3", "--estimates", &given]);
        command.args(extra).output().expect("the binary starts")
    };
    let output = eval(&["--gate", "success@super-glue >= 0.9"]);
    assert_eq!(output.status.code(), Some(1), "one of three has no pose");
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("super-glue"), "{table}");
    let text = fs::read_to_string(out.join("results.jsonl")).expect("results");
    assert!(text.contains("super-glue has no pose of 000004"), "{text}");
    assert_eq!(eval(&["--resume"]).status.code(), Some(0));
    let mut export = posescope();
    export
        .arg("results")
        .arg(&out)
        .args(["--as", "vloc", "--where", "method = super-glue"]);
    let exported = export.output().expect("the binary starts");
    let lines = String::from_utf8_lossy(&exported.stdout);
    assert_eq!(lines.lines().count(), 2, "{lines}");
    posescope()
        .arg("compare")
        .args([&out, &out])
        .assert()
        .code(0);
    // A run that names a method which nobody brought is not read.
    let run_file = fs::read_to_string(out.join("run.toml")).expect("text");
    let without: String = run_file
        .lines()
        .filter(|line| !line.starts_with("estimates"))
        .map(|line| format!("{line}\n"))
        .collect();
    fs::write(out.join("run.toml"), without).expect("writable");
    let output = posescope()
        .arg("compare")
        .arg(&out)
        .arg(&out)
        .output()
        .expect("starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(
        message.contains("run.toml:") && message.contains("`super-glue` is no method"),
        "{message}"
    );
}

#[test]
fn poses_that_cannot_be_read_are_named_with_their_line() {
    let sequence = SmallSequence::write();
    let scene = scene::open(text(&sequence.folder()), None).expect("our own");
    let file = sequence.path().join("poses.txt");
    for (content, words) in [
        ("", "poses expected, none found"),
        ("1 2 3\n", "poses.txt:1: TUM"),
        (
            "a.png 1 0 0 0 0 0 0\n",
            "are called such as `000004`; here they are called such as `a.png`",
        ),
        (
            "5 1 0 0 0 0 0 0\n5.png 1 0 0 0 0 0 0\n",
            "poses.txt:2: frame 000005 has a pose already",
        ),
        (
            "0.4 0 0 0 0 0 0 1\n0.5 0 0 0 0 0 9 1\n",
            "poses.txt:2: a quaternion of length 1 expected",
        ),
        (
            "a.png 2 0 0 0 0 0 0\n",
            "poses.txt:1: a quaternion of length 1 expected",
        ),
        (
            "77.4 0 0 0 0 0 0 1\n",
            "their times are 0.4 … 0.7, those of the poses 77.4",
        ),
        (
            "1 0 0 0 0 1 0 0 0 0 1 x\n",
            "poses.txt:1: a number expected, `x` found",
        ),
        (
            "1 1 0 0 0 0 0 0 1 5.png\n\n2 1 0 0 0 0 0 0 1\n",
            "poses.txt:3: a line `id qw",
        ),
    ] {
        fs::write(&file, content).expect("writable");
        let read = scene::read_estimates(&file, scene.as_ref());
        let error = read.expect_err(content).to_string();
        damage::expect_words(&error, &[words]);
    }
}

#[test]
fn a_number_that_is_a_frame_and_a_time_is_told_by_its_quaternion_and_then_as_a_frame() {
    let sequence = SmallSequence::write();
    let scene = scene::open(text(&sequence.folder()), None).expect("our own");
    let file = sequence.path().join("poses.txt");
    let frames = |content: &str| -> Vec<String> {
        fs::write(&file, content).expect("writable");
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
fn an_unreadable_file_of_poses_is_bad_data_and_a_wrong_name_is_bad_usage() {
    let sequence = SmallSequence::write();
    let file = sequence.path().join("poses.txt");
    fs::write(&file, "1 2 3\n").expect("writable");
    let poses = format!("other={}", file.display());
    for (given, code, words) in [
        (poses.as_str(), 3, "poses.txt:1: TUM"),
        ("mi=poses.txt", 2, "mi is a method of ours"),
        ("poses.txt", 2, "NAME=FILE expected"),
        ("A B=poses.txt", 2, "cannot name a method"),
    ] {
        let asked = ["--query", "5", "--reference", "4", "--estimates", given];
        let output = run(text(&sequence.folder()), &asked);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{message}");
        assert!(message.contains(words), "{given}: {message}");
    }
}
