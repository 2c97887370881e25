//! A cost's place in the registry.

use std::fmt;

use super::{Cost, ExplanationKind};
use crate::describe::{Describe, choice};

/// How a direct method finds the pose of least cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchRule {
    /// It scans a coarse-to-fine grid, as the paper does.
    #[default]
    Grid,
    /// It refines many minima of a coarse grid in six freedoms, as `mi6` does.
    Starts,
    /// It goes down from the reference pose by derivatives, as the methods do that the paper takes its
    /// costs from.
    Descent,
}

choice!(SearchRule: Grid = "grid", Starts = "starts", Descent = "descent");

/// A cost whose parameters describe themselves.
pub trait RegisteredCost: Cost + Describe + fmt::Debug {
    /// The same cost once more.
    fn boxed(&self) -> Box<dyn RegisteredCost>;
}

impl<C: Cost + Describe + Clone + fmt::Debug + 'static> RegisteredCost for C {
    fn boxed(&self) -> Box<dyn RegisteredCost> {
        Box::new(self.clone())
    }
}

/// What two images share, as a number 0 … 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Similarity {
    /// Its abbreviation: `NMI`.
    pub name: &'static str,
    /// What it is, in entropies H and mutual information I of query Q and synthetic view S.
    pub formula: &'static str,
}

/// A cost's place in the registry.
#[derive(Debug)]
pub struct Entry {
    /// The name of the method that searches the pose of least cost, and of the parameters' group.
    pub name: &'static str,
    /// One phrase.
    pub about: &'static str,
    /// What a value of its channel is: `grey value`.
    pub sees: &'static str,
    /// Whether it can be descended too: then how it is searched is a parameter, `search`.
    pub is_smooth: bool,
    /// What the cost is one minus of, where it is made of a joint histogram.
    pub similarity: Option<Similarity>,
    /// The cost with its default parameters.
    pub make: fn() -> Box<dyn RegisteredCost>,
}

impl Entry {
    /// How it explains itself, if it does.
    pub fn explains(&self) -> Option<ExplanationKind> {
        (self.make)().statistic().explains()
    }
}
