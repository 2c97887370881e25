//! The file of a lesson.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

use super::moment::Moment;
use super::number;
use super::page::{Answer, Page, Question};
use super::setting::{Fields, Setting};
use super::{Claim, Lesson};
use crate::measure::Condition;
use crate::method::Method;

/// Why a lesson cannot be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LessonError {
    /// There is no lesson with this name.
    #[error("`{name}` is neither a lesson nor a file; the lessons are {known}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The existing names.
        known: String,
    },
    /// The file cannot be read.
    #[error("{}: {why}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        why: String,
    },
    /// The file is malformed.
    #[error("lesson {name}, line {line}: {why}")]
    Malformed {
        /// The lesson.
        name: String,
        /// The line, from 1.
        line: usize,
        /// What was expected.
        why: String,
    },
    /// The results have no number for a placeholder.
    #[error("lesson {name}: no result has a number for {placeholders}")]
    Unfilled {
        /// The lesson.
        name: String,
        /// The placeholders.
        placeholders: String,
    },
}

/// The header of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    title: String,
    about: String,
    minutes: u32,
    setting: Fields,
    #[serde(default)]
    variant: BTreeMap<String, Fields>,
    #[serde(default)]
    claim: Vec<ClaimText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClaimText {
    variant: Option<String>,
    holds: String,
}

/// The header of a page; missing fields are those of the previous page.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PageHeader {
    variant: Option<String>,
    at: Option<Moment>,
    show: Option<Vec<String>>,
    lockstep: Option<usize>,
    question: Option<QuestionText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct QuestionText {
    ask: String,
    /// With `right`, counted from 1.
    #[serde(default)]
    choices: Vec<String>,
    right: Option<usize>,
    /// Instead of choices: where will this method put the query?
    place: Option<Method>,
    because: String,
    reveal: Option<Moment>,
}

/// TOML in the file.
struct Block {
    /// The line above it, from 1.
    line: usize,
    text: String,
}

/// The source of a page.
struct Section {
    title: String,
    line: usize,
    header: Option<Block>,
    /// Its text, with the number of each line.
    text: Vec<(usize, String)>,
}

/// The name of the first setting of a lesson.
const FIRST: &str = "first";

/// The default views of a lesson.
const SHOWN: [&str; 3] = ["images", "surface", "space"];

impl Lesson {
    /// Reads a lesson.
    ///
    /// # Errors
    /// [`LessonError::Malformed`], with the line.
    pub fn parse(name: &str, text: &str) -> Result<Self, LessonError> {
        let source = Source { name };
        let (header, sections) = source.sections(text)?;
        let block =
            header.ok_or_else(|| source.malformed(1, "a header between lines of +++ expected"))?;
        let header: Header = source.toml(&block)?;
        let setting = |fields: &Fields| {
            Setting::of(fields).map_err(|(at, why)| source.malformed_at(&block, at, &why))
        };
        let first = setting(&header.setting)?;
        let mut variants = vec![(FIRST.to_owned(), first.clone())];
        for (variant, fields) in header.variant {
            variants.push((variant, setting(&fields)?.over(&first)));
        }
        let known = |variant: &str, line: usize| {
            if variants.iter().any(|(name, _)| name == variant) {
                Ok(variant.to_owned())
            } else {
                Err(source.malformed(
                    line,
                    &format!("a variant of the header expected, `{variant}` found"),
                ))
            }
        };
        let mut claims = Vec::new();
        for claim in header.claim {
            claims.push(Claim {
                variant: known(claim.variant.as_deref().unwrap_or(FIRST), block.line)?,
                holds: (claim.holds.parse::<Condition>())
                    .map_err(|why| source.malformed(block.line, &why))?,
            });
        }
        let mut pages: Vec<Page> = Vec::new();
        for section in sections {
            pages.push(source.page(section, pages.last(), &known)?);
        }
        if pages.is_empty() {
            let end = text.lines().count();
            return Err(source.malformed(end, "a page expected, which begins with `## `"));
        }
        Ok(Self {
            name: name.to_owned(),
            title: header.title,
            about: header.about,
            minutes: header.minutes,
            variants,
            claims,
            pages,
        })
    }
}

struct Source<'a> {
    name: &'a str,
}

impl Source<'_> {
    fn malformed(&self, line: usize, why: &(impl ToString + ?Sized)) -> LessonError {
        LessonError::Malformed { name: self.name.to_owned(), line, why: why.to_string() }
    }

    /// An error at a byte of a block.
    fn malformed_at(
        &self,
        block: &Block,
        at: usize,
        why: &(impl ToString + ?Sized),
    ) -> LessonError {
        let before = block.text.bytes().take(at);
        let lines = before.filter(|byte| *byte == b'\n').count();
        self.malformed(block.line + 1 + lines, why)
    }

    fn toml<T: serde::de::DeserializeOwned>(&self, block: &Block) -> Result<T, LessonError> {
        toml::from_str(&block.text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            self.malformed_at(block, at, error.message())
        })
    }

    /// The header of the file and its pages.
    fn sections(&self, text: &str) -> Result<(Option<Block>, Vec<Section>), LessonError> {
        let mut header = None;
        let mut sections: Vec<Section> = Vec::new();
        let mut is_code = false;
        let mut lines = (1..).zip(text.lines());
        while let Some((line, text)) = lines.next() {
            let mut block_until = |fence: &str| {
                let inside = lines.by_ref().map(|(_, text)| text);
                let inside = inside.take_while(|text| text.trim_end() != fence);
                let text = inside.map(|text| format!("{text}\n")).collect();
                Block { line, text }
            };
            match text.trim_end() {
                "+++" if line == 1 => header = Some(block_until("+++")),
                "```page" if !is_code => match sections.last_mut() {
                    Some(page) if page.header.is_none() => page.header = Some(block_until("```")),
                    _ => {
                        return Err(self.malformed(
                            line,
                            "at most one header per page expected, below its heading",
                        ));
                    }
                },
                heading if heading.starts_with("## ") && !is_code => sections.push(Section {
                    title: heading[3..].trim().to_owned(),
                    line,
                    header: None,
                    text: Vec::new(),
                }),
                words => {
                    is_code ^= words.starts_with("```");
                    if let Some(page) = sections.last_mut() {
                        page.text.push((line, text.to_owned()));
                    }
                }
            }
        }
        Ok((header, sections))
    }

    fn page(
        &self,
        section: Section,
        before: Option<&Page>,
        known: &dyn Fn(&str, usize) -> Result<String, LessonError>,
    ) -> Result<Page, LessonError> {
        let (header, line) = match &section.header {
            Some(block) => (self.toml(block)?, block.line),
            None => (PageHeader::default(), section.line),
        };
        let variant = match (&header.variant, before) {
            (Some(variant), _) => known(variant, line)?,
            (None, Some(before)) => before.variant.clone(),
            (None, None) => FIRST.to_owned(),
        };
        let before = before.filter(|before| before.variant == variant);
        // After an answered question, the run stays at the moment of the answer.
        let left = before.map(|page| match &page.question {
            Some(question) => &question.reveal,
            None => &page.at,
        });
        let moment = header.at.or_else(|| left.cloned());
        let moment = moment.unwrap_or(Moment::Start);
        let question = header.question.map(|question| self.question(question, &moment, line));
        let shown = header.show.or_else(|| Some(before?.show.clone()));
        let question = question.transpose()?;
        let asked = question.iter().flat_map(Question::texts).map(|text| (line, text));
        let told = section.text.iter().map(|(line, text)| (*line, text));
        for (line, text) in told.chain(asked) {
            for variant in number::variants(text).map_err(|why| self.malformed(line, &why))? {
                known(variant, line)?;
            }
        }
        let text: Vec<String> = section.text.into_iter().map(|(_, text)| text).collect();
        Ok(Page {
            title: section.title,
            text: text.join("\n").trim().to_owned(),
            variant,
            at: moment,
            show: shown.unwrap_or_else(|| SHOWN.map(str::to_owned).to_vec()),
            lockstep: header.lockstep,
            question,
        })
    }

    fn question(
        &self,
        text: QuestionText,
        moment: &Moment,
        line: usize,
    ) -> Result<Question, LessonError> {
        let answer = match (text.place, text.right) {
            (Some(method), None) if text.choices.is_empty() => Answer::Place(method),
            (None, Some(right)) if (1..=text.choices.len()).contains(&right) => {
                Answer::Choice { choices: text.choices, right: right - 1 }
            }
            _ => {
                let why = "either `choices` with `right`, counted from 1, or `place` expected in a question";
                return Err(self.malformed(line, why));
            }
        };
        Ok(Question {
            ask: text.ask,
            answer,
            because: text.because,
            reveal: text.reveal.unwrap_or_else(|| moment.clone()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LESSON: &str = r#"+++
title = "Two pages"
about = "nothing"
minutes = 1
[setting]
scene = "street"
query = "70"
reference = ["62"]
[variant.dark]
query-scene = ["street:night"]
[[claim]]
variant = "dark"
holds = "method = mi and error < 1"
+++

## The first

```page
at = "after fb.match"
show = ["images"]
[question]
ask = "Which?"
choices = ["this", "that"]
right = 2
because = "So."
reveal = "after fb"
```

Some *words*.

## The second

More words.

## The third

```page
variant = "dark"
```
"#;

    #[test]
    fn a_lesson_says_what_is_run_and_what_is_asked() {
        let lesson = Lesson::parse("two", LESSON).expect("a lesson");
        let [first, second, third] = lesson.pages.as_slice() else {
            panic!("three pages: {:?}", lesson.pages);
        };
        assert_eq!((first.title.as_str(), first.text.as_str()), ("The first", "Some *words*."));
        let question = first.question.as_ref().expect("a question");
        assert!(matches!(&question.answer, Answer::Choice { right: 1, .. }));
        // A page goes on from where the one before has left the run.
        assert_eq!(second.at, question.reveal);
        assert_eq!(second.show, ["images"]);
        assert_eq!((third.variant.as_str(), &third.at), ("dark", &Moment::Start));
        let [light, dark] = [FIRST, "dark"].map(|name| {
            let task = lesson.setting(name).task();
            task.expect("a task").protocol
        });
        assert_eq!(dark.query_scene, ["street:night"]);
        assert_eq!(dark.references, light.references);
        let shown = first.markdown(1, 3);
        assert!(shown.contains("2. that") && !shown.contains("So."), "{shown}");
        assert!(first.answered(1, 3).expect("an answer").contains("So."));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (from, to, line, why) in [
            ("minutes = 1", "minutes = \"one\"", 4, "u32"),
            ("scene = ", "scenery = ", 6, "scenery"),
            ("[\"street:night\"]", "\"street:night\"", 10, "sequence"),
            ("error < 1\"", "error <\"", 1, "expected"),
            ("variant = \"dark\"\nholds", "variant = \"rain\"\nholds", 1, "rain"),
            ("after fb.match", "after lunch", 19, "lunch"),
            ("right = 2", "right = 3", 18, "right"),
            ("```page\nvariant = \"dark\"", "```page\nvariant = \"fog\"", 37, "fog"),
            ("+++\ntitle", "title", 1, "header"),
            ("More words.", "{fb.machtes}", 33, "machtes"),
            ("More words.", "{fog:fb.matches}", 33, "fog"),
            ("\"So.\"", "\"{sift.matches}\"", 18, "sift"),
        ] {
            assert!(LESSON.contains(from), "{from}");
            let broken = LESSON.replacen(from, to, 1);
            let error = Lesson::parse("two", &broken).expect_err(to);
            let LessonError::Malformed { line: found, .. } = &error else {
                panic!("{error}");
            };
            assert!(error.to_string().contains(why), "{to}: {error}");
            assert_eq!(*found, line, "{to}: {error}");
        }
    }
}
