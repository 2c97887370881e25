//! See why a camera pose estimate fails.
//!
//! One query photo and a reference tuple (a photo with known pose and the LiDAR cloud registered
//! with it) go in; the query's pose comes out, and on the way the estimator tells every decision as
//! a stream of typed events.
//!
//! ```text
//! scene → Problem → Estimator → Outcome → evaluate
//!                       │ events
//!                       ├→ nothing              headless
//!                       ├→ a Rerun recording
//!                       └→ whoever implements trace::Sink
//! ```

// The README's code is a doctest.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(feature = "app")]
pub mod app;
mod cache;
pub mod camera;
pub mod cloud;
pub mod cost;
pub mod depth;
pub mod describe;
pub mod estimator;
pub mod evaluate;
pub mod event;
pub mod features;
mod files;
pub mod fusion;
pub mod geometry;
pub mod grid;
pub mod history;
pub mod image;
pub mod memo;
#[cfg(feature = "rerun")]
mod narration;
#[cfg(feature = "rerun")]
mod palette;
pub mod params;
#[cfg(feature = "rerun")]
mod picture;
pub mod problem;
pub mod render;
pub mod retrieval;
pub mod robust;
pub mod scene;
pub mod session;
pub mod sink;
pub mod solver;
pub mod trace;
