//! Units of the times in files.

/// A unit of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeUnit {
    Second,
    Millisecond,
    Microsecond,
    Nanosecond,
}

impl TimeUnit {
    pub const ALL: [Self; 4] =
        [Self::Second, Self::Millisecond, Self::Microsecond, Self::Nanosecond];

    /// The unit of a time since 1970, by its size: 10¹¹ s is after the year 5000.
    pub fn of_epoch(time: f64) -> Self {
        match time.abs() {
            size if size >= 1e17 => Self::Nanosecond,
            size if size >= 1e14 => Self::Microsecond,
            size if size >= 1e11 => Self::Millisecond,
            _ => Self::Second,
        }
    }

    /// A time of this unit \[s\].
    pub fn seconds(self, time: f64) -> f64 {
        match self {
            Self::Second => time,
            Self::Millisecond => time / 1e3,
            Self::Microsecond => time / 1e6,
            Self::Nanosecond => time / 1e9,
        }
    }

    pub fn symbol(self) -> &'static str {
        match self {
            Self::Second => "s",
            Self::Millisecond => "ms",
            Self::Microsecond => "us",
            Self::Nanosecond => "ns",
        }
    }
}

/// The time that a name states \[s\]. Names are often in nanoseconds since 1970.
pub(super) fn time_of_name(name: &str) -> Option<f64> {
    let time: f64 = name.parse().ok()?;
    time.is_finite().then(|| TimeUnit::of_epoch(time).seconds(time))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_in_any_unit_is_the_same_time() {
        for name in ["1403636579.75", "1403636579750", "1403636579750000", "1403636579750000000"] {
            let time = time_of_name(name).expect("a time");
            assert!((time - 1_403_636_579.75).abs() < 1e-6, "{name}: {time}");
        }
        assert_eq!(time_of_name("0.5"), Some(0.5));
        assert_eq!(time_of_name("12"), Some(12.0));
        assert_eq!(time_of_name("nan"), None);
        assert_eq!(time_of_name("left"), None);
    }
}
