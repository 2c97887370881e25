//! What was worked out about something, remembered with it.
//!
//! A person who turns one knob runs the same estimator on the same photos again and again. What does
//! not depend on the knob need not be made twice: the features of a photo, its smoothed copy, the
//! coloured cloud, the scores of a lattice. Each is remembered under everything that it depends on,
//! so there is no list of what a change makes invalid that could be out of date.

use std::any::Any;
use std::convert::Infallible;
use std::fmt;
use std::sync::Arc;

use crate::recent::Recent;

/// The values that were used last, each under a key that names all it depends on.
///
/// A memo belongs to data that do not change. A clone of the data may be changed, so a clone of a
/// memo starts empty.
#[derive(Default)]
pub struct Memo(Option<Recent<dyn Any + Send + Sync>>);

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
        Self(Some(Recent::new(capacity)))
    }

    /// The value of `key`, remembered or made now. No lock is held meanwhile.
    pub fn recall<T: Any + Send + Sync>(
        &self,
        key: &impl fmt::Debug,
        make: impl FnOnce() -> T,
    ) -> Recalled<T> {
        let Ok(recalled) = self.try_recall(key, || Ok::<_, Infallible>(make()));
        recalled
    }

    /// As [`Self::recall`], for a value whose making can be stopped: then nothing is remembered.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn try_recall<T: Any + Send + Sync, E>(
        &self,
        key: &impl fmt::Debug,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Recalled<T>, E> {
        let Some(recent) = &self.0 else {
            return Ok(Recalled {
                value: Arc::new(make()?),
                reused: false,
            });
        };
        // A key may spell out a thousand correspondences; its hash is kept.
        let key = format!("{} {key:?}", std::any::type_name::<T>());
        let key = format!("{:032x}", xxhash_rust::xxh3::xxh3_128(key.as_bytes()));
        if let Some(value) = recent.get(&key)
            && let Ok(value) = value.downcast()
        {
            return Ok(Recalled {
                value,
                reused: true,
            });
        }
        let value = Arc::new(make()?);
        recent.insert(&key, Arc::clone(&value) as Arc<dyn Any + Send + Sync>);
        Ok(Recalled {
            value,
            reused: false,
        })
    }
}

impl Clone for Memo {
    fn clone(&self) -> Self {
        match &self.0 {
            Some(recent) => Self::of(recent.capacity()),
            None => Self::off(),
        }
    }
}

impl fmt::Debug for Memo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() {
            "Memo"
        } else {
            "Memo(off)"
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_made_once_for_each_key_and_type() {
        let memo = Memo::of(4);
        assert!(!memo.recall(&("half", 8), || 4_u32).reused);
        let again = memo.recall(&("half", 8), || -> u32 { panic!("it is remembered") });
        assert!(again.reused);
        assert_eq!(*again.value, 4);
        assert!(!memo.recall(&("half", 8), || 4.0_f64).reused);
        assert!(!memo.recall(&("half", 9), || 4_u32).reused);
    }

    #[test]
    fn what_was_stopped_is_not_remembered() {
        let memo = Memo::of(4);
        assert_eq!(
            memo.try_recall(&"a", || Err::<u32, _>("stopped")).err(),
            Some("stopped")
        );
        let again = memo
            .try_recall(&"a", || Ok::<u32, &str>(7))
            .expect("it is made");
        assert!(!again.reused && *again.value == 7);
    }

    #[test]
    fn a_clone_starts_empty_and_off_remembers_nothing() {
        let memo = Memo::of(4);
        memo.recall(&"a", || 1);
        assert!(!memo.clone().recall(&"a", || 2).reused);
        let off = Memo::off();
        off.recall(&"a", || 1);
        assert!(!off.recall(&"a", || 2).reused);
    }
}
