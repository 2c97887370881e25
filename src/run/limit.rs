//! The argument of `--limit`: how many queries a run has.

use std::fmt;
use std::str::FromStr;

/// `40`, or `10%` of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At most this many queries. All other frames, drawn ones too, may be their references.
    Count(usize),
    /// This share of the frames in percent, above 0 and up to 100. Drawn frames are not used as references.
    Percent(f64),
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let limit = match text.strip_suffix('%') {
            Some(percent) => percent
                .parse()
                .ok()
                .filter(|percent: &f64| *percent > 0.0 && *percent <= 100.0)
                .map(Self::Percent),
            None => text.parse().ok().filter(|count| *count > 0).map(Self::Count),
        };
        limit.ok_or_else(|| "a number of queries or a percentage such as 10% expected".to_owned())
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => count.fmt(f),
            Self::Percent(percent) => write!(f, "{percent}%"),
        }
    }
}

posescope_core::serde_as_text!(Limit);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_number_or_a_percentage() {
        assert_eq!("40".parse(), Ok(Limit::Count(40)));
        assert_eq!("2.5%".parse(), Ok(Limit::Percent(2.5)));
        assert_eq!(Limit::Percent(10.0).to_string(), "10%");
        for wrong in ["0", "0%", "101%", "-3", "a", "", "0.1"] {
            assert!(wrong.parse::<Limit>().is_err(), "{wrong}");
        }
    }
}
