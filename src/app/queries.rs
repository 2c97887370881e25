//! What is known about the queries beside the one at work: thumbnails, and whether they fail.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use egui::{ColorImage, TextureHandle, TextureOptions};

use super::setup::Setup;
use super::textures::color_image;
use super::worker::{Answers, Worker};
use crate::event::{KindSet, Side};
use crate::localize::{LocalizeObserver, QueryResult};
use crate::picture;
use crate::scene::Scene;
use crate::session::{Job, JobError};
use crate::trace::{Cancelled, Record, Sink};

/// Width of a thumbnail \[px\].
const THUMBNAIL_WIDTH: u32 = 124;

/// The results of a query, or why it could not be run.
pub(super) type BatchOutcome = (usize, Result<Vec<QueryResult>, String>);

/// Thumbnails and results that are made beside the window's thread.
pub struct Queries {
    /// Of the queries' and the references' frames; `None` for a photo that cannot be read.
    thumbnails: RefCell<Answers<(Side, usize), Option<TextureHandle>>>,
    ctx: egui::Context,
    worker: Worker<BatchOutcome>,
    batch: Option<Batch>,
}

/// All queries at work, one after the other.
struct Batch {
    stop: UntilStopped,
    done: usize,
    all: usize,
}

impl Drop for Batch {
    fn drop(&mut self) {
        self.stop.0.store(true, Ordering::Release);
    }
}

/// Wants to hear nothing. Whoever raises the flag wants the run to stop.
#[derive(Clone, Default)]
struct UntilStopped(Arc<AtomicBool>);

impl Sink for UntilStopped {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        Err(Cancelled)
    }
}

impl LocalizeObserver for UntilStopped {
    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.0))
    }
}

impl Queries {
    pub(super) fn new(ctx: egui::Context) -> Self {
        let thumbnails = RefCell::new(Answers::new("thumbnails", &ctx));
        Self { thumbnails, worker: Worker::new("queries", &ctx), ctx, batch: None }
    }

    /// The thumbnail of a frame of the queries' or the references' scene, once it is made. With a setup, asking for it
    /// has it made.
    pub(super) fn thumbnail(
        &self,
        side: Side,
        frame: usize,
        setup: Option<&Setup>,
    ) -> Option<TextureHandle> {
        let mut thumbnails = self.thumbnails.borrow_mut();
        thumbnails.ask((side, frame), || {
            let (scene, ctx) = (Arc::clone(setup?.scene(side)), self.ctx.clone());
            Some(move || {
                let image = thumbnail(&*scene, frame)?;
                Some(ctx.load_texture("thumbnail", image, TextureOptions::LINEAR))
            })
        });
        thumbnails.get(&(side, frame))?.clone()
    }

    /// Whether thumbnails that were asked for are still to come.
    pub fn is_painting(&self) -> bool {
        self.thumbnails.borrow().is_busy()
    }

    /// How far the run over all queries is: done, and all.
    pub fn progress(&self) -> Option<(usize, usize)> {
        self.batch.as_ref().map(|batch| (batch.done, batch.all))
    }

    /// Stops running all queries. Whether that was going on.
    pub(super) fn stop_all(&mut self) -> bool {
        self.worker.forget();
        self.batch.take().is_some()
    }

    /// Starts to run all queries, or stops doing so.
    pub(super) fn run_all(&mut self, setup: &Setup) {
        if self.stop_all() {
            return;
        }
        let stop = UntilStopped::default();
        let mut setup = setup.clone();
        setup.frames = Arc::default();
        self.batch = Some(Batch { stop: stop.clone(), done: 0, all: setup.offered.len() });
        self.worker.ask(move |emit| localize_all(&setup, &stop, emit));
    }

    /// Takes in what was made.
    pub(super) fn poll(&mut self) -> Vec<BatchOutcome> {
        self.thumbnails.get_mut().poll();
        let outcomes: Vec<BatchOutcome> = self.worker.poll().into_iter().flatten().collect();
        if let Some(batch) = &mut self.batch {
            batch.done += outcomes.len();
        }
        if !self.worker.is_busy() {
            self.batch = None;
        }
        outcomes
    }
}

fn thumbnail(scene: &dyn Scene, frame: usize) -> Option<ColorImage> {
    let photo = scene.photo(frame).ok()?;
    let (width, height) = photo.dimensions();
    let small = picture::photo(&photo).thumbnail(THUMBNAIL_WIDTH, height * THUMBNAIL_WIDTH / width);
    Some(color_image(&small))
}

/// Localises all queries of a setup. A query whose estimator panics is reported like one whose files cannot be read.
fn localize_all(setup: &Setup, stop: &UntilStopped, emit: &mut dyn FnMut(BatchOutcome) -> bool) {
    for &query in &setup.offered {
        let localized = catch_unwind(AssertUnwindSafe(|| localize(&setup.job, query, stop)));
        let outcome = match localized {
            Ok(Ok(results)) => Ok(results),
            Ok(Err(error)) if error.is_cancelled() => break,
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err(format!("internal error at query {}", setup.queries.frames()[query])),
        };
        if !emit((query, outcome)) {
            break;
        }
    }
}

fn localize(job: &Job, query: usize, stop: &UntilStopped) -> Result<Vec<QueryResult>, JobError> {
    let mut job = job.clone();
    job.go_to(query);
    job.leave_itself_out();
    job.work(0, &mut stop.clone(), |_| {})
}
