//! The parameters of retrieval.

use super::verification::Tolerance;
use crate::describe::{About, Describe, ParamVisitor};
use crate::features::SurfParams;

/// What an index is made of and how it is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RetrievalParams {
    /// Features of a photo at most, the strongest.
    pub features: usize,
    /// Descriptors per word that the vocabulary is learnt from, at most.
    pub sample: usize,
    /// Rounds of k-means at most.
    pub iterations: usize,
    /// Randomised k-d trees.
    pub trees: usize,
    /// Words that a descriptor is compared with.
    pub checks: usize,
    /// Frames that are verified, the first in the order of their scores; 0 verifies none.
    pub verify: usize,
    /// Greatest distance of an inlier of the affine transform \[px\].
    pub inlier_px: f64,
    /// Fewest inliers of a verified frame.
    pub min_inliers: usize,
}

impl Default for RetrievalParams {
    /// Eight trees as in the paper.
    fn default() -> Self {
        Self {
            features: 1000,
            sample: 50,
            iterations: 10,
            trees: 8,
            checks: 128,
            verify: 50,
            inlier_px: 15.0,
            min_inliers: 6,
        }
    }
}

impl RetrievalParams {
    /// The names of those that decide what an index holds; the others only how it is asked.
    pub const BUILDING: [&'static str; 5] = ["features", "sample", "iterations", "trees", "checks"];

    /// What verification allows.
    pub fn tolerance(&self) -> Tolerance {
        Tolerance {
            inlier_px: self.inlier_px,
            min_inliers: self.min_inliers,
        }
    }

    /// The features that are indexed and asked for: the strongest of those that `surf` finds.
    pub fn surf(&self, surf: &SurfParams) -> SurfParams {
        let max_keypoints = match surf.max_keypoints {
            0 => self.features,
            limit => limit.min(self.features),
        };
        SurfParams {
            max_keypoints,
            ..*surf
        }
    }
}

impl Describe for RetrievalParams {
    fn visit(&mut self, visitor: &mut dyn ParamVisitor) {
        let about = |name, unit, help| About { name, unit, help };
        let mut count = |name, help, value: &mut usize, range| {
            visitor.count(about(name, "", help), value, range);
        };
        count(
            "features",
            "features of a photo at most, the strongest",
            &mut self.features,
            1..=100_000,
        );
        count(
            "sample",
            "descriptors per word that the vocabulary is learnt from, at most",
            &mut self.sample,
            1..=10_000,
        );
        count(
            "iterations",
            "rounds of approximate k-means at most",
            &mut self.iterations,
            1..=1000,
        );
        count(
            "trees",
            "randomised k-d trees over the words",
            &mut self.trees,
            1..=64,
        );
        count(
            "checks",
            "words that a descriptor is compared with",
            &mut self.checks,
            1..=1_000_000,
        );
        count(
            "verify",
            "frames whose geometry is verified, those of the best scores; 0 verifies none",
            &mut self.verify,
            0..=100_000,
        );
        count(
            "min_inliers",
            "fewest inliers of a verified frame",
            &mut self.min_inliers,
            2..=1000,
        );
        visitor.number(
            about(
                "inlier_px",
                "px",
                "greatest distance of an inlier of the affine transform",
            ),
            &mut self.inlier_px,
            0.5..=100.0,
        );
    }
}
