//! How parameters describe themselves: name, unit, range, meaning.
//!
//! A struct of parameters shows its fields to a [`ParamVisitor`] and knows nothing of the other
//! structs; [`crate::params`] puts them together.

use std::fmt;
use std::ops::RangeInclusive;

/// What a parameter is called, measured in and good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct About {
    /// The name within its group.
    pub name: &'static str,
    /// The unit, empty for a pure number.
    pub unit: &'static str,
    /// One phrase.
    pub help: &'static str,
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
    /// A real number.
    fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>);
    /// A whole number.
    fn count(&mut self, about: About, value: &mut usize, range: RangeInclusive<usize>);
    /// Yes or no.
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
    /// `group.name`.
    pub key: String,
    /// Unit and meaning.
    pub about: About,
    /// The present value.
    pub value: Value,
    /// What it accepts.
    pub domain: Domain,
}

/// Why a parameter could not be set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParamError {
    /// No parameter has this key.
    #[error("there is no parameter `{key}`{}; `posescope params` lists all", hint(.nearest))]
    Unknown {
        /// The key as given.
        key: String,
        /// The key that resembles it most, if any does.
        nearest: Option<String>,
    },
    /// The value is not of the parameter's kind or outside its range.
    #[error("`{key}` takes {expected}, not `{given}`")]
    BadValue {
        /// The parameter.
        key: String,
        /// What it accepts.
        expected: String,
        /// What was given.
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
