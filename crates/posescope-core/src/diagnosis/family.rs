//! How methods find their poses.

pub use crate::estimator::Family;
