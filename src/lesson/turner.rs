//! The pages of a lesson, each at its moment.

use std::collections::VecDeque;
use std::ops::Range;

use super::Lesson;
use super::moment::Watch;
use crate::trace::Record;

/// Turns the pages while a run is told, for somebody who reads them afterwards: a page comes at its
/// moment and not before the pages in front of it, and the answer to its question where that is shown.
#[derive(Clone, Debug)]
pub struct PageTurner {
    waiting: VecDeque<WaitingPage>,
}

#[derive(Clone, Debug)]
struct WaitingPage {
    watch: Watch,
    has_come: bool,
    text: String,
}

impl PageTurner {
    /// Turns these pages of a lesson, which follow each other in one run.
    pub fn new(lesson: &Lesson, pages: Range<usize>) -> Self {
        let all = lesson.pages.len();
        let mut waiting = VecDeque::new();
        for index in pages {
            let page = &lesson.pages[index];
            let mut wait = |moment: &super::Moment, text| {
                waiting.push_back(WaitingPage {
                    watch: Watch::new(moment.clone()),
                    has_come: false,
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

    /// The pages that come with a record, as Markdown. Every record must be shown.
    pub fn turn(&mut self, record: &Record) -> Vec<String> {
        for page in &mut self.waiting {
            page.has_come |= page.watch.is_reached(record);
        }
        let mut turned = Vec::new();
        while let Some(page) = self.waiting.pop_front_if(|page| page.has_come) {
            turned.push(page.text);
        }
        turned
    }

    /// The pages that are left when the run is over.
    pub fn rest(self) -> impl Iterator<Item = String> {
        self.waiting.into_iter().map(|page| page.text)
    }
}
