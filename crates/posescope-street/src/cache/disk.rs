//! Files in a folder of the user's cache directory, bounded in size.
//!
//! Any number of processes may share the folder: files appear whole, are never changed, and are
//! checked when they are read.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;
use std::{fs, io};

use posescope_core::files::{self, write_whole};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use super::user_folder::user_cache_folder;

/// Only files with this extension are ever read, counted or removed, so that a folder named by
/// mistake loses nothing.
const EXTENSION: &str = "posescope-cache";
/// The last byte is the version of this layout: magic, checksum, payload.
const MAGIC: [u8; 8] = *b"PSCACHE\x01";
const HEADER: usize = MAGIC.len() + size_of::<u64>();

/// A folder of files by their key.
pub(crate) struct DiskCache {
    folder: PathBuf,
    limit: u64,
    /// After one failure nothing more is written: the next would fail as well.
    failed: AtomicBool,
}

impl DiskCache {
    /// A cache in a folder of its own, which is made when it is needed, of at most `limit` bytes.
    pub(crate) fn new(folder: PathBuf, limit: u64) -> Self {
        Self { folder, limit, failed: AtomicBool::new(false) }
    }

    /// The cache `name` where the environment or else the system says; `None` where it is turned
    /// off or the user has no cache directory.
    pub(crate) fn of_user(name: &str, limit: u64) -> Option<Self> {
        Some(Self::new(user_cache_folder(name)?, limit))
    }

    /// The bytes of a key, if they are there and undamaged.
    pub(crate) fn read(&self, key: &str) -> Option<Vec<u8>> {
        let mut bytes = files::read(&self.path(key), self.limit).ok()?;
        let (magic, rest) = bytes.split_first_chunk()?;
        let (sum, payload) = rest.split_first_chunk()?;
        if *magic != MAGIC || u64::from_le_bytes(*sum) != checksum(key, payload) {
            log::debug!("{}: damaged, made again", self.path(key).display());
            return None;
        }
        bytes.drain(..HEADER);
        Some(bytes)
    }

    /// Keeps the bytes of a key, if possible.
    pub(crate) fn write(&self, key: &str, payload: &[u8]) {
        if self.failed.load(Ordering::Relaxed) {
            return;
        }
        let mut bytes = Vec::with_capacity(HEADER + payload.len());
        bytes.extend(MAGIC);
        bytes.extend(checksum(key, payload).to_le_bytes());
        bytes.extend(payload);
        let written = fs::create_dir_all(&self.folder)
            .and_then(|()| self.make_room(bytes.len() as u64))
            .and_then(|()| write_whole(&self.path(key), &bytes));
        if let Err(error) = written
            && !self.failed.swap(true, Ordering::Relaxed)
        {
            let folder = self.folder.display();
            log::debug!("{folder}: {error}; nothing more is kept there by this process");
        }
    }

    /// Removes the oldest files until `needed` more bytes stay within the limit. Temporary files
    /// count too: those of a killed process become the oldest some day.
    fn make_room(&self, needed: u64) -> io::Result<()> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            // Another process may remove it meanwhile.
            if path.extension().is_some_and(|end| end == EXTENSION)
                && let Ok(metadata) = path.symlink_metadata()
            {
                let age = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                files.push((age, path, metadata.len()));
            }
        }
        files.sort();
        let mut total = needed + files.iter().map(|(_, _, size)| size).sum::<u64>();
        for (_, path, size) in files {
            if total <= self.limit {
                break;
            }
            match fs::remove_file(path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => total -= size,
            }
        }
        if total > self.limit {
            return Err(io::Error::new(
                io::ErrorKind::FileTooLarge,
                format!("{total} bytes are more than the limit of {}", self.limit),
            ));
        }
        Ok(())
    }

    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.{EXTENSION}"))
    }
}

/// Over the key too, so that a file under another's name is not taken for it.
fn checksum(key: &str, payload: &[u8]) -> u64 {
    xxh3_64_with_seed(payload, xxh3_64(key.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;
    use tempfile::TempDir;

    fn cache(limit: u64) -> (TempDir, DiskCache) {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = DiskCache::new(folder.path().join("made/on demand"), limit);
        (folder, cache)
    }

    #[test]
    fn what_was_written_is_read_by_its_key_only() {
        let (_folder, cache) = cache(1000);
        assert_eq!(cache.read("a"), None);
        cache.write("a", b"payload");
        cache.write("empty", b"");
        assert_eq!(cache.read("a").as_deref(), Some(&b"payload"[..]));
        assert_eq!(cache.read("empty").as_deref(), Some(&b""[..]));
        fs::copy(cache.path("a"), cache.path("b")).expect("writable");
        assert_eq!(cache.read("b"), None);
    }

    #[test]
    fn damaged_files_are_not_read_and_can_be_replaced() {
        let (_folder, cache) = cache(1000);
        cache.write("a", b"payload");
        let whole = fs::read(cache.path("a")).expect("just written");
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x10;
            fs::write(cache.path("a"), damaged).expect("writable");
            assert_eq!(cache.read("a"), None, "byte {at}");
            fs::write(cache.path("a"), &whole[..at]).expect("writable");
            assert_eq!(cache.read("a"), None, "cut off at {at}");
        }
        cache.write("a", b"payload");
        assert_eq!(cache.read("a").as_deref(), Some(&b"payload"[..]));
    }

    #[test]
    fn the_oldest_files_make_room_and_foreign_files_stay() {
        let (_folder, cache) = cache(3 * (HEADER as u64 + 10));
        let foreign = cache.folder.join("notes.txt");
        for (age, key) in ["c", "a", "b"].into_iter().enumerate() {
            cache.write(key, &[0; 10]);
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(age as u64);
            let file = fs::File::options().write(true).open(cache.path(key));
            file.and_then(|file| file.set_modified(time)).expect("writable");
        }
        fs::write(&foreign, [0; 1000]).expect("writable");
        cache.write("d", &[0; 10]);
        let there = ["a", "b", "c", "d"].map(|key| cache.read(key).is_some());
        assert_eq!(there, [true, true, false, true]);
        assert!(foreign.exists());
    }

    #[test]
    fn what_is_larger_than_the_limit_is_not_kept() {
        let (_folder, cache) = cache(20);
        cache.write("a", &[0; 10]);
        assert_eq!(cache.read("a"), None);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_no_error() {
        let (folder, _) = cache(0);
        let file = folder.path().join("file");
        fs::write(&file, b"").expect("writable");
        let cache = DiskCache::new(file.join("folder"), 1000);
        cache.write("a", b"payload");
        assert_eq!(cache.read("a"), None);
        assert!(cache.failed.load(Ordering::Relaxed));
    }

    #[test]
    fn threads_may_write_and_read_the_same_key() {
        let (_folder, cache) = cache(100_000);
        let payload = vec![7; 10_000];
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..20 {
                        cache.write("a", &payload);
                        // Making room may have removed it in between, but it is never damaged.
                        assert!(cache.read("a").is_none_or(|read| read == payload));
                    }
                });
            }
        });
        assert_eq!(fs::read_dir(&cache.folder).expect("made").count(), 1);
    }
}
