//! Every decision in words.

use std::ops::Range;

use egui::{RichText, ScrollArea, TextStyle, Ui, Vec2};

use super::View;
use super::in_sight::bring_to_the_middle;
use crate::app::{Command, ViewContext};
use crate::event::Event;
use crate::narration;

/// The decisions up to the end of the run; those behind the cursor are pale.
#[derive(Default)]
pub struct LogView {
    /// Sentences with their positions, and how many records they were made from.
    lines: Vec<(usize, String)>,
    told: usize,
    sight: Sight,
    /// The lines as they are broken for a width, and that width in letters.
    rows: Vec<Row>,
    letters: usize,
}

/// What keeps the decision at the cursor in sight until somebody scrolls.
#[derive(Default)]
struct Sight {
    /// The cursor, and the room there was, when it was put there.
    put_for: Option<(usize, Vec2)>,
    /// Where it was put, and where the view is since \[points from the top\].
    put_at: f32,
    now_at: f32,
    /// Whether it is on its way there: areas scroll a frame after they are asked to.
    is_moving: bool,
}

impl Sight {
    /// Whether it is to be put there again: the cursor moved, or the room changed and nobody scrolled.
    fn is_lost(&self, cursor: usize, room: Vec2) -> bool {
        match self.put_for {
            Some((before, _)) if before != cursor => true,
            // What is shown is rounded to pixels.
            Some((_, before)) => before != room && (self.put_at - self.now_at).abs() < 1.0,
            None => true,
        }
    }
}

/// A part of a line that fits into the view.
struct Row {
    line: usize,
    /// Spaces before it, where it is not the first part.
    indent: String,
    part: Range<usize>,
}

/// How much farther in the parts of a line begin behind the first \[letters\].
const HANGING: usize = 2;
/// Lines are not broken to less than that \[letters\].
const NARROWEST: usize = 24;

impl LogView {
    fn take_in(&mut self, context: &ViewContext<'_>) {
        let records = context.run.records();
        if records.len() < self.told {
            *self = Self::default();
        }
        for (at, record) in records.iter().enumerate().skip(self.told) {
            let indent = "  ".repeat(record.depth.saturating_sub(1));
            let words = match &record.event {
                Event::StageStarted(started) => Some(started.stage.name().to_owned()),
                Event::StageEnded(ended) if !ended.succeeded => {
                    Some(format!("{} stopped here", ended.stage.name()))
                }
                event => narration::sentence(event).map(|words| format!("  {words}")),
            };
            if let Some(words) = words {
                self.lines.push((at, format!("{indent}{words}")));
            }
        }
        self.told = records.len();
    }
}

impl View for LogView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        self.take_in(context);
        if self.lines.is_empty() {
            ui.weak("Nothing was told yet");
            return;
        }
        self.wrap(ui);
        let here = self.lines.partition_point(|(at, _)| *at <= context.cursor);
        let first_here = self.rows.partition_point(|row| row.line + 1 < here);
        let height = ui.text_style_height(&TextStyle::Monospace);
        let room = ui.available_size();
        let is_lost = self.sight.is_lost(context.cursor, room);
        // An id of its own: a view that has all the room would share it with the view before.
        let area = ScrollArea::vertical().id_salt("log").auto_shrink(false);
        let shown = area.show_rows(ui, height, self.rows.len(), |ui, rows| {
            if is_lost {
                bring_to_the_middle(ui, rows.start, first_here, height);
            }
            for row in &self.rows[rows] {
                let (at, words) = &self.lines[row.line];
                let words = format!("{}{}", row.indent, &words[row.part.clone()]);
                let mut text = RichText::new(words).monospace();
                if row.line + 1 == here {
                    text = text.strong();
                } else if row.line >= here {
                    text = text.weak();
                }
                let label = egui::Label::new(text).sense(egui::Sense::click()).extend();
                if ui.add(label).on_hover_text(format!("step {at}")).clicked() {
                    context.send(Command::MoveCursor(*at));
                }
            }
        });
        self.sight.now_at = shown.state.clamped_offset().y;
        if self.sight.is_moving {
            self.sight.put_at = self.sight.now_at;
        }
        self.sight.is_moving = is_lost;
        if is_lost {
            self.sight.put_for = Some((context.cursor, room));
        }
    }
}

impl LogView {
    /// Breaks lines that are longer than the view is wide.
    fn wrap(&mut self, ui: &Ui) {
        let font = TextStyle::Monospace.resolve(ui.style());
        let letter = ui.fonts_mut(|fonts| fonts.glyph_width(&font, 'm'));
        let room = ui.available_width() - ui.spacing().scroll.allocated_width();
        let letters = ((room / letter.max(1.0)) as usize).max(NARROWEST);
        if letters != self.letters {
            self.letters = letters;
            self.rows.clear();
        }
        let wrapped = self.rows.last().map_or(0, |row| row.line + 1);
        for line in wrapped..self.lines.len() {
            let (_, words) = &self.lines[line];
            let indent = words.len() - words.trim_start().len();
            for (index, part) in parts(words, letters, indent + HANGING)
                .into_iter()
                .enumerate()
            {
                self.rows.push(Row {
                    line,
                    indent: match index {
                        0 => String::new(),
                        _ => " ".repeat(indent + HANGING),
                    },
                    part,
                });
            }
        }
    }
}

/// The parts of a line of which each fits into so many letters, broken between words where there are any;
/// those behind the first have an indent to stand behind.
fn parts(line: &str, letters: usize, indent: usize) -> Vec<Range<usize>> {
    let mut parts = Vec::new();
    let mut begin = 0;
    loop {
        let room = match begin {
            0 => letters,
            _ => letters.saturating_sub(indent).max(1),
        };
        let rest = &line[begin..];
        let Some((end, next)) = rest.char_indices().nth(room) else {
            parts.push(begin..line.len());
            return parts;
        };
        // The spaces that a line begins with are no place to break it.
        let from = rest.len() - rest.trim_start().len();
        let whole_words = &rest[..end + next.len_utf8()];
        let broken = whole_words.rfind(' ').filter(|space| *space > from);
        let end = begin + broken.unwrap_or(end);
        parts.push(begin..end);
        begin = end + line[end..].len() - line[end..].trim_start().len();
        if begin == line.len() {
            return parts;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wrapped(line: &str, letters: usize) -> Vec<&str> {
        let parts = parts(line, letters, 4).into_iter();
        parts.map(|part| &line[part]).collect()
    }

    #[test]
    fn a_line_breaks_between_words_and_a_long_word_anywhere() {
        assert_eq!(wrapped("  one two three", 20), ["  one two three"]);
        assert_eq!(wrapped("  one two three", 9), ["  one two", "three"]);
        assert_eq!(wrapped("abcdefghij", 6), ["abcdef", "gh", "ij"]);
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_nothing_is_too_long(
            line in "( ){0,6}[a-zé→]{1,9}( [a-zé→]{1,30}){0,12}", letters in 6_usize..60,
        ) {
            let parts = wrapped(&line, letters);
            prop_assert_eq!(parts.concat().replace(' ', ""), line.replace(' ', ""));
            for (index, part) in parts.iter().enumerate() {
                let room = if index == 0 { letters } else { letters - 4 };
                prop_assert!(part.chars().count() <= room, "{:?}", parts);
            }
        }
    }
}
