//! *r-wavg*, the robust weighted average: references with few matches are left out.

use super::{Entry, Way, wavg};

pub(super) const ENTRY: Entry = Entry {
    name: "r-wavg",
    about: "as wavg, over references with at least half of the most matches",
    way: Way::Weighed(weigh),
};

/// With K the most matches of any reference, those with at least K/2 stay.
fn weigh(matches: &[usize]) -> Vec<f64> {
    let most = matches.iter().max().copied().unwrap_or_default();
    wavg::weigh(matches)
        .into_iter()
        .zip(matches)
        .map(|(weight, &count)| if 2 * count >= most { weight } else { 0.0 })
        .collect()
}
