//! A page of a lesson: text about one moment of a run.

use crate::method::Method;

use super::moment::Moment;
use super::number::{self, Results};

/// A page.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Its text, in Markdown.
    pub text: String,
    /// The name of its setting.
    pub variant: String,
    /// The moment of the run that it shows.
    pub at: Moment,
    /// The names of the views to show, the largest first.
    pub show: Vec<String>,
    /// Show the methods in lockstep, this many steps into each.
    pub lockstep: Option<usize>,
    /// Its question, asked before the answer is shown.
    pub question: Option<Question>,
}

/// A question and its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// The question, in one sentence.
    pub ask: String,
    /// The kind of answer.
    pub answer: Answer,
    /// The explanation in Markdown, shown afterwards.
    pub because: String,
    /// The moment of the run to show then.
    pub reveal: Moment,
}

/// The kind of answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// One of several choices.
    Choice {
        /// What can be chosen.
        choices: Vec<String>,
        /// The position of the right choice.
        right: usize,
    },
    /// A place on the map: where this method puts the query.
    Place(Method),
}

impl Question {
    /// All its words.
    pub(super) fn texts(&self) -> impl Iterator<Item = &String> {
        let choices = match &self.answer {
            Answer::Choice { choices, .. } => choices.as_slice(),
            Answer::Place(_) => &[],
        };
        [&self.ask, &self.because].into_iter().chain(choices)
    }
}

impl Page {
    /// The page with the numbers of these results, and the placeholders without a value, which show as `…`.
    pub fn filled(&self, results: &Results) -> (Self, Vec<String>) {
        let mut missing = Vec::new();
        let mut page = self.clone();
        let mut fill = |text: &mut String| {
            *text = number::filled(text, &self.variant, results, &mut missing);
        };
        fill(&mut page.text);
        if let Some(question) = &mut page.question {
            fill(&mut question.ask);
            fill(&mut question.because);
            if let Answer::Choice { choices, .. } = &mut question.answer {
                choices.iter_mut().for_each(fill);
            }
        }
        (page, missing)
    }

    /// The whole page as Markdown: title, text, and the question without its answer.
    pub fn markdown(&self, number: usize, pages: usize) -> String {
        let mut text = format!("# {}\n\n*Page {number} of {pages}*\n\n{}\n", self.title, self.text);
        if let Some(question) = &self.question {
            text += &format!("\n**{}**\n\n", question.ask);
            if let Answer::Choice { choices, .. } = &question.answer {
                for (index, choice) in choices.iter().enumerate() {
                    text += &format!("{}. {choice}\n", index + 1);
                }
            }
            text += "\nThe answer is shown further on.\n";
        }
        text
    }

    /// The page with the answer; `None` if there is no question.
    pub fn answered(&self, number: usize, pages: usize) -> Option<String> {
        let question = self.question.as_ref()?;
        let answer = match &question.answer {
            Answer::Choice { choices, right } => choices[*right].clone(),
            Answer::Place(method) => format!("Where {} puts it, the map shows.", method.label()),
        };
        Some(format!(
            "# {}\n\n*Page {number} of {pages}*\n\n**{}**\n\n{answer}\n\n{}\n",
            self.title, question.ask, question.because
        ))
    }
}
