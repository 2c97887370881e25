//! See why a camera pose estimate fails.
//!
//! One query photo and a reference tuple (a photo with known pose and the LiDAR cloud registered
//! with it) go in; the query's pose comes out. On the way, the estimator emits every decision as
//! a stream of typed events.
//!
//! ```text
//! scene → Problem → Estimator → Outcome → evaluate
//!                       │ events
//!                       ├→ nothing              headless
//!                       ├→ a Rerun recording
//!                       └→ your implementation of trace::Sink
//! ```

// The README's code is a doctest.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

// The command line names the library as its other users do.
#[cfg(feature = "rerun")]
extern crate self as posescope;

pub use posescope_core::{
    Cloud, Cost, Direct, Estimator, Failure, History, InputError, Intrinsics, Method, Outcome,
    Params, Photo, Pose, Problem, Query, ReferenceTuple, Trace, inner_scene, localize_by,
    localize_traced,
};
pub use posescope_core::{
    camera, cloud, cost, covariance, depth, describe, diagnosis, estimator, event, features,
    foreign, fusion, geometry, grid, history, image, localize, method, opinion, params, problem,
    render, retrieval, robust, scale, solver, text, trace,
};

#[cfg(feature = "app")]
pub mod app;
#[cfg(feature = "cli")]
mod chart;
#[cfg(feature = "rerun")]
pub mod cli;
pub mod doctor;
#[cfg(feature = "rerun")]
pub mod feature_progress;
#[cfg(feature = "cli")]
pub mod lesson;
pub mod measure;
#[cfg(feature = "rerun")]
mod narration;
pub mod palette;
#[cfg(feature = "rerun")]
pub mod picture;
#[cfg(feature = "rerun")]
mod place;
#[cfg(feature = "rerun")]
pub mod proof;
mod relation;
#[cfg(feature = "rerun")]
pub mod report;
mod route;
pub mod run;
pub mod scene;
pub mod session;
pub mod sink;
#[cfg(feature = "rerun")]
pub mod survey;
pub mod table;
