//! The registered costs with their parameters.

use super::entry::{Entry, RegisteredCost, SearchRule};
use super::{ALL, key};
use crate::describe::{About, Describe, Field};

/// A registered cost with its parameters, and how it is searched.
#[derive(Debug)]
pub struct CostSetting {
    /// The cost.
    pub cost: Box<dyn RegisteredCost>,
    /// How its minimum is found.
    pub search: SearchRule,
    is_smooth: bool,
}

impl CostSetting {
    /// The default setting of a cost.
    pub fn new(entry: &Entry) -> Self {
        let search = SearchRule::default();
        Self { cost: (entry.make)(), search, is_smooth: entry.is_smooth }
    }
}

impl Describe for CostSetting {
    fn fields(&mut self) -> Vec<Field<'_>> {
        let mut fields = self.cost.fields();
        if self.is_smooth {
            let doc = "How the pose of least cost is found: over the grid, from many starts, or from the reference \
                       pose downhill.";
            let about = About { name: "search", unit: "", doc };
            fields.push(Field::choice(about, &mut self.search));
        }
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

    /// The setting of a registered cost.
    pub fn of(&self, entry: &Entry) -> Option<&CostSetting> {
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
