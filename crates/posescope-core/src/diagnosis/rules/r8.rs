//! R8: the pose was accepted and is wrong.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "a wrong pose was accepted",
    advice: "check that camera and cloud belong to the photos; then use --method robust",
    advice_of_matches: Some("check that camera, cloud and matches belong to the photos"),
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::Matches,
    proof_on: |evidence| {
        let count = |key: &str| evidence.get(key)?.as_u64();
        let inliers = [count("inliers")?, count("true_inliers")?];
        depths_are_wrong(inliers, count("wrong_depth")?, count("supports_truth")?)
            .then_some(Proof::DepthPatch)
    },
    remedies,
    ..Rule::new(Code::R8)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let matches = case.matches()?;
    Some(RULE.found(&Accepted {
        error: case.subject.error()?,
        inliers: matches.inliers() as u64,
        true_inliers: matches.funnel.inliers as u64,
        supports_truth: matches.funnel.lifted as u64,
        wrong_depth: matches.wrong_depth as u64,
        true_matches: matches.funnel,
    }))
}

/// Whether most inliers are true, and many of the true matches have a wrong depth.
fn depths_are_wrong([inliers, true_ones]: [u64; 2], wrong_depth: u64, right_depth: u64) -> bool {
    2 * true_ones >= inliers && 2 * wrong_depth > right_depth
}

evidence!(Accepted {
    error: PoseError,
    inliers: u64,
    true_inliers: u64,
    supports_truth: u64,
    wrong_depth: u64,
    true_matches: Funnel,
} => {
    let off = distance(error);
    // A pose on true matches points at their depths or their spread, one on false matches at the photos.
    let why = if depths_are_wrong([*inliers, *true_inliers], *wrong_depth, *supports_truth) {
        format!("Of the true matches, {wrong_depth} have a wrong depth, {supports_truth} the right one.")
    } else if 2 * true_inliers >= *inliers {
        "They are too few or too close together to determine it.".to_owned()
    } else {
        format!(
            "The truth explains {supports_truth}: something looks alike or moved, or the camera or cloud is \
             not as stated."
        )
    };
    format!(
        "A wrong pose was accepted: {inliers} matches agree on it, {off} off, {true_inliers} of them true. \
         {why}"
    )
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let mut tried = Vec::from(many_starts());
    tried.extend([vec![ask.more_keypoints(0.2)], vec![ask.ratio(-0.1)], vec![ask.ratio(-0.2)]]);
    if ask.family == Family::Features {
        tried.push(vec![ask.word("fb.depth", "guarded")]);
    }
    tried
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn false_matches_point_at_the_photos_and_true_ones_at_their_depths_or_their_spread() {
        let said = |true_inliers, wrong_depth| {
            let accepted = Accepted {
                error: PoseError { translation_m: 3.0, rotation_deg: 0.0, max_euler_deg: 0.0 },
                inliers: 20,
                true_inliers,
                supports_truth: 21,
                wrong_depth,
                true_matches: Funnel::default(),
            };
            let found = RULE.found(&accepted);
            assert_eq!(found.proof() == Proof::DepthPatch, found.text.contains("wrong depth"));
            found.text
        };
        let elsewhere = "The truth explains 21: something looks alike or moved, or the camera or cloud is not as stated.";
        assert!(said(14, 18).ends_with("18 have a wrong depth, 21 the right one."));
        assert!(said(14, 10).ends_with("They are too few or too close together to determine it."));
        assert!(said(3, 27).ends_with(elsewhere));
    }
}
