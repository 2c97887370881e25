//! Draws the queries of a run from the frames of a scene.

use std::collections::BTreeSet;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

use super::limit::Limit;
use super::scene_pair::{ScenePair, cameras_of, times_of};
use crate::scene::{Scene, SceneError};

/// How the queries of a scene are chosen.
#[derive(Clone, Copy, Debug)]
pub struct Draw<'a> {
    /// How many frames are drawn; all without a limit.
    pub limit: Option<Limit>,
    /// Only these of the drawn frames, and frames without a pose; all drawn ones if empty.
    pub only: &'a [String],
    /// The seed of the choice.
    pub seed: u64,
}

/// Why there are no queries.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// No frame of the references' scene can be a reference.
    #[error(
        "{0}: no frame has a known pose, so there are no references; `posescope doctor` says what is missing"
    )]
    NoPose(String),
    /// The frame exists but was not drawn.
    #[error(
        "{scene}: frame {frame} is not among the {drawn} drawn queries; raise --limit or change --seed"
    )]
    NotDrawn {
        /// The scene.
        scene: String,
        /// The frame.
        frame: String,
        /// Number of queries.
        drawn: usize,
    },
    /// There is no such frame.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl Draw<'_> {
    /// Pairs a scene of references, at position `scene_index`, with a scene of queries.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn pair(
        &self,
        scene_index: usize,
        references: &dyn Scene,
        queries: &dyn Scene,
    ) -> Result<ScenePair, DrawError> {
        let has_references = (0..references.frames().len()).any(|at| references.pose(at).is_some());
        if !has_references {
            return Err(DrawError::NoPose(references.name().to_owned()));
        }
        let mut drawn = self.frames(queries);
        let mut wanted = BTreeSet::new();
        for name in self.only {
            let frame = queries.find(name)?;
            wanted.insert(frame);
            if queries.pose(frame).is_none() && !drawn.contains(&frame) {
                drawn.push(frame);
            }
            if !drawn.contains(&frame) {
                return Err(DrawError::NotDrawn {
                    scene: queries.name().to_owned(),
                    frame: queries.frames()[frame].clone(),
                    drawn: drawn.len(),
                });
            }
        }
        drawn.sort_unstable();
        let mut chosen = drawn.clone();
        chosen.retain(|frame| wanted.is_empty() || wanted.contains(frame));
        let names = |frames: &[usize]| {
            let frames = frames.iter();
            let names = frames.map(|&frame| queries.frames()[frame].clone());
            names.collect::<Vec<_>>()
        };
        let (camera, cameras) = cameras_of(queries, &chosen);
        // If every frame is a query, all other frames may be its references.
        let excluded = match self.limit {
            Some(Limit::Percent(percent)) if percent < 100.0 => &drawn[..],
            _ => &[],
        };
        Ok(ScenePair {
            scene_index,
            query_index: None,
            scene: references.name().to_owned(),
            query_scene: queries.name().to_owned(),
            camera,
            cameras,
            drawn: names(excluded),
            queries: names(&chosen),
            times_s: times_of(queries, &chosen),
            references: Vec::new(),
        })
    }

    /// The drawn frames in the order of the scene: of those with a known pose, or of all where none has one. The seed and
    /// the scene's name determine them.
    fn frames(&self, scene: &dyn Scene) -> Vec<usize> {
        let all = 0..scene.frames().len();
        let mut frames: Vec<usize> =
            all.clone().filter(|&frame| scene.pose(frame).is_some()).collect();
        if frames.is_empty() {
            frames = all.collect();
        }
        let count = match self.limit {
            None => frames.len(),
            Some(Limit::Count(count)) => count,
            Some(Limit::Percent(percent)) => {
                ((percent / 100.0 * frames.len() as f64).round() as usize).max(1)
            }
        };
        if count < frames.len() {
            let text = format!("{}/{}/queries", self.seed, scene.name());
            let seed = xxhash_rust::xxh3::xxh3_64(text.as_bytes());
            frames.shuffle(&mut Pcg64::seed_from_u64(seed));
            frames.truncate(count);
            frames.sort_unstable();
        }
        frames
    }
}
