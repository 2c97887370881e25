//! R4: depths are missing or wrong.

use super::r3::FEW_MATCHES;
use super::*;

pub(super) const RULE: Rule = Rule {
    title: "depths are missing or wrong",
    advice: "raise fb.depth_radius, try fb.depth=guarded; does the cloud belong to the photo?",
    advice_of: |family| match family {
        Family::Guided => Some("raise fb2.depth_radius; does the cloud belong to the photo?"),
        _ => None,
    },
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::DepthLift),
    proof: Proof::DepthPatch,
    remedies,
    ..Rule::new(Code::R4)
};

/// True matches whose depth is missing or wrong.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let matches = case.matches()?;
    let right = matches.funnel.lifted;
    let (wrong, missing) = (matches.wrong_depth, matches.no_depth);
    let lost = wrong + matches.lost_for_depth();
    let starved = right < FEW_MATCHES && lost >= FEW_MATCHES.min(matches.all_unique / 2);
    let misled =
        wrong >= FEW_MATCHES && wrong > right && !case.would_accept(matches, &matches.true_ones());
    let is_telling = matches.many_without_depth();
    ((starved || misled) && is_telling && !case.consensus_is_right())
        .then(|| RULE.found(&Depths { right, wrong, missing, true_matches: matches.funnel }))
}

evidence!(Depths { right: usize, wrong: usize, missing: usize, true_matches: Funnel } =>
    "Too few depths are right: of the true matches, {right} have the right depth, {wrong} a wrong \
     one, {missing} none."
);

pub(super) fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let radius = ask.key("fb.depth_radius", "fb2.depth_radius");
    let mut tried = vec![vec![ask.set(radius, 2.0 * ask.matching().depth_radius_px)]];
    tried.push(match ask.family {
        Family::Guided => vec![ask.set("fb2.depth_spread", 3.0 * ask.params.fb2.depth_spread)],
        _ => vec![ask.word("fb.depth", "guarded")],
    });
    tried.extend([vec![ask.ratio(0.06)], vec![ask.more_keypoints(0.2)]]);
    tried
}
