//! For posescope's own crates: may change in any version.
//!
//! How parameters describe themselves: name, unit, range, meaning.
//!
//! `parameters!` declares a struct of parameters, which knows nothing of the other structs; [`crate::params`] puts
//! them together.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use crate::scale::Scale;

/// What a parameter is called, measured in and good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct About {
    /// The name within its group.
    pub name: &'static str,
    /// The unit, empty for a pure number.
    pub unit: &'static str,
    /// The field's doc comment.
    pub doc: &'static str,
}

impl About {
    /// What it is good for: the first paragraph of the doc comment, without its last full stop.
    pub fn help(&self) -> String {
        let lines = self.doc.lines().map(str::trim);
        let paragraph: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
        let text = paragraph.join(" ");
        // A link is only its text here.
        let text = text.replace("[`", "").replace("`]", "");
        text.strip_suffix('.').unwrap_or(&text).to_owned()
    }
}

/// A parameter that takes one of a few names.
pub trait Choice {
    /// All names, in the order in which they are offered.
    fn names(&self) -> &'static [&'static str];
    /// The position of the present one.
    fn index(&self) -> usize;
    /// Chooses the one at `index`, which is below `names().len()`.
    fn choose(&mut self, index: usize);
}

/// A parameter of a struct, and its place there.
pub struct Field<'a> {
    /// Its name, unit and meaning.
    pub about: About,
    /// Its value.
    pub place: Place<'a>,
}

/// The value of a parameter in its struct, and what it accepts.
pub enum Place<'a> {
    /// A real number.
    Number(&'a mut f64, RangeInclusive<f64>),
    /// A whole number.
    Count(&'a mut usize, RangeInclusive<usize>),
    /// An odd number.
    Odd(&'a mut usize, RangeInclusive<usize>),
    /// A switch.
    Flag(&'a mut bool),
    /// One of a few names.
    Choice(&'a mut dyn Choice),
}

/// A struct that describes its parameters.
pub trait Describe {
    /// Each parameter, in a fixed order.
    fn fields(&mut self) -> Vec<Field<'_>>;
}

impl Field<'_> {
    fn described(&self) -> Described {
        let (value, domain) = match &self.place {
            Place::Number(value, range) => (Value::Number(**value), Domain::Number(range.clone())),
            Place::Count(value, range) => (Value::Count(**value), Domain::Count(range.clone())),
            Place::Odd(value, range) => (Value::Count(**value), Domain::Odd(range.clone())),
            Place::Flag(value) => (Value::Flag(**value), Domain::Flag),
            Place::Choice(choice) => {
                let names = choice.names();
                (Value::Choice(names[choice.index()]), Domain::Choice(names))
            }
        };
        Described { key: self.about.name.to_owned(), about: self.about, value, domain }
    }

    /// Scales a length, or what is given per length.
    pub(crate) fn scale(self, scale: Scale) {
        if let Place::Number(value, _) = self.place {
            *value = match self.about.unit {
                "m" => scale.length(*value),
                "°/m" => scale.per_length(*value),
                _ => *value,
            };
        }
    }

    /// Sets the parameter; `None` where the text is no value of it.
    fn set(self, text: &str) -> Option<()> {
        match self.place {
            Place::Number(value, range) => *value = parsed(text).filter(|v| range.contains(v))?,
            Place::Count(value, range) => *value = parsed(text).filter(|v| range.contains(v))?,
            Place::Odd(value, range) => *value = parsed(text).filter(|v| is_odd_in(&range, *v))?,
            Place::Flag(value) => *value = parsed(text)?,
            Place::Choice(choice) => {
                choice.choose(choice.names().iter().position(|name| *name == text)?);
            }
        }
        Some(())
    }
}

fn is_odd_in(range: &RangeInclusive<usize>, value: usize) -> bool {
    range.contains(&value) && value % 2 == 1
}

fn parsed<T: FromStr>(text: &str) -> Option<T> {
    text.parse().ok()
}

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Value {
    /// A real number.
    Number(f64),
    /// A whole number.
    Count(usize),
    /// Yes or no.
    Flag(bool),
    /// One of a few names.
    Choice(&'static str),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Choice(name) => f.write_str(name),
        }
    }
}

/// What a parameter accepts.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Domain {
    /// Real numbers from … to.
    Number(RangeInclusive<f64>),
    /// Whole numbers from … to.
    Count(RangeInclusive<usize>),
    /// Odd numbers from … to.
    Odd(RangeInclusive<usize>),
    /// `true` or `false`.
    Flag,
    /// One of these names.
    Choice(&'static [&'static str]),
}

impl Domain {
    /// Whether a value is one of these. Flags and choices have no other.
    pub(crate) fn accepts(&self, value: Value) -> bool {
        match (self, value) {
            (Self::Number(range), Value::Number(value)) => range.contains(&value),
            (Self::Count(range), Value::Count(value)) => range.contains(&value),
            (Self::Odd(range), Value::Count(value)) => is_odd_in(range, value),
            _ => true,
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(range) => write!(f, "{} … {}", range.start(), range.end()),
            Self::Count(range) => write!(f, "{} … {}", range.start(), range.end()),
            Self::Odd(range) => write!(f, "odd numbers {} … {}", range.start(), range.end()),
            Self::Flag => f.write_str("true | false"),
            Self::Choice(names) => f.write_str(&names.join(" | ")),
        }
    }
}

/// One row of the table of parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Described {
    /// `group.name`; the name alone where a struct is listed by itself.
    pub key: String,
    /// Unit and meaning.
    pub about: About,
    /// The present value.
    pub value: Value,
    /// What values the parameter accepts.
    pub domain: Domain,
}

/// Why a parameter could not be set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParamError {
    /// No parameter has this key.
    #[error("`{key}` is not a parameter{}; `posescope params` lists all", hint(.nearest))]
    Unknown {
        /// The key as given.
        key: String,
        /// The key that resembles it most, if any does.
        nearest: Option<String>,
    },
    /// The value is not of the parameter's kind or outside its range.
    #[error("`{key}` takes {expected}, not `{given}`")]
    BadValue {
        /// The parameter, as `group.name`.
        key: String,
        /// What values the parameter accepts.
        expected: String,
        /// The value that was given.
        given: String,
    },
    /// An assignment without `=`.
    #[error("`{0}` is not an assignment; write for example `fb.ratio=0.7`")]
    NotAnAssignment(String),
    /// The configuration is not TOML, or not made of groups.
    #[error("{0}")]
    Syntax(String),
}

fn hint(nearest: &Option<String>) -> String {
    match nearest {
        Some(key) => format!(" (did you mean `{key}`?)"),
        None => String::new(),
    }
}

/// The parameters of a struct with their present values; keys are their bare names.
pub fn list(params: &mut (impl Describe + ?Sized)) -> Vec<Described> {
    params.fields().iter().map(Field::described).collect()
}

/// Sets a parameter of a struct from text; `None` where there is none of this name.
///
/// # Errors
/// What values the parameter accepts.
pub fn set(
    params: &mut (impl Describe + ?Sized),
    name: &str,
    text: &str,
) -> Option<Result<(), Domain>> {
    let field = params.fields().into_iter().find(|field| field.about.name == name)?;
    let domain = field.described().domain;
    Some(field.set(text).ok_or(domain))
}

/// Declares a struct of parameters together with its [`Default`] and [`Describe`]: each field with its default,
/// kind, key, unit and range. What it means is the first paragraph of its doc comment.
///
/// ```text
/// parameters! {
///     /// How to look.
///     #[derive(Clone, Debug, PartialEq)]
///     pub struct LookParams {
///         /// How far to look.
///         pub reach_m: f64 = 2.5 => number("reach", "m", 0.1..=50.0),
///         /// How often to look.
///         pub rounds: usize = 1 => count("rounds", "", 1..=10),
///         /// Side of the window.
///         pub window_px: usize = 3 => odd("window", "px", 1..=9),
///         /// Whether to look back.
///         pub back: bool = false => flag("back"),
///         /// Where to begin.
///         pub side: Side = Side::Left => choice("side"),
///         /// The parameters of the struct inside.
///         pub glasses: GlassesParams = GlassesParams::default() => group(),
///     }
/// }
/// ```
///
/// A field without a description does not compile, so that none can be lost.
macro_rules! parameters {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $field_visibility:vis $field:ident: $type:ty = $default:expr => $kind:ident $arguments:tt
            ),* $(,)?
        }
    ) => {
        $(#[$attribute])*
        #[non_exhaustive]
        $visibility struct $name {
            $(
                $(#[doc = $doc])*
                #[doc = $crate::describe::parameters!(@doc $kind $arguments)]
                $field_visibility $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $crate::describe::Describe for $name {
            fn fields(&mut self) -> Vec<$crate::describe::Field<'_>> {
                let mut fields = Vec::new();
                $(
                    $crate::describe::parameters!(
                        @add $kind $arguments, fields, &mut self.$field, concat!($($doc, "\n"),*)
                    );
                )*
                fields
            }
        }
    };

    (@doc number $arguments:tt) => { $crate::describe::parameters!(@range $arguments) };
    (@doc count $arguments:tt) => { $crate::describe::parameters!(@range $arguments) };
    (@doc odd $arguments:tt) => {
        concat!($crate::describe::parameters!(@range $arguments), ", odd")
    };
    (@doc $kind:ident $arguments:tt) => { "" };
    (@range ($key:literal, "", $range:expr)) => {
        concat!("\n`", stringify!($range), "`")
    };
    (@range ($key:literal, $unit:literal, $range:expr)) => {
        concat!("\n`", stringify!($range), "` \\[", $unit, "\\]")
    };

    (@add group (), $fields:ident, $place:expr, $doc:expr) => {
        $fields.extend($crate::describe::Describe::fields($place))
    };
    (@add $kind:ident ($key:literal $(, $unit:literal, $range:expr)?),
        $fields:ident, $place:expr, $doc:expr) => {{
        let unit = concat!("" $(, $unit)?);
        let about = $crate::describe::About { name: $key, unit, doc: $doc };
        let place = $crate::describe::parameters!(@place $kind $place $(, $range)?);
        $fields.push($crate::describe::Field { about, place })
    }};
    (@place number $place:expr, $range:expr) => { $crate::describe::Place::Number($place, $range) };
    (@place count $place:expr, $range:expr) => { $crate::describe::Place::Count($place, $range) };
    (@place odd $place:expr, $range:expr) => { $crate::describe::Place::Odd($place, $range) };
    (@place flag $place:expr) => { $crate::describe::Place::Flag($place) };
    (@place choice $place:expr) => { $crate::describe::Place::Choice($place) };
}
pub(crate) use parameters;

/// Gives the variants of an enum without fields the names by which a parameter chooses them.
macro_rules! choice {
    ($type:ident: $($variant:ident = $name:literal),+ $(,)?) => {
        impl $crate::describe::Choice for $type {
            fn names(&self) -> &'static [&'static str] {
                &[$($name),+]
            }
            fn index(&self) -> usize {
                match self {
                    $(Self::$variant => Self::$variant as usize),+
                }
            }
            fn choose(&mut self, index: usize) {
                *self = [$(Self::$variant),+][index];
            }
        }
    };
}
pub(crate) use choice;

#[cfg(test)]
mod tests {
    use super::*;

    choice!(Side: Left = "left", Right = "right");

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Side {
        Left,
        Right,
    }

    parameters! {
        /// What is inside.
        struct Inner {
            /// A number of times,
            /// at most.
            ///
            /// This is nobody's business.
            rounds: usize = 3 => count("rounds", "", 1..=10),
        }
    }

    parameters! {
        /// One of each kind.
        struct All {
            /// How far, as in [`std`].
            reach_m: f64 = 1.5 => number("reach", "m", 0.5..=2.0),
            /// Whether at all.
            is_on: bool = true => flag("on"),
            /// Inside.
            inner: Inner = Inner::default() => group(),
            /// Which side.
            side: Side = Side::Right => choice("side"),
            /// How wide.
            window_px: usize = 3 => odd("window", "px", 1..=9),
        }
    }

    #[test]
    fn every_field_is_shown_in_order_with_the_first_paragraph_of_its_doc_comment() {
        let mut all = All::default();
        let shown: Vec<String> = list(&mut all)
            .into_iter()
            .map(|Described { about, value, domain, .. }| {
                format!("{} [{}] {}: {value} in {domain}", about.name, about.unit, about.help())
            })
            .collect();
        let expected = [
            "reach [m] How far, as in std: 1.5 in 0.5 … 2",
            "on [] Whether at all: true in true | false",
            "rounds [] A number of times, at most: 3 in 1 … 10",
            "side [] Which side: right in left | right",
            "window [px] How wide: 3 in odd numbers 1 … 9",
        ];
        assert_eq!(shown, expected);
        assert_eq!(set(&mut all, "side", "left"), Some(Ok(())));
        assert_eq!(set(&mut all, "rounds", "11"), Some(Err(Domain::Count(1..=10))));
        assert_eq!(set(&mut all, "window", "5"), Some(Ok(())));
        for wrong in ["4", "11", "-1"] {
            assert_eq!(set(&mut all, "window", wrong), Some(Err(Domain::Odd(1..=9))));
        }
        assert_eq!(set(&mut all, "turns", "1"), None);
        assert_eq!((all.side, all.inner.rounds, all.window_px), (Side::Left, 3, 5));
    }
}
