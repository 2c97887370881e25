//! How queries are localised, whichever they are.

use serde::{Deserialize, Serialize};

use crate::fusion::Fusion;
use crate::localize::Selection;
use crate::method::Method;

/// The protocol of a localisation: what is the same for every query, scene and radius. The defaults
/// of everything in it are here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Protocol {
    /// How references are chosen.
    pub references: Selection,
    /// How far from the query's known position references may be \[m\]; without it, as far as the
    /// uncertainty radius. See [`Self::reach_m`].
    pub prior_m: Option<f64>,
    /// The methods, in the order of their results.
    pub methods: Vec<Method>,
    /// What to make of several references: one pose by each of these, or without any a pose for each
    /// reference.
    pub fusions: Vec<Fusion>,
    /// Seed of every random choice.
    pub seed: u64,
}

/// One random reference, the methods of the paper.
impl Default for Protocol {
    fn default() -> Self {
        Self {
            references: Selection::Random(1),
            prior_m: None,
            methods: Method::PAPER.to_vec(),
            fusions: Vec::new(),
            seed: 0,
        }
    }
}

impl Protocol {
    /// The uncertainty radius where none is given \[m\].
    pub const RADIUS_M: f64 = 15.0;

    /// How far from a query's known position its references may be \[m\], with this uncertainty
    /// radius \[m\].
    pub fn reach_m(&self, radius_m: f64) -> f64 {
        self.prior_m.unwrap_or(radius_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_reach_as_far_as_the_prior_and_without_one_as_the_radius() {
        let mut protocol = Protocol::default();
        assert_eq!(protocol.reach_m(Protocol::RADIUS_M), 15.0);
        protocol.prior_m = Some(200.0);
        assert_eq!(protocol.reach_m(Protocol::RADIUS_M), 200.0);
    }
}
