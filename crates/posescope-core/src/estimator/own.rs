//! What estimators have in common that are neither a registered cost with a search nor a hybrid.

use super::Estimator;
use crate::cost;
use crate::params::Params;

/// An estimator that makes itself.
#[derive(Clone, Copy, Debug)]
pub struct Own {
    /// The estimator with these parameters.
    pub make: fn(&Params) -> Box<dyn Estimator>,
    /// The registered cost by which its views of the query are explained, if it draws any.
    pub shows: Option<&'static str>,
    /// Whether it matches features and tells so.
    pub has_features: bool,
    /// The least probability of being within 1 m with which its pose is accepted, if it asks for one.
    pub least_probability: fn(&Params) -> Option<f64>,
}

impl Own {
    /// The registered cost by which its views are explained.
    pub fn cost(&self) -> Option<&'static cost::Entry> {
        let name = self.shows?;
        cost::ALL.iter().find(|entry| entry.name == name)
    }
}
