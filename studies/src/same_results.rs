use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::Failure;

/// What identifies a result.
const IDENTITY: &str = "scene query_scene query references method fusion setting";

/// What must be the same, as JSON pointers.
const COMPARED: &str = "/status /reason/code /pose /error /counts /cost";

/// Do two runs have the same results?
///
/// Matches results by scene, query, references, method, fusion and setting, and compares status, reason code, pose,
/// error, counts and cost. Keys that only one side has are ignored below these names, so a newer version may add
/// some. Prints each difference and exits with code 1 if there is one.
#[derive(clap::Args)]
pub struct Options {
    /// A results.jsonl, a run folder, or a folder of run folders.
    a: PathBuf,
    /// What it is compared with.
    b: PathBuf,
}

/// Compares every pair of files and returns the number of results that differ.
pub fn run(Options { a, b }: &Options) -> Result<usize, Failure> {
    let (files_a, files_b) = (result_files(a)?, result_files(b)?);
    let (mut compared, mut differing) = (0, 0);
    let names: BTreeSet<&String> = files_a.keys().chain(files_b.keys()).collect();
    for name in names {
        let (Some(file_a), Some(file_b)) = (files_a.get(name), files_b.get(name)) else {
            let side = if files_a.contains_key(name) { a } else { b };
            println!("{name}: only in {}", side.display());
            differing += 1;
            continue;
        };
        let results = read(file_a)?;
        let found = differences(&results, &read(file_b)?);
        for (result, lines) in &found {
            println!("{}", format!("{name} {result}").trim_start());
            lines.iter().for_each(|line| println!("    {line}"));
        }
        compared += results.len();
        differing += found.len();
    }
    println!("{compared} results compared, {differing} differ");
    Ok(differing)
}

/// The `results.jsonl` files of a place, by the name of their folder in it.
fn result_files(place: &Path) -> Result<BTreeMap<String, PathBuf>, Failure> {
    for own in [place.to_owned(), place.join("results.jsonl")] {
        if own.is_file() {
            return Ok(BTreeMap::from([(String::new(), own)]));
        }
    }
    let error_of = |error: &dyn std::fmt::Display| format!("{}: {error}", place.display());
    let entries = fs::read_dir(place).map_err(|error| error_of(&error))?.flatten();
    let files = entries.map(|entry| (entry.file_name(), entry.path().join("results.jsonl")));
    let found: BTreeMap<String, PathBuf> = files
        .filter(|(_, file)| file.is_file())
        .map(|(name, file)| (name.to_string_lossy().into_owned(), file))
        .collect();
    if found.is_empty() {
        return Err(error_of(&"no results.jsonl in it or one folder down").into());
    }
    Ok(found)
}

/// The results of a file, by what identifies them.
fn read(file: &Path) -> Result<BTreeMap<String, Value>, Failure> {
    let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let mut results = BTreeMap::new();
    for (index, line) in text.lines().enumerate() {
        let error_of =
            |error: &dyn std::fmt::Display| format!("{}:{}: {error}", file.display(), index + 1);
        let result: Value = serde_json::from_str(line).map_err(|error| error_of(&error))?;
        let name = identity(&result);
        if results.insert(name.clone(), result).is_some() {
            return Err(error_of(&format!("a second result of {name}")).into());
        }
    }
    Ok(results)
}

fn identity(result: &Value) -> String {
    let values = IDENTITY.split(' ').filter_map(|key| result.get(key));
    let words = values.filter(|value| !value.is_null()).map(|value| match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    });
    words.collect::<Vec<_>>().join(" ")
}

/// What differs, by result.
fn differences(
    a: &BTreeMap<String, Value>,
    b: &BTreeMap<String, Value>,
) -> BTreeMap<String, Vec<String>> {
    let mut found = BTreeMap::new();
    for (name, of_a) in a {
        let value = |of: &Value, at: &str| of.pointer(at).cloned().unwrap_or(Value::Null);
        let lines = match b.get(name) {
            None => vec!["only in A".to_owned()],
            Some(of_b) => COMPARED
                .split(' ')
                .flat_map(|at| below(at, &value(of_a, at), &value(of_b, at)))
                .collect(),
        };
        if !lines.is_empty() {
            found.insert(name.clone(), lines);
        }
    }
    for name in b.keys().filter(|name| !a.contains_key(*name)) {
        found.insert(name.clone(), vec!["only in B".to_owned()]);
    }
    found
}

/// What differs at or below a place. A key that only one of two objects has is no difference.
fn below(place: &str, a: &Value, b: &Value) -> Vec<String> {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => a
            .iter()
            .filter_map(|(key, of_a)| Some((key, of_a, b.get(key)?)))
            .flat_map(|(key, of_a, of_b)| below(&format!("{place}/{key}"), of_a, of_b))
            .collect(),
        (a, b) if a == b => Vec::new(),
        (a, b) => vec![format!("{place}: {a} became {b}")],
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn of(results: &[Value]) -> BTreeMap<String, Value> {
        let named = results.iter().map(|one| (identity(one), one.clone()));
        named.collect()
    }

    fn result(query: &str, best: f64) -> Value {
        json!({
            "scene": "street", "query": query, "references": ["62"], "method": "mi", "fusion": null,
            "status": "ok", "reason": null, "pose": { "position_m": [0.0, 1.0, 2.0] },
            "error": null, "counts": null, "cost": { "best": best },
            "diagnosis": [{ "code": "D3", "text": "as it was put before" }],
        })
    }

    #[test]
    fn equal_results_do_not_differ_and_new_keys_and_other_words_are_allowed() {
        let a = of(&[result("70", 0.5)]);
        let mut newer = result("70", 0.5);
        newer["grade"] = json!("wrong");
        newer["cost"]["median"] = json!(0.7);
        newer["diagnosis"] = json!([]);
        assert!(differences(&a, &of(&[newer])).is_empty());
    }

    #[test]
    fn another_number_and_a_missing_result_are_differences() {
        let a = of(&[result("70", 0.5), result("71", 0.5)]);
        let b = of(&[result("70", 0.25), result("72", 0.5)]);
        let found = differences(&a, &b);
        let lines: Vec<&str> = found.values().flatten().map(String::as_str).collect();
        assert_eq!(lines, ["/cost/best: 0.5 became 0.25", "only in A", "only in B"]);
        let mut failed = result("70", 0.5);
        failed["status"] = json!("failed");
        failed["reason"] = json!({ "code": "R3", "text": "" });
        failed["pose"] = Value::Null;
        let found = differences(&of(&[result("70", 0.5)]), &of(&[failed]));
        assert_eq!(found.values().map(Vec::len).sum::<usize>(), 3);
    }
}
