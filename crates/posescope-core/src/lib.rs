//! The estimators of [posescope](https://docs.rs/posescope), without any file format, recording or
//! window.
//!
//! One query photo and a reference tuple (a photo with known pose and the LiDAR cloud registered
//! with it) go in; the query's pose comes out, and on the way the estimator tells every decision as
//! a stream of typed events.
//!
//! ```text
//! scene → Problem → Estimator → Outcome → localize, the only place that sees ground truth
//!                       │ events
//!                       ├→ nothing              headless
//!                       └→ whoever implements trace::Sink
//! ```

pub mod camera;
pub mod cloud;
pub mod cost;
pub mod depth;
pub mod describe;
pub mod estimator;
pub mod event;
pub mod features;
pub mod files;
pub mod fusion;
pub mod geometry;
pub mod grid;
pub mod history;
pub mod image;
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
pub mod text;
pub mod trace;
