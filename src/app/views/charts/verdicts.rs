//! Which verdicts are frequent, by method and by condition.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use egui::{Button, Grid, RichText, ScrollArea, Ui};
use egui_plot::{Bar, BarChart, Legend, Plot};

use super::Chosen;
use crate::app::{Command, ViewContext, theme};
use crate::diagnosis::Code;
use crate::localize::QueryResult;
use crate::method::Method;

/// The most frequent first, one bar for each method on top of the other.
pub(super) fn by_method(ui: &mut Ui, results: &[Chosen<'_>]) {
    let mut counts: BTreeMap<Code, BTreeMap<Method, usize>> = BTreeMap::new();
    for (_, result) in results {
        if let Some(finding) = result.diagnosis.first() {
            let of_code = counts.entry(finding.code).or_default();
            *of_code.entry(result.method).or_default() += 1;
        }
    }
    if counts.is_empty() {
        ui.weak("None of these results has a verdict: all are right and sure");
        return;
    }
    let mut codes: Vec<(Code, BTreeMap<Method, usize>)> = counts.into_iter().collect();
    codes.sort_by_key(|(code, counts)| (Reverse(counts.values().sum::<usize>()), *code));
    let names: Vec<&str> = codes.iter().map(|(code, _)| code.name()).collect();
    let methods: BTreeSet<Method> = codes
        .iter()
        .flat_map(|(_, counts)| counts.keys().copied())
        .collect();
    let labels = names.clone();
    let plot = Plot::new("verdicts")
        .y_axis_label("results")
        .legend(Legend::default())
        .x_axis_formatter(move |mark, _| {
            let index = mark.value.round();
            let is_whole = (mark.value - index).abs() < 1e-6;
            let name = labels.get(index.max(0.0) as usize);
            match (is_whole && index >= 0.0, name) {
                (true, Some(name)) => (*name).to_owned(),
                _ => String::new(),
            }
        })
        .show(ui, |plot| {
            let mut below = vec![0.0; codes.len()];
            for method in methods {
                let bars = codes
                    .iter()
                    .enumerate()
                    .filter_map(|(index, (code, counts))| {
                        let count = *counts.get(&method)? as f64;
                        let bar = Bar::new(index as f64, count)
                            .base_offset(below[index])
                            .width(0.7)
                            .name(format!("{} {code}: {}", method.label(), code.title()));
                        below[index] += count;
                        Some(bar)
                    });
                let bars: Vec<Bar> = bars.collect();
                plot.bar_chart(BarChart::new(method.label(), bars).color(theme::method(method)));
            }
        });
    let words: Vec<String> = codes
        .iter()
        .map(|(code, counts)| format!("{code} {}", counts.values().sum::<usize>()))
        .collect();
    plot.response.widget_info(|| {
        let words = format!("Verdicts: {}", words.join(", "));
        egui::WidgetInfo::labeled(egui::Role::Image, true, words)
    });
}

/// Where the query and where the references are from.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    queries: String,
    references: String,
}

impl Pair {
    fn of(result: &QueryResult) -> Self {
        let references = result.scene.clone();
        Self {
            queries: result.query_scene.clone().unwrap_or(references.clone()),
            references,
        }
    }

    /// Such as `street:night ← street:overcast`.
    fn words(&self) -> String {
        if self.queries == self.references {
            self.references.clone()
        } else {
            format!("{} ← {}", self.queries, self.references)
        }
    }
}

/// How often a method's primary verdict is which, in each condition.
#[derive(Default)]
struct Tally {
    /// `None` is a result without a verdict.
    counts: BTreeMap<(Option<Code>, Pair), usize>,
}

impl Tally {
    fn of<'a>(results: impl Iterator<Item = &'a QueryResult>) -> Self {
        let mut tally = Self::default();
        for result in results {
            let code = result.diagnosis.first().map(|verdict| verdict.code);
            *tally.counts.entry((code, Pair::of(result))).or_default() += 1;
        }
        tally
    }

    fn count(&self, code: Option<Code>, pair: &Pair) -> usize {
        let found = self.counts.get(&(code, pair.clone()));
        found.copied().unwrap_or_default()
    }

    fn pairs(&self) -> BTreeSet<&Pair> {
        self.counts.keys().map(|(_, pair)| pair).collect()
    }

    /// Results without a verdict come first, then the most frequent verdict.
    fn codes(&self) -> Vec<Option<Code>> {
        let mut sums: BTreeMap<Option<Code>, usize> = BTreeMap::new();
        for ((code, _), count) in &self.counts {
            *sums.entry(*code).or_default() += count;
        }
        let mut codes: Vec<Option<Code>> = sums.keys().copied().collect();
        codes.sort_by_key(|code| (code.is_some(), Reverse(sums[code]), *code));
        codes
    }

    /// All results of a condition.
    fn all(&self, pair: &Pair) -> usize {
        let own = self.counts.iter().filter(|((_, other), _)| other == pair);
        own.map(|(_, count)| count).sum()
    }
}

/// A table for each method: verdicts in rows, scenes of queries and references in columns. A click on a
/// number looks at its results.
pub(super) fn by_condition(ui: &mut Ui, context: &ViewContext<'_>, results: &[Chosen<'_>]) {
    let methods: BTreeSet<Method> = results.iter().map(|(_, result)| result.method).collect();
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        for method in methods {
            let own = results.iter().map(|(_, result)| *result);
            let tally = Tally::of(own.filter(|result| result.method == method));
            ui.strong(method.label());
            ui.push_id(method.name(), |ui| table(ui, context, method, &tally));
            ui.add_space(8.0);
        }
    });
}

fn table(ui: &mut Ui, context: &ViewContext<'_>, method: Method, tally: &Tally) {
    let pairs = tally.pairs();
    Grid::new("verdicts").striped(true).show(ui, |ui| {
        ui.weak("first verdict");
        for pair in &pairs {
            ui.weak(pair.words());
        }
        ui.end_row();
        for code in tally.codes() {
            match code {
                Some(code) => ui.strong(code.name()).on_hover_text(code.title()),
                None => ui.weak("none"),
            };
            for pair in &pairs {
                match tally.count(code, pair) {
                    0 => {
                        ui.weak("·");
                    }
                    count => cell(ui, context, count, method, code, pair, tally.all(pair)),
                }
            }
            ui.end_row();
        }
    });
}

/// A number that is clicked to see its results.
fn cell(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    count: usize,
    method: Method,
    code: Option<Code>,
    pair: &Pair,
    all: usize,
) {
    let name = code.map_or("none", |code| code.name());
    let share = 100.0 * count as f64 / all.max(1) as f64;
    let text = RichText::new(format!("{count} ({share:.0} %)"));
    let text = match code {
        Some(_) => text,
        None => text.color(theme::text(ui.visuals(), theme::TRUTH)),
    };
    let words = format!(
        "{} {name}, {}: {count} of {all}",
        method.label(),
        pair.words()
    );
    let answer = ui.add(Button::new(text).frame(false));
    answer.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &words));
    if answer
        .on_hover_text(format!("{words}. Look at these"))
        .clicked()
    {
        context.send(Command::FilterResults(condition(method, code, pair)));
        context.send(Command::ShowView("batch"));
    }
}

/// What chooses the results of a cell.
fn condition(method: Method, code: Option<Code>, pair: &Pair) -> String {
    let code = code.map_or("\"\"", |code| code.name());
    let Pair {
        queries,
        references,
    } = pair;
    format!(
        "method = {method} and code = {code} and queries = \"{queries}\" and scene = \"{references}\""
    )
}
