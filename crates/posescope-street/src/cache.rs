//! A bounded cache: the values used last in memory, more of them on disk.
//!
//! It only saves time. What cannot be read is made again, what cannot be written is not kept, and
//! neither is an error.

mod disk;
mod user_folder;

use std::sync::Arc;

pub(crate) use disk::DiskCache;
use posescope_core::recent::Recent;
pub use user_folder::user_cache_folder;

/// A value that can be kept as bytes.
pub(crate) trait Stored: Sized {
    /// The value as bytes; `None` leaves it off the disk.
    fn to_bytes(&self) -> Option<Vec<u8>>;

    /// The same value; `None` where the bytes are none.
    fn from_bytes(bytes: &[u8]) -> Option<Self>;
}

/// Values by their key. A key names everything that the value depends on.
pub(crate) struct Cache<T> {
    recent: Recent<String, Arc<T>>,
    disk: Option<Arc<DiskCache>>,
}

impl<T: Stored> Cache<T> {
    /// Keeps `in_memory` values in memory, and all on disk if there is one.
    pub(crate) fn new(in_memory: usize, disk: Option<Arc<DiskCache>>) -> Self {
        Self { recent: Recent::new(in_memory), disk }
    }

    /// The value of a key. Two threads that ask at the same time may both make it: no lock is held
    /// meanwhile, because making it may be parallel work itself.
    pub(crate) fn get_or_make(&self, key: &str, make: impl FnOnce() -> T) -> Arc<T> {
        if let Some(value) = self.recent.get(key) {
            return value;
        }
        let stored = || T::from_bytes(&self.disk.as_ref()?.read(key)?);
        let value = Arc::new(stored().unwrap_or_else(|| {
            let made = make();
            if let Some(disk) = &self.disk
                && let Some(bytes) = made.to_bytes()
            {
                disk.write(key, &bytes);
            }
            made
        }));
        self.recent.insert(key.to_owned(), value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Stored for String {
        fn to_bytes(&self) -> Option<Vec<u8>> {
            Some(self.clone().into_bytes())
        }

        fn from_bytes(bytes: &[u8]) -> Option<Self> {
            Self::from_utf8(bytes.to_vec()).ok()
        }
    }

    fn never() -> String {
        panic!("it is in the cache")
    }

    #[test]
    fn a_value_is_made_once_and_then_comes_from_memory_or_from_disk() {
        let folder = tempfile::tempdir().expect("a folder");
        let disk = || Some(Arc::new(DiskCache::new(folder.path().to_owned(), 1000)));
        let cache = Cache::new(1, disk());
        assert_eq!(*cache.get_or_make("a", || "one".to_owned()), "one");
        assert_eq!(*cache.get_or_make("a", never), "one");
        assert_eq!(*cache.get_or_make("b", || "two".to_owned()), "two");
        // Memory holds one value only, and another process none.
        assert_eq!(*cache.get_or_make("a", never), "one");
        assert_eq!(*Cache::new(1, disk()).get_or_make("b", never), "two");
    }

    #[test]
    fn bytes_that_are_no_value_are_made_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let disk = Arc::new(DiskCache::new(folder.path().to_owned(), 1000));
        disk.write("a", &[0xFF]);
        let cache = Cache::new(0, Some(disk));
        assert_eq!(*cache.get_or_make("a", || "one".to_owned()), "one");
        assert_eq!(*cache.get_or_make("a", never), "one");
    }

    #[test]
    fn without_a_disk_there_is_memory() {
        let cache = Cache::new(1, None);
        assert_eq!(*cache.get_or_make("a", || "one".to_owned()), "one");
        assert_eq!(*cache.get_or_make("a", never), "one");
    }
}
