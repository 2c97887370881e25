//! `report.html`: what `eval` leaves in a run folder and `posescope results --as html` makes of one.

use std::fs;
use std::path::Path;
use std::process::Command as Process;

use crate::binary::{Said, command_in, has, text, write};
use crate::small_sequence::SmallSequence;

/// Two methods over four frames, one of which is black, with a gate: the report.
#[track_caller]
fn run(sequence: &SmallSequence, out: &str, words: &str) -> String {
    sequence.blacken("000002");
    let asked = "--method fb,mi --radius 3 -q --reference nearest:1 --gate 'success@mi >= 0'";
    let line = format!("eval sequences/42 {asked} --out {out} {words}");
    Said::by(command_in(sequence.path(), &line).env_remove("GITHUB_STEP_SUMMARY")).ok();
    sequence.text(&format!("{out}/report.html"))
}

/// Whatever an attribute or a style names.
fn named<'a>(page: &'a str, before: &str, end: char) -> Vec<&'a str> {
    page.split(before).skip(1).filter_map(|rest| rest.split(end).next()).collect()
}

/// The page has these words, each after the one before.
#[track_caller]
fn has_in_order(page: &str, words: &str) {
    let mut rest = page;
    for word in words.split(" ~ ") {
        let (_, after) =
            rest.split_once(word).unwrap_or_else(|| panic!("`{word}` is missing or too early"));
        rest = after;
    }
}

/// Each frame shows the same wall, so that a reference finds its own pose, whatever the query.
#[test]
fn the_proof_of_a_fusion_is_drawn_around_the_reference_that_dragged_it() {
    let sequence = SmallSequence::write();
    let asked = "--method mi --radius 3 -q --query 4 --reference nearest:2 --fusion avg";
    sequence.run(&format!("eval sequences/42 {asked} --right 1.5m,5deg --out run")).ok();
    let page = sequence.text("run/report.html");
    has(&page, "Reference 000007 dragged the fused pose");
    has(&page, "Query; Reference 000007\"");
}

/// Where recordings can be looked at without a viewer of one's own: the version that writes them.
fn web_viewer() -> String {
    let manifest = text(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
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
    for outside in ["http:", "https:", "//cdn", "@import", "<link", "<iframe", "fetch("] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn eval_leaves_a_report_that_needs_nothing_else() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let page = run(&sequence, "run", "--threads 1 --explain 1 --min-confidence 0.25");
    assert_self_contained(&page);
    assert_eq!(page.matches("<tr id=\"r").count(), 8);
    // Thumbnails are kept once for each query, whatever the number of its results.
    let thumbnail = "{background-image:url(data:image/jpeg;base64,";
    assert_eq!(page.matches(thumbnail).count(), 4);
    // The black photo is a failure of fb with the line that opens its recording, and a direct method's
    // failure has its costs.
    let viewer = web_viewer();
    has(&page, &format!("<a hidden{viewer} data-recording=\"failures/000002-fb.rrd\">"));
    for words in [
        "kitti/42 ~ success@mi &gt;= 0 ~ Too few keypoints ~ Cost of each position",
        "<code>rerun failures/000002-fb.rrd</code>",
        "<caption> ~ scope=\"col\" ~ lang=\"en\" ~ aria-label=\"All results\"",
        "<dt>explain</dt><dd>1</dd> ~ <dt>min-confidence</dt><dd>0.25</dd>",
        "within 1m,5deg of the truth; wrong otherwise ~ success, as the paper counts it",
    ] {
        has(&page, words);
    }

    // What came of the run is first, what was run is last.
    has_in_order(
        &page,
        "class=\"headline\" ~ id=\"gates\" ~ id=\"methods\" ~ id=\"causes\" ~ id=\"failures\" ~ id=\"queries\" ~ \
         id=\"plots\" ~ id=\"figures\" ~ id=\"asked\"",
    );
    // The bars count every result, with its grade in words.
    has(&page, "role=\"img\" aria-label=\"fb: ~ no pose\" ~ aria-label=\"mi: ");
    // The worst failures are open, the greatest error first; a cause in the table leads to them.
    let (_, open) = page.split_once("id=\"failures\"").expect("failures");
    let (open, _) = open.split_once("id=\"queries\"").expect("results");
    assert!((1..=3).contains(&open.matches(" open>").count()), "{open}");
    has(open, "class=\"sentence\" ~ class=\"code\"");
    // Every column has a box, and the first ones are chosen.
    assert_eq!(page.matches("<input type=\"checkbox\"").count(), 11);
    assert_eq!(page.matches(" checked autocomplete").count(), 5);

    // From the folder alone, on any number of threads: the same bytes.
    sequence.run("results run --as html --out again.html --threads 3").ok();
    assert!(sequence.text("again.html") == page);

    // Without the scene there are no photos, which is said; everything else stays.
    fs::rename(sequence.folder(), sequence.path().join("away")).expect("movable");
    sequence.run("results run --as html").ok();
    let page = sequence.text("run/report.html");
    assert_self_contained(&page);
    has(&page, "There are no photos: ");
    assert_eq!(page.matches("<tr id=\"r").count(), 8);
    sequence.run("results nowhere --as html").fails(3, "nowhere");

    // What comes from elsewhere is no markup.
    for file in ["run.toml", "results.jsonl"] {
        let path = sequence.path().join("run").join(file);
        let spoilt = text(&path).replace("000002", "</td><script>alert('&')</script>");
        let spoilt = spoilt.replace("Too few keypoints", "<img src=x onerror=alert(1)>");
        write(path, spoilt);
    }
    sequence.run("results run --as html").ok();
    let page = sequence.text("run/report.html");
    assert!(!page.contains("<script>alert") && !page.contains("<img src=x"));
    has(&page, "&lt;script&gt;alert('&amp;')&lt;/script&gt;");
    assert_eq!(page.matches("<script>").count(), 1);
    assert_eq!(page.matches("<tr id=\"r").count(), 8);
}

#[test]
fn two_runs_are_held_against_each_other() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let before = run(&sequence, "before", "--right 0.5m,5deg --limit 3");
    has(&before, "<dt>limit</dt><dd>3</dd>");
    run(&sequence, "after", "--limit 3");
    sequence.run("compare before after --html compared.html").ok();
    let page = sequence.text("compared.html");
    assert_self_contained(&page);
    // A wider tolerance fixes what was wrong.
    has(&page, "Changes since <code> ~ >fixed</td>");
}

#[test]
fn a_browser_sorts_and_filters_it_without_a_complaint() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    run(&sequence, "run", "");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/ci/check-report.sh");
    let mut shell = Process::new("bash");
    shell.arg(script).arg(sequence.path().join("run/report.html"));
    let Ok(output) = shell.output() else {
        return println!("skipped: no shell");
    };
    let said = Said::of(&output);
    println!("{}", said.out);
    if said.code != Some(77) {
        has(&said.ok().out, "\"results\":8");
    }
}
