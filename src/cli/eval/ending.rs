//! What `eval` prints at the end: how each method did, why the worst failed, and what to type next.

use std::collections::BTreeSet;
use std::path::Path;

use posescope::diagnosis::{Grade, confidence};
use posescope::localize::QueryResult;
use posescope::measure::{Bar, Finding, Overview, Report, worst_first};
use posescope::opinion::Standing;
use posescope::report::repeat_command;
use posescope::run::RunFile;
use posescope::session::command_line;
use posescope::table::{Table, wrapped};

/// The most characters of a line.
const WIDEST: usize = 100;
/// The most failures that are listed, each with the command that opens it.
const WORST: usize = 5;

/// The text, in lines that fit a terminal of this width.
pub fn ending(run: &RunFile, report: &Report, folder: &Path, width: Option<usize>) -> String {
    let results = &report.results.results;
    let width = width.unwrap_or(WIDEST).min(WIDEST);
    let lines = |text: &str| wrapped(text, width, "  ");
    let overview = Overview::of(&results.iter().collect::<Vec<_>>(), &[]);
    let table = methods(&overview.bars).in_words_of(report.results.unit());
    let mut text = lines(&overview.headline) + "\n" + &table.to_text(Some(width));
    let meanings = report.results.unit().words(&meanings(run, &overview.bars));
    text += &(meanings.lines().map(lines).collect::<String>() + "\n");
    for Finding { text: found, .. } in &report.findings {
        text += &lines(&format!("Finding: {found}"));
    }
    for remark in &overview.remarks {
        text += &lines(remark);
    }
    for one in &report.gate_results {
        let verdict = if one.passed { "passed" } else { "FAILED" };
        text += &lines(&format!("{verdict}: {}: {}", one.gate, one.found));
    }
    for line in report.known.lines() {
        text += &lines(&line);
    }
    text += &worst(run, results, folder, width);
    let path = |words: &str, path: &Path| format!("{words} {}\n", path.display());
    text += &path("Report:", &folder.join(posescope::report::REPORT));
    let all = ["results", &folder.display().to_string(), "--table", "summary"];
    text + &format!("All figures: {}\n", command_line(&all.map(str::to_owned)))
}

/// One row per method.
fn methods(bars: &[Bar]) -> Table {
    let grades = Grade::ALL.into_iter();
    let grades: Vec<Grade> =
        grades.filter(|grade| bars.iter().any(|bar| bar.count(*grade) > 0)).collect();
    // Poses of other systems have second opinions, and own ones a confidence.
    let has_opinions = bars.iter().any(|bar| bar.opinions != [0; 3]);
    let has_confidence = bars.iter().any(|bar| bar.opinions == [0; 3]);
    let names = grades.iter().map(|grade| grade.word());
    let header = ["method"].into_iter().chain(names);
    let opinions = Standing::ALL.map(Standing::word);
    let header = header.chain(opinions.into_iter().filter(|_| has_opinions));
    let header = header.chain(["trusted"].into_iter().filter(|_| has_confidence));
    let header = header.chain(["median error", "cause of failures"]);
    let mut table = Table::new("", "", header);
    if let Some(cause) = table.align.last_mut() {
        *cause = posescope::table::Align::Note;
    }
    for bar in bars {
        let counts = grades.iter().map(|grade| bar.count(*grade).to_string());
        let error = bar.median_m.map_or("–".to_owned(), |median| format!("{median:.3} m"));
        let cause =
            bar.cause.map(|(code, times)| format!("mostly {code} {} ({times})", code.title()));
        let own = bar.opinions == [0; 3];
        let counted =
            |is: bool, count: usize| if is { count.to_string() } else { "–".to_owned() };
        let opinions = bar.opinions.map(|count| counted(!own, count));
        let cells = [bar.name.clone()].into_iter().chain(counts);
        let cells = cells.chain(opinions.into_iter().filter(|_| has_opinions));
        let trusted = counted(own, bar.trusted);
        let cells = cells.chain([trusted].into_iter().filter(|_| has_confidence));
        table.push(cells.chain([error, cause.unwrap_or_default()]));
    }
    table
}

/// What the columns of the table count, in lines.
fn meanings(run: &RunFile, bars: &[Bar]) -> String {
    let right = run.protocol.right;
    let (metres, degrees) = (right.translation_m, right.rotation_deg);
    let measured = format!(
        "Right: within {metres} m and {degrees}° of the truth. Median error: over all poses, right or wrong.\n"
    );
    let trusted = format!(
        "Trusted: by the method's own evidence at least {} likely right.\n",
        confidence::percent(confidence::TRUSTED_FROM)
    );
    let compared = "Confirmed, contradicted: by posescope's own pose of the query, found from the same references.\n";
    let is_any = |is: fn(&Bar) -> bool| bars.iter().any(is);
    let lines = [
        (measured, is_any(|bar| bar.median_m.is_some())),
        (trusted, is_any(|bar| bar.opinions == [0; 3])),
        (compared.to_owned(), is_any(|bar| bar.opinions != [0; 3])),
    ];
    lines.into_iter().filter_map(|(line, is_said)| is_said.then_some(line)).collect()
}

/// The worst failures, each of another query, with the commands that open them. One without a pose is among them
/// if there is any.
fn worst(run: &RunFile, results: &[QueryResult], folder: &Path, width: usize) -> String {
    let failures: Vec<&QueryResult> =
        worst_first(results).into_iter().map(|at| &results[at]).collect();
    let mut seen = BTreeSet::new();
    let distinct =
        failures.iter().filter(|one| seen.insert((&one.scene, &one.query_scene, &one.query)));
    let mut worst: Vec<&QueryResult> = distinct.copied().take(WORST).collect();
    let is_missing = |one: &QueryResult| one.grade == Grade::NoPose;
    let missing = failures.iter().find(|one| is_missing(one));
    if let Some(missing) = missing.filter(|_| !worst.iter().any(|one| is_missing(one))) {
        worst.truncate(WORST - 1);
        worst.push(missing);
    }
    if worst.is_empty() {
        return String::new();
    }
    let count =
        |grade: Grade| -> usize { failures.iter().filter(|one| one.grade == grade).count() };
    let (wrong, missing) = (count(Grade::Wrong), count(Grade::NoPose));
    let contradicted = count(Grade::Unmeasured);
    let kinds = [
        (contradicted, "contradicted by a second opinion"),
        (wrong, "wrong"),
        (missing, "without a pose"),
    ];
    // What cannot be known is not counted.
    let is_told = |(count, what): &(usize, &str)| {
        *count > 0 || contradicted == 0 && *what != "contradicted by a second opinion"
    };
    let kinds: Vec<String> =
        kinds.into_iter().filter(is_told).map(|(count, what)| format!("{count} {what}")).collect();
    let mut text = wrapped(&format!("Failures: {}. The worst:", kinds.join(", ")), width, "  ");
    for one in worst {
        let cause = one.diagnosis.first().map(|found| format!(", {}", found.code.title()));
        let (wrong, cause) = (one.how_wrong(), cause.unwrap_or_default());
        let line = format!("  {} {}: {wrong}{cause}", one.query, one.method_name());
        text += &wrapped(&line, width, "    ");
        text += &format!("    {}\n", opening(run, one, folder));
    }
    let mut condition = "grade = wrong or grade = \"no pose\"".to_owned();
    if contradicted > 0 {
        condition += " or opinion = contradicted";
    }
    let all = ["results", &folder.display().to_string(), "--where", &condition];
    text + &format!("All failures: {}\n\n", command_line(&all.map(str::to_owned)))
}

/// The command that opens a query: in the run, whose window shows its first pair of scenes, or alone.
fn opening(run: &RunFile, result: &QueryResult, folder: &Path) -> String {
    let first = run.pairs.first();
    let is_first = run.pair_of(result).zip(first).is_some_and(|(own, first)| own == first);
    if is_first {
        let folder = folder.display().to_string();
        return command_line(&[
            "view".to_owned(),
            folder,
            "--query".to_owned(),
            result.query.clone(),
            "--method".to_owned(),
            result.method.to_string(),
        ]);
    }
    repeat_command(run, result).replacen("posescope run", "posescope view", 1)
}
