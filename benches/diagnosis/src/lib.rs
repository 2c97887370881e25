//! What the measurements of verdicts have in common: frames in memory, places of the street, and
//! queries that are localised there.

pub mod diagrams;
pub mod faults;
pub mod frames;
pub mod places;
pub mod real_pairs;
