//! *avg*: the simple average.

use super::{Entry, Way};

pub(super) const ENTRY: Entry = Entry {
    name: "avg",
    about: "the average over all references",
    way: Way::Weighed(|matches| vec![1.0; matches.len()]),
};
