//! A page of a lesson: words about one moment of a run.

use crate::method::Method;

use super::moment::Moment;

/// A page.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Its words, in Markdown.
    pub text: String,
    /// What is localised: the name of a setting of the lesson.
    pub variant: String,
    /// The moment of the run that it is about.
    pub at: Moment,
    /// The views that are to be seen, by name, the largest first.
    pub show: Vec<String>,
    /// With the methods beside each other, so many steps into each of them.
    pub lockstep: Option<usize>,
    /// What is asked, before anything of the answer is shown.
    pub question: Option<Question>,
}

/// A question, and what is shown once it is answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// The question, in one sentence.
    pub ask: String,
    /// What an answer is.
    pub answer: Answer,
    /// The answer in words, in Markdown, told afterwards.
    pub because: String,
    /// The moment that the run is shown at then.
    pub reveal: Moment,
}

/// What an answer is.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// One of several choices.
    Choice {
        /// What can be chosen.
        choices: Vec<String>,
        /// Position of the right one.
        right: usize,
    },
    /// A place on the map: where this method will put the query.
    Place(Method),
}

impl Page {
    /// The page as Markdown that stands alone: with its title, and the question without its answer.
    pub fn markdown(&self, number: usize, pages: usize) -> String {
        let mut text = format!(
            "# {}\n\n*Page {number} of {pages}*\n\n{}\n",
            self.title, self.text
        );
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

    /// The same once the question is answered; `None` where nothing is asked.
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
