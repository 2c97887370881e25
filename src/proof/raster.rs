//! Painting a proof on the processor: what reports and recordings show.

use std::sync::LazyLock;

use image::imageops;
use image::{Rgb, RgbImage};
use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider as _};
use vello_cpu::color::AlphaColor;
use vello_cpu::kurbo::{BezPath, Circle, Rect, Shape as _, Stroke};
use vello_cpu::peniko::{Blob, FontData};
use vello_cpu::{Glyph, Level, Pixmap, RenderContext, RenderSettings, Resources};

use super::layout::{MARK, free_corner, label_place, title_end};
use super::{ColorScale, Mark, Panel, Place, ProofPicture, Thing};
use crate::palette::{self, Rgb as Color};

/// The ground between panels.
const GROUND: Color = [0x22, 0x24, 0x28];
const WORDS: Color = [0xE8; 3];
/// Size of titles and labels \[px\].
const FONT_PX: f32 = 13.0;
/// Height of a line of the sentence \[px\].
const LINE: f32 = 19.0;
/// Length of a bar of colours, and the height of its ground \[px\].
const SCALE_BAR: f32 = 90.0;
const SCALE_HEIGHT: f32 = 24.0;
/// Height of a label with its ground \[px\].
const LABEL_HEIGHT: f32 = 17.0;

static FONT: LazyLock<FontData> = LazyLock::new(|| {
    let bytes: &'static [u8] = epaint_default_fonts::UBUNTU_LIGHT;
    FontData::new(Blob::from(bytes.to_vec()), 0)
});

impl ProofPicture {
    /// The sentence and below it the panels, in this width \[px\].
    pub fn raster(&self, width: u32, sentence: &str) -> RgbImage {
        let width = width.clamp(200, 4096);
        let lines = wrapped(sentence, width as f32 - 8.0);
        let head = LINE * lines.len() as f32;
        let (mut places, height) = self.on_page(width as f32);
        let height = ((head + height) as u32).clamp(1, 8192);
        let mut canvas = RgbImage::from_pixel(width, height, Rgb(GROUND));
        for place in &mut places {
            place.top += head;
        }
        for (panel, place) in self.panels().zip(&places) {
            paste(&mut canvas, panel, place);
        }
        // The same on every processor.
        let settings = RenderSettings { level: Level::baseline(), num_threads: 0 };
        let mut painter = Painter {
            context: RenderContext::new_with(width as u16, height as u16, settings),
            resources: Resources::new(),
            width: width as f32,
        };
        for (row, line) in lines.iter().enumerate() {
            painter.words(line, [4.0, LINE * row as f32 + 14.0], WORDS);
        }
        for (panel, place) in self.panels().zip(&places) {
            let end = title_end(place, &places, width as f32);
            painter.panel(panel, place, end);
        }
        painter.lay_over(&mut canvas);
        canvas
    }
}

/// Puts the panel's picture into its place.
fn paste(canvas: &mut RgbImage, panel: &Panel, place: &Place) {
    let size = [place.width, place.height].map(|length| (length.round() as u32).max(1));
    let picture = panel.picture.as_ref();
    let picture = if panel.has_cells {
        let [width, height] = size;
        let cell = |x, y| [x * picture.width() / width, y * picture.height() / height];
        RgbImage::from_fn(width, height, |x, y| {
            let [column, row] = cell(x, y);
            *picture.get_pixel(column, row)
        })
    } else {
        imageops::thumbnail(picture, size[0], size[1])
    };
    imageops::replace(canvas, &picture, place.left.round() as i64, place.top.round() as i64);
}

struct Painter {
    context: RenderContext,
    resources: Resources,
    width: f32,
}

impl Painter {
    /// Draws all of a panel but its picture. The title ends at `end`.
    fn panel(&mut self, panel: &Panel, place: &Place, end: f32) {
        let title = elided(&panel.title, end - place.left);
        self.words(&title, [place.left, place.top - 5.0], WORDS);
        let scale = [
            place.width / panel.picture.width().max(1) as f32,
            place.height / panel.picture.height().max(1) as f32,
        ];
        let on_canvas =
            |at: [f32; 2]| [place.left + at[0] * scale[0], place.top + at[1] * scale[1]];
        let clip = Rect::new(
            place.left.into(),
            place.top.into(),
            (place.left + place.width).into(),
            (place.top + place.height).into(),
        );
        self.context.push_clip_layer(&clip.to_path(0.1));
        for line in &panel.lines {
            let mut path = BezPath::new();
            for (at, point) in line.points.iter().enumerate() {
                let point = on_canvas(*point).map(f64::from);
                if at == 0 {
                    path.move_to((point[0], point[1]));
                } else {
                    path.line_to((point[0], point[1]));
                }
            }
            self.stroke(&path, line.color, line.width.into());
        }
        let scale_corner = panel.scale.as_ref().map(|scale| {
            let size = [scale_width(scale), SCALE_HEIGHT];
            free_corner(place, size, panel.marks.iter().map(|mark| on_canvas(mark.at)))
        });
        let mut taken: Vec<Place> = Vec::new();
        if let (Some(scale), Some([left, top])) = (&panel.scale, scale_corner) {
            taken.push(Place { left, top, width: scale_width(scale), height: SCALE_HEIGHT });
        }
        for mark in &panel.marks {
            self.mark(mark, on_canvas(mark.at));
        }
        for mark in panel.marks.iter().filter(|mark| !mark.label.is_empty()) {
            let at = on_canvas(mark.at);
            if mark.thing == Thing::Words {
                self.words(&mark.label, [at[0], at[1] + 4.5], WORDS);
                continue;
            }
            let size = [width_of(&mark.label) + 6.0, LABEL_HEIGHT];
            self.label(&mark.label, &label_place(at, size, place, &mut taken));
        }
        self.context.pop_layer();
        if let (Some(scale), Some(corner)) = (&panel.scale, scale_corner) {
            self.scale(scale, corner);
        }
    }

    fn mark(&mut self, mark: &Mark, at: [f32; 2]) {
        let (x, y) = (f64::from(at[0]), f64::from(at[1]));
        let size = f64::from(MARK);
        let shape = match mark.thing {
            Thing::Reference => Circle::new((x, y), size).to_path(0.1),
            Thing::Truth => {
                path(&[&[(x - size, y), (x + size, y)], &[(x, y - size), (x, y + size)]])
            }
            Thing::Result(_) => {
                let corners =
                    [(x, y - size), (x + size, y), (x, y + size), (x - size, y), (x, y - size)];
                path(&[&corners])
            }
            Thing::Dot(_) => Circle::new((x, y), 3.0).to_path(0.1),
            Thing::Words => return,
        };
        self.stroke(&shape, [0; 3], 5.0);
        self.stroke(&shape, mark.thing.color(), 2.5);
    }

    /// Words on a dark ground.
    fn label(&mut self, words: &str, place: &Place) {
        let ground = Rect::new(
            place.left.into(),
            place.top.into(),
            (place.left + place.width).into(),
            (place.top + place.height).into(),
        );
        self.context.set_paint(AlphaColor::from_rgba8(0, 0, 0, 190));
        self.context.fill_rect(&ground);
        self.words(words, [place.left + 3.0, place.top + 12.0], WORDS);
    }

    fn stroke(&mut self, path: &BezPath, color: Color, width: f64) {
        let [red, green, blue] = color;
        self.context.set_paint(AlphaColor::from_rgba8(red, green, blue, 255));
        self.context.set_stroke(Stroke::new(width));
        self.context.stroke_path(path);
    }

    /// Words that begin at a place, on their base line; what does not fit is cut off with an ellipsis.
    fn words(&mut self, words: &str, at: [f32; 2], color: Color) {
        let words = elided(words, self.width - at[0]);
        let [red, green, blue] = color;
        self.context.set_paint(AlphaColor::from_rgba8(red, green, blue, 255));
        let glyphs = glyphs(&words, at);
        let run = self.context.glyph_run(&mut self.resources, &FONT);
        run.font_size(FONT_PX).hint(false).fill_glyphs(glyphs.into_iter());
    }

    /// A bar of colours with the numbers at its ends.
    fn scale(&mut self, scale: &ColorScale, corner: [f32; 2]) {
        const STEPS: u32 = 64;
        let bar = SCALE_BAR;
        let ground = Rect::new(
            corner[0].into(),
            corner[1].into(),
            (corner[0] + scale_width(scale)).into(),
            (corner[1] + SCALE_HEIGHT).into(),
        );
        let [left, top] = corner.map(|along| along + 4.0);
        self.context.set_paint(AlphaColor::from_rgba8(0, 0, 0, 190));
        self.context.fill_rect(&ground);
        self.words(&scale.dark, [left, top + 12.0], WORDS);
        let start = left + width_of(&scale.dark) + 6.0;
        for step in 0..STEPS {
            let [red, green, blue] = palette::viridis((f64::from(step) + 0.5) / f64::from(STEPS));
            self.context.set_paint(AlphaColor::from_rgba8(red, green, blue, 255));
            let x = f64::from(start + bar * step as f32 / STEPS as f32);
            let width = f64::from(bar) / f64::from(STEPS) + 0.5;
            self.context.fill_rect(&Rect::new(x, top.into(), x + width, f64::from(top) + 14.0));
        }
        self.words(&scale.bright, [start + bar + 6.0, top + 12.0], WORDS);
    }

    fn lay_over(mut self, canvas: &mut RgbImage) {
        self.context.flush();
        let mut pixmap = Pixmap::new(self.context.width(), self.context.height());
        self.context.render(&mut pixmap, &mut self.resources);
        for (below, above) in canvas.pixels_mut().zip(pixmap.data()) {
            let through = 255 - u32::from(above.a);
            let premultiplied = [above.r, above.g, above.b];
            below.0 = std::array::from_fn(|channel| {
                let mixed =
                    u32::from(premultiplied[channel]) * 255 + u32::from(below.0[channel]) * through;
                (mixed / 255) as u8
            });
        }
    }
}

/// How wide the ground of a bar of colours is \[px\].
fn scale_width(scale: &ColorScale) -> f32 {
    width_of(&scale.dark) + width_of(&scale.bright) + SCALE_BAR + 20.0
}

fn path(lines: &[&[(f64, f64)]]) -> BezPath {
    let mut path = BezPath::new();
    for line in lines {
        for (at, &point) in line.iter().enumerate() {
            if at == 0 {
                path.move_to(point);
            } else {
                path.line_to(point);
            }
        }
    }
    path
}

/// The glyphs of words that begin at a place.
fn glyphs(words: &str, at: [f32; 2]) -> Vec<Glyph> {
    let Ok(font) = FontRef::new(epaint_default_fonts::UBUNTU_LIGHT) else {
        return Vec::new();
    };
    let (map, metrics) =
        (font.charmap(), font.glyph_metrics(Size::new(FONT_PX), LocationRef::default()));
    let mut x = at[0];
    let glyph = |letter: char| {
        let id = map.map(letter).unwrap_or_default();
        let glyph = Glyph { id: id.to_u32(), x, y: at[1] };
        x += metrics.advance_width(id).unwrap_or_default();
        glyph
    };
    words.chars().map(glyph).collect()
}

/// How wide words are \[px\].
fn width_of(words: &str) -> f32 {
    // One letter more, whose place is the end of the words.
    let glyphs = glyphs(&format!("{words}."), [0.0, 0.0]);
    glyphs.last().map_or(0.0, |last| last.x)
}

/// Words in lines that fit a width; none for no words.
fn wrapped(words: &str, width: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_of(&format!("{line} {word}")) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// As much of the words as fits.
fn elided(words: &str, width: f32) -> String {
    if width_of(words) <= width {
        return words.to_owned();
    }
    let mut kept: Vec<char> = words.chars().collect();
    while kept.pop().is_some() {
        let shorter: String = kept.iter().chain(&['…']).collect();
        if width_of(&shorter) <= width {
            return shorter;
        }
    }
    String::new()
}
