//! Comparisons of numbers and text in gates, conditions and breakpoints.

use std::fmt;

/// A comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// `=`, also written `==`.
    Is,
    /// `!=`.
    IsNot,
    /// `<`.
    Below,
    /// `<=`.
    AtMost,
    /// `>`.
    Above,
    /// `>=`.
    AtLeast,
    /// `~`: the left text contains the right one. Never true for numbers.
    Contains,
}

/// Longer signs first: `<=` must not be parsed as `<`.
const SIGNS: [(&str, Relation); 8] = [
    ("!=", Relation::IsNot),
    ("<=", Relation::AtMost),
    (">=", Relation::AtLeast),
    ("==", Relation::Is),
    ("=", Relation::Is),
    ("<", Relation::Below),
    (">", Relation::Above),
    ("~", Relation::Contains),
];

impl Relation {
    /// Characters that a sign starts with.
    pub const STARTS: &str = "=!<>~";

    /// The sign at the start of a text, and what follows it.
    pub fn at_start(text: &str) -> Option<(Self, &str)> {
        let of = |&(sign, relation): &(&str, Self)| Some((relation, text.strip_prefix(sign)?));
        SIGNS.iter().find_map(of)
    }

    /// The first sign in a text, with the trimmed texts before and after it.
    pub fn split(text: &str) -> Option<(&str, Self, &str)> {
        let (at, _) = text.char_indices().find(|(at, _)| Self::at_start(&text[*at..]).is_some())?;
        let (relation, right) = Self::at_start(&text[at..])?;
        Some((text[..at].trim(), relation, right.trim()))
    }

    /// Whether the relation holds between two numbers. For NaN only `!=` holds.
    pub fn holds(self, left: f64, right: f64) -> bool {
        self.holds_between(&left, &right)
    }

    /// Whether the relation holds between two texts.
    pub fn holds_for_words(self, left: &str, right: &str) -> bool {
        match self {
            Self::Contains => left.contains(right),
            _ => self.holds_between(left, right),
        }
    }

    fn holds_between<T: PartialOrd + ?Sized>(self, left: &T, right: &T) -> bool {
        match self {
            Self::Is => left == right,
            Self::IsNot => left != right,
            Self::Below => left < right,
            Self::AtMost => left <= right,
            Self::Above => left > right,
            Self::AtLeast => left >= right,
            Self::Contains => false,
        }
    }
}

impl fmt::Display for Relation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut signs = SIGNS.iter().rev();
        let sign = signs.find(|(_, relation)| relation == self);
        f.pad(sign.map_or("", |(sign, _)| sign))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_sign_is_read_and_written_again() {
        for (sign, relation) in SIGNS {
            assert_eq!(Relation::at_start(sign), Some((relation, "")));
            let written = relation.to_string();
            assert_eq!(Relation::at_start(&written), Some((relation, "")));
        }
        assert_eq!(Relation::Is.to_string(), "=");
        assert_eq!(Relation::split("a<= 1"), Some(("a", Relation::AtMost, "1")));
        assert_eq!(Relation::split("a 1"), None);
        assert_eq!(Relation::at_start("=>"), Some((Relation::Is, ">")));
    }

    #[test]
    fn a_nan_only_differs() {
        let holding = SIGNS.iter().filter(|(_, one)| one.holds(f64::NAN, 1.0));
        assert!(holding.map(|one| one.1).eq([Relation::IsNot]));
        assert!(Relation::Contains.holds_for_words("D1 D2", "D2"));
    }
}
