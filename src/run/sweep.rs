//! The argument of `--sweep`: one setting at several values, such as `fb.ratio=0.5:0.9:0.05`.

use std::str::FromStr;

use crate::describe::ParamError;
use crate::image::{Degradation, DegradationError};
use crate::params::Params;

/// The most values; more are probably a mistyped step.
const MAX: f64 = 1000.0;

/// A parameter or a step of the degradation, and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    key: String,
    /// The values as text, with the decimals of the first value and the step.
    values: Vec<String>,
}

/// Why a sweep is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The text has another form.
    #[error(
        "`{0}`: KEY=FROM:TO:STEP expected, such as gamma=0.2:1:0.1 or fb.ratio=0.5:0.9:0.05, with FROM at most \
         TO, a STEP above 0 and at most 1000 values"
    )]
    Form(String),
    /// An unknown parameter, or a value out of its range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A strength out of a degradation's range.
    #[error(transparent)]
    Degradation(#[from] DegradationError),
}

impl Sweep {
    /// The parameter as `group.name`, or the step of the degradation.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Its values, in their order.
    pub fn values(&self) -> &[String] {
        &self.values
    }

    /// The unit of the values, empty for a pure number.
    pub fn unit(&self) -> &'static str {
        let steps = Degradation::default().steps();
        let all = steps.into_iter().chain(Params::default().list());
        let row = all.into_iter().find(|row| row.key == self.key);
        row.map_or("", |row| row.about.unit)
    }

    /// The assignment of a parameter; `None` if a degradation is swept.
    pub fn assignment(&self, value: &str) -> Option<String> {
        self.key.contains('.').then(|| format!("{}={value}", self.key))
    }

    /// Sets the step of a degradation to one of the values; nothing if a parameter is swept.
    ///
    /// # Errors
    /// An unknown step, or a strength out of its range; parsing has checked them all.
    pub fn degrade(
        &self,
        value: &str,
        degradation: &mut Degradation,
    ) -> Result<(), DegradationError> {
        match self.assignment(value) {
            Some(_) => Ok(()),
            None => degradation.set(&self.key, value),
        }
    }
}

impl FromStr for Sweep {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let wrong = || SweepError::Form(text.to_owned());
        let (key, range) = text.split_once('=').ok_or_else(wrong)?;
        let parts: Vec<&str> = range.split(':').map(str::trim).collect();
        let [from, to, step] = parts[..] else {
            return Err(wrong());
        };
        let number = |text: &str| {
            let number = text.parse::<f64>().ok();
            number.filter(|number| number.is_finite()).ok_or_else(wrong)
        };
        let (first, last, width) = (number(from)?, number(to)?, number(step)?);
        // 0.5 to 0.9 by 0.05 must include 0.9 in spite of rounding.
        let steps = ((last - first) / width + 1e-9).floor();
        if !(width > 0.0 && (0.0..MAX).contains(&steps)) {
            return Err(wrong());
        }
        let decimals = |text: &str| text.split_once('.').map_or(0, |(_, digits)| digits.len());
        let digits = decimals(from).max(decimals(step));
        let value = |at: usize| format!("{:.digits$}", first + at as f64 * width);
        let sweep =
            Self { key: key.trim().to_owned(), values: (0..=steps as usize).map(value).collect() };
        for value in &sweep.values {
            if let Some(assignment) = sweep.assignment(value) {
                Params::default().assign(&assignment)?;
            }
            sweep.degrade(value, &mut Degradation::default())?;
        }
        Ok(sweep)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_that_a_person_would_write() {
        let values = |text: &str| text.parse::<Sweep>().expect(text).values().join(" ");
        assert_eq!(values("gamma=0.2:1:0.1"), "0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1.0");
        assert_eq!(values("fb.ratio=0.5:0.6:0.05"), "0.50 0.55 0.60");
        assert_eq!(values("noise=0:40:16"), "0 16 32");
        assert_eq!(values("grid.rounds = 1:3:1"), "1 2 3");
        assert_eq!(values("exposure=-1:-1:2"), "-1");
        assert_eq!("blur=0:1:1".parse::<Sweep>().expect("one").unit(), "px");
    }

    #[test]
    fn what_is_no_sweep_is_told_what_was_expected() {
        let said = |text: &str| text.parse::<Sweep>().expect_err(text).to_string();
        for wrong in [
            "gamma",
            "gamma=0.2",
            "gamma=0.2:1",
            "gamma=1:0.2:0.1",
            "gamma=0.2:1:0",
            "gamma=0.2:1:-0.1",
            "gamma=0.2:1:1e-9",
            "gamma=a:1:0.1",
            "gamma=0.2:inf:0.1",
        ] {
            assert!(said(wrong).contains("KEY=FROM:TO:STEP expected"), "{wrong}");
        }
        assert_eq!(said("fb.ratio=0.5:1.2:0.1"), "`fb.ratio` takes 0.1 … 1, not `1.1`");
        assert!(said("gama=0.2:1:0.1").contains("`gama` is not a degradation"));
        assert!(said("fb.ratoi=0.2:1:0.1").contains("did you mean `fb.ratio`"));
        assert!(said("invert=0:1:1").contains("true | false"));
    }
}
