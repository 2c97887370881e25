//! Parameters of `mi6`.

use crate::describe::parameters;

parameters! {
    /// Parameters of the search in six freedoms. Coarse positions and the coverage floor are those of
    /// the grid.
    #[derive(Clone, Debug, PartialEq)]
    pub struct MultiStartParams {
        /// Coarse lattices, each at a yaw of its own, where no smaller copies are searched.
        pub yaws: usize = 5 => count("yaws", "", 1..=61),
        /// Yaw between neighbouring coarse lattices.
        pub yaw_step_deg: f64 = 4.0 => number("yaw_step", "°", 0.1..=45.0),
        /// Coarse minima that are refined in right, forward and yaw.
        pub starts: usize = 60 => count("starts", "", 1..=200),
        /// The best of those, around which samples gather before a refinement in all six freedoms.
        pub finalists: usize = 20 => count("finalists", "", 1..=100),
        /// First step of the refinement in right, forward and yaw, and standard deviation of the samples around finalists; at
        /// most half a step between coarse positions.
        pub first_step_m: f64 = 0.5 => number("first_step", "m", 1e-6..=1e4),
        /// First step of the refinement in six freedoms; at most half a step between coarse positions.
        pub six_step_m: f64 = 0.1 => number("six_step", "m", 1e-6..=1e4),
        /// Steps below this are the last.
        pub last_step_m: f64 = 0.004 => number("last_step", "m", 1e-6..=1e4),
        /// Turn that goes with a step of one metre: what moves a view by as much.
        pub deg_per_m: f64 = 3.0 => number("deg_per_m", "°/m", 1e-4..=1e5),
        /// How many times smaller the copies of the photos are whose minima are the finalists; at 1 the photos
        /// themselves are searched.
        pub coarse_shrink: usize = 3 => count("coarse_shrink", "", 1..=16),
        /// Lattices for the copies, each at a yaw of its own. The least likely poses are left out.
        pub coarse_yaws: usize = 31 => count("coarse_yaws", "", 1..=61),
        /// Turn against the reference's heading at which a pose's penalty is one standard deviation of the coarse
        /// costs; twice the turn has four times the penalty.
        pub usual_yaw_deg: f64 = 8.0 => number("usual_yaw", "°", 0.1..=1000.0),
        /// Height above or below the reference with the same penalty.
        pub usual_height_m: f64 = 0.5 => number("usual_height", "m", 1e-6..=1e6),
        /// Tilt against the reference, of pitch and roll together, with the same penalty.
        pub usual_tilt_deg: f64 = 1.5 => number("usual_tilt", "°", 0.1..=1000.0),
        /// The greatest penalty of an unlikely pose, in standard deviations; at 0 all poses are equally likely.
        pub unlikely: f64 = 4.0 => number("unlikely", "", 0.0..=100.0),
    }
}
