//! The tables of a run: an overview, and those of the paper with its figures beside ours.

mod advantage;
mod verdicts;

use super::metrics::{Measures, RECALL_LIMITS};
use super::paper::{self, FigureKey};
use super::table::Table;
use crate::fusion::Fusion;
use crate::method::Method;
use crate::run::Experiment;
use crate::run::{RunFile, ScenePair};

/// What is to be known of the paper's RMSE.
const RMSE_FOOTNOTE: &str = "What the paper calls RMSE behaves like a median (its table 4 has 0.125 m and \
    1.76° for FB with one reference, its table 3 a median of 0.13 m and 1.76°), so both of ours are given";

/// What stands where there is no figure.
const NOTHING: &str = "–";

/// All tables of a run.
pub fn tables(run: &RunFile, measures: &[Measures]) -> Vec<Table> {
    let mut tables = vec![overview(measures)];
    tables.extend(verdicts::verdicts(measures));
    for pair in &run.pairs {
        let of_pair = OfPair::new(pair, measures);
        match run.experiment {
            Some(Experiment::Single) => tables.extend(single(run, &of_pair)),
            Some(Experiment::Multi) => tables.extend(multi(run, &of_pair)),
            Some(Experiment::Large) | None => {}
        }
    }
    if run.experiment == Some(Experiment::Large) {
        tables.push(large(run, measures));
        if run.pairs.len() > 1 && !run.queries.is_empty() {
            tables.push(confusion(run, measures));
        }
        tables.extend(advantage::advantage(run, measures));
    }
    tables
}

/// Every figure that is measured, one line per group and method.
fn overview(measures: &[Measures]) -> Table {
    let mut header: Vec<String> = [
        "",
        "method",
        "queries",
        "reported solved (%)",
        "off the rim (%)",
        "success (%)",
        "success with a reference (%)",
        "by chance: reference pose, random pose (%)",
        "median (m)",
        "median max Euler (°)",
        "RMSE (m)",
        "RMSE max Euler (°)",
        "solved by all",
        "median of these (m)",
        "median max Euler of these (°)",
    ]
    .map(str::to_owned)
    .into();
    header.extend(RECALL_LIMITS.map(|(m, deg)| format!("within {m} m, {deg}° rotation (%)")));
    let mut table = Table::new(
        "overview",
        "All figures of the run. A query is reported solved where the method says so, whatever the error, \
         and solved by all where every method does; off the rim, if a direct method's minimum does not lie \
         where its grid ends. Success is within the failure radius; failures count as infinite in the \
         shares within limits.",
        header,
    );
    for one in measures {
        let (own, common) = (&one.of_successes, &one.of_common);
        let mut cells = vec![
            one.group.to_string(),
            one.method.name().to_uppercase(),
            one.queries.to_string(),
            percent(one.share(one.poses)),
            percent(one.share(one.off_rim)),
            percent(one.success_rate),
            percent(one.success_rate_with_reference()),
            one.chance.map_or(NOTHING.to_owned(), |chance| {
                format!(
                    "{}, {}",
                    percent(chance.reference_pose),
                    percent(chance.random_pose)
                )
            }),
            number(own.median_m, 2),
            number(own.median_deg, 2),
            number(own.rmse_m, 3),
            number(own.rmse_deg, 3),
            common.count.to_string(),
            number(common.median_m, 2),
            number(common.median_deg, 2),
        ];
        let recall = one.recall.map(|shares| shares.map(percent));
        cells.extend(recall.unwrap_or([NOTHING; 3].map(str::to_owned)));
        table.push(cells);
    }
    table
}

/// The figures of one pair of scenes.
struct OfPair<'a> {
    pair: &'a ScenePair,
    query_scene: Option<&'a str>,
    measures: Vec<&'a Measures>,
}

impl<'a> OfPair<'a> {
    fn new(pair: &'a ScenePair, measures: &'a [Measures]) -> Self {
        let is_same = pair.scene == pair.query_scene;
        let query_scene = (!is_same).then_some(pair.query_scene.as_str());
        let of_pair = |one: &&Measures| {
            one.group.scene == pair.scene && one.group.query_scene.as_deref() == query_scene
        };
        Self {
            pair,
            query_scene,
            measures: measures.iter().filter(of_pair).collect(),
        }
    }

    fn find(
        &self,
        method: Method,
        radius_m: f64,
        references: usize,
        fusion: Option<Fusion>,
    ) -> Option<&'a Measures> {
        self.measures.iter().copied().find(|one| {
            let setting = one.group.setting;
            one.method == method
                && one.group.fusion == fusion
                && setting.is_some_and(|s| s.radius_m == radius_m && s.references == references)
        })
    }

    fn title(&self) -> String {
        match self.query_scene {
            Some(queries) => format!("{}, queries from {queries}", self.pair.scene),
            None => self.pair.scene.clone(),
        }
    }

    /// A name for files.
    fn slug(&self, what: &str) -> String {
        match self.query_scene {
            Some(queries) => format!("{what}-{}-{}", slug(&self.pair.scene), slug(queries)),
            None => format!("{what}-{}", slug(&self.pair.scene)),
        }
    }

    fn figure_key<'s>(&'s self, table: u8, method: &'s str, measure: &'s str) -> FigureKey<'s> {
        FigureKey {
            table,
            scene: &self.pair.scene,
            query_scene: self.query_scene,
            method,
            radius_m: None,
            references: 1,
            fusion: None,
            measure,
        }
    }

    /// A figure of the paper's tables 5 (KITTI) and 6.
    fn figure_of_large(&self, method: Method, measure: &str) -> Option<f64> {
        let table = if self.pair.scene.starts_with("kitti") {
            5
        } else {
            6
        };
        paper::figure(&FigureKey {
            references: 5,
            fusion: Some("r-wavg"),
            ..self.figure_key(table, method.name(), measure)
        })
    }
}

/// A name without what a file's name had better not have.
pub(super) fn slug(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    name.chars().map(plain).collect()
}

/// The paper's table 3 and figure "single".
fn single(run: &RunFile, of_pair: &OfPair<'_>) -> Vec<Table> {
    let title = of_pair.title();
    let header = || {
        let radii = run.radii_m.iter().map(|radius| format!("{radius}"));
        std::iter::once("uncertainty radius (m)".to_owned()).chain(radii)
    };
    type Figure = fn(&Measures) -> Option<f64>;
    let tables: [(&str, &str, &str, Figure); 2] = [
        ("translation", "translation error (m)", "median_m", |one| {
            one.of_common.median_m
        }),
        ("rotation", "max Euler error (°)", "median_deg", |one| {
            one.of_common.median_deg
        }),
    ];
    let mut all = Vec::new();
    for (name, what, measure, figure) in tables {
        let mut table = Table::new(
            of_pair.slug(&format!("single-{name}")),
            format!("Median {what} with a single reference, over queries solved by all: {title}"),
            header(),
        );
        let common = |radius: f64| {
            let methods = run.protocol.methods.iter();
            methods
                .filter_map(|&method| of_pair.find(method, radius, 1, None))
                .next()
        };
        let row = |name: &str, cell: &dyn Fn(f64) -> Option<String>| -> Option<Vec<String>> {
            let cells: Vec<Option<String>> = run.radii_m.iter().map(|&r| cell(r)).collect();
            if cells.iter().all(Option::is_none) {
                return None;
            }
            let cells = cells.into_iter().map(|c| c.unwrap_or(NOTHING.to_owned()));
            Some(std::iter::once(name.to_owned()).chain(cells).collect())
        };
        let counted = |radius: f64| {
            let one = common(radius)?;
            let share = one.of_common.count as f64 / one.queries.max(1) as f64;
            Some(format!("{} ({} %)", one.of_common.count, percent(share)))
        };
        let counted_by_paper = |radius: f64| {
            let find = |measure| {
                paper::figure(&FigureKey {
                    radius_m: Some(radius),
                    ..of_pair.figure_key(3, "", measure)
                })
            };
            Some(format!(
                "{} ({} %)",
                find("common")?,
                find("common_percent")?
            ))
        };
        let mut rows = vec![
            row("#images", &counted),
            row("#images (paper)", &counted_by_paper),
        ];
        for &method in &run.protocol.methods {
            let ours = |radius: f64| {
                let one = of_pair.find(method, radius, 1, None)?;
                Some(number(figure(one), 2))
            };
            let papers = |radius: f64| {
                let figure = paper::figure(&FigureKey {
                    radius_m: Some(radius),
                    ..of_pair.figure_key(3, method.name(), measure)
                });
                Some(number(Some(figure?), 2))
            };
            let name = method.name().to_uppercase();
            rows.push(row(&name, &ours));
            rows.push(row(&format!("{name} (paper)"), &papers));
        }
        rows.into_iter().flatten().for_each(|row| table.push(row));
        all.push(table);
    }
    let mut success = Table::new(
        of_pair.slug("single-success"),
        format!("Success rate (%) with a single reference: {title}"),
        header(),
    );
    for &method in &run.protocol.methods {
        let rate = |&radius: &f64| rate_cell(of_pair.find(method, radius, 1, None));
        let rates = run.radii_m.iter().map(rate);
        success.push(std::iter::once(method.name().to_uppercase()).chain(rates));
    }
    all.push(success);
    all
}

/// The paper's table 4 and figure "multi".
fn multi(run: &RunFile, of_pair: &OfPair<'_>) -> Vec<Table> {
    let title = of_pair.title();
    let most = run.protocol.references.count();
    let columns =
        (1..=most).flat_map(|count| [format!("{count}: RMSE (m)"), format!("{count}: RMSE (°)")]);
    let mut rmse = Table::new(
        of_pair.slug("multi-rmse"),
        format!(
            "RMSE and median (of max Euler in °) with 1 to {most} references by method and fusion, over \
             successes: {title}{}",
            footnote(of_pair)
        ),
        std::iter::once("#references".to_owned()).chain(columns),
    );
    let Some(&radius) = run.radii_m.first() else {
        return vec![rmse];
    };
    for &method in &run.protocol.methods {
        for &fusion in &run.protocol.fusions {
            let name = format!("{} {fusion}", method.name().to_uppercase());
            let ours = (1..=most).flat_map(|count| {
                let one = of_pair.find(method, radius, count, Some(fusion));
                let spread = one.map(|one| one.of_successes);
                [
                    number(spread.and_then(|s| s.rmse_m), 3),
                    number(spread.and_then(|s| s.rmse_deg), 2),
                ]
            });
            rmse.push(std::iter::once(name.clone()).chain(ours));
            let medians = (1..=most).flat_map(|count| {
                let one = of_pair.find(method, radius, count, Some(fusion));
                let spread = one.map(|one| one.of_successes);
                [
                    number(spread.and_then(|s| s.median_m), 3),
                    number(spread.and_then(|s| s.median_deg), 2),
                ]
            });
            rmse.push(std::iter::once(format!("{name} (median)")).chain(medians));
            let papers: Vec<Option<f64>> = (1..=most)
                .flat_map(|references| {
                    ["rmse_m", "rmse_deg"].map(|measure| {
                        paper::figure(&FigureKey {
                            radius_m: Some(radius),
                            references,
                            fusion: Some(fusion.name),
                            ..of_pair.figure_key(4, method.name(), measure)
                        })
                    })
                })
                .collect();
            if papers.iter().any(Option::is_some) {
                let cells = papers.into_iter().map(|figure| number(figure, 3));
                rmse.push(std::iter::once(format!("{name} (paper)")).chain(cells));
            }
        }
    }
    let mut success = Table::new(
        of_pair.slug("multi-success"),
        format!("Success rate (%) with 1 to {most} references: {title}"),
        std::iter::once("#references".to_owned()).chain((1..=most).map(|k| k.to_string())),
    );
    for &method in &run.protocol.methods {
        for &fusion in &run.protocol.fusions {
            let rate = |count| rate_cell(of_pair.find(method, radius, count, Some(fusion)));
            let name = format!("{} {fusion}", method.name().to_uppercase());
            success.push(std::iter::once(name).chain((1..=most).map(rate)));
        }
    }
    vec![rmse, success]
}

/// What is said of the paper's RMSE where it has any of these scenes.
fn footnote(of_pair: &OfPair<'_>) -> String {
    let is_papers = paper::has_scene(&of_pair.pair.scene, of_pair.query_scene);
    match is_papers {
        true => format!(". {RMSE_FOOTNOTE}"),
        false => String::new(),
    }
}

/// The paper's tables 5 and 6: one line per pair of scenes and method, with the paper's figures if it has
/// any of these scenes.
fn large(run: &RunFile, measures: &[Measures]) -> Table {
    let mut rows: Vec<(Vec<String>, [Option<f64>; 3])> = Vec::new();
    for pair in &run.pairs {
        let of_pair = OfPair::new(pair, measures);
        for one in &of_pair.measures {
            let mut cells = vec![of_pair.title(), one.method.name().to_uppercase()];
            cells.push(one.queries.to_string());
            cells.extend(triple(one));
            cells.push(number(one.of_successes.median_m, 3));
            cells.push(number(one.of_successes.median_deg, 3));
            let papers = ["success_percent", "rmse_m", "rmse_deg"]
                .map(|measure| of_pair.figure_of_large(one.method, measure));
            rows.push((cells, papers));
        }
    }
    let mut header = vec![
        "references",
        "method",
        "queries",
        "%",
        "RMSE (m)",
        "RMSE (°)",
        "median (m)",
        "median (°)",
    ];
    let is_papers = rows
        .iter()
        .any(|(_, papers)| papers.iter().any(Option::is_some));
    if is_papers {
        header.extend(["% (paper)", "RMSE (m) (paper)", "RMSE (°) (paper)"]);
    }
    let mut caption = caption_of_large(run);
    if is_papers {
        caption += &format!(". {RMSE_FOOTNOTE}");
    }
    let mut table = Table::new("large", caption, header);
    for (mut cells, [rate, metres, degrees]) in rows {
        if is_papers {
            cells.extend([number(rate, 1), number(metres, 3), number(degrees, 3)]);
        }
        table.push(cells);
    }
    table
}

fn caption_of_large(run: &RunFile) -> String {
    format!(
        "References by {} within {} m: success rate (within {} m) and RMSE (of max Euler in °) over \
         successes",
        run.protocol.references,
        run.protocol.prior_m.unwrap_or_default(),
        run.failure_radius_m
    )
}

/// The paper's table 6: references by line, queries by column.
fn confusion(run: &RunFile, measures: &[Measures]) -> Table {
    let mut scenes: Vec<&str> = Vec::new();
    let mut queries: Vec<&str> = Vec::new();
    for pair in &run.pairs {
        if !scenes.contains(&pair.scene.as_str()) {
            scenes.push(&pair.scene);
        }
        if !queries.contains(&pair.query_scene.as_str()) {
            queries.push(&pair.query_scene);
        }
    }
    let columns = queries
        .iter()
        .flat_map(|query| ["%", "RMSE (m)", "RMSE (°)"].map(|figure| format!("{query}: {figure}")));
    let mut table = Table::new(
        "confusion",
        format!(
            "{}; references by line, queries by column",
            caption_of_large(run)
        ),
        ["references", "method"]
            .map(str::to_owned)
            .into_iter()
            .chain(columns),
    );
    for scene in scenes {
        for &method in &run.protocol.methods {
            let mut cells = vec![scene.to_owned(), method.name().to_uppercase()];
            for query in &queries {
                let pair = run
                    .pairs
                    .iter()
                    .find(|pair| pair.scene == scene && pair.query_scene == *query);
                let of_pair = pair.map(|pair| OfPair::new(pair, measures));
                let one = of_pair
                    .iter()
                    .flat_map(|of_pair| &of_pair.measures)
                    .find(|one| one.method == method);
                cells.extend(one.map_or([NOTHING; 3].map(str::to_owned), |one| triple(one)));
            }
            table.push(cells);
        }
    }
    table
}

fn triple(one: &Measures) -> [String; 3] {
    [
        percent(one.success_rate),
        number(one.of_successes.rmse_m, 3),
        number(one.of_successes.rmse_deg, 3),
    ]
}

fn rate_cell(one: Option<&Measures>) -> String {
    one.map_or(NOTHING.to_owned(), |one| percent(one.success_rate))
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or(NOTHING.to_owned(), |value| format!("{value:.decimals$}"))
}

fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

#[cfg(test)]
pub(super) mod tests;
