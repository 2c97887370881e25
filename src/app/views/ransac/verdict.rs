//! In words: the sample at the cursor, the refined pose, the test of it.

use egui::{Grid, RichText, Ui};

use super::trials::Trials;
use crate::app::ViewContext;
use crate::app::views::features;
use crate::depth::LiftedMatch;
use crate::event::{ConsensusJudged, DepthsLifted, PoseRefined};
use crate::feature_progress::{FeatureProgress, residual_px};
use crate::features::Keypoint;
use crate::localize::Status;
use crate::robust::{AcceptanceRule, Counted, Hypothesis, Trial};
use crate::session::Span;

/// Draws what is known at the cursor of a part.
pub(super) fn ui(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    span: &Span,
    cursor: usize,
    trials: &Trials,
) {
    ui.separator();
    if let Some(trial) = trials.at_cursor() {
        sample(ui, context, span, cursor, trial);
    }
    if let Some(refined) = context.run.latest_in::<PoseRefined>(span, cursor) {
        ui.separator();
        refinement(ui, refined, trials.best.as_ref());
    }
    if let Some(judged) = context.run.latest_in::<ConsensusJudged>(span, cursor) {
        acceptance(ui, context, judged);
    } else if let Some(result) = &span.result
        && cursor + 1 >= span.records.end
        && result.status == Status::Failed
        && let Some(reason) = &result.reason
    {
        ui.label(format!("{} {}", reason.code, reason.text));
    }
}

fn sample(ui: &mut Ui, context: &ViewContext<'_>, span: &Span, cursor: usize, trial: &Trial) {
    let score = |hypothesis: &Option<Hypothesis>| match hypothesis {
        Some(Hypothesis { score, .. }) => format!(
            "log likelihood {:.1}, {} inliers, share of true matches {:.2}",
            score.log_likelihood, score.inliers, score.mixing
        ),
        None => "no pose".to_owned(),
    };
    let is_best = if trial.is_best { ", a new best" } else { "" };
    ui.label(RichText::new(format!("Trial {}{is_best}", trial.index)).strong());
    Grid::new("trial").show(ui, |ui| {
        ui.weak("its hypothesis");
        ui.label(score(&trial.hypothesis));
        ui.end_row();
        ui.weak("the best so far");
        ui.label(score(&trial.best));
        ui.end_row();
    });
    let Some(lifted) = context.run.latest_in::<DepthsLifted>(span, cursor) else {
        return;
    };
    let correspondences: Vec<&LiftedMatch> =
        lifted.matches.iter().filter(|lifted| lifted.point.is_some()).collect();
    let features = features::of(context, span, cursor);
    Grid::new("sample").striped(true).show(ui, |ui| {
        let columns =
            ["sample", "query [px]", "reference [px]", "depth [m]", "here [px]", "best [px]"];
        for column in columns {
            ui.label(RichText::new(context.in_unit(column)).weak().small());
        }
        ui.end_row();
        for &index in &trial.sample {
            let Some(lifted) = correspondences.get(index) else {
                continue;
            };
            let help = "Select this feature";
            if ui.link(format!("match {index}")).on_hover_text(help).clicked() {
                let feature = Some(lifted.query);
                context.send(move |app| app.state.options.selected_feature = feature);
            }
            row(ui, context, &features, lifted, trial);
            ui.end_row();
        }
    });
    ui.weak("here, best: reprojection errors of this hypothesis and of the best so far");
}

fn row(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    features: &FeatureProgress<'_>,
    lifted: &LiftedMatch,
    trial: &Trial,
) {
    let seen = features.query.get(lifted.query);
    for keypoint in [seen, features.reference.get(lifted.reference)] {
        let words = |at: &Keypoint| format!("({:.0}, {:.0})", at.x, at.y);
        ui.label(keypoint.map_or("–".to_owned(), words));
    }
    let (Some(point), Some(problem)) = (lifted.point, context.problem()) else { return };
    ui.label(format!("{:.1}", point.z));
    let inlier_px = features::mlesac(context).inlier_threshold_px;
    for hypothesis in [&trial.hypothesis, &trial.best] {
        let error = hypothesis.as_ref().zip(seen).and_then(|(hypothesis, seen)| {
            residual_px(problem.query().intrinsics(), &hypothesis.pose, &point, seen)
        });
        ui.label(match error {
            Some(error) if error <= inlier_px => format!("{error:.1} inlier"),
            Some(error) => format!("{error:.1} outlier"),
            None => "–".to_owned(),
        });
    }
}

fn refinement(ui: &mut Ui, refined: &PoseRefined, best: Option<&Trial>) {
    ui.label(RichText::new("Refined").strong());
    let sampled = best
        .and_then(|trial| Some((trial.index, trial.hypothesis?.score.inliers)))
        .map_or(String::new(), |(index, inliers)| {
            format!("; the sample of trial {index} alone had {inliers}")
        });
    ui.label(format!(
        "{} of {} correspondences are inliers after {} trials{sampled}",
        refined.inliers, refined.correspondences, refined.trials
    ));
}

fn acceptance(ui: &mut Ui, context: &ViewContext<'_>, judged: &ConsensusJudged) {
    let verdict = if judged.accepted { "Accepted" } else { "Refused" };
    ui.label(RichText::new(verdict).strong());
    let ConsensusJudged { acceptance, counted, distance_m, .. } = judged;
    let params = &context.run.params.fb;
    let compared = |is_met| if is_met { "≥" } else { "<" };
    let inliers = acceptance.inliers;
    let agreeing = match counted {
        Counted::Correspondences => "inliers",
        Counted::Places => "places of inliers",
    };
    let is_met = params.accept.accepts(acceptance);
    ui.label(match (params.accept, acceptance.needed) {
        (AcceptanceRule::Consensus, Some(needed)) => format!(
            "{inliers} {agreeing} {} {needed} needed to be more than chance (false alarms expected: \
             10^{:.1})",
            compared(is_met),
            acceptance.log10_nfa
        ),
        (AcceptanceRule::Consensus, None) => {
            format!("{inliers} {agreeing}; so few matches could always be chance")
        }
        (AcceptanceRule::Paper, _) => {
            format!("{inliers} {agreeing} {} 4, the paper's rule", compared(is_met))
        }
    });
    let Some(problem) = context.problem() else { return };
    let radius_m = problem.uncertainty_radius_m();
    let limit_m = radius_m * (1.0 + params.radius_slack);
    let note = match params.accept {
        AcceptanceRule::Consensus => "",
        AcceptanceRule::Paper => " (the paper's rule ignores it)",
    };
    let words = format!(
        "{distance_m:.2} m from the reference {} {limit_m:.2} m, the radius of {radius_m:.1} m and {:.0} %{note}",
        if *distance_m > limit_m { ">" } else { "≤" },
        100.0 * params.radius_slack
    );
    ui.label(context.in_unit(&words));
}
