//! Threads that answer questions one after the other.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

/// Answers questions in their order, beside the window's thread. [`Worker::forget`] drops those that wait.
pub(super) struct Worker<Q, A> {
    questions: Sender<(usize, Q)>,
    answers: Receiver<(usize, Message<A>)>,
    /// Grows when questions are dropped; older ones are not worked on.
    epoch: Arc<AtomicUsize>,
    waiting: usize,
}

/// What the thread sends.
enum Message<A> {
    /// An answer, or a part of one.
    Part(A),
    /// The end of a question; not whole where it ended in a panic.
    End { is_whole: bool },
}

impl<Q: Send + 'static, A: Send + 'static> Worker<Q, A> {
    /// Starts a thread with one answer to each question. It wakes the window for each answer.
    pub(super) fn new(
        name: &str,
        ctx: egui::Context,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> Self {
        Self::in_parts(name, ctx, move |question, emit| {
            emit(answer(question));
        })
    }

    /// Starts a thread that answers each question in parts. `emit` returns whether more is wanted.
    pub(super) fn in_parts(
        name: &str,
        ctx: egui::Context,
        answer: impl Fn(Q, &mut dyn FnMut(A) -> bool) + Send + 'static,
    ) -> Self {
        let (questions, inbox) = mpsc::channel::<(usize, Q)>();
        let (outbox, answers) = mpsc::channel();
        let epoch = Arc::new(AtomicUsize::new(0));
        let now = Arc::clone(&epoch);
        // Without a thread `ask` finds nobody to send to.
        let _ = thread::Builder::new().name(name.to_owned()).spawn(move || {
            for (asked, question) in inbox {
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
                let answered = catch_unwind(AssertUnwindSafe(|| answer(question, &mut emit)));
                if !send(Message::End { is_whole: answered.is_ok() }) {
                    break;
                }
            }
        });
        Self { questions, answers, epoch, waiting: 0 }
    }

    /// Asks a question.
    pub(super) fn ask(&mut self, question: Q) {
        let epoch = self.epoch.load(Ordering::Relaxed);
        if self.questions.send((epoch, question)).is_ok() {
            self.waiting += 1;
        }
    }

    /// The answers since the last call. `None` stands for a question that ended in a panic.
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

    /// Drops all questions that wait, and the answer to the one at work.
    pub(super) fn forget(&mut self) {
        self.epoch.fetch_add(1, Ordering::Relaxed);
        self.waiting = 0;
    }

    /// Whether an answer is still to come.
    pub(super) fn is_busy(&self) -> bool {
        self.waiting > 0
    }
}

impl<Q, A> Drop for Worker<Q, A> {
    fn drop(&mut self) {
        self.epoch.fetch_add(1, Ordering::Relaxed);
    }
}

/// Answers to questions that are each asked once, by key.
pub(super) struct Answers<K, Q, A> {
    worker: Worker<(K, Q), (K, A)>,
    /// What was asked; `None` until there is an answer.
    known: Vec<(K, Option<A>)>,
}

impl<K: Clone + PartialEq + Send + 'static, Q: Send + 'static, A: Send + 'static> Answers<K, Q, A> {
    /// Starts the thread that answers.
    pub(super) fn new(
        name: &str,
        ctx: egui::Context,
        answer: impl Fn(&K, Q) -> A + Send + 'static,
    ) -> Self {
        let worker = Worker::new(name, ctx, move |(key, question): (K, Q)| {
            let answer = answer(&key, question);
            (key, answer)
        });
        Self { worker, known: Vec::new() }
    }

    /// Asks a question, unless that was done before.
    pub(super) fn ask(&mut self, key: K, question: impl FnOnce() -> Option<Q>) {
        let is_asked = self.known.iter().any(|(known, _)| *known == key);
        if let Some(question) = (!is_asked).then(question).flatten() {
            self.known.push((key.clone(), None));
            self.worker.ask((key, question));
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
    fn answers_come_in_order_and_dropped_questions_have_none() {
        let ctx = egui::Context::default();
        let mut worker = Worker::new("test", ctx, |number: u32| {
            assert!(number != 13, "a question that panics");
            2 * number
        });
        let collect = |worker: &mut Worker<u32, u32>| {
            let mut all = Vec::new();
            while worker.is_busy() {
                all.extend(worker.poll());
                thread::sleep(Duration::from_millis(1));
            }
            all
        };
        worker.ask(1);
        worker.forget();
        for number in [2, 13, 3] {
            worker.ask(number);
        }
        assert_eq!(collect(&mut worker), [Some(4), None, Some(6)]);
    }
}
