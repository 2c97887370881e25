//! `report.html`: what `eval` leaves in a run folder and `posescope results --as html` makes of one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

/// Two methods over four frames, one of which is black, with a gate.
fn run(sequence: &SmallSequence, name: &str, extra: &[&str]) -> PathBuf {
    let out = sequence.path().join(name);
    let black = image::GrayImage::new(160, 64);
    black.save(sequence.image("000002")).expect("writable");
    let mut command = posescope();
    command.arg("eval").arg(sequence.folder());
    command.args(["--method", "fb,mi", "--radius", "3", "-q"]);
    command.args(["--reference", "nearest:1", "--gate", "success@mi >= 0"]);
    command.arg("--out").arg(&out).args(extra);
    command.env_remove("GITHUB_STEP_SUMMARY");
    command.assert().code(0);
    out
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Whatever an attribute or a style names.
fn named<'a>(page: &'a str, before: &str, end: char) -> Vec<&'a str> {
    page.split(before)
        .skip(1)
        .filter_map(|rest| rest.split(end).next())
        .collect()
}

/// Where recordings can be looked at without a viewer of one's own: the version that writes them.
fn web_viewer() -> String {
    let manifest = text(&Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
    let manifest: toml::Table = manifest.parse().expect("a manifest");
    let version = manifest["dependencies"]["rerun"]["version"].as_str();
    let version = version.and_then(|version| version.strip_prefix('='));
    let version = version.expect("one version exactly");
    format!(" data-viewer=\"https://app.rerun.io/version/{version}/?url=\"")
}

/// The page names nothing outside itself but a viewer for its recordings, and everything inside that it
/// names is there.
fn assert_self_contained(page: &str) {
    let page = &page.replace(&web_viewer(), "");
    let (body, _) = page.split_once("<script>").expect("there is a script");
    let mut all = named(body, " href=\"", '"');
    all.extend(named(body, " src=\"", '"'));
    all.extend(named(body, "url(", ')'));
    assert!(!all.is_empty());
    for one in all {
        let is_inside = match one.strip_prefix('#') {
            Some(id) => body.contains(&format!(" id=\"{id}\"")),
            None => one.starts_with("data:image/"),
        };
        assert!(is_inside, "{one}");
    }
    for outside in [
        "http:", "https:", "//cdn", "@import", "<link", "<iframe", "fetch(",
    ] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn eval_leaves_a_report_that_needs_nothing_else() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let out = run(&sequence, "run", &["--threads", "1"]);
    let page = text(&out.join("report.html"));
    assert_self_contained(&page);
    assert_eq!(page.matches("<tr id=\"r").count(), 8);
    // Thumbnails are kept once for each query, whatever the number of its results.
    assert_eq!(
        page.matches("{background-image:url(data:image/jpeg;base64,")
            .count(),
        4
    );
    assert!(page.contains("kitti/42") && page.contains("success@mi &gt;= 0"));
    // The black photo is a failure of fb with the line that opens its recording.
    assert!(page.contains("<code>rerun failures/000002-fb.rrd</code>"));
    let link = format!(
        "<a hidden{} data-recording=\"failures/000002-fb.rrd\">",
        web_viewer()
    );
    assert!(page.contains(&link));
    assert!(page.contains("Too few keypoints"));
    // A direct method's failure has its costs.
    assert!(page.contains("Cost of each position"));
    for part in [
        "<caption>",
        "scope=\"col\"",
        "lang=\"en\"",
        "aria-label=\"All results\"",
    ] {
        assert!(page.contains(part), "{part}");
    }

    // From the folder alone, on any number of threads: the same bytes.
    let again = sequence.path().join("again.html");
    let mut command = posescope();
    command
        .arg("results")
        .arg(&out)
        .args(["--as", "html", "--out"]);
    command.arg(&again).args(["--threads", "3"]);
    command.assert().code(0);
    assert_eq!(text(&again), page);

    // Without the scene there are no photos, which is said; everything else stays.
    fs::rename(sequence.folder(), sequence.path().join("away")).expect("movable");
    let mut command = posescope();
    command.arg("results").arg(&out).args(["--as", "html"]);
    command.assert().code(0);
    let page = text(&out.join("report.html"));
    assert_self_contained(&page);
    assert!(page.contains("There are no photos: "));
    assert_eq!(page.matches("<tr id=\"r").count(), 8);
    let mut command = posescope();
    let nowhere = sequence.path().join("nowhere");
    command.arg("results").arg(nowhere).args(["--as", "html"]);
    command.assert().code(3);
}

#[test]
fn the_report_says_all_that_was_asked() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let out = run(
        &sequence,
        "run",
        &["--limit", "3", "--explain", "1", "--min-confidence", "0.25"],
    );
    let page = text(&out.join("report.html"));
    for words in [
        "<dt>limit</dt><dd>3</dd>",
        "<dt>explain</dt><dd>1</dd>",
        "<dt>min-confidence</dt><dd>0.25</dd>",
        "within 1m,5deg of the truth; wrong otherwise",
        "success, as the paper counts it",
    ] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn two_runs_are_held_against_each_other() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let before = run(&sequence, "before", &["--right", "0.5m,5deg"]);
    let after = run(&sequence, "after", &[]);
    let compared = sequence.path().join("compared.html");
    posescope()
        .arg("compare")
        .args([&before, &after])
        .arg("--html")
        .arg(&compared)
        .assert()
        .code(0);
    let page = text(&compared);
    assert_self_contained(&page);
    assert!(page.contains("Changes since <code>"));
    assert!(
        page.contains(">fixed</td>"),
        "a wider tolerance fixes what was wrong"
    );
}

#[test]
fn what_comes_from_elsewhere_is_no_markup() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let out = run(&sequence, "run", &[]);
    let evil = "</td><script>alert('&')</script>";
    for file in ["run.toml", "results.jsonl"] {
        let path = out.join(file);
        let spoilt = text(&path).replace("000002", evil);
        let spoilt = spoilt.replace("Too few keypoints", "<img src=x onerror=alert(1)>");
        fs::write(path, spoilt).expect("writable");
    }
    let mut command = posescope();
    command.arg("results").arg(&out).args(["--as", "html"]);
    command.assert().code(0);
    let page = text(&out.join("report.html"));
    assert!(!page.contains("<script>alert") && !page.contains("<img src=x"));
    assert!(page.contains("&lt;script&gt;alert('&amp;')&lt;/script&gt;"));
    assert_eq!(page.matches("<script>").count(), 1);
    assert_eq!(page.matches("<tr id=\"r").count(), 8);
}

#[test]
fn a_browser_sorts_and_filters_it_without_a_complaint() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let out = run(&sequence, "run", &[]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/ci/check-report.sh");
    let checked = Process::new("bash")
        .arg(script)
        .arg(out.join("report.html"))
        .output();
    let checked = match checked {
        Ok(checked) => checked,
        Err(_) => return println!("skipped: no shell"),
    };
    let said = String::from_utf8_lossy(&checked.stdout);
    println!("{said}");
    if checked.status.code() == Some(77) {
        return;
    }
    let wrong = String::from_utf8_lossy(&checked.stderr);
    assert_eq!(checked.status.code(), Some(0), "{said}{wrong}");
    assert!(said.contains("\"results\":8"), "{said}");
}
