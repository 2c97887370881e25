//! The methods that are compared, by their names.

use std::cmp::Ordering;
use std::fmt;

/// A method by its short name, which is the same on the command line, in results and in recordings.
///
/// Which methods there are says the registry of the estimators ([`crate::estimator::all`]): the four
/// of the paper are known by name here, any other is a line in a registry.
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

    /// The methods of the paper, in the order in which they run and are listed. Every command takes
    /// these where it is not told which.
    pub const PAPER: [Self; 4] = [Self::FB, Self::PM, Self::MI, Self::HY];

    /// The method of a name that a registry gives.
    pub const fn named(name: &'static str) -> Self {
        Self(name)
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
        paper
            .position(|known| *known == self)
            .unwrap_or(Self::PAPER.len())
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
}
