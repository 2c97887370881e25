//! What is known about the queries beside the one at work: thumbnails, and whether they fail.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use egui::{ColorImage, TextureHandle, TextureOptions};

use super::setup::Setup;
use super::textures::color_image;
use crate::event::{KindSet, Side};
use crate::localize::{LocalizeObserver, QueryResult};
use crate::picture;
use crate::scene::{FrameStore, Scene};
use crate::session::JobError;
use crate::trace::{Cancelled, Record, Sink};

/// Width of a thumbnail \[px\].
const THUMBNAIL_WIDTH: u32 = 124;

/// The results of a query, or why it could not be run.
pub(super) type BatchOutcome = (usize, Result<Vec<QueryResult>, String>);

/// Thumbnails and results that are made beside the window's thread.
pub struct Queries {
    ctx: egui::Context,
    thumbnails: BTreeMap<(Side, usize), Option<TextureHandle>>,
    wanted: Arc<Mutex<BTreeSet<(Side, usize)>>>,
    pictures: (Sender<PainterMessage>, Receiver<PainterMessage>),
    painter_is_busy: bool,
    batch: Option<Batch>,
}

enum PainterMessage {
    Thumbnail((Side, usize), Option<ColorImage>),
    Idle,
}

/// All queries at work, one after the other. Nobody joins the worker: it ends soon after the batch is
/// dropped.
struct Batch {
    outcomes: Receiver<BatchOutcome>,
    stop: Arc<AtomicBool>,
    done: usize,
    all: usize,
}

impl Drop for Batch {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
    }
}

/// Wants to hear nothing. Whoever raises the flag wants the run to stop.
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
        Self {
            ctx,
            thumbnails: BTreeMap::new(),
            wanted: Arc::default(),
            pictures: mpsc::channel(),
            painter_is_busy: false,
            batch: None,
        }
    }

    /// The thumbnail of a frame of the queries' or the references' scene, once it is made. Asking for
    /// it has it made.
    pub fn thumbnail(&self, side: Side, frame: usize) -> Option<&TextureHandle> {
        match self.thumbnails.get(&(side, frame)) {
            Some(thumbnail) => thumbnail.as_ref(),
            None => {
                let mut wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
                wanted.insert((side, frame));
                None
            }
        }
    }

    /// Whether thumbnails that were asked for are still to come.
    pub fn is_painting(&self) -> bool {
        let wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        self.painter_is_busy || !wanted.is_empty()
    }

    /// How far the run over all queries is: done, and all.
    pub fn progress(&self) -> Option<(usize, usize)> {
        self.batch.as_ref().map(|batch| (batch.done, batch.all))
    }

    /// Stops running all queries. Whether that was going on.
    pub(super) fn stop_all(&mut self) -> bool {
        self.batch.take().is_some()
    }

    /// Starts to run all queries, or stops doing so.
    pub(super) fn run_all(&mut self, setup: &Setup) {
        if self.stop_all() {
            return;
        }
        let (outbox, outcomes) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let (setup, flag, ctx) = (setup.clone(), Arc::clone(&stop), self.ctx.clone());
        let all = setup.offered.len();
        let started = thread::Builder::new().name("queries".to_owned()).spawn(move || {
            let frames = Arc::default();
            for &query in &setup.offered {
                let localized =
                    catch_unwind(AssertUnwindSafe(|| localize(&setup, query, &frames, &flag)));
                let outcome = match localized {
                    Ok(Ok(results)) => Ok(results),
                    Ok(Err(error)) if error.is_cancelled() => break,
                    Ok(Err(error)) => Err(error.to_string()),
                    Err(_) => {
                        let name = &setup.queries.frames()[query];
                        Err(format!("internal error at query {name}"))
                    }
                };
                if outbox.send((query, outcome)).is_err() {
                    break;
                }
                ctx.request_repaint();
            }
        });
        if started.is_ok() {
            self.batch = Some(Batch { outcomes, stop, done: 0, all });
        }
    }

    /// Takes in what was made; has what is wanted made.
    pub(super) fn poll(&mut self) -> Vec<BatchOutcome> {
        while let Ok(picture) = self.pictures.1.try_recv() {
            match picture {
                PainterMessage::Thumbnail(frame, image) => {
                    let texture = image.map(|image| {
                        let name = format!("thumbnail {frame:?}");
                        self.ctx.load_texture(name, image, TextureOptions::LINEAR)
                    });
                    self.thumbnails.insert(frame, texture);
                }
                PainterMessage::Idle => self.painter_is_busy = false,
            }
        }
        let Some(batch) = &mut self.batch else {
            return Vec::new();
        };
        let outcomes: Vec<BatchOutcome> = batch.outcomes.try_iter().collect();
        batch.done += outcomes.len();
        if batch.done == batch.all {
            self.batch = None;
        }
        outcomes
    }

    /// Has the wanted thumbnails made.
    pub(super) fn paint_thumbnails(&mut self, setup: &Setup) {
        if self.painter_is_busy || !self.is_painting() {
            return;
        }
        let (queries, references) = (Arc::clone(&setup.queries), Arc::clone(&setup.references));
        let wanted = Arc::clone(&self.wanted);
        let (outbox, ctx) = (self.pictures.0.clone(), self.ctx.clone());
        let started = thread::Builder::new().name("thumbnails".to_owned()).spawn(move || {
            loop {
                let next = wanted.lock().unwrap_or_else(PoisonError::into_inner).pop_first();
                let Some((side, frame)) = next else { break };
                let scene = match side {
                    Side::Query => queries.as_ref(),
                    Side::Reference => references.as_ref(),
                };
                let image = catch_unwind(AssertUnwindSafe(|| thumbnail(scene, frame)));
                let picture = PainterMessage::Thumbnail((side, frame), image.ok().flatten());
                let told = outbox.send(picture);
                if told.is_err() {
                    return;
                }
                ctx.request_repaint();
            }
            let _ = outbox.send(PainterMessage::Idle);
            ctx.request_repaint();
        });
        self.painter_is_busy = started.is_ok();
    }
}

impl Drop for Queries {
    fn drop(&mut self) {
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

fn thumbnail(scene: &dyn Scene, frame: usize) -> Option<ColorImage> {
    let photo = scene.photo(frame).ok()?;
    let (width, height) = photo.dimensions();
    let small = picture::photo(&photo).thumbnail(THUMBNAIL_WIDTH, height * THUMBNAIL_WIDTH / width);
    Some(color_image(&small))
}

fn localize(
    setup: &Setup,
    query: usize,
    frames: &Arc<FrameStore>,
    stop: &Arc<AtomicBool>,
) -> Result<Vec<QueryResult>, JobError> {
    let mut setup = setup.clone();
    setup.go_to(query);
    setup.leave_itself_out();
    let mut observer = UntilStopped(Arc::clone(stop));
    setup.job(frames).work(0, &mut observer, |_| {})
}
