//! The tables of a run: summary, verdicts, and the paper's tables with its figures next to ours.
//!
//! Their shapes are data (`assets/tables.toml`), which [`Filling`] fills.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use clap::ValueEnum;
use serde::Deserialize;

use super::metrics::Measures;
use super::paper;
use super::results::RunResults;
use super::rivals::{Rivals, rivals};
use super::triage::Field;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::table::Table;

/// The cell of a missing figure.
pub(super) const NOTHING: &str = "–";

/// A note on the paper's RMSE.
const RMSE_FOOTNOTE: &str = "The paper's RMSE behaves like a median (0.125 m and 1.76° in its table 4 for FB with one \
 reference, a median of 0.13 m and 1.76° in its table 3), so both of ours are given";

/// A table, or several related ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TableName {
    /// One row per result.
    Rows,
    /// All figures, one row per group and method.
    Summary,
    /// The shares of primary verdicts.
    Verdicts,
    /// Which of two other systems' poses the photos support, one row per query.
    Rivals,
    /// The paper's scenes of KITTI.
    #[value(name = "paper:1")]
    Paper1,
    /// The paper's scenes of RobotCar.
    #[value(name = "paper:2")]
    Paper2,
    /// Our figures and the paper's with a single reference.
    #[value(name = "paper:3")]
    Paper3,
    /// Our figures and the paper's with several references.
    #[value(name = "paper:4")]
    Paper4,
    /// Our figures and the paper's within a large prior, on KITTI.
    #[value(name = "paper:5")]
    Paper5,
    /// The same on RobotCar.
    #[value(name = "paper:6")]
    Paper6,
}

impl TableName {
    /// The tables of a run; empty if it has no results for them.
    pub fn of(self, run: &RunResults) -> Vec<Table> {
        let papers = |number: u8| {
            let mut tables = shaped(&run.measures, |shape| shape.paper.contains(&number));
            tables.extend(advantage(&run.measures).filter(|_| number >= 5));
            tables
        };
        let in_unit = |tables: Vec<Table>| {
            tables.into_iter().map(|table| table.in_words_of(run.unit())).collect()
        };
        match self {
            Self::Rows => {
                let fields = Field::ALL.iter().chain(Field::POSE);
                vec![rows(&run.results, fields, Field::whole)]
            }
            Self::Summary => in_unit(shaped(&run.measures, |shape| shape.name == "summary")),
            Self::Verdicts => in_unit(verdicts(&run.measures).into_iter().collect()),
            Self::Rivals => {
                let results: Vec<&QueryResult> = run.results.iter().collect();
                in_unit(rivals(&results).iter().map(Rivals::table).collect())
            }
            Self::Paper1 => vec![paper::scenes(1)],
            Self::Paper2 => vec![paper::scenes(2)],
            Self::Paper3 => papers(3),
            Self::Paper4 => papers(4),
            Self::Paper5 => papers(5),
            Self::Paper6 => papers(6),
        }
    }
}

/// The tables that a run prints: summary, verdicts, and those of its preset.
pub fn tables(run: &RunResults, preset: Option<&str>) -> Vec<Table> {
    let mut tables = TableName::Summary.of(run);
    tables.extend(TableName::Verdicts.of(run));
    if preset.is_some() {
        tables.extend(shaped(&run.measures, |shape| shape.preset.as_deref() == preset));
    }
    if preset == Some("large") {
        tables.extend(advantage(&run.measures));
    }
    tables
}

/// The short table for the page of a CI job.
pub(super) fn brief(measures: &[Measures]) -> Vec<Table> {
    shaped(measures, |shape| shape.name == "brief")
}

/// One row per result with these fields, formatted by `text`.
pub fn rows<'a, 'f>(
    results: impl IntoIterator<Item = &'a QueryResult>,
    fields: impl IntoIterator<Item = &'f Field>,
    text: fn(&Field, &QueryResult) -> String,
) -> Table {
    let fields: Vec<&Field> = fields.into_iter().collect();
    let mut table = Table::new("rows", "", fields.iter().map(|field| field.name));
    table.align = fields.iter().map(|field| field.align()).collect();
    for result in results {
        table.push(fields.iter().map(|field| text(field, result)));
    }
    table
}

#[derive(Deserialize)]
struct Shapes {
    table: Vec<Shape>,
    figures: BTreeMap<String, Figure>,
}

/// The shape of a table; `assets/tables.toml` documents its fields.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Shape {
    name: String,
    #[serde(default)]
    paper: Vec<u8>,
    preset: Option<String>,
    #[serde(default)]
    each: bool,
    caption: String,
    down: Vec<Dimension>,
    #[serde(default)]
    across: Vec<Dimension>,
    #[serde(default)]
    first: Vec<String>,
    figures: Vec<Vec<String>>,
    #[serde(default)]
    labels: Vec<String>,
    #[serde(default)]
    beside: Beside,
    #[serde(default)]
    several: bool,
}

/// The position of the paper's figures.
#[derive(Clone, Copy, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
enum Beside {
    /// They are left out.
    #[default]
    Nowhere,
    /// In lines below ours.
    Below,
    /// In columns after ours.
    Behind,
}

/// A dimension in which figures differ.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Dimension {
    Group,
    Pair,
    References,
    Queries,
    Method,
    Radius,
    Count,
    Fusion,
}

impl Dimension {
    fn head(self) -> &'static str {
        match self {
            Self::Group | Self::Pair => "",
            Self::References => "references",
            Self::Queries => "queries",
            Self::Method => "method",
            Self::Radius => "radius (m)",
            Self::Count => "references",
            Self::Fusion => "fusion",
        }
    }

    fn of(self, one: &Measures) -> String {
        let group = &one.group;
        match self {
            Self::Group => group.to_string(),
            Self::Pair => group.scenes(),
            Self::References => group.scene.clone(),
            Self::Queries => group.query_scene.as_ref().unwrap_or(&group.scene).clone(),
            Self::Method => one.method.to_string(),
            Self::Radius => group.setting.map_or(String::new(), |one| one.radius_m.to_string()),
            Self::Count => group.setting.map_or(String::new(), |one| one.references.to_string()),
            Self::Fusion => group.fusion.map_or(String::new(), |fusion| fusion.to_string()),
        }
    }
}

/// The heading and the format of a figure.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    head: String,
    #[serde(default)]
    decimals: usize,
    #[serde(default)]
    percent: bool,
    paper: Option<String>,
}

static SHAPES: LazyLock<Result<Shapes, toml::de::Error>> =
    LazyLock::new(|| toml::from_str(include_str!("../../assets/tables.toml")));

/// The tables of the wanted shapes.
fn shaped(measures: &[Measures], is_wanted: impl Fn(&Shape) -> bool) -> Vec<Table> {
    // A test reads the file.
    let Ok(shapes) = &*SHAPES else {
        return Vec::new();
    };
    let all: Vec<&Measures> = measures.iter().collect();
    let mut tables = Vec::new();
    for shape in shapes.table.iter().filter(|shape| is_wanted(shape)) {
        let pairs = if shape.each { keys(&all, &[Dimension::Pair]) } else { vec![Vec::new()] };
        for pair in pairs {
            let mut of_pair = all.clone();
            of_pair.retain(|one| pair.is_empty() || pair[0] == one.group.scenes());
            let filling = Filling {
                shape,
                figures: &shapes.figures,
                columns: keys(&of_pair, &shape.across),
                measures: &of_pair,
            };
            if filling.columns.len() > usize::from(shape.several) {
                tables.extend(filling.table(pair.first().map(String::as_str)));
            }
        }
    }
    tables
}

/// The distinct values of some dimensions, ordered by the first, then the next, each in the order of the figures.
fn keys(measures: &[&Measures], dimensions: &[Dimension]) -> Vec<Vec<String>> {
    let mut keys: Vec<(Vec<usize>, Vec<String>)> = Vec::new();
    let mut seen: Vec<Vec<String>> = vec![Vec::new(); dimensions.len()];
    for one in measures {
        let mut rank = Vec::new();
        let key: Vec<String> = dimensions.iter().map(|dimension| dimension.of(one)).collect();
        for (value, seen) in key.iter().zip(&mut seen) {
            rank.push(seen.iter().position(|known| known == value).unwrap_or(seen.len()));
            if rank.last() == Some(&seen.len()) {
                seen.push(value.clone());
            }
        }
        keys.push((rank, key));
    }
    keys.sort();
    keys.dedup();
    keys.into_iter().map(|(_, key)| key).collect()
}

/// Fills a shape with the figures of a pair of scenes, or of all.
struct Filling<'a> {
    shape: &'a Shape,
    figures: &'a BTreeMap<String, Figure>,
    measures: &'a [&'a Measures],
    /// The distinct values of the dimensions across; one without a name if there are none.
    columns: Vec<Vec<String>>,
}

/// A line of a table: its names and its figures.
struct Line<'a> {
    names: Vec<String>,
    label: &'a str,
    cells: Vec<Option<String>>,
}

impl<'a> Filling<'a> {
    fn head(&self, name: &str) -> String {
        let figure = self.figures.get(name);
        figure.map_or(name, |figure| &figure.head).to_owned()
    }

    fn ours(&self, name: &str, one: &Measures) -> Option<String> {
        let figure = self.figures.get(name)?;
        let (value, decimals) = (one.figure(name)?, figure.decimals);
        Some(if figure.percent {
            format!("{:.1}", 100.0 * value)
        } else {
            format!("{value:.decimals$}")
        })
    }

    fn papers(&self, name: &str, one: &Measures) -> Option<String> {
        let measure = self.figures.get(name)?.paper.as_deref()?;
        let tables = &self.shape.paper;
        paper::figure(tables, &one.group, one.method.name(), measure).map(str::to_owned)
    }

    /// The named figures in every column, of a row or, without one, of the first match.
    fn cells(
        &self,
        row: Option<&[String]>,
        names: &[String],
        cell: fn(&Self, &str, &Measures) -> Option<String>,
    ) -> Vec<Option<String>> {
        let is = |one: &Measures, key: &[String], dimensions: &[Dimension]| {
            let mut pairs = key.iter().zip(dimensions);
            pairs.all(|(key, dimension)| *key == dimension.of(one))
        };
        let mut cells = Vec::new();
        for column in &self.columns {
            let one = self.measures.iter().find(|one| {
                is(one, column, &self.shape.across)
                    && row.is_none_or(|row| is(one, row, &self.shape.down))
            });
            let of_one = |name: &String| one.and_then(|one| cell(self, name, one));
            cells.extend(names.iter().map(of_one));
        }
        cells
    }

    /// A line of our figures, followed by one of the paper's if it is shown below.
    fn lines(
        &self,
        names: Vec<String>,
        row: Option<&[String]>,
        label: &'a str,
        figures: &[String],
    ) -> impl Iterator<Item = Line<'a>> + use<'a> {
        let papers = (self.shape.beside == Beside::Below).then(|| Line {
            names: names.clone(),
            label: "paper",
            cells: self.cells(row, figures, Self::papers),
        });
        let ours = Line { names, label, cells: self.cells(row, figures, Self::ours) };
        let papers = papers.filter(|line| line.cells.iter().any(Option::is_some));
        [ours].into_iter().chain(papers)
    }

    fn table(&self, pair: Option<&str>) -> Option<Table> {
        let Shape { down, figures, .. } = self.shape;
        let names = figures.first()?;
        let mut lines: Vec<Line<'_>> = Vec::new();
        for name in &self.shape.first {
            let mut row_names = vec![String::new(); down.len()];
            row_names[0] = self.head(name);
            lines.extend(self.lines(row_names, None, "", std::slice::from_ref(name)));
        }
        let rows = keys(self.measures, down);
        for row in &rows {
            for (at, figures) in figures.iter().enumerate() {
                let label = self.shape.labels.get(at).map_or("", String::as_str);
                lines.extend(self.lines(row.clone(), Some(row), label, figures));
            }
        }
        let mut header: Vec<String> = down.iter().map(|one| one.head().to_owned()).collect();
        for column in self.columns.iter().map(|column| column.join(" ")) {
            header.extend(names.iter().map(|name| match (column.as_str(), names.len()) {
                ("", _) => self.head(name),
                (_, 1) => column.clone(),
                _ => format!("{column}: {}", self.head(name)),
            }));
        }
        let mut has_papers = lines.iter().any(|line| line.label == "paper");
        if self.shape.beside == Beside::Behind {
            let has_one =
                |name: &&String| self.figures.get(*name).is_some_and(|one| one.paper.is_some());
            let known: Vec<String> = names.iter().filter(has_one).cloned().collect();
            let behind = rows.iter().map(|row| self.cells(Some(row), &known, Self::papers));
            let behind: Vec<Vec<Option<String>>> = behind.collect();
            has_papers = behind.iter().flatten().any(Option::is_some);
            if has_papers {
                header.extend(known.iter().map(|name| format!("{} (paper)", self.head(name))));
                for (line, behind) in lines.iter_mut().zip(behind) {
                    line.cells.extend(behind);
                }
            }
        }
        let mut name = self.shape.name.clone();
        let mut caption = self.shape.caption.clone();
        if let Some(pair) = pair {
            name += &format!("-{}", slug(pair));
            caption += &format!(": {pair}");
        }
        if has_papers && names.iter().any(|name| name.contains("rmse")) {
            caption += &format!(". {RMSE_FOOTNOTE}");
        }
        let mut table = Table::new(name, caption, header);
        table.shared = down.len() - 1;
        for Line { mut names, label, cells } in lines {
            if let (Some(last), false) = (names.last_mut(), label.is_empty()) {
                *last = format!("{last} ({label})").trim_start().to_owned();
            }
            let cells = cells.into_iter().map(|cell| cell.unwrap_or(NOTHING.to_owned()));
            table.push(names.into_iter().chain(cells));
        }
        Some(table)
    }
}

/// The causes of failures: one line per group and method, one column per primary verdict.
fn verdicts(measures: &[Measures]) -> Option<Table> {
    let codes = measures.iter().flat_map(|one| one.verdicts.keys());
    let codes: BTreeSet<_> = codes.copied().collect();
    if codes.is_empty() {
        return None;
    }
    let meanings: Vec<String> =
        codes.iter().map(|code| format!("{code} {}", code.title())).collect();
    let caption = format!("Shares of the queries by primary verdict: {}.", meanings.join("; "));
    let head = ["", "method", "queries"].map(str::to_owned);
    let columns = codes.iter().map(|code| format!("{code} (%)"));
    let mut table = Table::new("verdicts", caption, head.into_iter().chain(columns));
    table.shared = 1;
    for one in measures {
        let head = [one.group.to_string(), one.method.to_string(), one.queries.to_string()];
        let shares = codes.iter().map(|code| {
            let count = one.verdicts.get(code).copied().unwrap_or_default();
            format!("{:.1}", 100.0 * one.share(count))
        });
        table.push(head.into_iter().chain(shares));
    }
    Some(table)
}

/// The hybrid's lead in success rate over each other method in percentage points, as the mean over all pairs of
/// scenes, for us and for the paper (the averages in its abstract). `None` without a hybrid.
fn advantage(measures: &[Measures]) -> Option<Table> {
    let header = ["hy over", "pairs of scenes", "points", "points (paper)"];
    let caption = "The hybrid's lead in success rate, in percentage points, averaged over the pairs of scenes";
    let mut table = Table::new("advantage", caption, header);
    let hybrids: Vec<&Measures> = measures.iter().filter(|one| one.method == Method::HY).collect();
    let others: BTreeSet<Method> = measures.iter().map(|one| one.method).collect();
    for method in others.into_iter().filter(|&method| method != Method::HY) {
        let ours = hybrids.iter().filter_map(|hybrid| {
            let mut others = measures.iter().filter(|one| one.method == method);
            let other = others.find(|one| one.group == hybrid.group)?;
            Some(100.0 * (hybrid.success_rate - other.success_rate))
        });
        let papers = hybrids.iter().filter_map(|hybrid| {
            let rate = |method: Method| -> Option<f64> {
                paper::figure(&[5, 6], &hybrid.group, method.name(), "success_percent")?
                    .parse()
                    .ok()
            };
            Some(rate(Method::HY)? - rate(method)?)
        });
        let [ours, papers]: [Vec<f64>; 2] = [ours.collect(), papers.collect()];
        let mean = |points: &[f64]| match points.len() {
            0 => NOTHING.to_owned(),
            count => format!("{:.1}", points.iter().sum::<f64>() / count as f64),
        };
        table.push([method.to_string(), ours.len().to_string(), mean(&ours), mean(&papers)]);
    }
    (!hybrids.is_empty() && !table.rows.is_empty()).then_some(table)
}

/// A name that is safe as part of a file name.
pub(super) fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests;
