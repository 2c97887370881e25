//! *avg*: the simple average.

use super::Entry;

pub(super) const ENTRY: Entry = Entry {
    name: "avg",
    about: "the average over all references",
    weigh: |matches| vec![1.0; matches.len()],
};
