//! *maxf*: the reference with the most matches alone.

use super::{Entry, Way};

pub(super) const ENTRY: Entry = Entry {
    name: "maxf",
    about: "the reference with the most matches alone",
    way: Way::Weighed(weigh),
};

/// The first of equals wins.
fn weigh(matches: &[usize]) -> Vec<f64> {
    let most = matches.iter().max();
    let winner = matches.iter().position(|count| Some(count) == most);
    (0..matches.len()).map(|index| if Some(index) == winner { 1.0 } else { 0.0 }).collect()
}
