//! Parsers of the options of a protocol.

use crate::describe::Domain;
use crate::estimator;
use crate::image::Degradation;
use crate::method::Method;
use crate::text::UnknownWord;

/// Our own method, or a name for another system.
///
/// # Errors
/// The text is no possible name.
pub fn method(name: &str) -> Result<Method, String> {
    Method::called(name).map_err(|_| {
        let known = estimator::methods().map(Method::name);
        let error = UnknownWord::among(name, "method", known);
        format!("{error}, or a name defined by --estimates")
    })
}

/// A number above 0.
///
/// # Errors
/// Any other text.
pub fn positive(text: &str) -> Result<f64, String> {
    number_up_to(text, f64::MAX).ok_or_else(|| "a positive number expected".to_owned())
}

/// A probability above 0.
///
/// # Errors
/// Any other text.
pub fn probability(text: &str) -> Result<f64, String> {
    number_up_to(text, 1.0).ok_or_else(|| "a number above 0 and up to 1 expected".to_owned())
}

fn number_up_to(text: &str, most: f64) -> Option<f64> {
    text.parse().ok().filter(|number| *number > 0.0 && *number <= most)
}

/// The help of `--degrade`: every step with its range.
pub fn degradations() -> String {
    let mut text = "Degrade the query photos first, for example gamma=0.4,noise=8,invert. References stay \
                    unchanged. The steps are applied in this order, whatever the order of the names:"
        .to_owned();
    for step in Degradation::default().steps() {
        let range = match step.domain {
            Domain::Flag => String::new(),
            domain => format!("={domain}"),
        };
        let unit = match step.about.unit {
            "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        text += &format!("\n- {}{range}{unit}: {}", step.key, step.about.help());
    }
    text
}
