//! The parameters of retrieval.

use crate::describe::parameters;
use crate::features::SurfParams;

parameters! {
    /// Parameters of building and querying an index.
    ///
    /// Eight trees as in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct RetrievalParams {
        /// Most features per photo; the strongest are used.
        pub features: usize = 1000 => count("features", "", 1..=100_000),
        /// Most descriptors per word to learn the vocabulary from.
        pub sample: usize = 50 => count("sample", "", 1..=10_000),
        /// Most rounds of approximate k-means.
        pub iterations: usize = 10 => count("iterations", "", 1..=1000),
        /// Randomised k-d trees over the words.
        pub trees: usize = 8 => count("trees", "", 1..=64),
        /// Words that a descriptor is compared with.
        pub checks: usize = 128 => count("checks", "", 1..=1_000_000),
        /// Number of best-scored frames to verify geometrically; 0 turns verification off.
        pub verify: usize = 50 => count("verify", "", 0..=100_000),
        /// Fewest inliers of a verified frame.
        pub min_inliers: usize = 6 => count("min_inliers", "", 2..=1000),
        /// Fewest inliers of a frame that becomes a reference; 0 accepts every frame.
        pub accept: usize = 0 => count("accept", "", 0..=1000),
        /// Greatest distance of an inlier of the affine transform.
        pub inlier_px: f64 = 15.0 => number("inlier_px", "px", 0.5..=100.0),
    }
}

parameters! {
    /// Parameters of an index.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct IndexParams {
        /// Number of visual words.
        pub words: usize = 10_000 => count("words", "", 1..=10_000_000),
    }
}

impl RetrievalParams {
    /// The names of those that decide what an index holds; the others only how it is asked.
    pub const BUILDING: [&'static str; 5] = ["features", "sample", "iterations", "trees", "checks"];

    /// The features that are indexed and asked for: the strongest of those that `surf` finds.
    pub fn surf(&self, surf: &SurfParams) -> SurfParams {
        let max_keypoints = match surf.max_keypoints {
            0 => self.features,
            limit => limit.min(self.features),
        };
        SurfParams { max_keypoints, ..*surf }
    }
}
