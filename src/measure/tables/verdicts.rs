//! Why poses are wrong or missing: the primary verdicts of a run, counted.

use std::collections::BTreeMap;

use super::percent;
use crate::diagnosis::Code;
use crate::measure::metrics::Measures;
use crate::measure::table::Table;

/// One line per group and method, one column for each primary verdict that occurs.
pub(super) fn verdicts(measures: &[Measures]) -> Option<Table> {
    let mut codes: Vec<Code> = measures
        .iter()
        .flat_map(|one| one.verdicts.keys())
        .copied()
        .collect();
    codes.sort_unstable();
    codes.dedup();
    if codes.is_empty() {
        return None;
    }
    let head = ["", "method", "queries"].map(str::to_owned);
    let columns = codes.iter().map(|code| format!("{code} (%)"));
    let meanings: Vec<String> = codes
        .iter()
        .map(|code| format!("{code} {}", code.title()))
        .collect();
    let mut table = Table::new(
        "verdicts",
        format!(
            "Shares of the queries by primary verdict. {}.",
            meanings.join("; ")
        ),
        head.into_iter().chain(columns),
    );
    for one in measures {
        let share = |code: &Code, of: &BTreeMap<Code, usize>| {
            let count = of.get(code).copied().unwrap_or_default();
            percent(count as f64 / one.queries.max(1) as f64)
        };
        let mut cells = vec![
            one.group.to_string(),
            one.method.name().to_uppercase(),
            one.queries.to_string(),
        ];
        cells.extend(codes.iter().map(|code| share(code, &one.verdicts)));
        table.push(cells);
    }
    Some(table)
}
