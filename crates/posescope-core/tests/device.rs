//! A device that is wrong where nobody checks at once: its scores must not outlive their correction.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use nalgebra::Point3;
use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::cost::{IntensityPair, JointHistogram, Statistic};
use posescope_core::event::{Event, Kind, KindSet};
use posescope_core::geometry::Pose;
use posescope_core::grid::{Phase, ScoredLattice};
use posescope_core::image::{GrayImage, Photo};
use posescope_core::localize_traced;
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::{Problem, Query, ReferenceTuple};
use posescope_core::render::{
    ColoredPoint, Device, Loaded, ProjectionRows, Rasterizer, Tally, Workload, use_device,
};
use posescope_core::trace::{Cancelled, Record, Sink, Trace};

/// Powers of two, so that poses in whole metres are exact in single precision.
const CAMERA: Intrinsics =
    Intrinsics { fx: 64.0, fy: 64.0, cx: 48.0, cy: 16.0, width: 96, height: 32 };

/// Hypotheses of the coarse positions: a disc of 6 m in steps of 1 m.
const COARSE: usize = 113;

/// Draws on the processor, and adds one count at one hypothesis of the coarse positions.
#[derive(Debug, Default)]
struct Sly {
    lies_at: OnceLock<usize>,
    loaded: AtomicUsize,
}

struct SlyLoaded {
    points: Vec<ColoredPoint>,
    query: Vec<f32>,
    bins: usize,
    lies_at: usize,
}

impl Device for Sly {
    fn batch(&self, hypotheses: usize) -> Option<usize> {
        (hypotheses == COARSE).then_some(hypotheses)
    }

    fn load(&self, workload: &Workload<'_>) -> Option<Box<dyn Loaded>> {
        let &Statistic::Histogram { bins, .. } = workload.statistic else {
            return None;
        };
        self.loaded.fetch_add(1, Ordering::Relaxed);
        Some(Box::new(SlyLoaded {
            points: workload.points.to_vec(),
            query: workload.query.to_vec(),
            bins,
            lies_at: *self.lies_at.get()?,
        }))
    }

    fn distrust(&self) {}

    fn left_out(&self, _method: Method, _why: &str) {}
}

impl Loaded for SlyLoaded {
    fn tally(&self, projections: &[ProjectionRows]) -> Option<Vec<Option<Tally>>> {
        let tally = |(place, rows): (usize, &ProjectionRows)| {
            // Of a camera that is only moved the rows tell where it is.
            let along = rows[2][3];
            let across = (rows[0][3] - CAMERA.cx as f32 * along) / CAMERA.fx as f32;
            let pose = Pose::translation(f64::from(across), 0.0, f64::from(along));
            let mut rasterizer = Rasterizer::new(&CAMERA, 1);
            let pixels = rasterizer.splat(&self.points, &pose);
            let pairs: Vec<_> = pixels
                .iter()
                .map(|pixel| IntensityPair {
                    query: self.query[pixel.index as usize],
                    synthetic: pixel.intensity,
                })
                .collect();
            let mut counts = JointHistogram::of(&pairs, self.bins).counts;
            counts[0] += u32::from(place == self.lies_at);
            Some(Tally::Counts(counts))
        };
        Some(projections.iter().enumerate().map(tally).collect())
    }
}

/// Keeps the scored coarse positions.
#[derive(Default)]
struct Coarse(Option<Arc<ScoredLattice>>);

impl Sink for Coarse {
    fn wanted(&self) -> KindSet {
        KindSet::of(&[Kind::PhaseSearched])
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if let Event::PhaseSearched(searched) = &record.event
            && searched.surface.lattice.phase == Phase::PositionCoarse
        {
            self.0 = Some(Arc::clone(&searched.surface));
        }
        Ok(())
    }
}

fn texture(x: f32, y: f32) -> u8 {
    let cell = |v: f32| (v * 1.7 + 1000.0).floor() as u32;
    let mixed = cell(x).wrapping_mul(0x9E37_79B9) ^ cell(y).wrapping_mul(0x85EB_CA6B);
    ((mixed ^ (mixed >> 15)).wrapping_mul(0x2C1B_3C6D) >> 24) as u8
}

/// A wall 16 m ahead, seen by both cameras, the query 2 m nearer to it.
fn problem(is_remembering: bool) -> Problem {
    let photo = |ahead: f32| {
        let mut image = GrayImage::new(CAMERA.width, CAMERA.height);
        for (x, y, pixel) in image.enumerate_pixels_mut() {
            let depth = 16.0 - ahead;
            let right = (x as f32 - CAMERA.cx as f32) / CAMERA.fx as f32 * depth;
            let down = (y as f32 - CAMERA.cy as f32) / CAMERA.fy as f32 * depth;
            pixel.0 = [texture(right, down)];
        }
        Photo::from_gray(image)
    };
    let across = (-60_i8..=60).flat_map(|x| (-20_i8..=20).map(move |y| (x, y)));
    let points = across.map(|(x, y)| Point3::new(f32::from(x) * 0.2, f32::from(y) * 0.2, 16.0));
    let cloud = Cloud { points: points.collect() };
    let mut query = Query::new("query", photo(2.0), CAMERA).expect("fits");
    let mut reference =
        ReferenceTuple::new("reference", photo(0.0), CAMERA, Pose::identity(), cloud)
            .expect("fits");
    if is_remembering {
        (query, reference) = (query.remembering(), reference.remembering());
    }
    Problem::new(query, reference, 6.0).expect("a radius")
}

fn coarse(problem: &Problem) -> ScoredLattice {
    let mut found = Coarse::default();
    let mut trace = Trace::to(&mut found);
    localize_traced(problem, Method::MI, &Params::default(), &mut trace).expect("nobody cancels");
    ScoredLattice::clone(&found.0.expect("it was searched"))
}

#[test]
fn a_score_that_was_corrected_stays_corrected_in_the_next_run() {
    let on_threads = coarse(&problem(false));
    let cells: Vec<usize> = (on_threads.lattice.hypotheses()).map(|(cell, _)| cell).collect();
    assert_eq!(cells.len(), COARSE);
    // A minimum, which is reported, and not one of those that each batch is checked by.
    let checked: Vec<usize> = (0..COARSE).step_by(COARSE / 4).collect();
    let minima = on_threads.local_minima();
    let lies_at = minima
        .iter()
        .skip(1)
        .filter_map(|(cell, _)| cells.iter().position(|one| one == cell))
        .find(|place| !checked.contains(place))
        .expect("there are several minima");
    let sly = Arc::new(Sly::default());
    sly.lies_at.set(lies_at).expect("for the first time");
    assert!(use_device(Arc::clone(&sly) as Arc<dyn Device>));

    let problem = problem(true);
    let (first, again) = (coarse(&problem), coarse(&problem));
    assert!(sly.loaded.load(Ordering::Relaxed) > 0, "the device was asked");
    assert_eq!(first.scores, on_threads.scores);
    assert_eq!(again.scores, on_threads.scores);
}
