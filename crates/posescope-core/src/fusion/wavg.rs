//! *wavg*: the average weighted by matches.

use super::{Entry, Way};

pub(super) const ENTRY: Entry = Entry {
    name: "wavg",
    about: "the average over all references, weighted by their matches",
    way: Way::Weighed(weigh),
};

/// Where no reference has a match, none is better than another.
pub(super) fn weigh(matches: &[usize]) -> Vec<f64> {
    if matches.iter().all(|count| *count == 0) {
        return vec![1.0; matches.len()];
    }
    matches.iter().map(|&count| count as f64).collect()
}
