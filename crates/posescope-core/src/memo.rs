//! What was worked out about something, remembered with it.
//!
//! A person who turns one knob runs the same estimator on the same photos again and again, and
//! several estimators ask the same of one photo. What does not depend on the knob or on the estimator
//! need not be made twice: the features of a photo, its smoothed copy, the coloured cloud, the scores
//! of a lattice. Each is remembered under everything that it depends on, so there is no list of what
//! a change makes invalid that could be out of date.

mod key;

use std::any::{Any, TypeId};
use std::convert::Infallible;
use std::fmt;
use std::hash::Hash;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

pub(crate) use key::bits_of_fields;
pub use key::{Bits, Exact, Key};

use crate::recent::{Limit, Recent};

/// Memory that the values of one memo may take \[bytes\]: thirty smoothed copies of a photo of
/// 1241 × 376 px. Turning one knob through all its values stays within.
const BYTES: usize = 64 << 20;

/// A value that can be remembered.
pub trait Remembered: Any + Send + Sync {
    /// Memory that it takes beside itself \[bytes\], roughly.
    fn heap_bytes(&self) -> usize;
}

/// The values that were used last, each under a key that names all it depends on.
///
/// A memo belongs to data that do not change. A clone of the data may be changed, so a clone of a
/// memo starts empty.
#[derive(Default)]
pub struct Memo(Option<Arc<Values>>);

/// Which memo: no two are the same within one process, so that what was worked out about two things
/// can be remembered with one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MemoId(u64);

struct Values {
    id: MemoId,
    recent: Recent<(TypeId, Key), Entry>,
}

#[derive(Clone)]
struct Entry {
    value: Arc<dyn Any + Send + Sync>,
    bytes: usize,
}

/// A value, and whether it was remembered.
#[derive(Clone, Debug)]
pub struct Recalled<T> {
    /// The value.
    pub value: Arc<T>,
    /// Whether it was at hand, and not made for this call.
    pub reused: bool,
}

impl Memo {
    /// A memo that remembers nothing: every value is made when it is asked for.
    pub const fn off() -> Self {
        Self(None)
    }

    /// A memo of at most `capacity` values.
    pub fn of(capacity: usize) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let limit = Limit { count: capacity, bytes: BYTES };
        Self(Some(Arc::new(Values {
            id: MemoId(NEXT.fetch_add(1, Ordering::Relaxed)),
            recent: Recent::within(limit, |entry: &Entry| entry.bytes, |_| false),
        })))
    }

    /// The same memo once more, for other data of the same frame.
    pub fn shared(&self) -> Self {
        Self(self.0.clone())
    }

    /// Which memo it is; `None` for one that remembers nothing.
    pub fn id(&self) -> Option<MemoId> {
        self.0.as_ref().map(|values| values.id)
    }

    /// Memory that the values take \[bytes\], roughly.
    pub fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |values| values.recent.bytes())
    }

    /// The value of `key`, remembered or made now. No lock is held meanwhile: two threads may make
    /// equal values at the same time, one of which is kept.
    pub fn recall<T: Remembered>(
        &self,
        key: impl Any + Hash + Eq + Send + Sync,
        make: impl FnOnce() -> T,
    ) -> Recalled<T> {
        let Ok(recalled) = self.try_recall(key, || Ok::<_, Infallible>(make()));
        recalled
    }

    /// Recalls as [`Self::recall`] does, for a value whose making can be stopped: then nothing is
    /// remembered.
    ///
    /// # Errors
    /// The errors of `make`.
    pub fn try_recall<T: Remembered, E>(
        &self,
        key: impl Any + Hash + Eq + Send + Sync,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Recalled<T>, E> {
        let Some(values) = &self.0 else {
            return Ok(Recalled::made(Arc::new(make()?)));
        };
        let key = (TypeId::of::<T>(), Key::new(key));
        if let Some(entry) = values.recent.get(&key)
            && let Ok(value) = entry.value.downcast()
        {
            return Ok(Recalled { value, reused: true });
        }
        let made = Arc::new(make()?);
        let entry = values.recent.insert(
            key,
            Entry {
                bytes: size_of::<T>() + made.heap_bytes(),
                value: Arc::clone(&made) as Arc<dyn Any + Send + Sync>,
            },
        );
        Ok(Recalled::made(entry.value.downcast().unwrap_or(made)))
    }
}

impl<T> Recalled<T> {
    /// A value that was made for this call.
    pub fn made(value: Arc<T>) -> Self {
        Self { value, reused: false }
    }
}

impl Clone for Memo {
    fn clone(&self) -> Self {
        match &self.0 {
            Some(values) => Self::of(values.recent.limit().count),
            None => Self::off(),
        }
    }
}

impl fmt::Debug for Memo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Memo" } else { "Memo(off)" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Remembered for u32 {
        fn heap_bytes(&self) -> usize {
            0
        }
    }

    impl Remembered for f64 {
        fn heap_bytes(&self) -> usize {
            0
        }
    }

    impl Remembered for Vec<u8> {
        fn heap_bytes(&self) -> usize {
            self.capacity()
        }
    }

    #[test]
    fn a_value_is_made_once_for_each_key_and_type() {
        let memo = Memo::of(4);
        assert!(!memo.recall(("half", 8), || 4_u32).reused);
        let again = memo.recall(("half", 8), || -> u32 { panic!("it is remembered") });
        assert!(again.reused);
        assert_eq!(*again.value, 4);
        assert!(!memo.recall(("half", 8), || 4.0_f64).reused);
        assert!(!memo.recall(("half", 9), || 4_u32).reused);
    }

    #[test]
    fn what_was_stopped_is_not_remembered() {
        let memo = Memo::of(4);
        let stopped = memo.try_recall("a", || Err::<u32, _>("stopped"));
        assert_eq!(stopped.err(), Some("stopped"));
        let again = memo.try_recall("a", || Ok::<u32, &str>(7));
        let again = again.expect("it is made");
        assert!(!again.reused && *again.value == 7);
    }

    #[test]
    fn a_clone_starts_empty_a_shared_one_does_not_and_off_remembers_nothing() {
        let memo = Memo::of(4);
        memo.recall("a", || 1_u32);
        assert!(!memo.clone().recall("a", || 2_u32).reused);
        assert!(memo.shared().recall("a", || 2_u32).reused);
        assert_ne!(memo.id(), memo.clone().id());
        assert_eq!(memo.id(), memo.shared().id());
        let off = Memo::off();
        off.recall("a", || 1_u32);
        assert!(!off.recall("a", || 2_u32).reused);
        assert_eq!(off.id(), None);
    }

    #[test]
    fn a_memo_stays_within_its_bytes() {
        let memo = Memo::of(1000);
        for number in 0..8_u32 {
            memo.recall(number, || vec![0_u8; BYTES / 4]);
            assert!(memo.bytes() <= BYTES);
        }
        assert!(memo.recall(7_u32, Vec::<u8>::new).reused);
        assert!(!memo.recall(0_u32, Vec::<u8>::new).reused);
    }
}
