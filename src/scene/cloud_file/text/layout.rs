//! The layout of a text cloud, from its first lines.
//!
//! Every combination of separator and decimal sign is tried. What could be read in two ways is refused.

use super::words::{Separator, Words, expected_number, is_comment, lone_count, number};
use crate::scene::lines::excerpt;

/// Where the coordinates are in a line.
#[derive(Debug)]
pub(super) struct Layout {
    separator: Separator,
    has_decimal_comma: bool,
    /// The columns of x, y and z.
    columns: [usize; 3],
    /// The number of columns, where a line with another number would be misread.
    width: Option<usize>,
    /// The position of the first line of points.
    pub first: usize,
    /// The number of points that precedes them.
    pub count: Option<u64>,
}

/// The position of a line, and what was expected of it.
type Refusal = (usize, String);

impl Layout {
    /// The layout of a file with these first lines; `None` if none of them has points.
    pub fn of(sample: &[String]) -> Result<Option<Self>, Refusal> {
        let mut tried: Vec<Attempt> = Vec::new();
        for has_decimal_comma in [false, true] {
            for separator in Separator::ALL {
                // Commas cannot be both.
                if !(has_decimal_comma && separator == Separator::Comma) {
                    let dialect = Dialect { separator, has_decimal_comma };
                    tried.extend(dialect.attempt(sample));
                }
            }
        }
        // What a dialect takes for titles must not be points in another one.
        let earliest = tried.iter().map(|attempt| attempt.layout.first).min();
        tried.retain(|attempt| Some(attempt.layout.first) == earliest);
        let reach = |attempt: &Attempt| attempt.broken.as_ref().map_or(usize::MAX, |(at, _)| *at);
        let furthest = tried.iter().map(reach).max();
        let Some(best) = tried.iter().position(|attempt| Some(reach(attempt)) == furthest) else {
            return Ok(None);
        };
        let Attempt { layout, broken, doubt } = tried.swap_remove(best);
        broken.or(doubt).map_or(Ok(Some(layout)), Err)
    }

    /// The point of a line \[m\].
    pub fn point(&self, line: &str) -> Result<[f64; 3], String> {
        let mut point = [0.0; 3];
        let (mut wide, mut found) = (0, 0);
        for word in self.separator.words(line) {
            if let Some(axis) = self.columns.iter().position(|column| *column == wide) {
                point[axis] = number(word, self.has_decimal_comma)
                    .ok_or_else(|| self.expected_number(word))?;
                found += 1;
            }
            wide += 1;
            if found == 3 && self.width.is_none() {
                return Ok(point);
            }
        }
        match self.width {
            Some(width) if wide != width => {
                Err(format!("{width} columns expected as in the lines above, {wide} found"))
            }
            _ if found < 3 => Err(format!("a line `x y z` expected, {wide} columns found")),
            _ => Ok(point),
        }
    }

    fn expected_number(&self, word: &str) -> String {
        let expected = expected_number(word);
        if word.contains([',', '.']) {
            return format!(
                "{expected}; write all numbers with decimal points, and separate all columns by one sign"
            );
        }
        expected
    }
}

/// How numbers are written and separated.
#[derive(Clone, Copy)]
struct Dialect {
    separator: Separator,
    has_decimal_comma: bool,
}

/// A dialect in which the first lines have points.
struct Attempt {
    layout: Layout,
    /// The first line that is none in this dialect.
    broken: Option<Refusal>,
    /// Why its points may mean something else.
    doubt: Option<Refusal>,
}

impl Dialect {
    fn words(self, line: &str) -> Words<'_> {
        self.separator.words(line)
    }

    fn number(self, word: &str) -> Option<f64> {
        number(word, self.has_decimal_comma)
    }

    /// Whether each word of a line is a number.
    fn shape(self, line: &str) -> Vec<bool> {
        self.words(line).map(|word| self.number(word).is_some()).collect()
    }

    /// Reads the first lines in this dialect; `None` if none of them is a point.
    fn attempt(self, sample: &[String]) -> Option<Attempt> {
        let mut header = None;
        let mut count = None;
        let lines = sample.iter().map(String::as_str).enumerate();
        for (at, line) in lines.clone() {
            if let Some(found) = Header::of(line) {
                header = Some((at, found));
                continue;
            }
            if is_comment(line) {
                continue;
            }
            if let Some(number) = lone_count(line) {
                count = Some(number);
                continue;
            }
            let next = sample[at + 1..].iter().find(|line| !is_comment(line));
            if !self.is_point(line, next.map(String::as_str), header.as_ref().map(|(_, h)| h)) {
                count = None;
                continue;
            }
            let width = self.words(line).count();
            let titles = lines.clone().take(at).filter(|(_, line)| !is_comment(line));
            let named = header.as_ref().map(|(named_at, header)| {
                let columns = header.columns(&sample[*named_at], width);
                columns.map_err(|expected| (*named_at, expected))
            });
            let (columns, misnamed) = match named {
                Some(Ok(columns)) => (columns, None),
                Some(Err(refusal)) => (None, Some(refusal)),
                None => (None, self.unnamed(titles, width)),
            };
            let is_named = columns.is_some();
            let columns = columns.unwrap_or([0, 1, 2]);
            // Where columns precede the coordinates or a comma separates them, one column more moves them.
            let is_rigid = columns != [0, 1, 2] || self.separator == Separator::Comma;
            let layout = Layout {
                separator: self.separator,
                has_decimal_comma: self.has_decimal_comma,
                columns,
                width: is_rigid.then_some(width),
                first: at,
                count,
            };
            let points = || {
                let points = lines.clone().skip(at);
                points.filter(|(_, line)| {
                    !is_comment(line) && (count.is_none() || lone_count(line).is_none())
                })
            };
            let broken = points()
                .find_map(|(at, line)| layout.point(line).err().map(|expected| (at, expected)));
            let ambiguous = (broken.is_none() && !is_named).then(|| {
                let points = points().map(|(_, line)| self.words(line).collect());
                Some((at, self.ambiguous(&points.collect::<Vec<Vec<&str>>>(), width)?))
            });
            let thousands = self.has_decimal_comma.then(|| {
                let words = points().flat_map(|(_, line)| self.words(line));
                let mut commas = words.filter(|word| word.contains(',')).peekable();
                let first = commas.peek().map(|word| excerpt(word))?;
                let is_open = commas.all(may_be_thousands);
                let expected = format!(
                    "decimal points expected: `{first}` may have a decimal comma or thousands"
                );
                is_open.then_some((at, expected))
            });
            let doubt = misnamed.or(ambiguous.flatten()).or(thousands.flatten());
            return Some(Attempt { layout, broken, doubt });
        }
        None
    }

    /// The title that has a word for each column, but not x, y and z.
    fn unnamed<'a>(
        self,
        mut titles: impl Iterator<Item = (usize, &'a str)>,
        width: usize,
    ) -> Option<Refusal> {
        let (at, _) = titles.find(|(_, title)| {
            let shape = self.shape(title);
            shape.len() == width && shape.iter().all(|is_number| !is_number)
        })?;
        let expected = "a header with x, y and z expected, other names found; call the columns of the coordinates \
                        x, y and z, or delete the line";
        Some((at, expected.to_owned()))
    }

    /// Whether a line is a point: its coordinates are numbers, and so are all its columns, or else those of the
    /// next line are of the same kinds.
    fn is_point(self, line: &str, next: Option<&str>, header: Option<&Header>) -> bool {
        let shape = self.shape(line);
        let columns = header.map_or([0, 1, 2], |header| header.at);
        let has = |column: &usize| shape.get(*column) == Some(&true);
        let commas = || line.match_indices(',').map(|(at, _)| line[at + 1..].starts_with(' '));
        // `1,5, 2,5, 3,5` has decimal commas, too.
        let is_mixed = self.separator == Separator::Comma
            && commas().any(|is_spaced| is_spaced)
            && commas().any(|is_spaced| !is_spaced);
        columns.iter().all(has)
            && !is_mixed
            && (shape.iter().all(|is_number| *is_number)
                || header.is_some()
                || next.is_some_and(|next| self.shape(next) == shape))
    }

    /// Why points without a header may mean something else.
    fn ambiguous(self, points: &[Vec<&str>], width: usize) -> Option<String> {
        /// So many lines that count up are no chance.
        const COUNTED: usize = 20;
        let first = |line: &Vec<&str>| line.first()?.parse::<i64>().ok();
        let counts_up = points.len() >= COUNTED
            && points.windows(2).all(|two| {
                first(&two[0]).is_some_and(|number| first(&two[1]) == number.checked_add(1))
            });
        if width > 3 && counts_up {
            return Some(
                "x expected as the first column, a count of the lines found; name the columns in a header"
                    .to_owned(),
            );
        }
        if self.separator != Separator::Comma {
            return None;
        }
        let words = || points.iter().flatten();
        let is_cut = |word: &&&str| {
            let digits = word.trim_start_matches(['-', '+']).as_bytes();
            digits.len() > 1
                && digits[0] == b'0'
                && digits[1].is_ascii_digit()
                && word.parse::<f64>().is_ok()
        };
        let halves = |line: &Vec<&str>| {
            line.chunks(2).take(3).all(|two| two.get(1).is_some_and(|word| !word.starts_with('-')))
        };
        let are_halves = width >= 6
            && words().all(|word| word.parse::<i64>().is_ok())
            && points.iter().all(halves);
        let odd = words().find(is_cut).or_else(|| words().find(|_| are_halves))?;
        Some(format!(
            "decimal points expected, or a header: the commas may be decimal commas (`{}` found)",
            excerpt(odd)
        ))
    }
}

/// Whether a number with a comma may be a whole one with its thousands marked.
fn may_be_thousands(word: &str) -> bool {
    let word = word.trim_matches(['"', '-', '+']);
    let (before, after) = word.split_once(',').unwrap_or((word, ""));
    after.len() == 3 && (1..=3).contains(&before.len()) && !before.starts_with('0')
}

/// A line that names the columns x, y and z.
struct Header {
    /// The columns of x, y and z.
    at: [usize; 3],
    width: usize,
    /// A word beside `x`, `y` or `z` that names another unit than metres.
    unit: Option<String>,
    is_twice: bool,
    is_comment: bool,
}

impl Header {
    fn of(line: &str) -> Option<Self> {
        Separator::ALL.into_iter().find_map(|separator| Self::in_words(line, separator))
    }

    fn in_words(line: &str, separator: Separator) -> Option<Self> {
        let bare = line.trim_start_matches(['#', '/']).trim();
        let words: Vec<&str> = separator
            .words(bare)
            // Units in words of their own, and a word such as `columns:`.
            .filter(|word| !(word.starts_with(['[', '(']) || word.ends_with(':') && word.len() > 1))
            .collect();
        let names: Vec<String> = words.iter().map(|word| name(word)).collect();
        let place = |called: &str| names.iter().position(|name| name == called);
        let at = [place("x")?, place("y")?, place("z")?];
        let is_metres = |unit: &str| {
            ["", "m", "meter", "meters", "metre", "metres"].contains(&unit.to_lowercase().as_str())
        };
        let other_unit = |word: &&&str| {
            let unit = word.split_once(['[', '(']).map(|(_, unit)| unit);
            unit.is_some_and(|unit| !is_metres(unit.trim_matches([']', ')', '"', ' '])))
        };
        let named = || at.iter().map(|column| &words[*column]);
        let more = |called: &str| names.iter().filter(|name| *name == called).count() > 1;
        Some(Self {
            at,
            width: words.len(),
            unit: named().find(other_unit).map(|word| excerpt(word)),
            is_twice: ["x", "y", "z"].into_iter().any(more),
            is_comment: bare.len() < line.trim().len(),
        })
    }

    /// The columns in lines of so many columns; `None` if a comment names others.
    fn columns(&self, line: &str, width: usize) -> Result<Option<[usize; 3]>, String> {
        if let Some(unit) = &self.unit {
            return Err(format!("coordinates in metres expected, `{unit}` found; convert them"));
        }
        if self.is_twice {
            return Err("one column of each of x, y and z expected, two found".to_owned());
        }
        if self.width == width {
            return Ok(Some(self.at));
        }
        // A comment that is longer may be a sentence; one that names only the first columns is clear.
        let is_clear = self.is_comment && (self.width > width || self.at == [0, 1, 2]);
        if is_clear {
            return Ok(None);
        }
        Err(format!(
            "a header of {width} columns expected, as many as the lines below have, {} found: `{}`",
            self.width,
            excerpt(line)
        ))
    }
}

/// A name of a column, in lower case and without quotes and unit; `x`, `y` or `z` for the coordinates in programs
/// built on VTK, too.
fn name(word: &str) -> String {
    let word = word.trim_matches(['"', '\'', ',', ';', ' ']).to_lowercase();
    let bare = word.split(['[', '(']).next().unwrap_or_default().trim();
    let part = bare.rsplit_once(':').filter(|(base, _)| base.starts_with("points"));
    match part {
        Some((_, "0")) => "x".to_owned(),
        Some((_, "1")) => "y".to_owned(),
        Some((_, "2")) => "z".to_owned(),
        _ => bare.to_owned(),
    }
}
