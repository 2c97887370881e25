//! Gates: conditions that the figures of a run must meet.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::metrics::Measures;
use crate::diagnosis::Code;
use crate::method::Method;
use crate::relation::Relation;

/// What a gate looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Metric {
    Right,
    Success,
    Recall {
        metres: f64,
        degrees: f64,
    },
    MedianMetres,
    MedianDegrees,
    RmseMetres,
    RmseDegrees,
    /// Share of the queries with this primary verdict.
    Share(Code),
    MedianConfidence,
    MedianSeconds,
}

/// A condition such as `success@mi >= 0.9`, `recall@0.5m,5deg@fb >= 0.8` or `share(D3)@mi <= 0.05`.
///
/// It holds where it holds in every group of the run: for each scene, setting and fusion.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    text: String,
    metric: Metric,
    method: Method,
    relation: Relation,
    limit: f64,
}

/// Whether a gate holds, and what decided it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GateResult {
    /// The gate as it was given.
    pub gate: String,
    /// Whether it holds everywhere.
    pub passed: bool,
    /// The worst figure and where it was found.
    pub found: String,
}

impl FromStr for Gate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "`{text}`: METRIC@METHOD >= NUMBER expected, where METRIC is right, success, \
                 recall@0.5m,5deg, median_m, median_deg, rmse_m, rmse_deg, share(CODE) of a verdict, \
                 median(confidence) or median(time) in seconds, and the comparison >=, >, <= or <"
            )
        };
        let (left, relation, right) = Relation::split(text).ok_or_else(expected)?;
        let (metric, method) = left.rsplit_once('@').ok_or_else(expected)?;
        let limit: f64 = right.parse().map_err(|_| expected())?;
        let method = Method::called(method).map_err(|_| expected())?;
        let is_unordered = matches!(
            relation,
            Relation::Is | Relation::IsNot | Relation::Contains
        );
        if is_unordered || !limit.is_finite() {
            return Err(expected());
        }
        Ok(Self {
            text: text.trim().to_owned(),
            metric: metric_of(metric).ok_or_else(expected)?,
            method,
            relation,
            limit,
        })
    }
}

fn metric_of(text: &str) -> Option<Metric> {
    Some(match text {
        "right" => Metric::Right,
        "success" => Metric::Success,
        "median_m" => Metric::MedianMetres,
        "median_deg" => Metric::MedianDegrees,
        "rmse_m" => Metric::RmseMetres,
        "rmse_deg" => Metric::RmseDegrees,
        "median(confidence)" => Metric::MedianConfidence,
        "median(time)" => Metric::MedianSeconds,
        _ if text.starts_with("share(") => {
            let code = text.strip_prefix("share(")?.strip_suffix(')')?;
            Metric::Share(code.parse().ok()?)
        }
        _ => {
            let (metres, degrees) = text.strip_prefix("recall@")?.split_once(',')?;
            Metric::Recall {
                metres: metres.strip_suffix('m')?.parse().ok()?,
                degrees: degrees.strip_suffix("deg")?.parse().ok()?,
            }
        }
    })
}

impl Gate {
    /// The method that it looks at.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Holds it against the figures of a run. A figure that does not exist passes no gate.
    pub fn check(&self, measures: &[Measures]) -> GateResult {
        let of_method = measures.iter().filter(|one| one.method == self.method);
        let mut worst: Option<(f64, Option<f64>, String)> = None;
        for one in of_method {
            let value = self.value(one);
            // How far on the good side; what is missing is on the worst.
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
        let found = value.map_or("no figure".to_owned(), |value| format!("{value:.4}"));
        self.result(passed, format!("{found} ({group})"))
    }

    fn result(&self, passed: bool, found: String) -> GateResult {
        GateResult {
            gate: self.text.clone(),
            passed,
            found,
        }
    }

    fn value(&self, measures: &Measures) -> Option<f64> {
        let errors = &measures.of_successes;
        match self.metric {
            Metric::Right => Some(measures.share(measures.right)),
            Metric::Success => Some(measures.success_rate),
            Metric::Recall { metres, degrees } => measures.recall_within(metres, degrees),
            Metric::MedianMetres => errors.median_m,
            Metric::MedianDegrees => errors.median_deg,
            Metric::RmseMetres => errors.rmse_m,
            Metric::RmseDegrees => errors.rmse_deg,
            Metric::Share(code) => {
                let count = measures.verdicts.get(&code).copied();
                Some(measures.share(count.unwrap_or(0)))
            }
            Metric::MedianConfidence => measures.median_confidence,
            Metric::MedianSeconds => measures.median_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::{ConfidenceOfRow, Finding, measure, tests::rows};
    use super::*;

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
        for (at, row) in rows
            .iter_mut()
            .filter(|row| row.method == Method::MI)
            .enumerate()
        {
            row.seconds = Some(at as f64);
            row.confidence = (at > 0).then_some(ConfidenceOfRow {
                probability: 0.9 + 0.01 * at as f64,
            });
            row.diagnosis
                .extend((at == 3).then_some(Finding { code: Code::D3 }));
        }
        let passes = |gate: &str| {
            let gate: Gate = gate.parse().expect("a gate");
            gate.check(&measure(&rows, 10.0)).passed
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
}
