//! Parameters of `mi6`.

use crate::describe::parameters;

parameters! {
    /// Parameters of the search in six freedoms. Coarse positions and the coverage floor are those of
    /// the grid.
    #[derive(Clone, Debug, PartialEq)]
    pub struct SixParams {
        /// Coarse lattices, each at a yaw of its own.
        pub yaws: usize = count("yaws", "", 1..=61),
        /// Yaw between neighbouring coarse lattices.
        pub yaw_step_deg: f64 = number("yaw_step", "°", 0.1..=45.0),
        /// Coarse minima that are refined in right, forward and yaw.
        pub starts: usize = count("starts", "", 1..=200),
        /// The best of those, which are refined in all six freedoms.
        pub finalists: usize = count("finalists", "", 1..=100),
        /// First step of the refinement in right, forward and yaw.
        pub first_step_m: f64 = number("first_step", "m", 0.01..=5.0),
        /// First step of the refinement in six freedoms.
        pub six_step_m: f64 = number("six_step", "m", 0.001..=2.0),
        /// Steps below this are the last.
        pub last_step_m: f64 = number("last_step", "m", 0.0005..=0.5),
        /// Turn that goes with a step of one metre: what moves a view by as much.
        pub deg_per_m: f64 = number("deg_per_m", "°", 0.1..=20.0),
        /// How many times smaller photos are for the coarse level, whose minima are finalists beside those
        /// of the fine one; 1 leaves it out.
        pub coarse_shrink: usize = count("coarse_shrink", "", 1..=16),
        /// Lattices of the coarse level, each at a yaw of its own.
        pub coarse_yaws: usize = count("coarse_yaws", "", 1..=61),
    }
}

impl Default for SixParams {
    fn default() -> Self {
        Self {
            yaws: 5,
            yaw_step_deg: 3.0,
            starts: 20,
            finalists: 8,
            first_step_m: 0.5,
            six_step_m: 0.1,
            last_step_m: 0.004,
            deg_per_m: 3.0,
            coarse_shrink: 3,
            coarse_yaws: 11,
        }
    }
}
