//! The stages of posescope's estimators on one pair of frames, for the benches and for the studies of their times.

mod pair;
mod problems;
pub mod stages;

pub use pair::{PAIR, poses_of_a_disc, registered_cost, seen_by};
pub use problems::Outliers;
