//! The estimators of [posescope](https://docs.rs/posescope), without any file format, recording or
//! window.
//!
//! One query photo and a reference tuple (a photo with known pose and the LiDAR cloud registered
//! with it) go in; the query's pose comes out, and on the way the estimator tells every decision as
//! a stream of typed events.
//!
//! ```text
//! Query, ReferenceTuple → Problem → localize → Outcome
//!                                      │ events
//!                                      ├→ nothing       localize
//!                                      ├→ a History     localize_traced
//!                                      └→ whoever else implements trace::Sink
//! ```
//!
//! ```
//! use posescope_core::{
//!     Cloud, Failure, Intrinsics, Method, Params, Photo, Pose, Problem, Query, ReferenceTuple, localize,
//! };
//!
//! let camera = Intrinsics { fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5, width: 64, height: 48 };
//! let black = || Photo::from_gray_values(64, 48, vec![0; 64 * 48]);
//! let query = Query::new("night", black()?, camera)?;
//! let cloud: Cloud = [[0.0, 0.0, 9.0], [1.0, 0.0, 9.0]].into_iter().collect();
//! let reference = ReferenceTuple::new("day", black()?, camera, Pose::identity(), cloud)?;
//! let problem = Problem::new(query, reference, 15.0)?;
//!
//! let outcome = localize(&problem, Method::FB, &Params::default());
//! // Two black photos have nothing in common, which is an answer.
//! assert_eq!(outcome.pose, Err(Failure::TooFewFeatures { query: 0, reference: 0 }));
//! # Ok::<(), posescope_core::InputError>(())
//! ```
//!
//! `examples/own_data.rs` makes a small world and localises in it; `examples/own_cost.rs` searches it
//! with a cost of its own.

pub mod camera;
pub mod cloud;
pub mod cost;
pub mod depth;
pub mod descent;
pub mod describe;
pub mod diagnosis;
pub mod estimator;
pub mod event;
pub mod features;
pub mod files;
pub mod foreign;
pub mod fusion;
pub mod geometry;
pub mod grid;
pub mod history;
pub mod image;
pub mod input;
pub mod judge;
pub mod localize;
pub mod memo;
pub mod method;
pub mod params;
pub mod problem;
pub mod recent;
pub mod render;
pub mod retrieval;
pub mod robust;
pub mod scene;
pub mod solver;
mod stats;
pub mod text;
pub mod trace;

pub use nalgebra;

pub use camera::Intrinsics;
pub use cloud::Cloud;
pub use cost::{Cost, IntensityPair};
pub use estimator::{Direct, Estimator, Failure, Outcome};
pub use geometry::Pose;
pub use history::History;
pub use image::Photo;
pub use input::InputError;
pub use localize::{localize, localize_by, localize_traced};
pub use method::Method;
pub use params::Params;
pub use problem::{Problem, Query, ReferenceTuple};
pub use trace::Trace;
