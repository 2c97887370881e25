//! The estimators of [posescope](https://docs.rs/posescope), without any file format, recording or
//! window.
//!
//! A query photo and a reference (a photo with a known pose and the LiDAR cloud registered with it) go
//! in. The pose of the query comes out. On the way, the estimator emits every decision as a typed
//! [event].
//!
//! ```text
//! Query, ReferenceTuple → Problem → localize → Outcome
//!                                      │ events
//!                                      ├→ nothing       localize
//!                                      ├→ a History     localize_traced
//!                                      └→ your own Sink
//! ```
//!
//! # Localise and watch
//!
//! ```
//! use posescope_core::event::FeaturesDetected;
//! use posescope_core::{
//!     Cloud, Failure, History, Intrinsics, Method, Params, Photo, Pose, Problem, Query,
//!     ReferenceTuple, Trace, localize_traced,
//! };
//!
//! let camera = Intrinsics { fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5, width: 64, height: 48 };
//! let black = || Photo::from_gray_values(64, 48, vec![0; 64 * 48]);
//! let query = Query::new("night", black()?, camera)?;
//! let cloud: Cloud = [[0.0, 0.0, 9.0], [1.0, 0.0, 9.0]].into_iter().collect();
//! let reference = ReferenceTuple::new("day", black()?, camera, Pose::identity(), cloud)?;
//! let problem = Problem::new(query, reference, 15.0)?;
//!
//! let mut params = Params::default();
//! params.set("fb.ratio", "0.75")?;
//! let mut history = History::default();
//! let outcome = localize_traced(&problem, Method::FB, &params, &mut Trace::to(&mut history))?;
//! // Two black photos have nothing in common. Having no pose is an answer too.
//! assert_eq!(outcome.pose, Err(Failure::TooFewFeatures { query: 0, reference: 0 }));
//! let detected = history.last::<FeaturesDetected>().expect("it looked for features");
//! assert!(detected.features.keypoints.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Threads, and how to stop a run
//!
//! All work runs on the current [`rayon`] pool. To give one call threads of its own, call it in
//! [`rayon::ThreadPool::install`]. The answer is the same on any number of threads.
//!
//! A [`Sink`] stops the run when it returns [`Cancelled`], at any event or in [`Sink::attend`]. A run
//! looks at the flag of [`Trace::watched`] often: at most 256 hypotheses of a search, one trial of
//! MLESAC or one refinement of its pose lie in between. With photos of half a megapixel, that takes
//! milliseconds; with ten times as many pixels, points or matches, it takes ten times as long.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//!
//! use posescope_core::event::KindSet;
//! use posescope_core::{Cancelled, Record, Sink, Trace, rayon};
//! # use posescope_core::{
//! #     Cloud, Intrinsics, Method, Params, Photo, Pose, Problem, Query, ReferenceTuple,
//! #     localize_traced,
//! # };
//! # let camera = Intrinsics { fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5, width: 64, height: 48 };
//! # let black = || Photo::from_gray_values(64, 48, vec![0; 64 * 48]);
//! # let query = Query::new("night", black()?, camera)?;
//! # let cloud = Cloud::default();
//! # let reference = ReferenceTuple::new("day", black()?, camera, Pose::identity(), cloud)?;
//! # let problem = Problem::new(query, reference, 15.0)?;
//! # let params = Params::default();
//!
//! struct UntilStopped;
//!
//! impl Sink for UntilStopped {
//!     fn wanted(&self) -> KindSet {
//!         KindSet::NONE
//!     }
//!     fn accept(&mut self, _: &Record) -> Result<(), Cancelled> {
//!         Ok(())
//!     }
//!     fn attend(&mut self) -> Result<(), Cancelled> {
//!         Err(Cancelled)
//!     }
//! }
//!
//! // Another thread may raise it at any time.
//! let stop = AtomicBool::new(true);
//! let mut sink = UntilStopped;
//! let mut trace = Trace::watched(&mut sink, Some(&stop));
//! let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
//! let stopped = pool.install(|| localize_traced(&problem, Method::MI, &params, &mut trace));
//! assert_eq!(stopped, Err(Cancelled));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Extend it
//!
//! | trait | what it adds |
//! |---|---|
//! | [`Cost`] | another way to compare two images; [`Direct::searching`] finds the pose of lowest cost |
//! | [`Estimator`] | another way to find a pose; [`localize_by`] runs it |
//! | [`Sink`] | another observer |
//!
//! ```
//! use posescope_core::cost::{IntensityPair, QueryChannel, Statistic};
//! use posescope_core::{Cost, Direct, Params};
//!
//! /// The mean difference of grey values.
//! struct MeanDifference;
//!
//! impl Cost for MeanDifference {
//!     fn query_channel(&self) -> QueryChannel<'_> {
//!         QueryChannel::smoothed(1.0)
//!     }
//!     fn statistic(&self) -> Statistic<'_> {
//!         Statistic::of_pairs(|pairs: &[IntensityPair]| {
//!             let difference = |pair: &IntensityPair| f64::from((pair.query - pair.synthetic).abs());
//!             let sum: f64 = pairs.iter().map(difference).sum();
//!             (!pairs.is_empty()).then(|| sum / pairs.len() as f64)
//!         })
//!     }
//! }
//!
//! let estimator = Direct::searching("mean", Box::new(MeanDifference), &Params::default());
//! # let _ = estimator;
//! ```
//!
//! # Parts that are useful alone
//!
//! | what | does |
//! |---|---|
//! | [`features::surf`], [`features::sift`], [`features::best_matches`] | finds, describes and matches keypoints |
//! | [`solver::p3p`], [`solver::refine`] | pose from three, or from many, pixels with their points |
//! | [`robust::mlesac`] | pose from correspondences of which most may be false |
//! | [`grid::scan`] | scores all poses of a lattice |
//! | [`fusion::average_pose`] | mean of poses |
//! | [`retrieval::build`], [`retrieval::Index`] | finds similar photos by visual words |
//!
//! ```
//! use posescope_core::nalgebra::{Point2, Point3};
//! use posescope_core::{Intrinsics, Pose, robust, solver};
//!
//! let camera = Intrinsics { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };
//! let truth = Pose::translation(0.3, -0.1, 0.5);
//! let seen = |i: u32| {
//!     let [x, y] = [f64::from(i % 5) - 2.0, f64::from(i / 5) - 2.0];
//!     let point = Point3::new(x, y, 8.0 + 0.1 * x * y);
//!     let pixel = camera.project(&(truth * point)).expect("it is in front of the camera");
//!     solver::Correspondence { pixel, point }
//! };
//! let mut correspondences: Vec<_> = (0..25).map(seen).collect();
//! correspondences[7].pixel = Point2::new(5.0, 5.0);
//! let (params, seed) = (robust::MlesacParams::default(), 0);
//! let found = robust::mlesac(&correspondences, &camera, &params, seed, |_| Ok::<_, ()>(()));
//! let found = found.expect("most of them agree");
//! assert_eq!(found.inliers.len(), 24);
//! assert!((found.pose.translation.vector - truth.translation.vector).norm() < 1e-6);
//! ```
//!
//! `examples/own_data.rs` makes a small world and localises in it; `examples/own_cost.rs` searches it
//! with a cost of its own.
//!
//! # What is stable
//!
//! The interface is what this documentation shows, with the types of [`arrayvec`], of the `image` crate
//! (here [`image_crate`]), of [`nalgebra`] and of [`rayon`]. Other modules and items are public only for
//! posescope's own crates, hidden here, and may change in any version.

pub mod cost;
pub mod event;
pub mod features;
pub mod fusion;
pub mod geometry;
pub mod grid;
pub mod image;
pub mod params;
pub mod retrieval;
pub mod robust;
pub mod solver;

// For posescope's own crates.
#[doc(hidden)]
pub mod camera;
#[doc(hidden)]
pub mod cloud;
#[doc(hidden)]
pub mod covariance;
#[doc(hidden)]
pub mod depth;
#[doc(hidden)]
pub mod describe;
#[doc(hidden)]
pub mod diagnosis;
#[doc(hidden)]
pub mod estimator;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod foreign;
#[doc(hidden)]
pub mod history;
#[doc(hidden)]
pub mod judge;
#[doc(hidden)]
pub mod localize;
#[doc(hidden)]
pub mod method;
#[doc(hidden)]
pub mod opinion;
#[doc(hidden)]
pub mod problem;
#[doc(hidden)]
pub mod recent;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod scale;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod search;
#[doc(hidden)]
pub mod survey;
#[doc(hidden)]
pub mod systematic;
#[doc(hidden)]
pub mod text;
#[doc(hidden)]
pub mod trace;

mod directions;
mod input;
mod memo;
mod stats;

pub use ::image as image_crate;
pub use arrayvec;
pub use nalgebra;
pub use rayon;

pub use camera::Intrinsics;
pub use cloud::Cloud;
pub use cost::Cost;
pub use estimator::{CostSummary, Direct, Estimator, Failure, FeatureCounts, Outcome, methods};
pub use geometry::Pose;
pub use history::History;
pub use image::Photo;
pub use input::InputError;
pub use localize::{localize, localize_by, localize_traced};
pub use method::Method;
pub use params::Params;
pub use problem::{Problem, Query, ReferenceTuple};
pub use trace::{Cancelled, Record, Sink, Trace};
