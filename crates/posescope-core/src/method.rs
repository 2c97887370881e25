//! For posescope's own crates: may change in any version.
//!
//! The methods that are compared, by their names.

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Mutex, PoisonError};

/// A method by its short name, which is the same on the command line, in results and in recordings.
///
/// There is one way for each origin of a name. A name in the program is a constant ([`Self::named`]). A name
/// that a user gives to another system is declared once ([`Self::called`]). A name in a file or on the command
/// line is parsed: those of [`methods`](crate::methods) and the declared ones are known, and any other is an
/// error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Method(&'static str);

impl Method {
    /// FB, the indirect feature-based method.
    pub const FB: Self = Self("fb");
    /// PM, the direct photometric method.
    pub const PM: Self = Self("pm");
    /// MI, the direct mutual-information method.
    pub const MI: Self = Self("mi");
    /// HY, the hybrid of FB and MI.
    pub const HY: Self = Self("hy");

    /// The methods of the paper, in the order in which they run and are listed; the default of every
    /// command.
    pub const PAPER: [Self; 4] = [Self::FB, Self::PM, Self::MI, Self::HY];

    /// The method of a name in the program.
    pub const fn named(name: &'static str) -> Self {
        Self(name)
    }

    /// Another system as a method, by a name of the user's. Names are kept until the program ends.
    ///
    /// # Errors
    /// [`MethodNameError`] where the name could not stand in a list of methods or an entity path.
    pub fn called(name: &str) -> Result<Self, MethodNameError> {
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_.+".contains(c);
        let starts_well = name.starts_with(|c: char| c.is_ascii_lowercase());
        if !starts_well || !name.chars().all(is_plain) || name.len() > MAX_NAME {
            return Err(MethodNameError(name.chars().take(MAX_NAME).collect()));
        }
        if let Ok(known) = name.parse() {
            return Ok(known);
        }
        let kept: &'static str = Box::leak(name.into());
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        names.insert(kept);
        Ok(Self(kept))
    }

    /// The method of a name that [`Self::called`] declared.
    pub(crate) fn declared(name: &str) -> Option<Self> {
        let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        names.get(name).copied().map(Self)
    }

    /// The short name.
    pub const fn name(self) -> &'static str {
        self.0
    }

    /// The name as people read it: `FB`.
    pub fn label(self) -> String {
        self.0.to_uppercase()
    }

    /// Position among those of the paper; all others come behind.
    fn rank(self) -> usize {
        let mut paper = Self::PAPER.iter();
        paper.position(|known| *known == self).unwrap_or(Self::PAPER.len())
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.0)
    }
}

/// Sorts methods: those of the paper in its order, then the others by name.
impl Ord for Method {
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |method: &Self| (method.rank(), method.0);
        key(self).cmp(&key(other))
    }
}

impl PartialOrd for Method {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The names of other systems.
static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// Characters of a name at most; tables have columns of about this width.
const MAX_NAME: usize = 24;

/// What is no name of a method.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not a possible name of a method: lower-case letters, digits and -_.+ expected, a letter first, \
     {MAX_NAME} at most"
)]
pub struct MethodNameError(String);

crate::serde_as_text!(Method);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator;

    #[test]
    fn every_method_is_read_as_it_is_written() {
        for method in estimator::methods() {
            assert_eq!(method.to_string().parse(), Ok(method));
            let json = serde_json::to_string(&method).expect("a string");
            assert_eq!(json, format!("\"{}\"", method.name()));
            assert_eq!(serde_json::from_str::<Method>(&json).ok(), Some(method));
        }
    }

    #[test]
    fn another_system_goes_by_any_plain_name() {
        let method = Method::called("superglue-2").expect("a plain name");
        assert_eq!(method, Method::named("superglue-2"));
        // A name is kept once, and those of the registry are not kept again.
        for method in [method, Method::MI, Method::named("robust")] {
            let read = Method::called(method.name()).expect("a plain name");
            let known: Method = method.name().parse().expect("a known name");
            assert!(read == method && std::ptr::eq(read.name(), known.name()), "{method}");
        }
        assert_eq!(serde_json::from_str::<Method>("\"superglue-2\"").ok(), Some(method));
        let long = "x".repeat(25);
        for wrong in ["", "Mi", "2d", "a b", "a/b", "a@b", "a,b", "é", &long] {
            assert!(Method::called(wrong).is_err(), "{wrong}");
        }
        // What nobody brought is no method.
        assert!(serde_json::from_str::<Method>("\"sift-of-nobody\"").is_err());
    }
}
