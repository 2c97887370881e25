//! N1: as little speaks for the answer as where the query shows another place.

use super::*;
use crate::diagnosis::relation;

pub(super) const RULE: Rule = Rule {
    title: "the query may not show this place",
    advice: "check where the photo was taken, or use another reference",
    applies_to: &[Family::Features, Family::Guided, Family::Grid, Family::MultiStart],
    needs_truth: false,
    test: Test::Method(test),
    remedies: |_| other_references().into(),
    ..Rule::new(Code::N1)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    // With the truth, other verdicts say what the reference sees of the place.
    if case.subject.truth.is_some() {
        return None;
    }
    match &case.subject.outcome.pose {
        Ok(_) | Err(Failure::LowConfidence { .. }) => {
            let likeness = case.subject.trust.as_ref()?.elsewhere()?;
            Some(RULE.found(&Elsewhere { likeness }))
        }
        Err(failure) => {
            let is_chance = match failure {
                Failure::NoConsensus { .. }
                | Failure::ChanceConsensus { .. }
                | Failure::TooFewMatches { .. } => true,
                // Of many matches that agree on where the photos lie against each other, the depths are missing and not
                // the place.
                Failure::TooFewDepths { unique, .. } => {
                    *unique <= r3::FEW_MATCHES
                        || relation::is_chance(case.subject.evidence) == Some(true)
                }
                _ => false,
            };
            is_chance.then(|| RULE.found(&NoMatches { because: failure.to_string() }))
        }
    }
}

evidence!(Elsewhere {
    /// The probability that a pose like this one is right, beside one of a query of another place.
    likeness: f64,
} =>
    "The query may not show this place: as little speaks for the pose as for poses of other places. Of right poses, \
     fewer than 1 in 100 have so little."
);

evidence!(NoMatches { because: String } =>
    "The query may not show this place, or shows it from afar or in other light: its matches agree no more than those of other places. \
     {because}"
);
