//! Retrieval: which frames of a scene show the place of a query?
//!
//! After Philbin, Chum, Isard, Sivic, Zisserman, *Object retrieval with large vocabularies and fast
//! spatial matching*, CVPR 2007. Section numbers in this module are those of that paper.
//!
//! | file | what | section |
//! |---|---|---|
//! | `forest` | the nearest of many descriptors by randomised k-d trees | 3.1 |
//! | `vocabulary` | visual words by approximate k-means (AKM) over that forest | 3.1 |
//! | `tf_idf` | how much a word weighs, the inverted index | 3 |
//! | `affine`, `verification` | do the shared words lie alike? LO-RANSAC on affine transforms | 4 |
//! | `build` | from the features of the frames to a file | |
//! | `layout` | the file: checked, then mapped | |
//! | `index` | from the features of a query to ranked frames | |
//! | `ranking` | what is reported of ranked frames | |
//!
//! Nothing in here knows scenes or photos; the caller does.

mod affine;
mod build;
mod error;
mod forest;
mod index;
mod layout;
mod params;
mod ranking;
#[cfg(test)]
mod tests;
mod tf_idf;
mod verification;
mod vocabulary;

pub use affine::Affine;
pub use build::{BuildProgress, BuildRequest, BuildStep, BuildSummary, build};
pub use error::{BuildError, IndexError};
pub use index::{Geometry, Index, Ranked, Retrieval};
pub use layout::{Description, RecordCounts};
pub use params::{IndexParams, RetrievalParams};
pub use ranking::{Criterion, RankedReference, ReferenceRanking};
pub use verification::{Verification, VerifiedMatch};
pub use vocabulary::Clustering;
