//! The values used last, in memory.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// At most `capacity` values; the one that was not asked for the longest makes room.
pub struct Recent<T: ?Sized> {
    capacity: usize,
    /// From the least to the most recently used. A few dozen, so that searching takes no time.
    entries: Mutex<Vec<(String, Arc<T>)>>,
}

impl<T: ?Sized> Recent<T> {
    /// Room for `capacity` values; 0 keeps none.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            entries: Mutex::default(),
        }
    }

    /// How many values it has room for.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The value of a key, which then counts as the one used last.
    pub fn get(&self, key: &str) -> Option<Arc<T>> {
        let mut entries = self.entries();
        let at = entries.iter().position(|(known, _)| known == key)?;
        entries[at..].rotate_left(1);
        entries.last().map(|(_, value)| Arc::clone(value))
    }

    /// Keeps a value, in the place of any other of its key.
    pub fn insert(&self, key: &str, value: Arc<T>) {
        let mut entries = self.entries();
        entries.retain(|(known, _)| known != key);
        entries.push((key.to_owned(), value));
        let surplus = entries.len().saturating_sub(self.capacity);
        entries.drain(..surplus);
    }

    fn entries(&self) -> MutexGuard<'_, Vec<(String, Arc<T>)>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_value_makes_room() {
        let recent = Recent::new(2);
        recent.insert("a", Arc::new(1));
        recent.insert("b", Arc::new(2));
        assert_eq!(recent.get("a").as_deref(), Some(&1));
        recent.insert("c", Arc::new(3));
        assert_eq!(recent.get("b"), None);
        assert_eq!(recent.get("a").as_deref(), Some(&1));
        assert_eq!(recent.get("c").as_deref(), Some(&3));
    }

    #[test]
    fn a_value_that_two_threads_made_is_kept_once() {
        let recent = Recent::new(2);
        recent.insert("a", Arc::new(1));
        recent.insert("b", Arc::new(2));
        recent.insert("b", Arc::new(2));
        assert_eq!(recent.get("a").as_deref(), Some(&1));
    }
}
