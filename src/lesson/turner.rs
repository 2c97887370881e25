//! The pages of a lesson, each at its moment.

use std::collections::VecDeque;
use std::ops::Range;

use super::Lesson;
use super::moment::Watch;
use crate::trace::Record;

/// Emits the pages of a lesson during a run, for a recording. Each page comes at its moment, but not before earlier
/// pages; the answer to its question comes at its own moment.
#[derive(Clone, Debug)]
pub struct PageTurner {
    waiting: VecDeque<WaitingPage>,
}

#[derive(Clone, Debug)]
struct WaitingPage {
    watch: Watch,
    is_reached: bool,
    text: String,
}

impl PageTurner {
    /// The turner for consecutive pages of a lesson that share one run.
    pub fn new(lesson: &Lesson, pages: Range<usize>) -> Self {
        let all = lesson.pages.len();
        let mut waiting = VecDeque::new();
        for index in pages {
            let page = &lesson.pages[index];
            let mut wait = |moment: &super::Moment, text| {
                waiting.push_back(WaitingPage {
                    watch: Watch::new(moment.clone()),
                    is_reached: false,
                    text,
                });
            };
            wait(&page.at, page.markdown(index + 1, all));
            if let (Some(question), Some(text)) = (&page.question, page.answered(index + 1, all)) {
                wait(&question.reveal, text);
            }
        }
        Self { waiting }
    }

    /// The pages that come with a record, as Markdown. Must be called with every record.
    pub fn turn(&mut self, record: &Record) -> Vec<String> {
        for page in &mut self.waiting {
            page.is_reached |= page.watch.is_reached(record);
        }
        let mut turned = Vec::new();
        while let Some(page) = self.waiting.pop_front_if(|page| page.is_reached) {
            turned.push(page.text);
        }
        turned
    }

    /// The remaining pages when the run is over.
    pub fn rest(self) -> impl Iterator<Item = String> {
        self.waiting.into_iter().map(|page| page.text)
    }
}
