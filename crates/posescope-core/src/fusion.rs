//! Fusion: one pose from several references, each of which gave a candidate (paper, section 3.2).
//!
//! First, the query is localised against each reference alone. A fusion of the paper then weighs the references
//! by one number each: the feature matches with the query that pass the ratio test and are mutually best, before
//! any depth is looked up. The weights of the direct methods are the same. *joint* averages nothing: the estimator
//! takes all references at once.
//!
//! A new fusion is an entry in [`ALL`].

mod average;
pub(crate) mod share;

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

pub use average::average_pose;
pub use share::{Share, ShareOutcome, Support};

use crate::estimator::Failure;
use crate::event::{ReferencesFused, Stage};
use crate::geometry::Pose;
use crate::text::UnknownWord;
use crate::trace::{Cancelled, Trace};

/// A way to one pose from several references. Two are equal that have the same name.
#[derive(Clone, Copy, Debug)]
#[doc(hidden)]
pub struct Fusion {
    /// The name on the command line, in results and in tables.
    pub name: &'static str,
    /// What the fusion does, in one phrase.
    pub about: &'static str,
    /// How it comes to one pose.
    pub way: Way,
}

/// The weight of each reference, given the number of its matches: not negative, 0 leaves it out, any
/// common factor does not matter. At least one is positive where there is a reference.
#[doc(hidden)]
pub type Weigh = fn(&[usize]) -> Vec<f64>;

/// How several references become one pose.
#[derive(Clone, Copy, Debug)]
#[doc(hidden)]
pub enum Way {
    /// The poses that they gave each for itself are averaged, by weights.
    Weighed(Weigh),
    /// The method takes them all at once.
    Joint,
}

/// Every fusion, those of the paper in its order first.
#[doc(hidden)]
pub const ALL: &[Fusion] = &[
    Fusion {
        name: "maxf",
        about: "the reference with the most matches alone",
        way: Way::Weighed(most_matches),
    },
    Fusion {
        name: "avg",
        about: "the average over all references",
        way: Way::Weighed(|matches| vec![1.0; matches.len()]),
    },
    Fusion {
        name: "wavg",
        about: "the average over all references, weighted by their matches",
        way: Way::Weighed(by_matches),
    },
    Fusion {
        name: "r-wavg",
        about: "as wavg, over references with at least half of the most matches",
        way: Way::Weighed(by_many_matches),
    },
    Fusion {
        name: JOINT,
        about: "no poses: the matches of all references in one consensus, the costs of all added up",
        way: Way::Joint,
    },
];

pub(crate) const JOINT: &str = "joint";

/// All weight for the most matches; the first of equals wins.
fn most_matches(matches: &[usize]) -> Vec<f64> {
    let most = matches.iter().max();
    let winner = matches.iter().position(|count| Some(count) == most);
    (0..matches.len()).map(|index| if Some(index) == winner { 1.0 } else { 0.0 }).collect()
}

/// Where no reference has a match, none is better than another.
fn by_matches(matches: &[usize]) -> Vec<f64> {
    if matches.iter().all(|count| *count == 0) {
        return vec![1.0; matches.len()];
    }
    matches.iter().map(|&count| count as f64).collect()
}

/// With K the most matches of any reference, those with at least K/2 stay.
fn by_many_matches(matches: &[usize]) -> Vec<f64> {
    let most = matches.iter().max().copied().unwrap_or_default();
    let weighed = by_matches(matches).into_iter().zip(matches);
    weighed.map(|(weight, &count)| if 2 * count >= most { weight } else { 0.0 }).collect()
}

impl Fusion {
    /// Every fusion, in the order of [`ALL`].
    pub fn all() -> impl Iterator<Item = Self> {
        ALL.iter().copied()
    }
}

impl PartialEq for Fusion {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Fusion {}

impl fmt::Display for Fusion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

impl FromStr for Fusion {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let found = Self::all().find(|fusion| fusion.name == name);
        found.ok_or_else(|| UnknownWord::among(name, "fusion", ALL.iter().map(|one| one.name)))
    }
}

crate::serde_as_text!(Fusion);

/// What one reference alone gave.
#[derive(Clone, Debug)]
#[doc(hidden)]
pub struct Candidate<'a> {
    /// The reference frame's name.
    pub reference: &'a str,
    /// Feature matches between the query and the reference: ratio test and uniqueness passed.
    pub matches: usize,
    /// `world_from_camera` of the query, or why this reference gave none.
    pub pose: Result<&'a Pose, &'a Failure>,
    /// Whether the pose is that of a hybrid's second method, because the first had none.
    pub fell_back: bool,
}

/// Fuses what the references gave each for itself.
///
/// Candidates without a pose are left out and the weights of the others grow in proportion. Where all those
/// with a weight failed, so does the fusion: a reference that was left out for its few matches does not come
/// back.
///
/// HY falls back for the query, not for each reference: if any weighted reference has an FB pose, MI poses are
/// ignored. With `hy.per_reference`, no candidate is called a fallback, and all poses are averaged.
///
/// Returns the share of each candidate too, in their order.
///
/// # Errors
/// Only [`Cancelled`].
#[doc(hidden)]
pub fn fuse(
    name: &'static str,
    weigh: Weigh,
    candidates: &[Candidate<'_>],
    trace: &mut Trace<'_>,
) -> Result<(Result<Pose, Failure>, Vec<Share>), Cancelled> {
    trace.stage(Stage::Fuse, |trace| {
        let shares = shares(weigh, candidates);
        let members: Vec<(f64, &Pose)> = shares
            .iter()
            .filter(|share| share.outcome == ShareOutcome::Kept)
            .filter_map(|share| Some((share.weight, share.pose.as_ref()?)))
            .collect();
        let pose = average_pose(&members);
        trace.emit(|| ReferencesFused {
            fusion: name,
            shares: Arc::from(shares.as_slice()),
            pose,
        })?;
        let pose = pose.ok_or_else(|| no_pose(&shares, candidates));
        Ok((pose, shares))
    })
}

fn shares(weigh: Weigh, candidates: &[Candidate<'_>]) -> Vec<Share> {
    let matches: Vec<usize> = candidates.iter().map(|c| c.matches).collect();
    let weights = weigh(&matches);
    let weighed = candidates.iter().zip(&weights);
    let first_method_succeeded = weighed
        .filter(|(_, weight)| **weight > 0.0)
        .any(|(candidate, _)| candidate.pose.is_ok() && !candidate.fell_back);
    let outcome = |candidate: &Candidate<'_>, weight: f64| match candidate.pose {
        _ if weight <= 0.0 => ShareOutcome::Dropped,
        Err(_) => ShareOutcome::Failed,
        Ok(_) if candidate.fell_back && first_method_succeeded => ShareOutcome::FallbackUnneeded,
        Ok(_) => ShareOutcome::Kept,
    };
    let weighed = candidates.iter().zip(weights);
    let outcomes: Vec<(&Candidate<'_>, f64, ShareOutcome)> = weighed
        .map(|(candidate, weight)| (candidate, weight, outcome(candidate, weight)))
        .collect();
    let is_kept = |outcome: ShareOutcome| outcome == ShareOutcome::Kept;
    let kept: f64 = outcomes.iter().filter(|one| is_kept(one.2)).map(|one| one.1).sum();
    let share = |(candidate, weight, outcome): (&Candidate<'_>, f64, ShareOutcome)| Share {
        reference: candidate.reference.to_owned(),
        matches: candidate.matches,
        weight: if is_kept(outcome) { weight / kept } else { 0.0 },
        outcome,
        pose: candidate.pose.ok().copied(),
        support: None,
    };
    outcomes.into_iter().map(share).collect()
}

/// The reason names the reference that should have been the best.
fn no_pose(shares: &[Share], candidates: &[Candidate<'_>]) -> Failure {
    let weighed: Vec<(&Candidate<'_>, &Failure)> = shares
        .iter()
        .zip(candidates)
        .filter(|(share, _)| share.outcome == ShareOutcome::Failed)
        .filter_map(|(_, candidate)| Some((candidate, candidate.pose.err()?)))
        .collect();
    // The last of equals would win; the first one is wanted.
    match weighed.iter().rev().max_by_key(|(candidate, _)| candidate.matches) {
        Some((best, failure)) => Failure::NoReferenceSucceeded {
            weighed: weighed.len(),
            references: shares.len(),
            best: best.reference.to_owned(),
            failure: Box::new((*failure).clone()),
        },
        None => Failure::NoReference { radius_m: None },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Code;
    use crate::history::History;
    use proptest::prelude::*;

    /// The four of the paper, which average poses.
    fn of_the_paper() -> impl Iterator<Item = Fusion> {
        Fusion::all().filter(|fusion| matches!(fusion.way, Way::Weighed(_)))
    }

    fn at(x: f64) -> Pose {
        Pose::translation(x, 0.0, 0.0)
    }

    fn failure() -> Failure {
        Failure::TooFewMatches { unique: 2, keypoints: 90 }
    }

    fn fused(
        name: &str,
        candidates: &[(usize, Result<Pose, Failure>)],
    ) -> (Result<Pose, Failure>, ReferencesFused) {
        let names: Vec<String> = (0..candidates.len()).map(|i| format!("r{i}")).collect();
        let candidates: Vec<_> = candidates
            .iter()
            .zip(&names)
            .map(|((matches, pose), name)| Candidate {
                reference: name,
                matches: *matches,
                pose: pose.as_ref(),
                fell_back: false,
            })
            .collect();
        let mut history = History::default();
        let entry: Fusion = name.parse().expect("a fusion");
        let trace = &mut Trace::to(&mut history);
        let (pose, _) = fuse(entry.name, weigh(&entry), &candidates, trace).expect("not cancelled");
        let told = history
            .records()
            .iter()
            .find_map(|record| {
                <ReferencesFused as crate::event::DebugEvent>::from_event(&record.event)
            })
            .expect("it is told")
            .clone();
        (pose, told)
    }

    fn weigh(entry: &Fusion) -> Weigh {
        match entry.way {
            Way::Weighed(weigh) => weigh,
            Way::Joint => panic!("{} weighs no poses", entry.name),
        }
    }

    fn x(name: &str, candidates: &[(usize, Result<Pose, Failure>)]) -> f64 {
        fused(name, candidates).0.expect("a pose").translation.x
    }

    #[test]
    fn every_fusion_is_read_as_it_is_written() {
        for fusion in Fusion::all() {
            assert_eq!(fusion.to_string().parse(), Ok(fusion));
            let json = serde_json::to_string(&fusion).expect("a string");
            assert_eq!(json, format!("\"{}\"", fusion.name));
            assert_eq!(serde_json::from_str::<Fusion>(&json).ok(), Some(fusion));
        }
        let error = "mean".parse::<Fusion>().expect_err("unknown").to_string();
        assert_eq!(error, "`mean` is no fusion; maxf, avg, wavg, r-wavg or joint expected");
    }

    #[test]
    fn each_fusion_weighs_three_references_as_the_paper_says() {
        // Half of the most matches is 50: the last one is dropped by r-wavg.
        let candidates = [(100, Ok(at(0.0))), (50, Ok(at(3.0))), (49, Ok(at(30.0)))];
        assert_eq!(x("maxf", &candidates), 0.0);
        assert!((x("avg", &candidates) - 11.0).abs() < 1e-12);
        let weighted = (50.0 * 3.0 + 49.0 * 30.0) / 199.0;
        assert!((x("wavg", &candidates) - weighted).abs() < 1e-12);
        assert!((x("r-wavg", &candidates) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_failed_candidate_is_left_out_and_the_others_share_its_weight() {
        let candidates = [(60, Err(failure())), (30, Ok(at(1.0))), (90, Ok(at(5.0)))];
        assert!((x("wavg", &candidates) - 4.0).abs() < 1e-12);
        let (_, told) = fused("wavg", &candidates);
        let outcomes: Vec<_> = told.shares.iter().map(|s| (s.outcome, s.weight)).collect();
        let expected =
            [(ShareOutcome::Failed, 0.0), (ShareOutcome::Kept, 0.25), (ShareOutcome::Kept, 0.75)];
        assert_eq!(outcomes, expected);
        assert_eq!(told.shares[2].pose, Some(at(5.0)));
    }

    #[test]
    fn a_fallback_counts_only_where_no_weighed_reference_can_do_without() {
        let (good, coarse) = (at(1.0), at(9.0));
        let share_outcomes = |candidates: &[(usize, &Pose, bool)]| -> Vec<ShareOutcome> {
            let candidates: Vec<_> = candidates
                .iter()
                .map(|&(matches, pose, fell_back)| Candidate {
                    reference: "r",
                    matches,
                    pose: Ok(pose),
                    fell_back,
                })
                .collect();
            let fusion: Fusion = "r-wavg".parse().expect("a fusion");
            let shares = shares(weigh(&fusion), &candidates);
            let total: f64 = shares.iter().map(|share| share.weight).sum();
            assert!((total - 1.0).abs() < 1e-12);
            shares.iter().map(|share| share.outcome).collect()
        };
        use ShareOutcome::{Dropped, FallbackUnneeded, Kept};
        assert_eq!(
            share_outcomes(&[(90, &coarse, true), (80, &good, false)]),
            [FallbackUnneeded, Kept]
        );
        assert_eq!(share_outcomes(&[(90, &coarse, true), (80, &coarse, true)]), [Kept, Kept]);
        // What has no weight does not make the others' fallback unneeded.
        assert_eq!(share_outcomes(&[(90, &coarse, true), (10, &good, false)]), [Kept, Dropped]);
    }

    #[test]
    fn what_was_dropped_does_not_come_back_when_the_others_fail() {
        let candidates = [(60, Err(failure())), (5, Ok(at(1.0))), (60, Err(failure()))];
        for name in ["maxf", "r-wavg"] {
            let reason = fused(name, &candidates).0.expect_err("no pose");
            assert_eq!(Code::of(&reason), Code::R3);
            let text = reason.to_string();
            assert!(text.contains("r0") && text.contains("2 of 90"), "{text}");
        }
        assert!(fused("wavg", &candidates).0.is_ok());
        let (_, told) = fused("r-wavg", &candidates);
        assert_eq!(told.shares[1].outcome, ShareOutcome::Dropped);
    }

    #[test]
    fn without_a_single_match_no_reference_is_better_than_another() {
        let candidates = [(0, Ok(at(0.0))), (0, Ok(at(2.0)))];
        for name in ["avg", "wavg", "r-wavg"] {
            assert!((x(name, &candidates) - 1.0).abs() < 1e-12, "{name}");
        }
        assert_eq!(x("maxf", &candidates), 0.0);
    }

    #[test]
    fn without_a_reference_there_is_no_pose() {
        for entry in of_the_paper() {
            assert_eq!(Code::of(&fused_nothing(&entry)), Code::R1);
        }
    }

    fn fused_nothing(entry: &Fusion) -> Failure {
        fuse(entry.name, weigh(entry), &[], &mut Trace::off())
            .expect("not cancelled")
            .0
            .expect_err("no pose")
    }

    proptest! {
        #[test]
        fn every_fusion_gives_weights_that_can_be_shared_out(
            matches in prop::collection::vec(0usize..3000, 1..8),
        ) {
            for entry in of_the_paper() {
                let weights = weigh(&entry)(&matches);
                prop_assert_eq!(weights.len(), matches.len());
                prop_assert!(weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0));
                prop_assert!(weights.iter().sum::<f64>() > 0.0, "{}", entry.name);
                // More matches never mean less to say.
                for (i, a) in matches.iter().enumerate() {
                    for (j, b) in matches.iter().enumerate() {
                        if a > b {
                            prop_assert!(weights[i] >= weights[j], "{}", entry.name);
                        }
                    }
                }
            }
        }

        #[test]
        fn a_single_reference_is_taken_as_it_is(x in -1e6..1e6f64, angle in -3.0..3.0f64) {
            let pose = Pose::new([x, 2.0, 3.0].into(), [0.0, angle, 0.0].into());
            for entry in of_the_paper() {
                let candidate =
                    Candidate { reference: "r", matches: 7, pose: Ok(&pose), fell_back: false };
                let (fused, _) =
                    fuse(entry.name, weigh(&entry), &[candidate], &mut Trace::off()).expect("not cancelled");
                prop_assert_eq!(fused, Ok(pose));
            }
        }
    }
}
