//! Robust estimation: a pose from correspondences of which most may be false.
//!
//! | file | question | answer |
//! |---|---|---|
//! | [`mod@mlesac`] | which pose makes all the residuals likeliest? | random samples, scored by a mixture |
//! | `likelihood` | how likely are the residuals of a pose? | Gaussian + uniform, the mixing by EM |
//! | `local` | which pose do all who agree prefer? | refined on the inliers until likelihood stops rising |
//! | [`params`] | what decides it? | σ, threshold, confidence, trials |
//! | [`consensus`] | what came of it? | trials, consensus, errors |
//! | [`acceptance`] | are the inliers more than chance explains? | an a-contrario test |
//! | [`places`] | which correspondences are independent? | those at different places of the query |

pub mod acceptance;
pub mod consensus;
mod likelihood;
mod local;
pub mod mlesac;
pub mod params;
pub mod places;

pub use acceptance::{
    Acceptance, AcceptanceRule, effective_area_px, inliers_beyond_chance, places_beyond_chance,
};
pub use consensus::{Consensus, Hypothesis, MlesacError, Trial};
pub use likelihood::LikelihoodScore;
pub(crate) use local::residuals;
pub use mlesac::mlesac;
pub use params::MlesacParams;
pub use places::{Counted, Places};
