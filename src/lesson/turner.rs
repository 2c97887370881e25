//! The pages of a lesson, each at its moment.

use std::ops::Range;

use super::moment::Watch;
use super::number::Results;
use super::page::Page;
use super::{Lesson, LessonError};
use crate::trace::Record;

/// Turns the pages of a lesson during a run, for a recording. Each page comes at its moment, but not before earlier
/// pages; the answer to its question comes at its own moment. What they say is known when the run has its results.
#[derive(Clone, Debug)]
pub struct PageTurner {
    lesson: Lesson,
    pages: Range<usize>,
    moments: Vec<AwaitedMoment>,
    /// The number of moments that have come.
    turned: usize,
}

#[derive(Clone, Debug)]
struct AwaitedMoment {
    watch: Watch,
    is_reached: bool,
}

impl PageTurner {
    /// The turner for consecutive pages of a lesson that share one run.
    pub fn new(lesson: &Lesson, pages: Range<usize>) -> Self {
        let of_page = |page: &Page| {
            let reveal = page.question.as_ref().map(|question| question.reveal.clone());
            [Some(page.at.clone()), reveal].into_iter().flatten()
        };
        let moments = lesson.pages[pages.clone()].iter().flat_map(of_page);
        let moments =
            moments.map(|moment| AwaitedMoment { watch: Watch::new(moment), is_reached: false });
        Self { lesson: lesson.clone(), pages, moments: moments.collect(), turned: 0 }
    }

    /// The number of pages that come with a record. Must be called with every record.
    pub fn turn(&mut self, record: &Record) -> usize {
        let waiting = &mut self.moments[self.turned..];
        for moment in &mut *waiting {
            moment.is_reached |= moment.watch.is_reached(record);
        }
        let come = waiting.iter().take_while(|moment| moment.is_reached).count();
        self.turned += come;
        come
    }

    /// The number of pages that are left when the run is over.
    pub fn rest(&self) -> usize {
        self.moments.len() - self.turned
    }

    /// All pages in order, as Markdown, with the numbers of these results.
    ///
    /// # Errors
    /// [`LessonError::Unfilled`] beside the pages, if a number is missing.
    pub fn texts(&self, results: &Results) -> (Vec<String>, Result<(), LessonError>) {
        let all = self.lesson.pages.len();
        let (mut texts, mut missing) = (Vec::new(), Vec::new());
        for index in self.pages.clone() {
            let (page, without) = self.lesson.pages[index].filled(results);
            texts.push(page.markdown(index + 1, all));
            texts.extend(page.answered(index + 1, all));
            missing.extend(without);
        }
        let (name, placeholders) = (self.lesson.name.clone(), missing.join(", "));
        let unfilled = LessonError::Unfilled { name, placeholders };
        (texts, if missing.is_empty() { Ok(()) } else { Err(unfilled) })
    }
}
