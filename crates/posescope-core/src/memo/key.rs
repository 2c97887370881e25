//! What a remembered value is found by.

use std::any::{Any, TypeId};
use std::fmt;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher, Hash, Hasher};
use std::marker::PhantomData;
use std::sync::Arc;

use nalgebra::{Point2, Point3};

use crate::geometry::Pose;

/// A key of any type. Keys are equal where their types and values are.
#[derive(Clone)]
pub struct Key {
    /// Tells most unequal keys apart without comparing them.
    hash: u64,
    key: Arc<dyn AnyKey>,
}

trait AnyKey: Any + Send + Sync {
    fn as_any(&self) -> &dyn Any;
    fn is_equal(&self, other: &dyn Any) -> bool;
}

impl<T: Any + Eq + Send + Sync> AnyKey for T {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn is_equal(&self, other: &dyn Any) -> bool {
        other.downcast_ref() == Some(self)
    }
}

impl Key {
    /// The key of this value.
    pub fn new<T: Any + Hash + Eq + Send + Sync>(key: T) -> Self {
        let hasher = BuildHasherDefault::<DefaultHasher>::default();
        Self { hash: hasher.hash_one((TypeId::of::<T>(), &key)), key: Arc::new(key) }
    }
}

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash && self.key.is_equal(other.key.as_any())
    }
}

impl Eq for Key {}

impl Hash for Key {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.hash.hash(state);
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Key({:016x})", self.hash)
    }
}

/// Something made of real numbers as a part of a key: equal where every bit of it is.
///
/// So 0 and −0 are two keys, and a NaN is equal to itself.
pub struct Exact<T: ?Sized> {
    words: Box<[u64]>,
    of: PhantomData<fn(&T)>,
}

impl<T: Bits + ?Sized> Exact<T> {
    /// The bits of a value.
    pub fn of(value: &T) -> Self {
        let mut words = Vec::new();
        value.write(&mut words);
        Self { words: words.into(), of: PhantomData }
    }
}

impl<T: ?Sized> Clone for Exact<T> {
    fn clone(&self) -> Self {
        Self { words: self.words.clone(), of: PhantomData }
    }
}

impl<T: ?Sized> PartialEq for Exact<T> {
    fn eq(&self, other: &Self) -> bool {
        self.words == other.words
    }
}

impl<T: ?Sized> Eq for Exact<T> {}

impl<T: ?Sized> Hash for Exact<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.words.hash(state);
    }
}

/// What can be told bit by bit: two values write the same words where they are the same to the last
/// bit, and only there.
pub trait Bits {
    /// Appends the words of this value.
    fn write(&self, words: &mut Vec<u64>);
}

impl Bits for f64 {
    fn write(&self, words: &mut Vec<u64>) {
        words.push(self.to_bits());
    }
}

impl Bits for usize {
    fn write(&self, words: &mut Vec<u64>) {
        words.push(*self as u64);
    }
}

impl Bits for u32 {
    fn write(&self, words: &mut Vec<u64>) {
        words.push(u64::from(*self));
    }
}

impl Bits for bool {
    fn write(&self, words: &mut Vec<u64>) {
        words.push(u64::from(*self));
    }
}

impl<T: Bits> Bits for [T] {
    fn write(&self, words: &mut Vec<u64>) {
        self.len().write(words);
        for value in self {
            value.write(words);
        }
    }
}

impl Bits for Point2<f64> {
    fn write(&self, words: &mut Vec<u64>) {
        words.extend(self.iter().map(|value| value.to_bits()));
    }
}

impl Bits for Point3<f64> {
    fn write(&self, words: &mut Vec<u64>) {
        words.extend(self.iter().map(|value| value.to_bits()));
    }
}

impl Bits for Pose {
    fn write(&self, words: &mut Vec<u64>) {
        let numbers = self.translation.vector.iter().chain(self.rotation.coords.iter());
        words.extend(numbers.map(|value| value.to_bits()));
    }
}

/// [`Bits`] of a struct: those of all its fields. A field that is left out does not compile.
macro_rules! bits_of_fields {
    ($type:ty { $($field:ident),+ $(,)? }) => {
        impl $crate::memo::Bits for $type {
            fn write(&self, words: &mut Vec<u64>) {
                let Self { $($field),+ } = self;
                $($crate::memo::Bits::write($field, words);)+
            }
        }
    };
}
pub(crate) use bits_of_fields;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_equal_where_type_and_value_are() {
        assert_eq!(Key::new(1_u32), Key::new(1_u32));
        assert_ne!(Key::new(1_u32), Key::new(2_u32));
        assert_ne!(Key::new(1_u32), Key::new(1_i32));
        assert_eq!(Key::new("half".to_owned()), Key::new("half".to_owned()));
    }

    /// All of its values have the same hash.
    #[derive(PartialEq, Eq)]
    struct Collides(u32);

    impl Hash for Collides {
        fn hash<H: Hasher>(&self, _state: &mut H) {}
    }

    #[test]
    fn keys_of_one_hash_are_told_apart_by_their_values() {
        assert_eq!(Key::new(Collides(1)).hash, Key::new(Collides(2)).hash);
        assert_ne!(Key::new(Collides(1)), Key::new(Collides(2)));
    }

    #[test]
    fn real_numbers_are_the_same_bit_by_bit() {
        let exact = |value: f64| Exact::of(&value);
        assert!(exact(0.1 + 0.2) != exact(0.3));
        assert!(exact(0.0) != exact(-0.0));
        assert!(exact(f64::NAN) == exact(f64::NAN));
        let list = |values: &[f64]| Exact::of(values);
        assert!(list(&[1.0, 2.0]) == list(&[1.0, 2.0]));
        assert!(list(&[1.0]) != list(&[1.0, 2.0]));
    }
}
