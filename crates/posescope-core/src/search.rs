//! For posescope's own crates: may change in any version.
//!
//! Searches for the pose of least cost that need no lattice. Each takes what poses cost as a function, and knows nothing
//! of images.
//!
//! | file | what |
//! |---|---|
//! | `pattern` | from a start to the minimum near it, by steps that shrink |
//! | `cross_entropy` | from a start to the deep minimum near it, by samples that gather |
//! | `compass` | from a start downhill along axes of any number, for the diagnosis |
//! | `descent` | from a start downhill by the derivatives of a smooth cost |
//!
//! The lattices of the paper's search are in [`grid`](crate::grid).

pub(crate) mod compass;
pub mod cross_entropy;
pub(crate) mod descent;
pub mod pattern;

pub use cross_entropy::{CrossEntropy, cross_entropy};
pub use pattern::{Freedoms, PatternSearch, Refined, Start, moved, pattern_search};
