//! R3: too few true matches.

use super::*;
use crate::diagnosis::matches::FunnelStep;

/// Fewer true matches stand out from no crowd of false ones.
pub(super) const FEW_MATCHES: usize = 8;

pub(super) const RULE: Rule = Rule {
    title: "too few usable matches",
    advice: "use --method robust or another reference, or get more keypoints",
    advice_on: |found| {
        found
            .get("allowed_m")
            .map(|_| "use another reference, nearer to the query, or raise --radius")
    },
    advice_of_matches: Some(
        "let the matcher keep more matches, or use another reference or method",
    ),
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Match),
    proof: Proof::Matches,
    remedies,
    ..Rule::new(Code::R3)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    // Where nothing was matched, R2 or the failure says why.
    case.subject.evidence.decisions.as_ref()?;
    let matches = case.matches()?;
    let funnel = matches.funnel;
    let without_depth = if matches.many_without_depth() {
        matches.wrong_depth + matches.lost_for_depth()
    } else {
        0
    };
    let true_ones = funnel.unique.max(funnel.lifted) + without_depth;
    if true_ones >= FEW_MATCHES || case.consensus_is_right() {
        return None;
    }
    let (lost_at, before, after) = funnel.worst_step();
    let too_far = case.truth_beyond_prior();
    Some(RULE.found(&Matches {
        unique: matches.all_unique,
        lost_at,
        before,
        after,
        limit: case.keypoint_limit().filter(|_| lost_at == FunnelStep::Detect),
        true_matches: funnel,
        distance_m: too_far.map(|(distance_m, _)| distance_m),
        allowed_m: too_far.map(|(_, allowed_m)| allowed_m),
    }))
}

#[derive(Serialize)]
struct Matches {
    unique: usize,
    lost_at: FunnelStep,
    before: usize,
    after: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<String>,
    true_matches: Funnel,
    /// How far the truth is from the reference \[m\], where it is farther than the prior allows.
    #[serde(skip_serializing_if = "Option::is_none")]
    distance_m: Option<f64>,
    /// How far it may be then \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    allowed_m: Option<f64>,
}

impl fmt::Display for Matches {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, lost) = (self.before, self.before - self.after.min(self.before));
        let (of, lost_by) = match self.lost_at {
            FunnelStep::View => {
                ("reference keypoints with a depth", "are outside the query's view")
            }
            FunnelStep::Detect => {
                ("reference keypoints in the query's view", "were not detected there")
            }
            FunnelStep::Match => {
                ("keypoints detected in both photos", "have a wrong nearest neighbour")
            }
            FunnelStep::Ratio => ("true nearest neighbours", "fail the ratio test"),
            FunnelStep::Unique => ("true matches", "are not mutually best"),
        };
        let true_matches = self.true_matches.unique;
        write!(f, "Too few true matches: {true_matches} of {}. ", self.unique)?;
        write!(f, "Of {before} {of}, {lost} {lost_by}")?;
        match &self.limit {
            Some(limit) => write!(f, ": {limit}."),
            None => f.write_str("."),
        }
    }
}

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let own = match ask.family {
        Family::Guided => vec![
            ask.set("fb2.window", 2.0 * ask.params.fb2.window_px),
            ask.set("fb2.least_probability", 0.0),
        ],
        _ => vec![ask.word("fb.accept", "paper")],
    };
    let ([robust, mi6], [farther, nearer]) = (many_starts(), other_references());
    let keypoints = vec![ask.more_keypoints(0.2)];
    let both = vec![ask.more_keypoints(0.2), ask.ratio(0.06)];
    let (first, second) = match ask.family {
        Family::Guided => (keypoints, both),
        _ => (both, keypoints),
    };
    let tried = [robust, farther, first, mi6, nearer, second, vec![ask.ratio(0.06)]];
    tried.into_iter().chain(own.into_iter().map(|change| vec![change])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_of_keypoints_is_named_where_detection_lost_them() {
        let said = |limit: Option<&str>| {
            let matches = Matches {
                distance_m: None,
                allowed_m: None,
                unique: 6,
                lost_at: FunnelStep::Detect,
                before: 40,
                after: 2,
                limit: limit.map(str::to_owned),
                true_matches: Funnel::default(),
            };
            matches.to_string()
        };
        assert!(said(None).ends_with(
            "Of 40 reference keypoints in the query's view, 38 were not detected there."
        ));
        assert!(
            said(Some("surf.max_keypoints=40"))
                .ends_with("not detected there: surf.max_keypoints=40.")
        );
    }
}
