//! H1: a method that chooses between poses kept a wrong one.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the wrong method's pose was kept",
    advice: "use --method robust, or run the other method alone",
    advice_of: |family| match family {
        Family::MultiStart => Some("run the better method alone, or change robust.credit"),
        _ => None,
    },
    applies_to: Family::ALL,
    test: Test::Method(test),
    remedies,
    ..Rule::new(Code::H1)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    match case.family {
        Family::MultiStart => passed_over(case),
        _ => kept_by_hybrid(case),
    }
}

/// A hybrid that kept its first method's pose answers for it.
fn kept_by_hybrid(case: &Case<'_>) -> Option<Diagnosis> {
    let parts = case.hybrid()?;
    let error = case.subject.error()?;
    (case.responsible == parts.first).then(|| {
        RULE.found(&Kept {
            hybrid: case.subject.method,
            kept: parts.first,
            not_asked: parts.second,
            error,
        })
    })
}

evidence!(Kept { hybrid: Method, kept: Method, not_asked: Method, error: PoseError } =>
    "{} kept the wrong pose of {kept}, {} off, because that method accepted it. Its fallback \
     {not_asked} was not asked.",
    hybrid.label(), distance(error)
);

/// A method had a right candidate, and that of another one was taken. Where both are of one method, its search or its cost
/// failed, which other rules say.
fn passed_over(case: &Case<'_>) -> Option<Diagnosis> {
    case.subject.evidence.settled.as_ref()?;
    let truth = case.subject.reference_from_truth()?;
    let candidates = case.subject.evidence.candidates.as_ref()?;
    let (taken, others) = candidates.split_first()?;
    let error = |pose: &Pose| PoseError::between(&truth, pose);
    let is_right = |pose: &Pose| case.subject.tolerance.contains(&error(pose));
    let mut of_others = others.iter().filter(|other| other.method != taken.method);
    let right = of_others.find(|other| is_right(&other.refined.pose))?;
    Some(RULE.found(&PassedOver {
        kept: taken.method,
        cost_kept: taken.refined.cost,
        passed_over: right.method,
        cost_passed_over: right.refined.cost,
        error: error(&right.refined.pose),
    }))
}

evidence!(PassedOver {
    kept: Method,
    cost_kept: f64,
    passed_over: Method,
    cost_passed_over: f64,
    error: PoseError,
} => {
    let (right, lost_to) = pair(*cost_passed_over, *cost_kept);
    let why = if cost_passed_over < cost_kept {
        " The prior, or the credit of features, decided."
    } else {
        ""
    };
    format!(
        "A right pose of {passed_over}, cost {right}, lost to a wrong one of {kept}, cost {lost_to} \
         (lower is better).{why}"
    )
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let ([robust, mi6], [farther, nearer]) = (many_starts(), other_references());
    let mut tried = vec![robust, farther, mi6, nearer];
    if ask.family == Family::Features {
        tried.extend([vec![ask.ratio(-0.1)], vec![ask.more_keypoints(0.2), ask.ratio(0.06)]]);
    }
    tried
}
