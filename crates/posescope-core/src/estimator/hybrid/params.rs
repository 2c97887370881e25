//! Parameters of HY.

use crate::describe::parameters;

parameters! {
    /// Parameters of the fusion of a hybrid's poses.
    #[derive(Clone, Debug, PartialEq)]
    pub struct HybridParams {
        /// Whether each reference falls back to MI for itself when several are fused; otherwise MI's poses count only
        /// where no weighted reference has a pose of FB.
        pub per_reference: bool = false => flag("per_reference"),
    }
}
