//! Words in an SVG: as text, which can be searched and set in another font.

use egui::epaint::TextShape;
use egui::text::TextFormat;
use egui::{Color32, FontFamily, Stroke};

use super::values::{color, number, turned};

/// The window's fonts, and what is most like them where they are missing.
const PROPORTIONAL: &str = "Ubuntu Light, Ubuntu, DejaVu Sans, Helvetica, sans-serif";
const MONOSPACE: &str = "Hack, DejaVu Sans Mono, Menlo, monospace";

/// Letters of one format beside each other in a row.
struct Run<'a> {
    format: &'a TextFormat,
    letters: String,
    /// Where it begins, and its base line \[points\].
    x: f32,
    y: f32,
    width: f32,
}

/// One element for each piece of a row that has one format.
pub(super) fn elements(text: &TextShape) -> Vec<String> {
    let runs = runs(text).into_iter();
    let seen = runs.filter(|run| !run.letters.trim().is_empty());
    seen.map(|run| element(text, &run)).collect()
}

fn runs(text: &TextShape) -> Vec<Run<'_>> {
    let job = &text.galley.job;
    let mut sections = job.sections.iter().peekable();
    let mut byte = 0;
    let mut runs: Vec<Run<'_>> = Vec::new();
    for placed in &text.galley.rows {
        let (left, top) = (text.pos.x + placed.pos.x, text.pos.y + placed.pos.y);
        let mut open: Option<Run<'_>> = None;
        for glyph in &placed.row.glyphs {
            // Letters that stand for what was cut off belong to the last section.
            while sections.len() > 1
                && sections
                    .peek()
                    .is_some_and(|section| section.byte_range.end.0 <= byte)
            {
                sections.next();
            }
            byte += glyph.chr.len_utf8();
            let Some(section) = sections.peek().copied() else {
                continue;
            };
            let (x, y) = (left + glyph.pos.x, top + glyph.pos.y);
            match &mut open {
                Some(run) if std::ptr::eq(run.format, &section.format) => {
                    run.letters.push(glyph.chr);
                    run.width = x + glyph.advance_width - run.x;
                }
                _ => {
                    runs.extend(open.replace(Run {
                        format: &section.format,
                        letters: glyph.chr.to_string(),
                        x,
                        y,
                        width: glyph.advance_width,
                    }));
                }
            }
        }
        runs.extend(open);
        byte += usize::from(placed.ends_with_newline);
    }
    runs
}

fn element(text: &TextShape, run: &Run<'_>) -> String {
    let own = |color: Color32| match color {
        Color32::PLACEHOLDER => text.fallback_color,
        color => color,
    };
    let faded = |color: Color32| color.gamma_multiply(text.opacity_factor);
    let ink = text
        .override_text_color
        .unwrap_or_else(|| own(run.format.color));
    let family = match &run.format.font_id.family {
        FontFamily::Monospace => MONOSPACE,
        FontFamily::Proportional | FontFamily::Name(_) => PROPORTIONAL,
    };
    let size = number(run.format.font_id.size);
    let line = match run.format.underline == Stroke::NONE {
        true => "",
        false => " text-decoration=\"underline\"",
    };
    // Spaces at the ends are nothing to be seen, and would be dropped.
    let [x, y, width] = [run.x, run.y, run.width].map(number);
    let fill = color("fill", faded(ink));
    let turned = turned(text.angle, text.pos);
    let letters = escaped(&run.letters);
    format!(
        "<text x=\"{x}\" y=\"{y}\" font-family=\"{family}\" font-size=\"{size}\" \
         textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\" xml:space=\"preserve\" \
         {fill}{line}{turned}>{letters}</text>"
    )
}

/// Text between two tags. What XML cannot hold is left out.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            letter if letter.is_control() => {}
            letter => escaped.push(letter),
        }
    }
    escaped
}
