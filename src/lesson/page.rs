//! A page of a lesson: text about one moment of a run.

use crate::method::Method;

use super::moment::Moment;

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

impl Page {
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
