//! For posescope's own crates: may change in any version.
//!
//! The values used last, in memory.

use std::borrow::Borrow;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How much is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Values at most.
    pub count: usize,
    /// Memory of all of them together, at most \[bytes\].
    pub bytes: usize,
}

/// Values within a [`Limit`]; the least recently used makes room.
///
/// For a few dozen values that are cheap to clone, as an [`Arc`](std::sync::Arc) is.
pub struct Recent<K, V> {
    limit: Limit,
    /// What a value takes \[bytes\].
    bytes: fn(&V) -> usize,
    /// Whether the value is held elsewhere, so that dropping it would free nothing.
    is_held: fn(&V) -> bool,
    /// From the least to the most recently used.
    entries: Mutex<Vec<(K, V)>>,
}

impl<K: Eq, V: Clone> Recent<K, V> {
    /// At most `count` values, whatever their size.
    pub fn new(count: usize) -> Self {
        let bytes = usize::MAX;
        Self::within(Limit { count, bytes }, |_| 0, |_| false)
    }

    /// Values within the limit, but for those held elsewhere. `bytes` is what a value takes.
    pub fn within(limit: Limit, bytes: fn(&V) -> usize, is_held: fn(&V) -> bool) -> Self {
        Self { limit, bytes, is_held, entries: Mutex::default() }
    }

    /// The value of a key, which then counts as the one used last.
    pub fn get<Q: Eq + ?Sized>(&self, key: &Q) -> Option<V>
    where
        K: Borrow<Q>,
    {
        used(&mut self.entries(), key)
    }

    /// Keeps the value, and returns the one kept: where two threads made it, the first.
    pub fn insert(&self, key: K, value: V) -> V {
        let mut entries = self.entries();
        let kept = used(&mut entries, &key).unwrap_or_else(|| {
            entries.push((key, value.clone()));
            value
        });
        self.make_room(&mut entries);
        kept
    }

    /// Keeps to the limit again after values have grown or are no longer held elsewhere.
    pub fn trim(&self) {
        self.make_room(&mut self.entries());
    }

    /// Memory that the values take \[bytes\].
    pub fn bytes(&self) -> usize {
        self.sum(&self.entries())
    }

    /// Number of values.
    #[cfg(test)]
    fn len(&self) -> usize {
        self.entries().len()
    }

    fn sum(&self, entries: &[(K, V)]) -> usize {
        entries.iter().map(|(_, value)| (self.bytes)(value)).sum()
    }

    /// The newest value is kept even if it alone exceeds the byte limit.
    fn make_room(&self, entries: &mut Vec<(K, V)>) {
        let mut bytes = self.sum(entries);
        let mut at = 0;
        while at < entries.len() {
            let is_latest = at + 1 == entries.len();
            if entries.len() <= self.limit.count && (bytes <= self.limit.bytes || is_latest) {
                break;
            }
            if (self.is_held)(&entries[at].1) {
                at += 1;
            } else {
                let (_, value) = entries.remove(at);
                bytes = bytes.saturating_sub((self.bytes)(&value));
            }
        }
    }

    fn entries(&self) -> MutexGuard<'_, Vec<(K, V)>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The value of a key among entries, which becomes the last of them.
fn used<K: Borrow<Q>, V: Clone, Q: Eq + ?Sized>(entries: &mut [(K, V)], key: &Q) -> Option<V> {
    let at = entries.iter().position(|(known, _)| known.borrow() == key)?;
    entries[at..].rotate_left(1);
    entries.last().map(|(_, value)| value.clone())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn the_least_recently_used_value_makes_room() {
        let recent = Recent::new(2);
        recent.insert("a", 1);
        recent.insert("b", 2);
        assert_eq!(recent.get("a"), Some(1));
        recent.insert("c", 3);
        assert_eq!(recent.get("b"), None);
        assert_eq!(recent.get("a"), Some(1));
        assert_eq!(recent.get("c"), Some(3));
    }

    #[test]
    fn a_value_that_two_threads_made_is_kept_once() {
        let recent = Recent::new(2);
        recent.insert("a", 1);
        recent.insert("b", 2);
        assert_eq!(recent.insert("b", 3), 2);
        assert_eq!(recent.get("a"), Some(1));
        assert_eq!(recent.len(), 2);
    }

    #[test]
    fn values_stay_within_their_bytes_but_for_the_latest_and_those_that_others_hold() {
        let limit = Limit { count: 9, bytes: 10 };
        let recent: Recent<u8, Arc<Vec<u8>>> =
            Recent::within(limit, |value| value.len(), |value| Arc::strong_count(value) > 1);
        let held = recent.insert(0, Arc::new(vec![0; 6]));
        recent.insert(1, Arc::new(vec![0; 4]));
        assert_eq!(recent.bytes(), 10);
        recent.insert(2, Arc::new(vec![0; 3]));
        assert!(recent.get(&1).is_none() && recent.get(&0).is_some());
        drop(held);
        recent.insert(3, Arc::new(vec![0; 99]));
        assert_eq!((recent.len(), recent.bytes()), (1, 99));
    }
}
