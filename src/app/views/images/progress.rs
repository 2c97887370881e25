//! What FB has told up to the cursor about each query feature.

use std::collections::HashMap;
use std::sync::Arc;

use crate::app::ViewContext;
use crate::depth::LiftedMatch;
use crate::estimator::{self, Parts};
use crate::event::{Event, Side};
use crate::features::FeatureState;
use crate::features::{Features, Keypoint, Match, MatchVerdict};
use crate::method::Method;
use crate::session::{Part, Run, Span};

/// Position of "undecided" behind those of [`FeatureState::NAMES`].
pub(super) const UNDECIDED: usize = FeatureState::NAMES.len();
/// The states and "undecided".
pub(super) const KINDS: usize = UNDECIDED + 1;

/// The name of a state, or of none yet.
pub(super) fn name(kind: usize) -> &'static str {
    FeatureState::NAMES
        .get(kind)
        .copied()
        .unwrap_or("undecided")
}

/// The features of both photos, and how far each has come.
#[derive(Clone, Copy, Default)]
pub(super) struct FeatureProgress<'a> {
    /// The estimator whose features these are: FB, or the hybrid around it.
    pub(super) method: Option<Method>,
    query: Option<&'a Arc<Features>>,
    reference: Option<&'a Arc<Features>>,
    decisions: Option<&'a [Option<Match>]>,
    lifted: Option<&'a [LiftedMatch]>,
    states: Option<&'a [FeatureState]>,
}

impl<'a> FeatureProgress<'a> {
    /// The progress at the cursor; for the direct methods that of FB, or of the hybrid where FB was
    /// not asked to run.
    pub(super) fn at(context: &ViewContext<'a>) -> Self {
        let with_features = |method: Method| {
            let Some(entry) = estimator::find(method) else {
                return false;
            };
            let inside = entry
                .hybrid()
                .is_some_and(|parts| parts.first == Method::FB);
            inside || matches!(entry.parts, Parts::Features)
        };
        let part = match context.method().filter(|&here| with_features(here)) {
            Some(here) => context.part_of(here),
            None => {
                let mut asked = context.setup.task.protocol.methods.iter().copied();
                asked.find_map(|method| with_features(method).then(|| context.part_of(method))?)
            }
        };
        part.map_or_else(Self::default, |(span, cursor)| {
            Self::until(context.run, span, cursor)
        })
    }

    /// The progress at the end of the same estimator and reference in another run.
    pub(super) fn counterpart(
        context: &ViewContext<'_>,
        method: Method,
        other: &'a Run,
    ) -> Option<Self> {
        let span = other.span_of(Part::Reference(method, context.reference()))?;
        Some(Self::until(other, span, span.records.end.checked_sub(1)?))
    }

    fn until(run: &'a Run, span: &Span, cursor: usize) -> Self {
        let mut progress = Self {
            method: span.part.method(),
            ..Self::default()
        };
        let end = span.records.end.min(cursor.saturating_add(1));
        for record in &run.records()[span.records.start.min(end)..end] {
            match &record.event {
                Event::FeaturesDetected(detected) => match detected.side {
                    Side::Query => progress.query = Some(&detected.features),
                    Side::Reference => progress.reference = Some(&detected.features),
                },
                Event::MatchesDecided(decided) => progress.decisions = Some(&decided.decisions),
                Event::DepthsLifted(lifted) => progress.lifted = Some(&lifted.matches),
                Event::MatchesGuided(guided) => progress.lifted = Some(&guided.matches),
                Event::FeaturesClassified(classified) => progress.states = Some(&classified.states),
                _ => {}
            }
        }
        progress
    }

    /// Query keypoints; none before they are detected.
    pub(super) fn query(&self) -> &'a [Keypoint] {
        self.query.map_or(&[], |features| &features.keypoints)
    }

    /// Reference keypoints; none before they are detected.
    pub(super) fn reference(&self) -> &'a [Keypoint] {
        self.reference.map_or(&[], |features| &features.keypoints)
    }

    /// The nearest reference feature of a query feature, once it is known.
    pub(super) fn matched(&self, feature: usize) -> Option<&'a Match> {
        self.decisions?.get(feature)?.as_ref()
    }

    /// What the depth lift said about a query feature.
    pub(super) fn lifted(&self, feature: usize) -> Option<&'a LiftedMatch> {
        let lifted = self.lifted?;
        let at = lifted.binary_search_by_key(&feature, |lifted| lifted.query);
        lifted.get(at.ok()?)
    }

    /// Where a query feature has ended as far as it is known; `None` while it may still become an
    /// inlier. What a test has thrown out is told at once, not only when all is over.
    pub(super) fn state(&self, feature: usize) -> Option<FeatureState> {
        if let Some(states) = self.states {
            return states.get(feature).copied();
        }
        let Some(found) = self.decisions?.get(feature)? else {
            return Some(FeatureState::RatioFailed {
                ratio: f32::INFINITY,
            });
        };
        match found.verdict {
            MatchVerdict::Ambiguous => Some(FeatureState::RatioFailed { ratio: found.ratio }),
            MatchVerdict::NotUnique { rival } => Some(FeatureState::NotUnique { rival }),
            MatchVerdict::Candidate => {
                let lifted = self.lifted(feature)?;
                lifted.point.is_none().then_some(FeatureState::NoDepth {
                    distance_px: lifted.lidar_distance_px,
                })
            }
        }
    }

    /// A query feature's state with the number that decided it.
    pub(super) fn words(&self, feature: usize) -> String {
        let Some(state) = self.state(feature) else {
            return name(UNDECIDED).to_owned();
        };
        let decided_by = match state {
            FeatureState::RatioFailed { ratio } if ratio.is_infinite() => {
                "nothing to match".to_owned()
            }
            FeatureState::RatioFailed { ratio } => format!("ratio {ratio:.4}"),
            FeatureState::NotUnique { rival } => format!("nearer to query feature {rival}"),
            FeatureState::NoDepth { distance_px } => format!("LiDAR {distance_px:.2} px away"),
            FeatureState::Outlier { residual_px } if residual_px.is_infinite() => {
                "no pose to explain it".to_owned()
            }
            FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px } => {
                format!("residual {residual_px:.2} px")
            }
        };
        format!("{}: {decided_by}", state.name())
    }

    /// Whether nothing was matched yet.
    pub(super) fn is_unmatched(&self) -> bool {
        self.decisions.is_none()
    }

    /// The position of each query feature's state in [`FeatureState::NAMES`], or [`UNDECIDED`].
    pub(super) fn kinds(&self) -> Vec<usize> {
        (0..self.query().len())
            .map(|feature| self.state(feature).map_or(UNDECIDED, |state| state.index()))
            .collect()
    }

    /// Which query features have ended in another state than in another run, or do not occur in it.
    /// Features are told apart by their keypoints, because other settings may find others.
    pub(super) fn differing(&self, other: &FeatureProgress<'_>) -> Vec<bool> {
        let (mine, theirs) = (self.query(), other.query());
        let same_keypoints = mine == theirs;
        let places: HashMap<[u32; 3], usize> = if same_keypoints {
            HashMap::new()
        } else {
            theirs.iter().map(place).zip(0..).collect()
        };
        (0..mine.len())
            .map(|feature| {
                let Some(state) = self.state(feature) else {
                    return false;
                };
                let twin = if same_keypoints {
                    Some(feature)
                } else {
                    places.get(&place(&mine[feature])).copied()
                };
                let there = twin.and_then(|twin| other.state(twin));
                there.is_none_or(|there| there.index() != state.index())
            })
            .collect()
    }
}

fn place(keypoint: &Keypoint) -> [u32; 3] {
    [keypoint.x, keypoint.y, keypoint.scale].map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn features(columns: &[f32]) -> Arc<Features> {
        let keypoints = columns.iter().map(|&x| Keypoint {
            x,
            y: 1.0,
            scale: 2.0,
            angle: 0.0,
            response: 1.0,
            laplacian_positive: true,
        });
        Arc::new(Features {
            keypoints: keypoints.collect(),
            descriptors: Vec::new(),
        })
    }

    fn decision(query: usize, verdict: MatchVerdict) -> Option<Match> {
        Some(Match {
            query,
            reference: 0,
            distance: 0.3,
            ratio: 0.8,
            verdict,
        })
    }

    #[test]
    fn a_feature_is_decided_as_soon_as_a_test_throws_it_out() {
        let query = features(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let decisions = [
            decision(0, MatchVerdict::Ambiguous),
            decision(1, MatchVerdict::NotUnique { rival: 0 }),
            decision(2, MatchVerdict::Candidate),
            decision(3, MatchVerdict::Candidate),
            None,
        ];
        let mut progress = FeatureProgress {
            query: Some(&query),
            ..FeatureProgress::default()
        };
        assert_eq!(progress.kinds(), [UNDECIDED; 5]);
        progress.decisions = Some(&decisions);
        assert_eq!(progress.kinds(), [0, 1, UNDECIDED, UNDECIDED, 0]);
        let lifted = [2, 3].map(|feature| LiftedMatch {
            query: feature,
            reference: 0,
            lidar_distance_px: 1.5,
            depth_range_m: None,
            point: (feature == 3).then(|| Point3::new(0.0, 0.0, 9.0)),
        });
        progress.lifted = Some(&lifted);
        assert_eq!(progress.kinds(), [0, 1, 2, UNDECIDED, 0]);
    }

    #[test]
    fn differences_are_found_by_keypoint_where_the_settings_found_others() {
        let (mine, theirs) = (features(&[1.0, 2.0, 3.0]), features(&[2.0, 1.0]));
        let inlier = FeatureState::Inlier { residual_px: 0.5 };
        let outlier = FeatureState::Outlier { residual_px: 9.0 };
        let here = FeatureProgress {
            query: Some(&mine),
            states: Some(&[inlier, outlier, inlier]),
            ..FeatureProgress::default()
        };
        let there = FeatureProgress {
            query: Some(&theirs),
            states: Some(&[inlier, inlier]),
            ..FeatureProgress::default()
        };
        assert_eq!(here.differing(&there), [false, true, true]);
        assert_eq!(here.differing(&here), [false; 3]);
    }
}
