//! R2: too few keypoints.

use super::*;
use crate::image::GrayImage;
use crate::stats::mean_and_squares;

/// Fewer keypoints leave nothing to match.
const FEW_KEYPOINTS: usize = 20;

pub(super) const RULE: Rule = Rule {
    title: "too few keypoints",
    advice: "lower surf.threshold (fb2: fb2.contrast)",
    advice_of: |family| match family {
        Family::Features => Some("lower surf.threshold"),
        _ => Some("lower fb2.contrast"),
    },
    advice_of_matches: Some("let the matcher keep more keypoints, or use another reference"),
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Detect),
    proof: Proof::Matches,
    remedies,
    ..Rule::new(Code::R2)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    case.matches()?;
    let counts = case.subject.outcome.counts?;
    let (query, reference) = (counts.query_keypoints, counts.reference_keypoints);
    let limit = case.keypoint_limit();
    (query.min(reference) < FEW_KEYPOINTS).then(|| {
        let because = if limit.is_none() && 2 * query < reference { flaw(case) } else { None };
        RULE.found(&Keypoints { query, reference, limit, because })
    })
}

/// What the query photo lacks, compared with the reference's.
fn flaw(case: &Case<'_>) -> Option<&'static str> {
    /// Less than this share of what the reference has is a flaw.
    const LITTLE: f64 = 0.5;
    let problem = case.subject.problem;
    let [query, reference] =
        [&problem.query.photo, &problem.reference.photo].map(|photo| look(&photo.gray));
    if query.contrast < LITTLE * reference.contrast {
        Some("has little contrast")
    } else if query.sharpness < LITTLE * reference.sharpness {
        Some("is blurred")
    } else {
        None
    }
}

/// The standard deviation of grey values, and the mean step between neighbours as a share of it.
struct PhotoLook {
    contrast: f64,
    sharpness: f64,
}

fn look(photo: &GrayImage) -> PhotoLook {
    let values: Vec<f64> = photo.as_raw().iter().copied().map(f64::from).collect();
    let squares = mean_and_squares(&values).map_or(0.0, |(_, squares)| squares);
    let contrast = (squares / values.len().max(1) as f64).sqrt();
    let steps: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    let sharpness = steps / (values.len().max(1) as f64 * contrast.max(1e-9));
    PhotoLook { contrast, sharpness }
}

evidence!(Keypoints {
    query: usize,
    reference: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    because: Option<&'static str>,
} => {
    let limit = limit.as_ref().map(|limit| format!(" The limit is {limit}.")).unwrap_or_default();
    let because = because.map(|flaw| format!(" The query {flaw}.")).unwrap_or_default();
    format!("Too few keypoints: {query} in the query, {reference} in the reference.{limit}{because}")
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    vec![vec![ask.more_keypoints(0.2)], vec![ask.more_keypoints(0.05)]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_takes_sharpness_and_haze_takes_contrast() {
        let stripes = |low: u8, high: u8, wide: u32| {
            GrayImage::from_fn(64, 8, |x, _| {
                image::Luma([if (x / wide).is_multiple_of(2) { low } else { high }])
            })
        };
        let sharp = look(&stripes(0, 200, 2));
        let hazy = look(&stripes(90, 110, 2));
        let blurred = look(&stripes(0, 200, 16));
        assert!((hazy.sharpness / sharp.sharpness - 1.0).abs() < 1e-9);
        assert!(hazy.contrast < 0.2 * sharp.contrast);
        assert!((blurred.contrast / sharp.contrast - 1.0).abs() < 1e-9);
        assert!(blurred.sharpness < 0.2 * sharp.sharpness);
    }
}
