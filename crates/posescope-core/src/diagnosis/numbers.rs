//! Numbers in sentences.

use crate::geometry::PoseError;

/// Two numbers to compare: three significant digits, and more where those are equal and the numbers are not. The second
/// says so where they are equal in six.
pub(super) fn pair(a: f64, b: f64) -> (String, String) {
    let texts = |digits| (with_digits(a, digits), with_digits(b, digits));
    (3..=6).map(texts).find(|(a, b)| a != b).unwrap_or_else(|| {
        let (a, b) = texts(3);
        (a, format!("{b} (the same)"))
    })
}

/// A distance with two decimals below 10 m and one above.
pub(super) fn metres(value: f64) -> String {
    let decimals = if value.abs() < 9.995 { 2 } else { 1 };
    format!("{value:.decimals$} m")
}

/// How far a pose is off: in metres, and in degrees where it is turned by more than most tolerances allow.
pub(super) fn distance(error: &PoseError) -> String {
    const TURNED_DEG: f64 = 5.0;
    let off = metres(error.translation_m);
    if error.rotation_deg > TURNED_DEG {
        format!("{off} and {:.1}°", error.rotation_deg)
    } else {
        off
    }
}

/// A place in a ranking: 1st, 2nd, 3rd, 4th, 11th.
pub(super) fn ordinal(rank: usize) -> String {
    let suffix = match (rank % 10, rank % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{rank}{suffix}")
}

pub(super) fn with_digits(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let before_the_point = value.abs().log10().floor() as i32 + 1;
    let decimals = (digits as i32 - before_the_point).clamp(0, 9) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_more_where_those_are_equal() {
        let digits = |value| with_digits(value, 3);
        assert_eq!([0.91456, 7.2148, 32.06, 1234.5].map(digits), ["0.915", "7.21", "32.1", "1234"]);
        assert_eq!([0.0, 0.000123].map(digits), ["0", "0.000123"]);
        let texts = |a, b| {
            let (a, b) = pair(a, b);
            format!("{a} {b}")
        };
        assert_eq!(texts(0.9146, 0.9270), "0.915 0.927");
        assert_eq!(texts(0.72141, 0.72144), "0.72141 0.72144");
        assert_eq!(texts(0.5, 0.5), "0.500 0.500 (the same)");
        assert_eq!(texts(0.5, 0.500_000_01), "0.500 0.500 (the same)");
    }

    #[test]
    fn ranks_are_written_as_people_say_them() {
        assert_eq!(
            [1, 2, 3, 4, 11, 12, 13, 21, 112].map(ordinal),
            ["1st", "2nd", "3rd", "4th", "11th", "12th", "13th", "21st", "112th"]
        );
    }
}
