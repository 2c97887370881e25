//! Lessons: guided runs with text, questions and claims.
//!
//! A lesson is one Markdown file. Its header, TOML between lines of `+++`, defines the run. Each heading of the
//! second level begins a page. The page's own header, a code block called `page`, defines the moment of the run and
//! the question. Numbers of a run stand in the words as placeholders. `docs/lessons.md` lists all fields.

mod file;
mod moment;
mod number;
mod page;
mod setting;
mod turner;

use std::ops::Range;
use std::path::Path;

use include_dir::{Dir, include_dir};
use posescope_core::files;

pub use file::LessonError;
pub use moment::{Moment, MomentError, Watch};
pub use number::Results;
pub use page::{Answer, Page, Question};
pub use setting::{Setting, SettingError, named_scenes};
pub use turner::PageTurner;

use crate::measure::Condition;

/// The built-in lessons, each `NUMBER-NAME.md`.
static LESSONS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/assets/lessons");

/// A lesson: guided runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesson {
    /// The name on the command line.
    pub name: String,
    /// The title.
    pub title: String,
    /// A summary in one line.
    pub about: String,
    /// Its duration \[min\].
    pub minutes: u32,
    /// The named settings that pages localise; the first is that of the first page.
    pub variants: Vec<(String, Setting)>,
    /// Conditions on the results under which the text is true.
    pub claims: Vec<Claim>,
    /// The pages, at least one.
    pub pages: Vec<Page>,
}

/// A condition on the results under which the text of a lesson is true.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The name of its setting.
    pub variant: String,
    /// A condition that at least one result of the setting meets.
    pub holds: Condition,
}

impl Lesson {
    /// All built-in lessons in order.
    ///
    /// # Errors
    /// A malformed file; a test reads them all.
    pub fn all() -> Result<Vec<Self>, LessonError> {
        let mut files: Vec<_> = LESSONS.files().collect();
        files.sort_by_key(|file| file.path());
        let lessons = files.into_iter().map(|file| {
            let name = name_of(file.path());
            Self::parse(&name, file.contents_utf8().unwrap_or_default())
        });
        lessons.collect()
    }

    /// A lesson by its name, or from a file.
    ///
    /// # Errors
    /// There is no such lesson, or the file is malformed.
    pub fn open(name: &str) -> Result<Self, LessonError> {
        let path = Path::new(name);
        if path.is_file() {
            let text = files::read_text(path, files::DESCRIPTION).map_err(|error| {
                LessonError::Unreadable { path: path.to_owned(), why: error.to_string() }
            })?;
            return Self::parse(name, &text);
        }
        let all = Self::all()?;
        let names: Vec<&str> = all.iter().map(|lesson| lesson.name.as_str()).collect();
        let unknown = LessonError::Unknown { name: name.to_owned(), known: names.join(", ") };
        let mut all = all.into_iter();
        all.find(|lesson| lesson.name == name).ok_or(unknown)
    }

    /// Consecutive pages with the same setting, in order: the name of the setting, and the pages.
    pub fn groups(&self) -> Vec<(&str, Range<usize>)> {
        let mut end = 0;
        let groups = self.pages.chunk_by(|a, b| a.variant == b.variant).map(|pages| {
            let start = end;
            end += pages.len();
            (pages[0].variant.as_str(), start..end)
        });
        groups.collect()
    }

    /// The setting of this name; the first one if there is none.
    pub fn setting(&self, variant: &str) -> &Setting {
        let found = self.variants.iter().find(|(name, _)| name == variant);
        found.map_or(&self.variants[0].1, |(_, setting)| setting)
    }
}

/// `light` for `04-light.md`.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = stem.trim_start_matches(|c: char| c.is_ascii_digit() || c == '-');
    name.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lesson_is_read_and_has_a_name_of_its_own() {
        let lessons = Lesson::all().expect("our own");
        assert!(!lessons.is_empty());
        let mut names: Vec<_> = lessons.iter().map(|lesson| &lesson.name).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), lessons.len());
        for lesson in &lessons {
            assert!(!lesson.pages.is_empty(), "{}", lesson.name);
            assert!(!lesson.claims.is_empty(), "{} claims nothing", lesson.name);
            assert_eq!(Lesson::open(&lesson.name).as_ref(), Ok(lesson));
        }
    }

    #[test]
    fn an_unknown_lesson_is_answered_by_those_there_are() {
        let why = Lesson::open("nonsense").expect_err("none").to_string();
        assert!(why.contains("four-points"), "{why}");
    }
}
