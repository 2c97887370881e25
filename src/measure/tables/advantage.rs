//! What the hybrid gains over the methods that it is made of: the averages of the paper's abstract.

use super::{NOTHING, OfPair};
use crate::measure::metrics::Measures;
use crate::measure::table::Table;
use crate::method::Method;
use crate::run::RunFile;

/// The mean, over all pairs of scenes, of how many points more of the queries the hybrid localises than each
/// other method, and the paper's mean over those of the pairs that it has. `None` without a hybrid.
pub(super) fn advantage(run: &RunFile, measures: &[Measures]) -> Option<Table> {
    let pairs: Vec<OfPair<'_>> = run
        .pairs
        .iter()
        .map(|pair| OfPair::new(pair, measures))
        .collect();
    let methods = &run.protocol.methods;
    let others = methods.iter().filter(|&&method| method != Method::HY);
    if !methods.contains(&Method::HY) || others.clone().next().is_none() {
        return None;
    }
    let papers = |method: Method| mean(pairs.iter().filter_map(|pair| papers_points(pair, method)));
    let has_papers = others.clone().any(|&method| papers(method).is_some());
    let mut header = vec!["HY over", "pairs of scenes", "points"];
    header.extend(has_papers.then_some("points (paper)"));
    let mut table = Table::new(
        "advantage",
        "How many points more of the queries the hybrid localises, on average over the pairs of scenes",
        header,
    );
    for &method in others {
        let ours: Vec<f64> = pairs
            .iter()
            .filter_map(|pair| points(pair, method))
            .collect();
        let one = |mean: Option<f64>| mean.map_or(NOTHING.to_owned(), |mean| format!("{mean:.1}"));
        let mut cells = vec![method.name().to_uppercase(), ours.len().to_string()];
        cells.push(one(mean(ours.into_iter())));
        cells.extend(has_papers.then(|| one(papers(method))));
        table.push(cells);
    }
    Some(table)
}

/// In one pair of scenes, of ours.
fn points(pair: &OfPair<'_>, method: Method) -> Option<f64> {
    let rate = |method| {
        let of_method = pair.measures.iter().find(|one| one.method == method);
        of_method.map(|one| 100.0 * one.success_rate)
    };
    Some(rate(Method::HY)? - rate(method)?)
}

/// In one pair of scenes, of the paper's.
fn papers_points(pair: &OfPair<'_>, method: Method) -> Option<f64> {
    let rate = |method| pair.figure_of_large(method, "success_percent");
    Some(rate(Method::HY)? - rate(method)?)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
