//! Results that were computed before, kept with the frame that they are of.
//!
//! Someone who turns one knob runs the same estimator on the same photos again and again, and several
//! estimators need the same of one photo: its features, its smoothed copy, the coloured cloud, the scores of a
//! lattice. The key of each contains every input, so nothing needs invalidating.

use std::any::{Any, TypeId};
use std::convert::Infallible;
use std::fmt::{self, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use xxhash_rust::xxh3::Xxh3;

use crate::recent::{Limit, Recent};

/// Memory that the values of one memo may take \[bytes\]: thirty smoothed copies of a photo of
/// 1241 × 376 px. Turning one knob through all its values stays within.
const BYTES: usize = 64 << 20;

/// KeptValues that one memo keeps: some settings of each stage with several references, so that going back to the
/// last setting costs nothing either.
const VALUES: usize = 256;

/// What a value is found by: a hash of all that it depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(u128);

/// The key of all that a value depends on: the 128-bit XXH3 hash of its `Debug` text, which writes different
/// numbers differently.
pub fn key(inputs: impl fmt::Debug) -> Key {
    struct Text(Xxh3);
    impl fmt::Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.update(text.as_bytes());
            Ok(())
        }
    }
    let mut text = Text(Xxh3::new());
    // Hashing cannot fail.
    let _ = write!(text, "{inputs:?}");
    Key(text.0.digest128())
}

/// The values that were used last, each under its [`Key`].
///
/// A memo belongs to data that do not change. A clone of the data may be changed, so a clone of a
/// memo starts empty.
#[derive(Default)]
pub(crate) struct Memo(Option<Arc<KeptValues>>);

/// Identifies a memo or a scene: no two are the same within one process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Id(u64);

impl Id {
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

struct KeptValues {
    id: Id,
    recent: Recent<(TypeId, Key), KeptValue>,
}

#[derive(Clone)]
struct KeptValue {
    value: Arc<dyn Any + Send + Sync>,
    bytes: usize,
}

/// A value, and whether it was remembered.
#[derive(Clone, Debug)]
pub(crate) struct Recalled<T> {
    /// The value.
    pub(crate) value: Arc<T>,
    /// Whether it was at hand, and not made for this call.
    pub(crate) reused: bool,
}

impl Memo {
    /// A memo that keeps nothing: every value is made when it is asked for.
    pub(crate) const fn off() -> Self {
        Self(None)
    }

    /// An empty memo.
    pub(crate) fn new() -> Self {
        let limit = Limit { count: VALUES, bytes: BYTES };
        Self(Some(Arc::new(KeptValues {
            id: Id::new(),
            recent: Recent::within(limit, |entry: &KeptValue| entry.bytes, |_| false),
        })))
    }

    /// The same memo once more, for other data of the same frame.
    pub(crate) fn shared(&self) -> Self {
        Self(self.0.clone())
    }

    /// Which memo it is, for results that depend on two frames; `None` for one that keeps nothing.
    pub(crate) fn id(&self) -> Option<Id> {
        self.0.as_ref().map(|values| values.id)
    }

    /// Memory that the values take \[bytes\], roughly.
    pub(crate) fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |values| values.recent.bytes())
    }

    /// The value of these inputs, kept or made now; `heap_bytes` is the memory that it takes beside itself,
    /// roughly. No lock is held meanwhile: two threads may make equal values at the same time, one of which is
    /// kept.
    pub(crate) fn recall<T: Any + Send + Sync>(
        &self,
        inputs: impl fmt::Debug,
        heap_bytes: fn(&T) -> usize,
        make: impl FnOnce() -> T,
    ) -> Recalled<T> {
        let Ok(recalled) = self.try_recall(inputs, heap_bytes, || Ok::<_, Infallible>(make()));
        recalled
    }

    /// Recalls as [`Self::recall`] does a value whose making can be stopped: then nothing is kept.
    pub(crate) fn try_recall<T: Any + Send + Sync, E>(
        &self,
        inputs: impl fmt::Debug,
        heap_bytes: fn(&T) -> usize,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Recalled<T>, E> {
        let Some(values) = &self.0 else {
            return Ok(Recalled::made(Arc::new(make()?)));
        };
        let key = (TypeId::of::<T>(), key(inputs));
        if let Some(entry) = values.recent.get(&key)
            && let Ok(value) = entry.value.downcast()
        {
            return Ok(Recalled { value, reused: true });
        }
        let made = Arc::new(make()?);
        let entry = KeptValue {
            bytes: size_of::<T>() + heap_bytes(&made),
            value: Arc::clone(&made) as Arc<dyn Any + Send + Sync>,
        };
        let kept = values.recent.insert(key, entry).value;
        Ok(Recalled::made(kept.downcast().unwrap_or(made)))
    }
}

impl<T> Recalled<T> {
    /// A value that was made for this call.
    pub(crate) fn made(value: Arc<T>) -> Self {
        Self { value, reused: false }
    }
}

impl Clone for Memo {
    fn clone(&self) -> Self {
        if self.0.is_some() { Self::new() } else { Self::off() }
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

    fn none<T>(_: &T) -> usize {
        0
    }

    #[test]
    fn keys_are_equal_where_all_numbers_are_to_the_last_bit() {
        assert_eq!(key(("half", 8)), key(("half", 8)));
        assert_ne!(key(("half", 8)), key(("half", 9)));
        assert_ne!(key(0.1 + 0.2), key(0.3));
        assert_ne!(key(0.0), key(-0.0));
        assert_eq!(key(f64::NAN), key(f64::NAN));
        assert_ne!(key([1.0, 2.0]), key([1.0]));
        assert_ne!(key(f32::from_bits(0x3dcc_cccd)), key(f32::from_bits(0x3dcc_ccce)));
    }

    #[test]
    fn a_value_is_made_once_for_each_key_and_type() {
        let memo = Memo::new();
        assert!(!memo.recall(("half", 8), none, || 4_u32).reused);
        let again = memo.recall(("half", 8), none, || -> u32 { panic!("it is kept") });
        assert!(again.reused);
        assert_eq!(*again.value, 4);
        assert!(!memo.recall(("half", 8), none, || 4.0_f64).reused);
        assert!(!memo.recall(("half", 9), none, || 4_u32).reused);
    }

    #[test]
    fn what_was_stopped_is_not_kept() {
        let memo = Memo::new();
        let stopped = memo.try_recall("a", none, || Err::<u32, _>("stopped"));
        assert_eq!(stopped.err(), Some("stopped"));
        let again = memo.try_recall("a", none, || Ok::<u32, &str>(7));
        let again = again.expect("it is made");
        assert!(!again.reused && *again.value == 7);
    }

    #[test]
    fn a_clone_starts_empty_a_shared_one_does_not_and_off_keeps_nothing() {
        let memo = Memo::new();
        memo.recall("a", none, || 1_u32);
        assert!(!memo.clone().recall("a", none, || 2_u32).reused);
        assert!(memo.shared().recall("a", none, || 2_u32).reused);
        assert_ne!(memo.id(), memo.clone().id());
        assert_eq!(memo.id(), memo.shared().id());
        let off = Memo::off();
        off.recall("a", none, || 1_u32);
        assert!(!off.recall("a", none, || 2_u32).reused);
        assert_eq!(off.id(), None);
    }

    #[test]
    fn a_memo_stays_within_its_bytes() {
        let memo = Memo::new();
        let bytes = |value: &Vec<u8>| value.capacity();
        for number in 0..8_u32 {
            memo.recall(number, bytes, || vec![0_u8; BYTES / 4]);
            assert!(memo.bytes() <= BYTES);
        }
        assert!(memo.recall(7_u32, bytes, Vec::<u8>::new).reused);
        assert!(!memo.recall(0_u32, bytes, Vec::<u8>::new).reused);
    }
}
