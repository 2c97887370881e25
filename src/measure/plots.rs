//! The plots of a run.

use std::collections::{BTreeMap, BTreeSet};

use clap::ValueEnum;

use super::groups::grouped;
use super::metrics::{Group, Measures};
use super::results::RunResults;
use crate::chart::{self, Axis, Chart, Mark, Shape, round_up};
use crate::diagnosis::Code;
use crate::localize::{CostReport, QueryResult, Status};
use crate::method::Method;
use crate::palette;

/// The number of distance bins.
const BINS: f64 = 6.0;
/// The shortest bar with a label \[%\].
const LABELLED_FROM: f64 = 5.0;
/// Results without a pose are drawn above the greatest error by this factor.
const ABOVE: f64 = 2.0;
/// The width of a bar \[px\].
const BAR_PX: f64 = 26.0;

/// A kind of plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Plot {
    /// Error over the distance of the reference.
    Errors,
    /// Primary verdicts by method and condition.
    Verdicts,
    /// Success rate over what an experiment varies.
    Success,
    /// Share that the methods report as solved, likewise: the paper's figures 11 and 12.
    Solved,
    /// Share of the queries within an error.
    Recall,
    /// Primary failure verdicts over the distance of the reference.
    Causes,
    /// The radius around the truth from which the search finds it.
    Basin,
    /// The cost margin of the best minimum elsewhere.
    Margin,
}

impl Plot {
    /// What a run must have, so that there is something to draw.
    pub fn needs(self) -> &'static str {
        match self {
            Self::Errors | Self::Recall => "ground truth",
            Self::Verdicts | Self::Causes => "ground truth and failures",
            Self::Success | Self::Solved => "several radii, numbers of references or scenes",
            Self::Basin | Self::Margin => "a method with a cost",
        }
    }

    /// The plot of a run as an SVG file; `None` if there is nothing to draw.
    pub fn svg(self, run: &RunResults) -> Option<String> {
        let charts = self.charts(run);
        (!charts.is_empty()).then(|| chart::file(&charts))
    }

    /// One chart per pair of scenes; for causes, also per method.
    pub(crate) fn charts(self, run: &RunResults) -> Vec<Chart> {
        let charts = self.in_metres(run).into_iter();
        charts.map(|chart| chart.in_words_of(run.unit())).collect()
    }

    fn in_metres(self, run: &RunResults) -> Vec<Chart> {
        match self {
            Self::Errors => errors(&run.results).into_iter().collect(),
            Self::Verdicts => verdicts(&run.measures).into_iter().collect(),
            Self::Success | Self::Solved if !varies(&run.measures) => {
                let all: Vec<&Measures> = run.measures.iter().collect();
                let rate = self.rate();
                let chart = rates(rate.title.to_owned(), "scenes", &all, brief_scenes, &rate);
                chart.into_iter().collect()
            }
            _ => {
                let results = run.results.iter().map(|one| (Group::of(one).scenes(), one));
                let pairs = grouped(results).into_iter();
                pairs.flat_map(|(pair, results)| self.of_pair(run, &pair, &results)).collect()
            }
        }
    }

    fn of_pair(self, run: &RunResults, pair: &str, results: &[&QueryResult]) -> Vec<Chart> {
        let measures = run.measures.iter().filter(|one| one.group.scenes() == pair);
        let measures: Vec<&Measures> = measures.collect();
        let methods = grouped(measures.iter().map(|one| (one.method, ())));
        let methods: Vec<Method> = methods.into_iter().map(|(method, _)| method).collect();
        let titled = |what: &str| format!("{what}: {pair}");
        let of_costs = |what, axis, value: fn(&CostReport) -> Option<f64>| {
            lines(titled(what), axis, &methods, |method| at_least(costs(results, method, value)))
        };
        match self {
            Self::Errors | Self::Verdicts => Vec::new(),
            Self::Success | Self::Solved => {
                let (axis, rate) = ("uncertainty radius, and references", self.rate());
                let chart = rates(titled(rate.title), axis, &measures, setting, &rate);
                chart.into_iter().collect()
            }
            Self::Recall => {
                let axis = "translation error (m), failures infinite";
                let title = titled("Share of the queries within an error");
                lines(title, axis, &methods, |method| recall(method, &measures))
            }
            Self::Causes => {
                let of_method = methods.iter().filter_map(|&method| {
                    let title = format!("{} over the distance of the reference", method.label());
                    causes(titled(&format!("Causes of failures of {title}")), method, results)
                });
                of_method.collect()
            }
            Self::Basin => of_costs(
                "Radius around the truth from which the search finds it",
                "radius of the truth's basin, at least (m)",
                |cost| cost.basin_m,
            ),
            Self::Margin => of_costs(
                "Cost margin of the best minimum elsewhere",
                "best minimum elsewhere above that at the truth, at least (% of the cost at the result)",
                |cost| Some(100.0 * cost.basin_margin? / cost.best),
            ),
        }
    }

    /// What the bars of the success plot, or of that of solved queries, show.
    fn rate(self) -> Rate {
        let success =
            Rate { title: "Success rate", axis: "success rate (%)", of: |one| one.success_rate };
        let solved = Rate {
            title: "Queries reported as solved",
            axis: "reported as solved (%)",
            of: |one| one.share(one.poses),
        };
        if self == Self::Solved { solved } else { success }
    }
}

/// A share of the queries that bars show.
struct Rate {
    title: &'static str,
    axis: &'static str,
    of: fn(&Measures) -> f64,
}

fn legend(methods: impl IntoIterator<Item = Method>) -> Vec<(String, palette::Rgb)> {
    let entries = methods.into_iter();
    entries.map(|method| (method.label(), palette::method(method))).collect()
}

/// One line per method, in per cent of the queries. Methods without points are left out.
fn lines(
    title: String,
    x_axis: &str,
    methods: &[Method],
    points: impl Fn(Method) -> Vec<(f64, f64)>,
) -> Vec<Chart> {
    let lines = methods.iter().map(|&method| (method, points(method)));
    let lines: Vec<_> = lines.filter(|(_, points)| !points.is_empty()).collect();
    let chart = curves(title, x_axis, "queries (%)", lines);
    chart.into_iter().collect()
}

/// One line per method.
pub(super) fn curves(
    title: String,
    x_axis: &str,
    y_axis: &str,
    lines: Vec<(Method, Vec<(f64, f64)>)>,
) -> Option<Chart> {
    let points = || lines.iter().flat_map(|(_, points)| points);
    let least = points().map(|point| point.0).reduce(f64::min)?;
    let most = points().map(|point| point.0).fold(least, f64::max);
    let highest = points().map(|point| point.1).fold(1e-3, f64::max);
    let y = if y_axis.ends_with("(%)") {
        Axis::percent(y_axis)
    } else {
        Axis::linear(y_axis, 0.0, 1.1 * highest)
    };
    let legend = legend(lines.iter().map(|(method, _)| *method));
    let marks = lines.into_iter().map(|(method, points)| {
        Mark::new(Shape::Line(points), palette::method(method)).titled(method.label())
    });
    Some(Chart { title, x: Axis::linear(x_axis, least, most), y, marks: marks.collect(), legend })
}

/// Steps over the error, for the last group only: the largest radius, or the most references.
fn recall(method: Method, measures: &[&Measures]) -> Vec<(f64, f64)> {
    let longest = measures.iter().filter_map(|one| one.errors.as_ref()).flatten();
    let finite = longest.map(|error| error.0).filter(|error| error.is_finite());
    let end = finite.fold(0.0, f64::max);
    let last = measures.iter().rfind(|one| one.method == method);
    let Some(errors) = last.and_then(|one| one.errors.as_ref()) else {
        return Vec::new();
    };
    let mut metres: Vec<f64> = errors.iter().map(|error| error.0).collect();
    metres.sort_unstable_by(f64::total_cmp);
    let share = |count: usize| 100.0 * count as f64 / metres.len() as f64;
    let found = metres.iter().take_while(|error| error.is_finite());
    let steps = found.enumerate();
    let steps = steps.flat_map(|(at, &error)| [(error, share(at)), (error, share(at + 1))]);
    let mut steps: Vec<_> = [(0.0, 0.0)].into_iter().chain(steps).collect();
    steps.extend(steps.last().map(|last| (end, last.1)));
    steps
}

/// A figure of a method's costs, for results with a known basin of the truth. A truth without a minimum has no
/// margin, and counts as minus infinity.
fn costs(
    results: &[&QueryResult],
    method: Method,
    value: fn(&CostReport) -> Option<f64>,
) -> Vec<f64> {
    let of_method = results.iter().filter(|result| result.method == method);
    let costs = of_method.filter_map(|result| result.cost.as_ref());
    let known = costs.filter(|cost| cost.basin_m.is_some());
    known.map(|cost| value(cost).unwrap_or(f64::NEG_INFINITY)).collect()
}

/// The share of the values that are at least x, in steps in ascending order.
fn at_least(mut values: Vec<f64>) -> Vec<(f64, f64)> {
    let all = values.len() as f64;
    values.retain(|value| value.is_finite());
    values.sort_unstable_by(f64::total_cmp);
    let count = values.len();
    let share = |rank: usize| 100.0 * (count - rank) as f64 / all;
    let steps = values.iter().enumerate();
    let steps = steps.flat_map(|(rank, &value)| [(value, share(rank)), (value, share(rank + 1))]);
    steps.collect()
}

/// Whether the run has several radii, or several numbers of references.
fn varies(measures: &[Measures]) -> bool {
    let mut settings = measures.iter().map(|one| one.group.setting);
    let first = settings.next();
    settings.any(|setting| Some(setting) != first)
}

fn setting(one: &Measures) -> String {
    one.group.setting.map_or(String::new(), |setting| {
        format!("{} m, {} ref.", setting.radius_m, setting.references)
    })
}

/// Short names of the scenes: `night` for `street:night`.
fn brief_scenes(one: &Measures) -> String {
    let brief = |scene: &str| scene.rsplit(['/', ':']).next().unwrap_or_default().to_owned();
    let scene = brief(&one.group.scene);
    match &one.group.query_scene {
        Some(queries) => format!("{} in {scene}", brief(queries)),
        None => scene,
    }
}

/// Rates as bars: one group per name, one bar per method, and only r-wavg of several fusions. `None` if there is
/// only one group.
fn rates(
    title: String,
    axis: &str,
    measures: &[&Measures],
    name: fn(&Measures) -> String,
    shown: &Rate,
) -> Option<Chart> {
    let is_shown = |one: &&&Measures| one.group.fusion.is_none_or(|fusion| fusion.name == "r-wavg");
    let groups = grouped(measures.iter().filter(is_shown).map(|one| (name(one), *one)));
    let methods: BTreeSet<Method> = measures.iter().map(|one| one.method).collect();
    let mut marks = Vec::new();
    for (at, (name, of_group)) in groups.iter().enumerate() {
        let width = 0.84 / of_group.len().max(1) as f64;
        for (place, one) in of_group.iter().enumerate() {
            let left = at as f64 + 0.08 + width * place as f64;
            let (right, rate) = (left + 0.9 * width, 100.0 * (shown.of)(one));
            let (from, to) = ((left, 0.0), (right, rate));
            let words = format!("{} {name}: {rate:.0} %", one.method.label());
            let color = palette::method(one.method);
            marks.push(Mark::new(Shape::Bar { from, to }, color).titled(words));
            let top = ((left + right) / 2.0, rate);
            marks.push(Mark::words(format!("{rate:.0}"), top, (0.0, -3.0)));
        }
    }
    let bars = groups.iter().map(|group| group.1.len() + 1).sum::<usize>() as f64;
    (groups.len() > 1).then(|| Chart {
        title,
        x: Axis::named(axis, groups.iter().map(|group| group.0.clone()))
            .long((bars * BAR_PX).max(500.0)),
        y: Axis::percent(shown.axis),
        marks,
        legend: legend(methods),
    })
}

/// The primary verdicts in one distance bin.
#[derive(Debug, Default, PartialEq)]
struct Bin {
    queries: usize,
    verdicts: BTreeMap<Code, usize>,
}

/// Stacked bars of primary failure verdicts over the distance between reference and truth. `None` if no distance
/// is known or there is no failure.
fn causes(title: String, method: Method, results: &[&QueryResult]) -> Option<Chart> {
    let (width_m, bins) = binned(method, results)?;
    let codes: BTreeSet<Code> = bins.iter().flat_map(|bin| bin.verdicts.keys().copied()).collect();
    let mut marks = Vec::new();
    for (at, bin) in bins.iter().enumerate().filter(|(_, bin)| bin.queries > 0) {
        let across = [0.08, 0.5, 0.92].map(|share| width_m * (at as f64 + share));
        let top = stacked(&mut marks, &codes, &bin.verdicts, bin.queries, |along, at| {
            (across[at], along)
        });
        let words = format!("{} queries", bin.queries);
        marks.push(Mark::words(words, (across[1], top), (0.0, -3.0)));
    }
    (!codes.is_empty()).then(|| Chart {
        title,
        x: Axis::linear(
            "distance of the reference from the truth (m)",
            0.0,
            width_m * bins.len() as f64,
        ),
        y: Axis::percent("queries (%)"),
        marks,
        legend: Vec::new(),
    })
}

/// Adds a bar of the shares of queries by verdict. `place` has the place of a share \[%\] at the near side (0), the
/// middle (1) and the far side (2) of the bar. Returns the share at its end.
fn stacked(
    marks: &mut Vec<Mark>,
    codes: &BTreeSet<Code>,
    verdicts: &BTreeMap<Code, usize>,
    queries: usize,
    place: impl Fn(f64, usize) -> (f64, f64),
) -> f64 {
    let mut from = 0.0;
    for (rank, code) in codes.iter().enumerate() {
        let count = verdicts.get(code).copied().unwrap_or_default();
        let share = 100.0 * count as f64 / queries.max(1) as f64;
        let to = from + share;
        if count > 0 {
            let bar = Shape::Bar { from: place(from, 0), to: place(to, 2) };
            let about = format!("{count} of {queries} queries ({share:.0} %)");
            let title = format!("{code} {}: {about}", code.title());
            marks.push(Mark::new(bar, palette::verdict(rank)).titled(title));
        }
        if to - from >= LABELLED_FROM {
            let middle = place((from + to) / 2.0, 1);
            marks.push(Mark::words(code.name(), middle, (0.0, 4.0)));
        }
        from = to;
    }
    from
}

/// The width of a bin \[m\], and the bins starting at 0.
fn binned(method: Method, results: &[&QueryResult]) -> Option<(f64, Vec<Bin>)> {
    let of_method = results.iter().filter(|result| result.method == method);
    let known = of_method.filter_map(|result| {
        let primary = result.diagnosis.first().map(|finding| finding.code);
        let distance_m = result.initial_error?.translation_m;
        let code = primary.filter(|code| code.is_failure());
        distance_m.is_finite().then_some((distance_m, code))
    });
    let known: Vec<(f64, Option<Code>)> = known.collect();
    let farthest_m = known.iter().map(|one| one.0).reduce(f64::max)?;
    let width_m = round_up(farthest_m / BINS);
    let mut bins: Vec<Bin> = Vec::new();
    for (distance_m, code) in known {
        let bin = (distance_m / width_m) as usize;
        if bins.len() <= bin {
            bins.resize_with(bin + 1, Bin::default);
        }
        bins[bin].queries += 1;
        if let Some(code) = code {
            *bins[bin].verdicts.entry(code).or_default() += 1;
        }
    }
    Some((width_m, bins))
}

/// The error over the distance of the reference, for results where both are known. Results without a pose are on
/// the upper border. Points link to their rows in the report.
fn errors(results: &[QueryResult]) -> Option<Chart> {
    let known = results.iter().enumerate().filter_map(|(number, result)| {
        let start = result.initial_error?.translation_m;
        let error = result.error.map(|error| error.translation_m.max(1e-3));
        let is_shown = error.is_some() || result.status == Status::Failed;
        (start.is_finite() && is_shown).then_some((start, error, number, result))
    });
    let known: Vec<_> = known.collect();
    let errors = || known.iter().filter_map(|one| one.1);
    let least = errors().reduce(f64::min)?;
    let top = ABOVE * errors().fold(0.0, f64::max);
    let farthest = known.iter().map(|one| one.0).fold(0.0, f64::max);
    let methods: BTreeSet<Method> = known.iter().map(|one| one.3.method).collect();
    let marks = known.iter().map(|(start, error, number, result)| {
        let dot = Shape::Dot { at: (*start, error.unwrap_or(top)), filled: error.is_some() };
        Mark {
            link: Some(format!("#r{number}")),
            ..Mark::new(dot, palette::method(result.method)).titled(result.headline())
        }
    });
    Some(Chart {
        title: "Error over the distance of the reference; results without a pose on top".to_owned(),
        x: Axis::linear("distance of the reference (m)", 0.0, 1.05 * farthest),
        y: Axis::log("error (m)", 0.8 * least, 1.2 * top),
        marks: marks.collect(),
        legend: legend(methods),
    })
}

/// One stacked bar per method and condition: the shares of its queries by primary verdict.
fn verdicts(measures: &[Measures]) -> Option<Chart> {
    let codes = measures.iter().flat_map(|one| one.verdicts.keys());
    let codes: BTreeSet<Code> = codes.copied().collect();
    let bars = measures.len() as f64;
    let mut marks = Vec::new();
    for (at, one) in measures.iter().enumerate() {
        let low = bars - 1.0 - at as f64;
        let name = format!("{} {}", one.method.label(), one.group);
        marks.push(Mark::words(name, (50.0, low + 0.7), (0.0, 0.0)));
        let across = [0.08, 0.33, 0.58].map(|share| low + share);
        stacked(&mut marks, &codes, &one.verdicts, one.queries, |along, at| (along, across[at]));
    }
    (!codes.is_empty()).then(|| Chart {
        title: "Primary verdicts by method and condition".to_owned(),
        x: Axis::percent("queries (%)"),
        y: Axis::named("", measures.iter().map(|_| String::new())).long(40.0 * bars),
        marks,
        legend: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::metrics::{
        measure,
        tests::{finding, row},
    };
    use super::*;
    use crate::geometry::PoseError;

    #[test]
    fn recall_rises_in_steps_and_stays_where_failures_begin() {
        let rows = [
            row("a", "fb", Some(3.0)),
            row("b", "fb", Some(1.0)),
            row("c", "fb", None),
            row("d", "fb", None),
            row("a", "mi", Some(2.0)),
        ];
        let measures = measure(&rows, 10.0);
        let measures: Vec<&Measures> = measures.iter().collect();
        let fb = [(0.0, 0.0), (1.0, 0.0), (1.0, 25.0), (3.0, 25.0), (3.0, 50.0), (3.0, 50.0)];
        assert_eq!(recall(Method::FB, &measures), fb);
        let mi = [(0.0, 0.0), (2.0, 0.0), (2.0, 100.0), (3.0, 100.0)];
        assert_eq!(recall(Method::MI, &measures), mi);
    }

    #[test]
    fn a_curve_falls_from_all_that_have_a_value_to_none() {
        let steps = [(1.0, 75.0), (1.0, 50.0), (2.0, 50.0), (2.0, 25.0), (3.0, 25.0), (3.0, 0.0)];
        assert_eq!(at_least(vec![3.0, 1.0, f64::NEG_INFINITY, 2.0]), steps);
        assert!(at_least(Vec::new()).is_empty());
    }

    fn started(away_m: f64, code: Option<Code>) -> QueryResult {
        QueryResult {
            initial_error: Some(PoseError {
                translation_m: away_m,
                rotation_deg: 0.0,
                max_euler_deg: 0.0,
            }),
            diagnosis: code.map(finding).into_iter().collect(),
            ..row("a", "mi", Some(1.0))
        }
    }

    #[test]
    fn results_fall_into_bins_of_a_round_width_and_a_doubt_is_no_failure() {
        let rows = [
            started(0.3, None),
            started(1.7, Some(Code::D2)),
            started(2.2, Some(Code::L1)),
            started(11.4, Some(Code::D3)),
            started(11.9, Some(Code::D3)),
            row("b", "mi", None),
        ];
        let of_run: Vec<&QueryResult> = rows.iter().collect();
        let (width_m, bins) = binned(Method::MI, &of_run).expect("there are distances");
        assert_eq!((width_m, bins.len()), (2.0, 6));
        assert_eq!(bins[0].queries, 2);
        assert_eq!(bins[0].verdicts, BTreeMap::from([(Code::D2, 1)]));
        assert!(bins[1].verdicts.is_empty() && bins[1].queries == 1);
        assert_eq!(bins[5].verdicts, BTreeMap::from([(Code::D3, 2)]));
        assert_eq!(binned(Method::FB, &of_run), None);
        let svg = Plot::Causes.svg(&RunResults::of(rows.to_vec(), 10.0));
        let svg = svg.expect("some failed");
        assert!(svg.contains("D3") && svg.contains("2 queries"), "{svg}");
    }

    #[test]
    fn what_is_known_is_drawn() {
        let rows = vec![row("a", "fb", Some(0.1)), row("a", "mi", None)];
        let run = RunResults::of(rows, 10.0);
        let recall = Plot::Recall.svg(&run).expect("errors are known");
        for words in ["FB", "street", "queries (%)"] {
            assert!(recall.contains(words), "{recall}");
        }
        assert_eq!(Plot::Basin.svg(&run), None);
        assert_eq!(Plot::Verdicts.svg(&run), None);
    }
}
