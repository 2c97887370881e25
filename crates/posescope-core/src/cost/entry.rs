//! A cost's place in the registry, and the registered costs with their parameters.

use std::fmt;

use super::{ALL, Cost, ExplanationKind};
use crate::describe::{About, Choice as _, Describe, Field, Place, choice};
use crate::memo::key;

/// How a direct method finds the pose of least cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchRule {
    /// It scans a coarse-to-fine grid, as the paper does.
    #[default]
    Grid,
    /// It refines many minima of a coarse grid in six freedoms, as `mi6` does.
    MultiStart,
    /// It goes down from the reference pose by derivatives, as the methods do that the paper takes its
    /// costs from.
    Descent,
}

choice!(SearchRule: Grid = "grid", MultiStart = "starts", Descent = "descent");

impl SearchRule {
    /// The word that sets it.
    pub fn name(self) -> &'static str {
        self.names()[self.index()]
    }
}

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
pub struct CostEntry {
    /// The name of the method that searches the pose of least cost, and of the parameters' group.
    pub name: &'static str,
    /// One phrase.
    pub about: &'static str,
    /// What a value of its channel is: `grey value`.
    pub sees: &'static str,
    /// What the cost is one minus of, where it is made of a joint histogram.
    pub similarity: Option<Similarity>,
    /// The cost with its default parameters.
    pub make: fn() -> Box<dyn RegisteredCost>,
}

impl CostEntry {
    /// How it explains itself, if it does.
    pub fn explains(&self) -> Option<ExplanationKind> {
        (self.make)().statistic().explains()
    }
}

/// A registered cost with its parameters, and how it is searched.
#[derive(Debug)]
pub struct CostSetting {
    /// The cost.
    pub cost: Box<dyn RegisteredCost>,
    /// How its minimum is found.
    pub search: SearchRule,
}

impl CostSetting {
    /// The default setting of a cost.
    pub fn new(entry: &CostEntry) -> Self {
        Self { cost: (entry.make)(), search: SearchRule::default() }
    }
}

impl Describe for CostSetting {
    fn fields(&mut self) -> Vec<Field<'_>> {
        let mut fields = self.cost.fields();
        let doc = "How the pose of least cost is found: over the grid, from many starts, or from the reference \
                   pose downhill.";
        let about = About { name: "search", unit: "", doc };
        fields.push(Field { about, place: Place::Choice(&mut self.search) });
        fields
    }
}

impl Clone for CostSetting {
    fn clone(&self) -> Self {
        Self { cost: self.cost.boxed(), ..*self }
    }
}

/// The setting of every cost, in the order of [`ALL`].
#[derive(Clone, Debug)]
pub struct CostSettings(Vec<CostSetting>);

impl CostSettings {
    /// Names of the groups, with their parameters.
    pub fn groups(&mut self) -> impl Iterator<Item = (&'static str, &mut dyn Describe)> {
        let settings = self.0.iter_mut().map(|setting| setting as &mut dyn Describe);
        ALL.iter().map(|entry| entry.name).zip(settings)
    }

    /// How the minimum of a registered cost is found.
    pub fn search(&self, entry: &CostEntry) -> SearchRule {
        self.of(entry).map_or_else(SearchRule::default, |setting| setting.search)
    }

    /// The setting of a registered cost.
    pub fn of(&self, entry: &CostEntry) -> Option<&CostSetting> {
        let place = ALL.iter().position(|known| known.name == entry.name)?;
        self.0.get(place)
    }
}

impl Default for CostSettings {
    fn default() -> Self {
        Self(ALL.iter().map(CostSetting::new).collect())
    }
}

impl PartialEq for CostSettings {
    fn eq(&self, other: &Self) -> bool {
        key(&self.0) == key(&other.0)
    }
}
