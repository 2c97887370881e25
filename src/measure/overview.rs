//! Many results at a glance: one sentence, a bar for each method, and the causes by how often they occur.

use super::finding::Finding;
use super::findings::findings;
use super::groups::grouped;
use super::mended::mended;
use super::metrics::median;
use super::rivals::{Rivals, rivals};
use super::systematic::nothing_in_common;
use crate::diagnosis::{Code, Confidence, Grade};
use crate::estimator;
use crate::localize::QueryResult;
use crate::opinion::Standing;

/// Remedies that the headline names, at most.
const REMEDIES: usize = 3;

/// What a run came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overview {
    /// Mistakes of a whole scene.
    pub findings: Vec<Finding>,
    /// How the best method did, why its worst failures failed, and what mends most of them.
    pub headline: String,
    /// What else is known of files of other systems' poses, a sentence each.
    pub remarks: Vec<String>,
    /// One bar for each method, in the order of the results.
    pub bars: Vec<Bar>,
    /// The primary causes of all failures, the most frequent first.
    pub causes: Vec<(Code, usize)>,
}

/// How many results of a method have each grade.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// The method as it is typed, with its fusion.
    pub name: String,
    /// In the order of [`Grade::ALL`].
    pub counts: [usize; Grade::ALL.len()],
    /// How many poses are trusted.
    pub trusted: usize,
    /// How many poses have each second opinion, in the order of [`Standing::ALL`].
    pub opinions: [usize; Standing::ALL.len()],
    /// The median translation error of its poses \[m\].
    pub median_m: Option<f64>,
    /// The most frequent primary cause of its failures.
    pub cause: Option<(Code, usize)>,
}

impl Bar {
    /// All results of the method.
    pub fn total(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Those of a grade.
    pub fn count(&self, grade: Grade) -> usize {
        let place = Grade::ALL.iter().position(|known| *known == grade);
        place.map_or(0, |place| self.counts[place])
    }
}

impl Overview {
    /// Of the results of a run, and of what `posescope doctor` says of its scenes.
    pub fn of(results: &[&QueryResult], examined: &[Finding]) -> Self {
        let bars = grouped(results.iter().map(|result| (result.method_name(), *result)));
        let bars = bars.into_iter().map(|(name, results)| {
            let of = |grade| results.iter().filter(|one| one.grade == grade).count();
            let errors: Vec<f64> =
                results.iter().filter_map(|one| Some(one.error?.translation_m)).collect();
            let word = |one: &QueryResult| one.confidence.as_ref().map(|known| known.word);
            let failed = results.iter().filter(|one| one.is_suspect());
            // Of equally frequent ones the first.
            let cause = causes(failed).into_iter().rev().max_by_key(|(_, times)| *times);
            Bar {
                name,
                counts: Grade::ALL.map(of),
                trusted: results
                    .iter()
                    .filter(|one| word(one) == Some(Confidence::Trusted))
                    .count(),
                opinions: opinions(&results),
                median_m: median(&errors),
                cause,
            }
        });
        let bars: Vec<Bar> = bars.collect();
        let mut causes = causes(results.iter().filter(|result| result.is_suspect()));
        // A stable sort: causes that are as frequent stay in the order in which they occur.
        causes.sort_by_key(|(_, times)| std::cmp::Reverse(*times));
        let findings = findings(results, examined);
        let mut remarks = nothing_in_common(results, &findings);
        remarks.extend(rivals(results).iter().map(Rivals::words));
        Self { findings, headline: headline(results, &bars), remarks, bars, causes }
    }
}

/// The positions of the failures: wrong poses by their error, those that a second opinion contradicts by how far off
/// they seem, then those without a pose.
pub fn worst_first(results: &[QueryResult]) -> Vec<usize> {
    let failures = (0..results.len()).filter(|&at| results[at].is_suspect());
    let mut failures: Vec<usize> = failures.collect();
    let off_m = |at: usize| {
        let result = &results[at];
        // A second opinion may be of a turn alone, which counts like the distance that is as wrong.
        let estimated = result.opinion.as_ref().and_then(|one| Some(one.share()? * one.within.m));
        let off_m = result.error.map(|error| error.translation_m).or(estimated);
        off_m.filter(|_| result.grade != Grade::NoPose).unwrap_or(f64::NEG_INFINITY)
    };
    failures.sort_by(|&one, &other| off_m(other).total_cmp(&off_m(one)));
    failures
}

/// How many results have each primary cause.
fn causes<'a>(results: impl Iterator<Item = &'a &'a QueryResult>) -> Vec<(Code, usize)> {
    let primary = results.filter_map(|result| Some((result.diagnosis.first()?.code, ())));
    let causes = grouped(primary).into_iter();
    causes.map(|(code, results)| (code, results.len())).collect()
}

/// How many poses have each second opinion.
fn opinions(results: &[&QueryResult]) -> [usize; Standing::ALL.len()] {
    let standings = || results.iter().filter_map(|one| Some(one.opinion.as_ref()?.standing));
    Standing::ALL.map(|standing| standings().filter(|one| *one == standing).count())
}

/// What the second opinions on a method's poses come to, as the end of a sentence; empty where there are none.
fn opinions_in_words(bar: &Bar) -> String {
    let counts = Standing::ALL.into_iter().zip(bar.opinions).filter(|(_, count)| *count > 0);
    let parts: Vec<String> =
        counts.map(|(standing, count)| format!("{count} {standing}")).collect();
    if parts.is_empty() {
        String::new()
    } else {
        format!(": by a second opinion {}", parts.join(", "))
    }
}

/// The poses of another system are what a run is about, and methods beside it are there to compare.
fn headline(results: &[&QueryResult], bars: &[Bar]) -> String {
    let is_foreign = |result: &&QueryResult| estimator::find(result.method).is_none();
    let (foreign, own): (Vec<_>, Vec<_>) = results.iter().copied().partition(is_foreign);
    let of = |those: &[&QueryResult]| -> Vec<Bar> {
        let is_of = |bar: &&Bar| those.iter().any(|one| one.method_name() == bar.name);
        bars.iter().filter(is_of).cloned().collect()
    };
    match (of(&foreign).as_slice(), of(&own).as_slice()) {
        ([only], own_bars @ [_, ..]) => {
            let words = best_in_words(&foreign, std::slice::from_ref(only), true);
            let compared = own_bars.iter().map(|bar| {
                format!("{} for {} of {}", bar.name, bar.count(Grade::Right), bar.total())
            });
            let compared: Vec<String> = compared.collect();
            let is_measured = foreign.iter().any(|one| one.error.is_some());
            if is_measured {
                format!("{words} Beside it are right: {}.", compared.join(", "))
            } else {
                words
            }
        }
        _ => best_in_words(results, bars, false),
    }
}

/// How the best method did, which is called by its name even if it is right for nothing where `is_named`.
fn best_in_words(results: &[&QueryResult], bars: &[Bar], is_named: bool) -> String {
    let is_measured =
        results.iter().any(|result| matches!(result.grade, Grade::Right | Grade::Wrong));
    let worth = |bar: &Bar| {
        if is_measured { bar.count(Grade::Right) } else { bar.total() - bar.count(Grade::NoPose) }
    };
    // Of equal ones the first.
    let Some(best) = bars.iter().rev().max_by_key(|bar| worth(bar)) else {
        return "There are no results yet.".to_owned();
    };
    let (name, good, total) = (&best.name, worth(best), best.total());
    let queries = if total == 1 { "query" } else { "queries" };
    if !is_measured && good == 0 {
        return if is_named {
            format!("{name} gives no pose for any of {total} {queries}.")
        } else {
            format!("No method gives a pose for any of {total} {queries}.")
        };
    }
    if !is_measured {
        let opinions = opinions_in_words(best);
        return format!(
            "{name} gives a pose for {good} of {total} {queries}{opinions}. The truth is not known."
        );
    }
    let mut words = match good {
        0 if is_named => format!("{name} is right for none of {total} {queries}."),
        0 if total == 1 => "No method is right for the query.".to_owned(),
        0 => format!("No method is right for any of {total} {queries}."),
        _ if bars.len() > 1 => {
            format!("Best method: {name}, right for {good} of {total} {queries}.")
        }
        _ => format!("{name} is right for {good} of {total} {queries}."),
    };
    // Where none is right, all failures count.
    let is_counted = |result: &QueryResult| good == 0 || result.method_name() == *name;
    let whose = if good == 0 && !is_named { "the" } else { "its" };
    let failed: Vec<&&QueryResult> =
        results.iter().filter(|result| is_counted(result) && result.is_suspect()).collect();
    let causes = causes(failed.iter().copied());
    if let Some((code, times)) = causes.iter().rev().max_by_key(|(_, times)| *times) {
        words += &format!(
            " Most frequent cause of {whose} failures: {} ({times} of {}).",
            code.title(),
            failed.len()
        );
    }
    let explained: Vec<&QueryResult> = failed.into_iter().copied().collect();
    let mends = mended(&explained).into_iter().take(REMEDIES);
    let mends: Vec<String> =
        mends.map(|(remedy, queries)| format!("{remedy} ({queries})")).collect();
    if !mends.is_empty() {
        words += &format!(" What mends most: {}.", mends.join(", "));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localize::{Explanation, Helped};
    use crate::measure::metrics::tests::row;
    use crate::method::Method;

    #[test]
    fn the_headline_names_the_best_method_and_its_most_frequent_cause() {
        let mut rows = vec![
            row("1", "fb", Some(0.1)),
            row("2", "fb", None),
            row("1", "mi", Some(0.1)),
            row("2", "mi", Some(9.0)),
        ];
        rows[3].diagnosis = vec![crate::measure::metrics::tests::finding(Code::D3)];
        rows.push(row("3", "mi", Some(0.2)));
        let all: Vec<&QueryResult> = rows.iter().collect();
        let overview = Overview::of(&all, &[]);
        assert_eq!(
            overview.headline,
            format!(
                "Best method: mi, right for 2 of 3 queries. Most frequent cause of its failures: {} (1 of 1).",
                Code::D3.title()
            )
        );
        let one = Overview::of(&all[..2], &[]);
        assert_eq!(one.headline, "fb is right for 1 of 2 queries.");
        let counts: Vec<_> = overview
            .bars
            .iter()
            .map(|bar| (bar.name.as_str(), bar.count(Grade::Right), bar.total()))
            .collect();
        assert_eq!(counts, [("fb", 1, 2), ("mi", 2, 3)]);
        assert_eq!(overview.causes, [(Code::D3, 1)]);
        let wrong = Overview::of(&[&rows[3], &rows[1]], &[]);
        let title = Code::D3.title();
        let words = "No method is right for the query. Most frequent cause of the failures:";
        assert_eq!(wrong.headline, format!("{words} {title} (1 of 2)."));
        assert_eq!(Overview::of(&[], &[]).headline, "There are no results yet.");
    }

    #[test]
    fn the_headline_ranks_remedies_and_names_no_frame() {
        let explained = |query: &str, helped: &[&str]| {
            let error = row(query, "mi", Some(0.1)).error.expect("an error");
            let args = |words: &&str| words.split(' ').map(str::to_owned).collect();
            let helped = helped.iter().map(|one| Helped { args: args(one), error }).collect();
            let explanation = Explanation { helped, complete: true, ..Explanation::default() };
            QueryResult { explanation: Some(explanation), ..row(query, "mi", Some(9.0)) }
        };
        let rows = [
            explained("1", &["--reference 000133", "--method pm"]),
            explained("2", &["--set grid.rounds=2", "--reference 000140"]),
            explained("3", &["--set grid.rounds=2", "--reference 000007"]),
        ];
        let said = Overview::of(&rows.iter().collect::<Vec<_>>(), &[]).headline;
        let mends = "What mends most: a reference farther away (3), `grid.rounds=2` (2), `--method pm` (1).";
        assert_eq!(said, format!("No method is right for any of 3 queries. {mends}"));
    }

    #[test]
    fn the_headline_is_about_the_other_system() {
        let mine = |query: &str, off_m: f64| QueryResult {
            method: Method::called("mine").expect("a name"),
            ..row(query, "fb", Some(off_m))
        };
        let rows =
            [mine("1", 9.0), row("1", "fb", Some(0.1)), mine("2", 0.1), row("2", "fb", Some(0.1))];
        let all: Vec<&QueryResult> = rows.iter().collect();
        let said = Overview::of(&all, &[]).headline;
        assert_eq!(said, "mine is right for 1 of 2 queries. Beside it are right: fb for 2 of 2.");
        let said = Overview::of(&all[..2], &[]).headline;
        assert_eq!(said, "mine is right for none of 1 query. Beside it are right: fb for 1 of 1.");
    }

    #[test]
    fn causes_stand_by_frequency_and_equal_ones_as_they_occur() {
        let codes = [Code::R2, Code::D4, Code::D3, Code::D3];
        let rows: Vec<QueryResult> = codes
            .into_iter()
            .map(|code| QueryResult {
                diagnosis: vec![crate::measure::metrics::tests::finding(code)],
                ..row("1", "mi", Some(9.0))
            })
            .collect();
        let all: Vec<&QueryResult> = rows.iter().collect();
        let causes = Overview::of(&all, &[]).causes;
        assert_eq!(causes, [(Code::D3, 2), (Code::R2, 1), (Code::D4, 1)]);
    }
}
