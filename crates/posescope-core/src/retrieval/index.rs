//! Asking an index.

use std::iter::repeat;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::build::{BuildRequest, fingerprint_text};
use super::error::IndexError;
use super::layout::{Description, MappedIndex};
use super::params::RetrievalParams;
use super::tf_idf::query_weights;
use super::verification::{Verification, WordMatch, verify};
use super::vocabulary::Vocabulary;
use crate::features::Features;

/// Pairs of one word at most: a word that a wall of equal bricks has many times in both images says
/// nothing about where each of them is.
const PAIRS_PER_WORD: usize = 16;

/// What verification made of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// It was not asked: the score was not among the best, or scores are all that counts.
    Unchecked,
    /// Too few of the shared words lie alike.
    Refused,
    /// Many of the shared words lie alike.
    Verified(Verification),
}

/// A frame and how much it resembles the query.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranked {
    /// Its position in the scene.
    pub frame: usize,
    /// How much; from an index the cosine of the tf-idf weights, in 0 … 1.
    pub score: f32,
    /// Whether the resemblance has a geometry.
    pub geometry: Geometry,
}

impl Ranked {
    /// What verification found, if it found anything.
    pub fn verification(&self) -> Option<&Verification> {
        match &self.geometry {
            Geometry::Verified(found) => Some(found),
            Geometry::Unchecked | Geometry::Refused => None,
        }
    }

    /// Inliers of the verification; 0 without one.
    pub fn inliers(&self) -> usize {
        self.verification().map_or(0, |found| found.inliers)
    }
}

/// What the index answers.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Retrieval {
    /// The word of each feature of the query.
    pub words: Vec<Option<u32>>,
    /// The frames that share words with the query and are allowed: first those verified, by their
    /// inliers, then the others by their scores.
    pub ranked: Vec<Ranked>,
}

/// An index, open to queries from any thread.
pub struct Index {
    path: PathBuf,
    stored: MappedIndex,
    vocabulary: Vocabulary,
}

impl Index {
    /// Opens an index after checking every byte of it; its vocabulary comes into memory, the rest is
    /// mapped.
    ///
    /// # Errors
    /// [`IndexError`] when there is none, or it is damaged or of another layout.
    pub fn open(path: &Path, checks: usize) -> Result<Self, IndexError> {
        let stored = MappedIndex::open(path)?;
        let Description { trees, seed, .. } = stored.description;
        Ok(Self {
            path: path.to_owned(),
            vocabulary: Vocabulary::new(stored.words(), trees, checks, seed),
            stored,
        })
    }

    /// What the index was made from and how.
    pub fn description(&self) -> &Description {
        &self.stored.description
    }

    /// The file of the index.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the index is of this scene as it is now, and made as asked as far as `recipe` says.
    ///
    /// # Errors
    /// [`IndexError::Stale`] names what differs.
    pub fn check<'a>(
        &self,
        scene: &str,
        fingerprint: u64,
        recipe: impl IntoIterator<Item = (&'a String, &'a String)>,
    ) -> Result<(), IndexError> {
        let made = self.description();
        let stale = |why| Err(IndexError::Stale { path: self.path.clone(), why });
        if made.scene != scene {
            return stale(format!("it was built for {} instead of {scene}", made.scene));
        }
        if made.fingerprint != fingerprint_text(fingerprint) {
            return stale(format!("the frames of {scene} have changed"));
        }
        for (key, wanted) in recipe {
            let made = made.recipe.get(key).map_or("nothing", String::as_str);
            if made != wanted {
                return stale(format!("it was built with {key} = {made} instead of {wanted}"));
            }
        }
        Ok(())
    }

    /// Whether [`super::build`] would make the same index again.
    ///
    /// # Errors
    /// [`IndexError::Stale`] names what differs.
    pub fn check_request(&self, request: &BuildRequest) -> Result<(), IndexError> {
        self.check(&request.scene, request.fingerprint, &request.recipe)?;
        let made = &self.description().recipe;
        match made.iter().find(|(key, _)| !request.recipe.contains_key(*key)) {
            Some((key, made)) => Err(IndexError::Stale {
                path: self.path.clone(),
                why: format!("it was built with {key} = {made}, which is not set now"),
            }),
            None => Ok(()),
        }
    }

    /// The frames that resemble the query most, of those that are allowed.
    ///
    /// Philbin et al. 2007: the words of the features (section 3.1), the cosine of tf-idf weights
    /// from the inverted index (section 3), and the order of the best by the inliers of an affine
    /// transform (section 4). A frame that shares no word of any weight is not ranked.
    pub fn query(
        &self,
        features: &Features,
        params: &RetrievalParams,
        allowed: impl Fn(usize) -> bool,
    ) -> Retrieval {
        let words = self.vocabulary.quantize(&features.descriptors);
        let mut by_word: Vec<(u32, u32)> =
            words.iter().zip(0..).filter_map(|(word, feature)| Some(((*word)?, feature))).collect();
        by_word.sort_unstable();
        let sorted: Vec<u32> = by_word.iter().map(|(word, _)| *word).collect();
        let mut scored = self.scored(&sorted, allowed);
        scored.sort_unstable_by(|a, b| (b.1.total_cmp(&a.1)).then(a.0.cmp(&b.0)));
        let verified: Vec<Geometry> = scored
            .par_iter()
            .take(params.verify)
            .map(|&(document, _)| {
                let found = verify(&self.pairs(features, &by_word, document), params);
                found.map_or(Geometry::Refused, Geometry::Verified)
            })
            .collect();
        let mut ranked: Vec<Ranked> = scored
            .into_iter()
            .zip(verified.into_iter().chain(repeat(Geometry::Unchecked)))
            .filter_map(|((document, score), geometry)| {
                Some(Ranked { frame: self.stored.frame(document)?, score, geometry })
            })
            .collect();
        // Stable: of as many inliers, or none, the better score stays first.
        ranked.sort_by_key(|ranked| {
            let inliers = ranked.verification().map(|found| found.inliers);
            std::cmp::Reverse(inliers)
        });
        Retrieval { words, ranked }
    }

    /// The allowed documents with a score.
    fn scored(&self, words: &[u32], allowed: impl Fn(usize) -> bool) -> Vec<(usize, f32)> {
        let mut scores = vec![0.0_f32; self.description().counts.documents];
        for (word, weight) in query_weights(words, |word| self.stored.idf(word)) {
            for (document, there) in self.stored.postings(word) {
                if let Some(score) = scores.get_mut(document) {
                    *score += weight * there;
                }
            }
        }
        scores
            .into_iter()
            .enumerate()
            .filter(|(_, score)| *score > 0.0)
            .filter(|(document, _)| self.stored.frame(*document).is_some_and(&allowed))
            .collect()
    }

    /// The features of query and document that share a word, those of one query feature together.
    fn pairs(
        &self,
        features: &Features,
        by_word: &[(u32, u32)],
        document: usize,
    ) -> Vec<WordMatch> {
        let theirs: Vec<_> = self.stored.features(document).collect();
        let mut theirs = theirs.chunk_by(|a, b| a.0 == b.0).peekable();
        let mut pairs = Vec::new();
        for ours in by_word.chunk_by(|a, b| a.0 == b.0) {
            let word = ours[0].0;
            while theirs.next_if(|run| run[0].0 < word).is_some() {}
            let Some(run) = theirs.next_if(|run| run[0].0 == word) else {
                continue;
            };
            if ours.len() * run.len() > PAIRS_PER_WORD {
                continue;
            }
            for &(_, query) in ours {
                pairs.extend(run.iter().map(|&(_, reference_keypoint)| WordMatch {
                    query,
                    query_keypoint: features.keypoints[query as usize],
                    reference_keypoint,
                }));
            }
        }
        pairs
    }
}
