//! When a pose is right.

use std::fmt;
use std::str::FromStr;

use crate::geometry::PoseError;
use crate::scale::Scale;
use crate::text::UnknownWord;

/// How far a pose may be from the truth and still be right.
///
/// That is not the paper's success, which is a pose within the failure radius: chance alone lies
/// within a disc of 10 m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Distance of the camera centres \[m\].
    pub translation_m: f64,
    /// Geodesic angle \[°\].
    pub rotation_deg: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { translation_m: 1.0, rotation_deg: 5.0 }
    }
}

impl Tolerance {
    /// The tolerance that stands for this one at another scale. Angles are the same at all.
    #[must_use]
    pub fn at(self, scale: Scale) -> Self {
        Self { translation_m: scale.length(self.translation_m), ..self }
    }

    /// Whether an error is within. One that is no number is not.
    pub fn contains(&self, error: &PoseError) -> bool {
        error.translation_m <= self.translation_m && error.rotation_deg <= self.rotation_deg
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}m,{}deg", self.translation_m, self.rotation_deg)
    }
}

impl FromStr for Tolerance {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        let number = |text: &str| -> Option<f64> {
            let number: f64 = text.trim().parse().ok()?;
            (number.is_finite() && number > 0.0).then_some(number)
        };
        text.split_once(',')
            .and_then(|(metres, degrees)| {
                // A scene without metric scale has lengths without a unit.
                let metres = metres.trim();
                Some(Self {
                    translation_m: number(metres.strip_suffix('m').unwrap_or(metres))?,
                    rotation_deg: number(degrees.trim().strip_suffix("deg")?)?,
                })
            })
            .ok_or_else(|| UnknownWord {
                found: text.to_owned(),
                kind: "tolerance",
                expected: "metres and degrees above 0, such as 1m,5deg,".to_owned(),
            })
    }
}

crate::serde_as_text!(Tolerance);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tolerance_is_read_back_and_what_is_none_is_refused() {
        let tolerance = Tolerance { translation_m: 0.25, rotation_deg: 2.0 };
        assert_eq!(tolerance.to_string(), "0.25m,2deg");
        for same in ["0.25m, 2deg", "0.25,2deg"] {
            assert_eq!(same.parse(), Ok(tolerance));
        }
        for text in ["1m", "1,5", "0m,5deg", "1m,-5deg", "nanm,5deg", ""] {
            assert!(text.parse::<Tolerance>().is_err(), "{text}");
        }
    }

    #[test]
    fn right_is_near_in_both_and_no_number_is_not_near() {
        let error = |translation_m, rotation_deg| PoseError {
            translation_m,
            rotation_deg,
            max_euler_deg: rotation_deg,
        };
        let tolerance = Tolerance::default();
        assert!(tolerance.contains(&error(1.0, 5.0)));
        assert!(!tolerance.contains(&error(1.1, 0.0)));
        assert!(!tolerance.contains(&error(0.0, 5.1)));
        assert!(!tolerance.contains(&error(f64::NAN, 0.0)));
    }
}
