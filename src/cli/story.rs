//! The text below the table of results: poses, why they are wrong or missing, and what would have helped.

use std::time::Duration;

use posescope::diagnosis::Grade;
use posescope::estimator;
use posescope::localize::QueryResult;
use posescope::table::wrapped;

/// The poses and verdicts of all results, wrapped at `width` characters if given; empty if there is nothing to say.
pub fn story(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let mut text = String::new();
    let lines = |paragraph: String| wrapped(&paragraph, width.unwrap_or(usize::MAX), "    ");
    for (result, _) in results {
        let (pose, verdict) = (pose(result), result.verdict());
        if pose.is_none() && verdict.is_none() {
            continue;
        }
        // With several references, the sentence names the one that gave the pose.
        let is_same = |other: &QueryResult| {
            other.query == result.query && other.method_name() == result.method_name()
        };
        let against = match results.iter().filter(|(other, _)| is_same(other)).count() {
            1 => String::new(),
            _ => format!(" against {}", result.references.join(" ")),
        };
        let name = format!("{} {}{against}", result.query, result.method_name());
        let sentences = [pose, verdict].into_iter().flatten();
        text.push('\n');
        for sentence in sentences {
            text += &lines(format!("{name}: {sentence}"));
        }
        for paragraph in result.paragraphs() {
            text += &lines(format!("  {paragraph}"));
        }
    }
    text
}

/// The pose, unless it is wrong or another system's.
fn pose(result: &QueryResult) -> Option<String> {
    let is_ours = estimator::find(result.method).is_some();
    let pose = result.pose.as_ref().filter(|_| is_ours && result.grade != Grade::Wrong)?;
    let [x, y, z] = pose.position_m;
    let [qx, qy, qz, qw] = pose.quaternion_xyzw;
    let words = format!(
        "world_from_camera: position {x:.3} {y:.3} {z:.3} m, quaternion x y z w {qx:.6} {qy:.6} {qz:.6} {qw:.6}"
    );
    Some(result.unit.words(&words))
}
