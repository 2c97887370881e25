//! Which remedies mend most queries of a run.

use super::groups::grouped;
use crate::localize::{Helped, QueryResult};

/// What stands for references that were tried for single queries: another query needs another frame.
const ANOTHER_REFERENCE: &str = "a reference farther away";

/// The remedies with the number of queries that each mends, the one that mends most first; of equal ones, what was
/// tried first. Arguments are between backquotes.
pub fn mended(results: &[&QueryResult]) -> Vec<(String, usize)> {
    let helped = results.iter().flat_map(|result| {
        let helped = result.explanation.iter().flat_map(|explanation| &explanation.helped);
        let scene = result.query_scene.as_ref().unwrap_or(&result.scene);
        helped.map(move |helped| (words(helped), (scene, &result.query)))
    });
    let mut mended: Vec<(String, usize)> = grouped(helped)
        .into_iter()
        .map(|(remedy, mut queries)| {
            queries.sort_unstable();
            queries.dedup();
            (remedy, queries.len())
        })
        .collect();
    mended.sort_by_key(|(_, queries)| std::cmp::Reverse(*queries));
    mended
}

/// A remedy as one of a whole run.
fn words(helped: &Helped) -> String {
    if helped.names_a_frame() {
        return ANOTHER_REFERENCE.to_owned();
    }
    let args: Vec<&str> =
        helped.args.iter().map(String::as_str).filter(|arg| *arg != "--set").collect();
    format!("`{}`", args.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PoseError;
    use crate::localize::Explanation;
    use crate::measure::metrics::tests::row;

    /// A wrong result of a query with the arguments that made it right.
    fn explained(query: &str, method: &str, helped: &[&str]) -> QueryResult {
        let error = PoseError { translation_m: 0.1, rotation_deg: 0.0, max_euler_deg: 0.0 };
        let args = |words: &&str| words.split(' ').map(str::to_owned).collect();
        let helped = helped.iter().map(|words| Helped { args: args(words), error }).collect();
        let explanation = Explanation { helped, complete: true, ..Explanation::default() };
        QueryResult { explanation: Some(explanation), ..row(query, method, Some(9.0)) }
    }

    #[test]
    fn remedies_of_a_run_are_ranked_by_queries_and_name_no_frame() {
        let rows = [
            explained("1", "mi", &["--reference 000133", "--reference 000140"]),
            explained("2", "mi", &["--set grid.rounds=2", "--reference 000210"]),
            explained("3", "mi", &["--method mi6", "--set grid.rounds=2", "--reference 000007"]),
            // The same query again, by another method.
            explained("3", "pm", &["--set grid.rounds=2"]),
        ];
        let all: Vec<&QueryResult> = rows.iter().collect();
        let expected = [(ANOTHER_REFERENCE, 3), ("`grid.rounds=2`", 2), ("`--method mi6`", 1)];
        assert_eq!(mended(&all), expected.map(|(words, times)| (words.to_owned(), times)));
    }
}
