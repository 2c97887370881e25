//! How parameters describe themselves: name, unit, range, meaning.
//!
//! A struct of parameters is declared by `parameters!`, shows its fields to a [`ParamVisitor`] and
//! knows nothing of the other structs; [`crate::params`] puts them together.

use std::fmt;
use std::ops::RangeInclusive;

/// What a parameter is called, measured in and good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Something that walks over parameters: a list, a setter, a panel of sliders.
pub trait ParamVisitor {
    /// Visits a real number.
    fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>);
    /// Visits a whole number.
    fn count(&mut self, about: About, value: &mut usize, range: RangeInclusive<usize>);
    /// Visits a switch.
    fn flag(&mut self, about: About, value: &mut bool);
    /// One of a few names.
    fn choice(&mut self, about: About, value: &mut dyn Choice);
}

/// A struct that shows its parameters to a visitor, in a fixed order.
pub trait Describe {
    /// Shows each parameter once.
    fn visit(&mut self, visitor: &mut dyn ParamVisitor);
}

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
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
pub enum Domain {
    /// Real numbers from … to.
    Number(RangeInclusive<f64>),
    /// Whole numbers from … to.
    Count(RangeInclusive<usize>),
    /// `true` or `false`.
    Flag,
    /// One of these names.
    Choice(&'static [&'static str]),
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(range) => write!(f, "{} … {}", range.start(), range.end()),
            Self::Count(range) => write!(f, "{} … {}", range.start(), range.end()),
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
    let mut lister = ListVisitor::default();
    params.visit(&mut lister);
    lister.rows
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
    let mut setter = SetVisitor { name, text, outcome: None };
    params.visit(&mut setter);
    setter.outcome
}

#[derive(Default)]
struct ListVisitor {
    rows: Vec<Described>,
}

impl ListVisitor {
    fn push(&mut self, about: About, value: Value, domain: Domain) {
        self.rows.push(Described { key: about.name.to_owned(), about, value, domain });
    }
}

impl ParamVisitor for ListVisitor {
    fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>) {
        self.push(about, Value::Number(*value), Domain::Number(range));
    }
    fn count(&mut self, about: About, value: &mut usize, range: RangeInclusive<usize>) {
        self.push(about, Value::Count(*value), Domain::Count(range));
    }
    fn flag(&mut self, about: About, value: &mut bool) {
        self.push(about, Value::Flag(*value), Domain::Flag);
    }
    fn choice(&mut self, about: About, value: &mut dyn Choice) {
        let names = value.names();
        self.push(about, Value::Choice(names[value.index()]), Domain::Choice(names));
    }
}

/// Sets the parameter `name` of the struct it is shown.
struct SetVisitor<'a> {
    name: &'a str,
    text: &'a str,
    outcome: Option<Result<(), Domain>>,
}

impl SetVisitor<'_> {
    fn set<T>(&mut self, about: About, parsed: Option<T>, domain: Domain, place: &mut T) {
        if about.name == self.name {
            self.outcome = Some(match parsed {
                Some(value) => {
                    *place = value;
                    Ok(())
                }
                None => Err(domain),
            });
        }
    }
}

impl ParamVisitor for SetVisitor<'_> {
    fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>) {
        let parsed = self.text.parse().ok().filter(|v| range.contains(v));
        self.set(about, parsed, Domain::Number(range), value);
    }
    fn count(&mut self, about: About, value: &mut usize, range: RangeInclusive<usize>) {
        let parsed = self.text.parse().ok().filter(|v| range.contains(v));
        self.set(about, parsed, Domain::Count(range), value);
    }
    fn flag(&mut self, about: About, value: &mut bool) {
        self.set(about, self.text.parse().ok(), Domain::Flag, value);
    }
    fn choice(&mut self, about: About, value: &mut dyn Choice) {
        let names = value.names();
        let mut index = value.index();
        let parsed = names.iter().position(|name| *name == self.text);
        self.set(about, parsed, Domain::Choice(names), &mut index);
        value.choose(index);
    }
}

/// Declares a struct of parameters together with its [`Describe`]: each field with its kind, key,
/// unit and range. What it means is the first paragraph of its doc comment.
///
/// ```text
/// parameters! {
///     /// How to look.
///     #[derive(Clone, Debug, PartialEq)]
///     pub struct LookParams {
///         /// How far to look.
///         pub reach_m: f64 = number("reach", "m", 0.1..=50.0),
///         /// How often to look.
///         pub rounds: usize = count("rounds", "", 1..=10),
///         /// Whether to look back.
///         pub back: bool = flag("back"),
///         /// Where to begin.
///         pub side: Side = choice("side"),
///         /// What the struct inside says of itself.
///         pub glasses: GlassesParams = group(),
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
                $field_visibility:vis $field:ident: $type:ty = $kind:ident $arguments:tt
            ),* $(,)?
        }
    ) => {
        $(#[$attribute])*
        $visibility struct $name {
            $(
                $(#[doc = $doc])*
                #[doc = $crate::describe::parameters!(@doc $kind $arguments)]
                $field_visibility $field: $type,
            )*
        }

        impl $crate::describe::Describe for $name {
            fn visit(&mut self, visitor: &mut dyn $crate::describe::ParamVisitor) {
                $(
                    $crate::describe::parameters!(
                        @show $kind $arguments, visitor, &mut self.$field, concat!($($doc, "\n"),*)
                    );
                )*
            }
        }
    };

    (@doc number $arguments:tt) => { $crate::describe::parameters!(@range $arguments) };
    (@doc count $arguments:tt) => { $crate::describe::parameters!(@range $arguments) };
    (@doc $kind:ident $arguments:tt) => { "" };
    (@range ($key:literal, "", $range:expr)) => {
        concat!("\n`", stringify!($range), "`")
    };
    (@range ($key:literal, $unit:literal, $range:expr)) => {
        concat!("\n`", stringify!($range), "` \\[", $unit, "\\]")
    };

    (@show group (), $visitor:ident, $place:expr, $doc:expr) => {
        $crate::describe::Describe::visit($place, $visitor)
    };
    (@show $kind:ident ($key:literal), $visitor:ident, $place:expr, $doc:expr) => {
        $visitor.$kind($crate::describe::About { name: $key, unit: "", doc: $doc }, $place)
    };
    (@show $kind:ident ($key:literal, $unit:literal, $range:expr),
        $visitor:ident, $place:expr, $doc:expr) => {
        $visitor.$kind(
            $crate::describe::About { name: $key, unit: $unit, doc: $doc },
            $place,
            $range,
        )
    };
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
            rounds: usize = count("rounds", "", 1..=10),
        }
    }

    parameters! {
        /// One of each kind.
        struct All {
            /// How far, as in [`std`].
            reach_m: f64 = number("reach", "m", 0.5..=2.0),
            /// Whether at all.
            is_on: bool = flag("on"),
            /// Inside.
            inner: Inner = group(),
            /// Which side.
            side: Side = choice("side"),
        }
    }

    /// Writes down what it is shown.
    #[derive(Default)]
    struct RecordingVisitor(Vec<String>);

    impl RecordingVisitor {
        fn write(&mut self, about: About, rest: &str) {
            let About { name, unit, .. } = about;
            self.0.push(format!("{name} [{unit}] {}: {rest}", about.help()));
        }
    }

    impl ParamVisitor for RecordingVisitor {
        fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>) {
            self.write(about, &format!("{value} in {range:?}"));
        }
        fn count(&mut self, about: About, value: &mut usize, range: RangeInclusive<usize>) {
            self.write(about, &format!("{value} in {range:?}"));
        }
        fn flag(&mut self, about: About, value: &mut bool) {
            self.write(about, &format!("{value}"));
        }
        fn choice(&mut self, about: About, value: &mut dyn Choice) {
            let chosen = value.names()[value.index()];
            value.choose(0);
            self.write(about, &format!("{chosen} of {:?}", value.names()));
        }
    }

    #[test]
    fn every_field_is_shown_in_order_with_the_first_paragraph_of_its_doc_comment() {
        let mut all =
            All { reach_m: 1.5, is_on: true, inner: Inner { rounds: 3 }, side: Side::Right };
        let mut visitor = RecordingVisitor::default();
        all.visit(&mut visitor);
        let shown = [
            "reach [m] How far, as in std: 1.5 in 0.5..=2.0",
            "on [] Whether at all: true",
            "rounds [] A number of times, at most: 3 in 1..=10",
            "side [] Which side: right of [\"left\", \"right\"]",
        ];
        assert_eq!(visitor.0, shown);
        assert_eq!(all.side, Side::Left);
    }
}
