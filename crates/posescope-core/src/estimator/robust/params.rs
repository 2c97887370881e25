//! Parameters of `robust`.

use crate::describe::parameters;

parameters! {
    /// Parameters of the decision between the poses of several methods.
    #[derive(Clone, Debug, PartialEq)]
    pub struct RobustParams {
        /// How far below the costs of the coarse positions the answer's cost must be, in robust standard
        /// deviations of those costs; 0 answers always, as the direct methods do.
        pub deviations: f64 = 0.0 => number("deviations", "", 0.0..=100.0),
        /// What the pose of features that agree beyond chance is worth, in the same standard deviations:
        /// it is taken where it costs at most so much more than the search's.
        pub credit: f64 = 3.0 => number("credit", "", 0.0..=100.0),
        /// The least probability of being right with which the answer is accepted; 0 answers always.
        pub least_probability: f64 = 0.0 => number("least_probability", "", 0.0..=1.0),
    }
}
