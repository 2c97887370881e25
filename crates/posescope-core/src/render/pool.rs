//! What the threads that score hypotheses keep between them.

use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::{PointArrays, Score};
use crate::geometry::Pose;

/// Hypotheses that are scored between two checkpoints, at most: enough to keep eight threads busy.
pub const MAX_AT_A_TIME: usize = 256;

/// Hypotheses that a thread scores between two checkpoints. Of a street photo of 1241 × 376 px one
/// takes some 50 µs, so that stopping takes a few milliseconds.
const PER_THREAD: usize = 64;

/// Hypotheses that a thread takes at once. At the end of a batch the others wait for the last job: with 4 of
/// 32 hypotheses for up to an eighth of the time, with 2 of 64 for a thirty-second.
const PER_JOB: usize = 2;

/// How many hypotheses to score at a time: few enough that a run can be stopped soon, enough for all threads of
/// the current pool. At most [`MAX_AT_A_TIME`].
pub(crate) fn at_a_time() -> usize {
    (PER_THREAD * rayon::current_num_threads()).min(MAX_AT_A_TIME)
}

/// Points with what each shows.
pub(crate) struct ShownPoints<T> {
    pub positions: PointArrays,
    pub values: Vec<T>,
}

impl<T> ShownPoints<T> {
    /// What a memo counts them as.
    pub fn heap_bytes(&self) -> usize {
        self.values.len() * (size_of::<T>() + 3 * size_of::<f32>())
    }
}

/// The buffers of the workers that no thread uses at present. A clone has none yet.
pub(crate) struct Pool<W>(Mutex<Vec<W>>);

impl<W> Default for Pool<W> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<W: Send> Pool<W> {
    /// The scores of many cameras, in their order, on all threads.
    pub fn score(
        &self,
        poses: &[Pose],
        new_worker: impl Fn() -> W + Sync,
        score: impl Fn(&mut W, &Pose) -> Score + Sync,
    ) -> Vec<Score> {
        let jobs = poses.par_chunks(PER_JOB);
        jobs.flat_map_iter(|poses| {
            self.with(&new_worker, |worker| -> Vec<Score> {
                poses.iter().map(|pose| score(worker, pose)).collect()
            })
        })
        .collect()
    }

    /// What a worker makes: one that no thread uses, or else a new one.
    pub fn with<T>(&self, new_worker: impl FnOnce() -> W, make: impl FnOnce(&mut W) -> T) -> T {
        let idle = self.idle().pop();
        let mut worker = idle.unwrap_or_else(new_worker);
        let made = make(&mut worker);
        self.idle().push(worker);
        made
    }

    fn idle(&self) -> MutexGuard<'_, Vec<W>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
