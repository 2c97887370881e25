//! Triage: selects and sorts the results of a run.

mod condition;
mod field;

pub use condition::{Condition, ConditionError};
#[cfg(feature = "app")]
pub(crate) use field::is_equal;
pub use field::{Field, Value};

use crate::localize::QueryResult;
use crate::text::UnknownWord;

/// The sort order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// The field.
    pub field: &'static Field,
    /// Whether the greatest value comes first.
    pub descending: bool,
}

impl std::str::FromStr for Order {
    type Err = UnknownWord;

    /// `error`, or `-error` for the greatest first.
    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        let name = text.strip_prefix('-').unwrap_or(text);
        Ok(Self { field: Field::find(name)?, descending: name != text })
    }
}

/// The positions of the results that meet a condition, sorted if an order is given. Missing values come last.
pub fn select(
    results: &[&QueryResult],
    condition: Option<&Condition>,
    order: Option<Order>,
) -> Vec<usize> {
    let is_met = |result: &QueryResult| condition.is_none_or(|one| one.is_met(result));
    let mut chosen: Vec<usize> =
        (0..results.len()).filter(|&index| is_met(results[index])).collect();
    if let Some(order) = order {
        let mut keyed: Vec<(Value, usize)> =
            chosen.into_iter().map(|index| (order.field.of(results[index]), index)).collect();
        keyed.sort_by(|(a, _), (b, _)| a.compare(b, order.descending));
        chosen = keyed.into_iter().map(|(_, index)| index).collect();
    }
    chosen
}
