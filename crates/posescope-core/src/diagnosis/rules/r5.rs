//! R5: the inliers do not determine the pose.

use super::*;

/// A pose is fixed if it is off by less than this, by the covariance of its inliers \[m\], at the paper's scale.
pub(super) const FIXED_M: f64 = 0.3;

pub(super) const RULE: Rule = Rule {
    title: "the inliers do not determine the pose",
    advice: "get more matches, and better spread ones",
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::InlierSpread,
    remedies: r4::remedies,
    ..Rule::new(Code::R5)
};

/// The inliers are true, but leave the pose play.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let matches = case.matches()?;
    let inliers = matches.inliers();
    case.subject.outcome.pose.as_ref().ok()?;
    if inliers == 0 || 2 * matches.funnel.inliers < inliers {
        return None;
    }
    let deviation_m = case.deviation_m(matches);
    let limit_m = case.length(FIXED_M);
    if deviation_m.is_some_and(|deviation| deviation < limit_m) {
        return None;
    }
    Some(RULE.found(&Loose { deviation_m, limit_m, inliers, true_matches: matches.funnel }))
}

evidence!(Loose { deviation_m: Option<f64>, limit_m: f64, inliers: usize, true_matches: Funnel } => {
    match deviation_m {
        Some(deviation) => format!(
            "The {inliers} inliers leave the pose loose: its standard deviation is {deviation:.2} m, \
             {limit_m} m is the limit. They are too few or too close together."
        ),
        None => format!("The {inliers} inliers leave the pose undetermined."),
    }
});
