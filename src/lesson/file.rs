//! The file of a lesson.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use pulldown_cmark::{CodeBlockKind, Event, HeadingLevel, Options, Parser, Tag, TagEnd};
use serde::Deserialize;

use super::moment::Moment;
use super::page::{Answer, Page, Question};
use super::setting::Setting;
use super::{Claim, Lesson};
use crate::measure::Condition;
use crate::method::Method;

/// Why there is no lesson.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LessonError {
    /// No lesson of this name.
    #[error("there is no lesson `{name}`, and no such file; there are {known}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// The file cannot be read.
    #[error("{}: {why}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        why: String,
    },
    /// The file is no lesson.
    #[error("lesson {name}, line {line}: {why}")]
    Malformed {
        /// The lesson.
        name: String,
        /// The line, from 1.
        line: usize,
        /// What was expected.
        why: String,
    },
}

/// The header of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    title: String,
    about: String,
    minutes: u32,
    setting: Setting,
    #[serde(default)]
    variant: BTreeMap<String, Setting>,
    #[serde(default)]
    claim: Vec<ClaimText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClaimText {
    variant: Option<String>,
    holds: String,
}

/// The header of a page; what it does not say is as on the page before.
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

/// A page as it stands in the file.
#[derive(Default)]
struct Section {
    title: String,
    heading: Range<usize>,
    header: Option<(Range<usize>, String)>,
}

/// The name of the setting that a lesson begins with.
const FIRST: &str = "first";

/// The views of a lesson that says nothing of them.
const SHOWN: [&str; 3] = ["images", "surface", "space"];

impl Lesson {
    /// Reads a lesson.
    ///
    /// # Errors
    /// [`LessonError::Malformed`], with the line.
    pub fn parse(name: &str, text: &str) -> Result<Self, LessonError> {
        let source = Source { name, text };
        let (header, sections) = source.sections()?;
        let (range, header) =
            header.ok_or_else(|| source.malformed(0, "a header between lines of +++ expected"))?;
        let header: Header = source.toml(&header, range.start)?;
        let mut variants = vec![(FIRST.to_owned(), header.setting.clone())];
        for (variant, setting) in header.variant {
            variants.push((variant, setting.over(&header.setting)));
        }
        let known = |variant: &str, at: usize| {
            if variants.iter().any(|(name, _)| name == variant) {
                Ok(variant.to_owned())
            } else {
                Err(source.malformed(at, &format!("there is no variant `{variant}`")))
            }
        };
        let mut claims = Vec::new();
        for claim in header.claim {
            claims.push(Claim {
                variant: known(claim.variant.as_deref().unwrap_or(FIRST), range.start)?,
                holds: (claim.holds.parse::<Condition>())
                    .map_err(|why| source.malformed(range.start, &why.to_string()))?,
            });
        }
        let mut pages: Vec<Page> = Vec::new();
        for (index, section) in sections.iter().enumerate() {
            let end = sections.get(index + 1);
            let end = end.map_or(text.len(), |next| next.heading.start);
            pages.push(source.page(section, end, pages.last(), &known)?);
        }
        if pages.is_empty() {
            return Err(source.malformed(text.len(), "a page, which begins with `## `, expected"));
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
    text: &'a str,
}

/// A text and where it is.
type Placed = (Range<usize>, String);

impl Source<'_> {
    fn malformed(&self, at: usize, why: &str) -> LessonError {
        let before = &self.text.as_bytes()[..at.min(self.text.len())];
        LessonError::Malformed {
            name: self.name.to_owned(),
            line: 1 + before.iter().filter(|byte| **byte == b'\n').count(),
            why: why.to_owned(),
        }
    }

    /// Reads TOML that begins behind a line at `at`.
    fn toml<T: serde::de::DeserializeOwned>(
        &self,
        text: &str,
        at: usize,
    ) -> Result<T, LessonError> {
        toml::from_str(text).map_err(|error| {
            let lines = error.span().map_or(0, |span| {
                let before = text.as_bytes().iter().take(span.start);
                before.filter(|byte| **byte == b'\n').count()
            });
            let line = self.malformed(at, "");
            match line {
                LessonError::Malformed { name, line, .. } => LessonError::Malformed {
                    name,
                    // The block's first line is its fence.
                    line: line + 1 + lines,
                    why: error.message().to_owned(),
                },
                other => other,
            }
        })
    }

    /// The header of the file and its pages.
    fn sections(&self) -> Result<(Option<Placed>, Vec<Section>), LessonError> {
        let mut header = None;
        let mut sections: Vec<Section> = Vec::new();
        // What the text that comes next belongs to.
        let mut block: Option<(Block, Placed)> = None;
        let options = Options::ENABLE_PLUSES_DELIMITED_METADATA_BLOCKS;
        for (event, range) in Parser::new_ext(self.text, options).into_offset_iter() {
            match event {
                Event::Start(Tag::MetadataBlock(_)) => {
                    block = Some((Block::Header, (range, String::new())));
                }
                Event::Start(Tag::Heading {
                    level: HeadingLevel::H2,
                    ..
                }) => block = Some((Block::Heading, (range, String::new()))),
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) if &*kind == "page" => {
                    block = Some((Block::Page, (range, String::new())));
                }
                Event::Text(words) | Event::Code(words) => {
                    if let Some((_, (_, text))) = &mut block {
                        text.push_str(&words);
                    }
                }
                Event::End(TagEnd::MetadataBlock(_) | TagEnd::Heading(_) | TagEnd::CodeBlock) => {
                    match (block.take(), sections.last_mut()) {
                        (Some((Block::Header, placed)), _) => header = Some(placed),
                        (Some((Block::Heading, (heading, title))), _) => sections.push(Section {
                            title,
                            heading,
                            header: None,
                        }),
                        (Some((Block::Page, placed)), Some(section))
                            if section.header.is_none() =>
                        {
                            section.header = Some(placed);
                        }
                        (Some((Block::Page, (range, _))), _) => {
                            let why = "a page has one header, below its heading";
                            return Err(self.malformed(range.start, why));
                        }
                        (None, _) => {}
                    }
                }
                _ => {}
            }
        }
        Ok((header, sections))
    }

    fn page(
        &self,
        section: &Section,
        end: usize,
        before: Option<&Page>,
        known: &dyn Fn(&str, usize) -> Result<String, LessonError>,
    ) -> Result<Page, LessonError> {
        let start = section.heading.end;
        let (header, at, text) = match &section.header {
            Some((range, toml)) => {
                let header: PageHeader = self.toml(toml, range.start)?;
                let words = format!(
                    "{}{}",
                    &self.text[start..range.start],
                    &self.text[range.end..end]
                );
                (header, range.start, words)
            }
            None => (
                PageHeader::default(),
                section.heading.start,
                self.text[start..end].to_owned(),
            ),
        };
        let variant = match (&header.variant, before) {
            (Some(variant), _) => known(variant, at)?,
            (None, Some(before)) => before.variant.clone(),
            (None, None) => FIRST.to_owned(),
        };
        let before = before.filter(|before| before.variant == variant);
        // A question that was answered has left the run where its answer is.
        let left = before.map(|page| match &page.question {
            Some(question) => &question.reveal,
            None => &page.at,
        });
        let moment = header.at.or_else(|| left.cloned());
        let moment = moment.unwrap_or(Moment::Start);
        let question = match header.question {
            Some(question) => Some(self.question(question, &moment, at)?),
            None => None,
        };
        let shown = header.show.or_else(|| Some(before?.show.clone()));
        Ok(Page {
            title: section.title.trim().to_owned(),
            text: text.trim().to_owned(),
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
        at: usize,
    ) -> Result<Question, LessonError> {
        let answer = match (text.place, text.right) {
            (Some(method), None) if text.choices.is_empty() => Answer::Place(method),
            (None, Some(right)) if (1..=text.choices.len()).contains(&right) => Answer::Choice {
                choices: text.choices,
                right: right - 1,
            },
            _ => {
                let why = "a question has either `choices` with `right` counted from 1, or `place`";
                return Err(self.malformed(at, why));
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

/// A part of the file that has a meaning.
#[derive(Clone, Copy)]
enum Block {
    Header,
    Heading,
    Page,
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
        assert_eq!(
            (first.title.as_str(), first.text.as_str()),
            ("The first", "Some *words*.")
        );
        let question = first.question.as_ref().expect("a question");
        assert!(matches!(&question.answer, Answer::Choice { right: 1, .. }));
        // A page goes on from where the one before has left the run.
        assert_eq!(second.at, question.reveal);
        assert_eq!(second.show, ["images"]);
        assert_eq!(
            (third.variant.as_str(), &third.at),
            ("dark", &Moment::Start)
        );
        let [light, dark] = [FIRST, "dark"].map(|name| {
            let task = lesson.setting(name).task();
            task.expect("a task").protocol
        });
        assert_eq!(dark.query_scene, ["street:night"]);
        assert_eq!(dark.references, light.references);
        let shown = first.markdown(1, 3);
        assert!(
            shown.contains("2. that") && !shown.contains("So."),
            "{shown}"
        );
        assert!(first.answered(1, 3).expect("an answer").contains("So."));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (from, to, line, why) in [
            ("minutes = 1", "minutes = \"one\"", 4, "u32"),
            ("scene = ", "scenery = ", 6, "scenery"),
            ("[\"street:night\"]", "\"street:night\"", 10, "sequence"),
            ("error < 1\"", "error <\"", 1, "expected"),
            (
                "variant = \"dark\"\nholds",
                "variant = \"rain\"\nholds",
                1,
                "rain",
            ),
            ("after fb.match", "after lunch", 19, "lunch"),
            ("right = 2", "right = 3", 18, "right"),
            (
                "```page\nvariant = \"dark\"",
                "```page\nvariant = \"fog\"",
                37,
                "fog",
            ),
            ("+++\ntitle", "title", 1, "header"),
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
