//! Robust estimation: a pose from correspondences of which most may be false.
//!
//! | file | question | answer |
//! |---|---|---|
//! | [`mlesac()`] | which pose makes all the residuals likeliest? | random samples, scored by a mixture |
//! | `likelihood` | how likely are the residuals of a pose? | Gaussian + uniform, the mixing by EM |
//! | `local` | which pose do all who agree prefer? | refined on the inliers until likelihood stops rising |
//! | [`MlesacParams`] | what decides it? | σ, threshold, confidence, trials |
//! | [`Consensus`] | what came of it? | trials, consensus, errors |
//! | [`inliers_beyond_chance`] | are the inliers more than chance explains? | an a-contrario test |
//! | `places` | which correspondences are independent? | those at different places of the query |

mod acceptance;
mod cells;
mod consensus;
mod likelihood;
mod local;
mod mlesac;
mod params;
mod places;

pub use acceptance::{Acceptance, AcceptanceRule, effective_area_px, inliers_beyond_chance};
pub use consensus::{Consensus, Hypothesis, MlesacError, Trial};
pub use likelihood::LikelihoodScore;
pub use mlesac::mlesac;
pub use params::{MlesacParams, NEEDED, SAMPLE};
pub use places::Counted;

pub(crate) use acceptance::places_beyond_chance;
pub(crate) use local::residuals;
pub(crate) use places::Places;
