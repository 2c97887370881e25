//! `junit.xml`: one test case per query and method, for the test report of a CI service.

use std::time::Duration;

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use super::gate::GateResult;
use super::groups::grouped;
use super::known::KnownFailures;
use super::metrics::Group;
use crate::fusion::Fusion;
use crate::localize::{QueryResult, Setting};

/// The report as XML, without timestamps. `times` are those of the results \[s\], where they are known.
///
/// # Errors
/// A text that cannot be written as XML.
pub fn junit(
    results: &[QueryResult],
    times: &[Option<f64>],
    gate_results: &[GateResult],
    known: &KnownFailures,
) -> Result<String, quick_junit::SerializeError> {
    let mut report = Report::new("posescope");
    // Results are ordered by query; a suite has those of one method.
    let cases = results.iter().zip(times).map(|(row, time)| {
        let suite = format!("{} {}", Group::of(row).scenes(), row.method);
        let words = row.grade.words(row.error.as_ref());
        let status = match (row.diagnosis.first(), &row.reason) {
            _ if !row.is_suspect() => TestCaseStatus::success(),
            _ if known.has(row) => skipped(&words),
            (Some(primary), _) => failure(primary.code.name(), &primary.text),
            (None, Some(reason)) => failure(reason.code.name(), &reason.text),
            (None, None) => failure(row.grade.word(), &words),
        };
        let mut case = TestCase::new(case_name(&row.query, row.setting, row.fusion), status);
        case.set_classname(suite.clone());
        if let Some(time) = time.and_then(|time| Duration::try_from_secs_f64(time).ok()) {
            case.set_time(time);
        }
        (suite, case)
    });
    for (name, cases) in grouped(cases) {
        let mut suite = TestSuite::new(name);
        suite.add_test_cases(cases);
        report.add_test_suite(suite);
    }
    if !gate_results.is_empty() {
        let mut suite = TestSuite::new("gates");
        for gate_result in gate_results {
            let status = if gate_result.passed {
                TestCaseStatus::success()
            } else {
                failure("gate", &gate_result.found)
            };
            suite.add_test_case(TestCase::new(gate_result.gate.as_str(), status));
        }
        report.add_test_suite(suite);
    }
    report.to_string()
}

fn failure(kind: &str, message: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
    status.set_type(kind).set_message(message);
    status
}

fn skipped(message: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::skipped();
    status.set_type("known failure").set_message(message);
    status
}

fn case_name(query: &str, setting: Option<Setting>, fusion: Option<Fusion>) -> String {
    let mut name = query.to_owned();
    if let Some(setting) = setting {
        name += &format!(" {} m {} ref", setting.radius_m, setting.references);
    }
    if let Some(fusion) = fusion {
        name += &format!(" {fusion}");
    }
    name
}
