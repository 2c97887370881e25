//! Threads that do jobs one after the other.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

/// Something to compute, in parts that are handed to its argument. That returns whether more is wanted.
type Job<A> = Box<dyn FnOnce(&mut dyn FnMut(A) -> bool) + Send>;

/// Does jobs in their order, beside the window's thread. [`Worker::forget`] drops those that wait.
pub(super) struct Worker<A> {
    jobs: Sender<(usize, Job<A>)>,
    answers: Receiver<(usize, Message<A>)>,
    /// Grows when jobs are dropped; older ones are not worked on.
    epoch: Arc<AtomicUsize>,
    waiting: usize,
}

/// What the thread sends.
enum Message<A> {
    /// An answer, or a part of one.
    Part(A),
    /// The end of a job; not whole where it ended in a panic.
    End { is_whole: bool },
}

impl<A: Send + 'static> Worker<A> {
    /// Starts a thread. It wakes the window for each answer.
    pub(super) fn new(name: &str, ctx: &egui::Context) -> Self {
        let (jobs, inbox) = mpsc::channel::<(usize, Job<A>)>();
        let (outbox, answers) = mpsc::channel();
        let epoch = Arc::new(AtomicUsize::new(0));
        let (now, ctx) = (Arc::clone(&epoch), ctx.clone());
        // Without a thread `ask` finds nobody to send to.
        let _ = thread::Builder::new().name(name.to_owned()).spawn(move || {
            for (asked, job) in inbox {
                let is_wanted = || asked >= now.load(Ordering::Relaxed);
                if !is_wanted() {
                    continue;
                }
                let send = |message| {
                    let is_sent = outbox.send((asked, message)).is_ok();
                    ctx.request_repaint();
                    is_sent
                };
                let mut emit = |part| send(Message::Part(part)) && is_wanted();
                let done = catch_unwind(AssertUnwindSafe(|| job(&mut emit)));
                if !send(Message::End { is_whole: done.is_ok() }) {
                    break;
                }
            }
        });
        Self { jobs, answers, epoch, waiting: 0 }
    }

    /// Asks for something that is computed in parts.
    pub(super) fn ask(&mut self, job: impl FnOnce(&mut dyn FnMut(A) -> bool) + Send + 'static) {
        let epoch = self.epoch.load(Ordering::Relaxed);
        if self.jobs.send((epoch, Box::new(job))).is_ok() {
            self.waiting += 1;
        }
    }

    /// The answers since the last call. `None` stands for a job that ended in a panic.
    pub(super) fn poll(&mut self) -> Vec<Option<A>> {
        let now = self.epoch.load(Ordering::Relaxed);
        let mut taken = Vec::new();
        while let Ok((asked, message)) = self.answers.try_recv() {
            if asked != now {
                continue;
            }
            match message {
                Message::Part(part) => taken.push(Some(part)),
                Message::End { is_whole } => {
                    self.waiting -= 1;
                    taken.extend((!is_whole).then_some(None));
                }
            }
        }
        taken
    }

    /// Drops all jobs that wait, and the answer to the one at work.
    pub(super) fn forget(&mut self) {
        self.epoch.fetch_add(1, Ordering::Relaxed);
        self.waiting = 0;
    }

    /// Whether an answer is still to come.
    pub(super) fn is_busy(&self) -> bool {
        self.waiting > 0
    }

    /// Waits until all jobs are done, whose answers nobody wants.
    pub(super) fn finish(&mut self) {
        while self.is_busy()
            && let Ok((_, message)) = self.answers.recv()
        {
            self.waiting -= usize::from(matches!(message, Message::End { .. }));
        }
    }
}

impl<A> Drop for Worker<A> {
    fn drop(&mut self) {
        self.epoch.fetch_add(1, Ordering::Relaxed);
    }
}

/// What is computed once for each key.
pub(super) struct Answers<K, A> {
    worker: Worker<(K, A)>,
    /// What was asked; `None` until there is an answer.
    known: Vec<(K, Option<A>)>,
}

impl<K: Clone + PartialEq + Send + 'static, A: Send + 'static> Answers<K, A> {
    /// Starts the thread that answers.
    pub(super) fn new(name: &str, ctx: &egui::Context) -> Self {
        Self { worker: Worker::new(name, ctx), known: Vec::new() }
    }

    /// Asks for the answer to a key, unless that was done before. `job` gives what computes it, if that is known.
    pub(super) fn ask<J>(&mut self, key: K, job: impl FnOnce() -> Option<J>)
    where
        J: FnOnce() -> A + Send + 'static,
    {
        let is_asked = self.known.iter().any(|(known, _)| *known == key);
        if let Some(job) = (!is_asked).then(job).flatten() {
            self.known.push((key.clone(), None));
            self.worker.ask(move |emit| {
                emit((key, job()));
            });
        }
    }

    /// The answer for a key, once it is there.
    pub(super) fn get(&self, key: &K) -> Option<&A> {
        self.find(|known| known == key)
    }

    /// The answer for the first key of which something is true.
    pub(super) fn find(&self, is_meant: impl Fn(&K) -> bool) -> Option<&A> {
        self.known.iter().find(|(key, _)| is_meant(key))?.1.as_ref()
    }

    /// Takes in answers. Whether none ended in a panic.
    pub(super) fn poll(&mut self) -> bool {
        let mut all_is_well = true;
        for answer in self.worker.poll() {
            let Some((key, answer)) = answer else {
                all_is_well = false;
                continue;
            };
            // Its key may be forgotten by now.
            if let Some((_, known)) = self.known.iter_mut().find(|(known, _)| *known == key) {
                *known = Some(answer);
            }
        }
        all_is_well
    }

    /// Forgets some keys with their answers.
    pub(super) fn forget_where(&mut self, is_meant: impl Fn(&K) -> bool) {
        self.known.retain(|(key, _)| !is_meant(key));
    }

    /// Forgets everything: what the answers depend on has changed.
    pub(super) fn forget(&mut self) {
        self.worker.forget();
        self.known.clear();
    }

    /// Whether an answer is still to come.
    pub(super) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn answers_come_in_order_and_dropped_jobs_have_none() {
        let mut worker = Worker::new("test", &egui::Context::default());
        let ask = |worker: &mut Worker<u32>, number: u32| {
            worker.ask(move |emit| {
                assert!(number != 13, "a job that panics");
                emit(2 * number);
            });
        };
        let collect = |worker: &mut Worker<u32>| {
            let mut all = Vec::new();
            while worker.is_busy() {
                all.extend(worker.poll());
                thread::sleep(Duration::from_millis(1));
            }
            all
        };
        ask(&mut worker, 1);
        worker.forget();
        for number in [2, 13, 3] {
            ask(&mut worker, number);
        }
        assert_eq!(collect(&mut worker), [Some(4), None, Some(6)]);
    }
}
