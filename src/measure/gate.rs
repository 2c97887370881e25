//! Gates: conditions on the figures of a run.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::metrics::Measures;
use crate::diagnosis::{Code, Tolerance};
use crate::method::Method;
use crate::relation::Relation;
use crate::table::Table;

/// The figure of a gate.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Metric {
    /// One of [`FIGURES`].
    Figure(&'static str),
    /// The share of the queries within these limits.
    Recall(Tolerance),
    /// The share of the queries with this primary verdict.
    Share(Code),
}

impl Metric {
    /// Whether its values are shares or probabilities.
    fn is_share(self) -> bool {
        match self {
            Self::Figure(name) => {
                !name.ends_with("_m") && !name.ends_with("_deg") && name != "median(time)"
            }
            Self::Recall(_) | Self::Share(_) => true,
        }
    }
}

/// The names of [`Measures::figure`] that gates may use.
const FIGURES: [&str; 11] = [
    "right",
    "success",
    "median_m",
    "median_deg",
    "rmse_m",
    "rmse_deg",
    "median(confidence)",
    "median(time)",
    "confirmed",
    "contradicted",
    "undecided",
];

/// A condition such as `success@mi >= 0.9`, `recall@0.5m,5deg@fb >= 0.8` or `share(D3)@mi <= 0.05`.
///
/// It must hold in every group of the run: for each scene, setting and fusion.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    text: String,
    metric: Metric,
    method: Method,
    relation: Relation,
    limit: f64,
}

/// The outcome of a gate, and the figure that decided it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GateResult {
    /// The text of the gate.
    pub gate: String,
    /// Whether it holds in every group.
    pub passed: bool,
    /// The worst figure and its group.
    pub found: String,
}

impl GateResult {
    /// A table of gates and their outcomes.
    pub fn table(gates: &[Self]) -> Table {
        let mut table = Table::with_notes(["gate", "", "found"], &[], 0);
        table.name = "Gates".to_owned();
        for one in gates {
            let passed = if one.passed { "passed" } else { "failed" };
            table.push([format!("`{}`", one.gate), passed.to_owned(), one.found.clone()]);
        }
        table
    }
}

impl fmt::Display for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Gate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "`{text}`: METRIC@METHOD >= NUMBER expected. METRIC is right, success, \
                 recall@0.5m,5deg, median_m, median_deg, rmse_m, rmse_deg, share(CODE) of a verdict, \
                 median(confidence), median(time) in seconds, or, of another system's poses, confirmed, \
                 contradicted or undecided; the comparison is >=, >, <= or <"
            )
        };
        let (left, relation, right) = Relation::split(text).ok_or_else(expected)?;
        let (metric, method) = left.rsplit_once('@').ok_or_else(expected)?;
        let limit: f64 = right.parse().map_err(|_| expected())?;
        let method = Method::called(method).map_err(|_| expected())?;
        let is_unordered = matches!(relation, Relation::Is | Relation::IsNot | Relation::Contains);
        if is_unordered || !limit.is_finite() {
            return Err(expected());
        }
        let metric = metric_of(metric).ok_or_else(expected)?;
        if metric.is_share() && !(0.0..=1.0).contains(&limit) {
            return Err(format!(
                "`{text}`: a number from 0 to 1 expected, {limit} found; 1 is all"
            ));
        }
        Ok(Self { text: text.trim().to_owned(), metric, method, relation, limit })
    }
}

fn metric_of(text: &str) -> Option<Metric> {
    if let Some(limits) = text.strip_prefix("recall@") {
        return Some(Metric::Recall(limits.parse().ok()?));
    }
    if let Some(code) = text.strip_prefix("share(") {
        return Some(Metric::Share(code.strip_suffix(')')?.parse().ok()?));
    }
    let figure = FIGURES.into_iter().find(|name| *name == text);
    figure.map(Metric::Figure)
}

impl Gate {
    /// Its method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Checks the gate on the figures of a run. A missing figure fails it.
    pub fn check(&self, measures: &[Measures]) -> GateResult {
        let of_method = measures.iter().filter(|one| one.method == self.method);
        let mut worst: Option<(f64, Option<f64>, String)> = None;
        for one in of_method {
            let value = self.value(one);
            // The distance to the limit, positive if the gate holds; missing figures are worst.
            let margin = value.map_or(f64::NEG_INFINITY, |value| match self.relation {
                Relation::AtLeast | Relation::Above => value - self.limit,
                _ => self.limit - value,
            });
            if worst.as_ref().is_none_or(|(known, ..)| margin < *known) {
                worst = Some((margin, value, one.group.to_string()));
            }
        }
        let Some((_, value, group)) = worst else {
            return self.result(false, format!("the run has no results of {}", self.method));
        };
        let passed = value.is_some_and(|value| self.relation.holds(value, self.limit));
        let found = value.map_or("no value".to_owned(), |value| format!("{value:.4}"));
        self.result(passed, format!("{found} ({group})"))
    }

    fn result(&self, passed: bool, found: String) -> GateResult {
        GateResult { gate: self.text.clone(), passed, found }
    }

    fn value(&self, measures: &Measures) -> Option<f64> {
        match self.metric {
            Metric::Figure(name) => measures.figure(name),
            Metric::Recall(limits) => {
                measures.recall_within(limits.translation_m, limits.rotation_deg)
            }
            Metric::Share(code) => {
                let count = measures.verdicts.get(&code).copied();
                Some(measures.share(count.unwrap_or(0)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::measure;
    use super::super::metrics::tests::{finding, rows};
    use super::*;
    use crate::localize::QueryResult;

    fn passes(gate: &str) -> bool {
        let gate: Gate = gate.parse().expect("a gate");
        gate.check(&measure(&rows(), 10.0)).passed
    }

    #[test]
    fn gates_hold_where_the_figures_by_hand_say_so() {
        assert!(passes("right@mi >= 0.5"));
        assert!(!passes("right@mi > 0.5"));
        assert!(passes("success@mi >= 0.75"));
        assert!(!passes("success@mi > 0.75"));
        assert!(passes("recall@0.5m,5deg@fb >= 0.5"));
        assert!(!passes("recall@0.5m,5deg@fb >= 0.51"));
        assert!(passes("median_m@fb < 0.3"));
        assert!(!passes("rmse_deg@mi<=1"));
        // There is no result of pm.
        assert!(!passes("success@pm >= 0"));
    }

    #[test]
    fn verdicts_confidence_and_time_have_gates() {
        let mut rows = rows();
        let of_mi = rows.iter_mut().filter(|row| row.method == Method::MI);
        for (at, row) in of_mi.enumerate() {
            let confidence = serde_json::json!({
                "probability": 0.9 + 0.01 * at as f64, "word": "unsure", "calibrated_on": "street"
            });
            let confidence = serde_json::from_value(confidence).expect("a confidence");
            row.confidence = (at > 0).then_some(confidence);
            row.diagnosis.extend((at == 3).then(|| finding(Code::D3)));
        }
        // The results of MI took 0, 1, 2 and 3 s.
        let seconds =
            |at: usize, row: &QueryResult| (row.method == Method::MI).then_some((at / 2) as f64);
        let timed = rows.iter().enumerate();
        let timed = timed.map(|(at, row)| (row, seconds(at, row)));
        let mut measures = measure(&rows, 10.0);
        super::super::timings::add_medians(&mut measures, timed);
        let passes = |gate: &str| {
            let gate: Gate = gate.parse().expect("a gate");
            gate.check(&measures).passed
        };
        assert!(passes("share(D3)@mi <= 0.25"));
        assert!(!passes("share(D3)@mi < 0.25"));
        assert!(passes("share(D2)@mi <= 0"));
        assert!(passes("median(time)@mi <= 1.5") && !passes("median(time)@mi < 1.5"));
        assert!(passes("median(confidence)@mi >= 0.92"));
        assert!(!passes("median(confidence)@mi > 0.92"));
        // What was not measured passes no gate.
        assert!(!passes("median(time)@fb < 1000"));
    }

    #[test]
    fn nonsense_is_refused_with_what_was_expected() {
        for wrong in [
            "success >= 0.9",
            "success@fb = 0.9",
            "recall@fb >= 1",
            "recall@0.5,5@fb >= 1",
            "success@fb >= much",
            "success@fb >= nan",
            "share(D99)@mi <= 1",
            "share(D3 @mi <= 1",
            "median(speed)@mi <= 1",
            "",
        ] {
            let error = wrong.parse::<Gate>().expect_err(wrong);
            assert!(error.contains("METRIC@METHOD"), "{error}");
        }
    }

    #[test]
    fn a_share_is_from_0_to_1() {
        for wrong in
            ["right@fb >= 2", "success@fb >= 90", "recall@0.5m,5deg@fb < -1", "share(D3)@mi <= 5"]
        {
            let error = wrong.parse::<Gate>().expect_err(wrong);
            assert!(error.contains("a number from 0 to 1 expected"), "{error}");
        }
        for possible in ["right@fb >= 1", "right@fb > 0", "median_deg@fb < 5", "rmse_m@fb <= 12"] {
            assert!(possible.parse::<Gate>().is_ok(), "{possible}");
        }
    }
}
