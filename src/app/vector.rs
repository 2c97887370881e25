//! What was drawn as SVG: lines, marks and words stay what they are, photos and maps become pictures in it.

mod elements;
mod not_drawn;
mod picture;
mod values;
mod words;

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use egui::emath::TSTransform;
use egui::epaint::{ClippedShape, ImageData, ImageDelta};
use egui::{Color32, Context, FullOutput, Plugin, Rect, TextureFilter, TextureId};

pub(super) use not_drawn::NotDrawn;

use elements::Elements;
use picture::Picture;

/// A drawing that was asked for.
struct Asked {
    path: PathBuf,
    /// The part of the window \[points\]; all of it without.
    area: Option<Rect>,
}

#[derive(Default)]
struct State {
    pictures: HashMap<TextureId, Picture>,
    asked: Vec<Asked>,
    /// What to say of those that were written or not.
    said: Vec<Result<String, String>>,
}

/// Sees what is drawn in each frame, and writes what is asked for.
#[derive(Clone, Default)]
pub(super) struct Drawings(Arc<Mutex<State>>);

impl Drawings {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks for the next frame, or a part of it \[points\], in a file.
    pub(super) fn ask(&self, ctx: &Context, path: PathBuf, area: Option<Rect>) {
        self.lock().asked.push(Asked { path, area });
        ctx.request_repaint();
    }

    /// What to say of what was written since the last call.
    pub(super) fn take_said(&self) -> Vec<Result<String, String>> {
        std::mem::take(&mut self.lock().said)
    }

    /// A part of a frame \[points\], on the ground of the theme.
    pub(super) fn svg(
        &self,
        shapes: &[ClippedShape],
        area: Rect,
        ground: Color32,
    ) -> Result<String, NotDrawn> {
        written(shapes, area, ground, &self.lock().pictures)
    }
}

impl State {
    fn take_pictures(&mut self, output: &FullOutput) {
        for (id, changes) in &output.textures_delta.set {
            // That of all letters changes in parts, and is never shown as a picture.
            let whole = changes.iter().rev().find(|change| change.pos.is_none());
            let Some(ImageDelta { image, options, .. }) = whole else {
                continue;
            };
            let ImageData::Color(image) = image;
            let picture = Picture {
                image: Arc::clone(image),
                is_pixelated: options.magnification == TextureFilter::Nearest,
            };
            self.pictures.insert(*id, picture);
        }
    }

    fn write(&mut self, ctx: &Context, output: &FullOutput) {
        let ground = ctx.global_style().visuals.panel_fill;
        for Asked { path, area } in std::mem::take(&mut self.asked) {
            let area = area.unwrap_or_else(|| ctx.content_rect());
            let said = |why: &dyn std::fmt::Display| format!("{}: {why}", path.display());
            let text = written(&output.shapes, area, ground, &self.pictures);
            let is_done = text.map_err(|why| said(&why)).and_then(|text| {
                if let Some(folder) = path.parent() {
                    std::fs::create_dir_all(folder).map_err(|why| said(&why))?;
                }
                std::fs::write(&path, text).map_err(|why| said(&why))
            });
            let words = is_done.map(|()| format!("Picture: {}", path.display()));
            self.said.push(words);
            ctx.request_repaint();
        }
    }
}

impl Plugin for Drawings {
    fn debug_name(&self) -> &'static str {
        "drawings"
    }

    fn output_hook(&mut self, ctx: &Context, output: &mut FullOutput) {
        let mut state = self.lock();
        state.take_pictures(output);
        state.write(ctx, output);
        for id in &output.textures_delta.free {
            state.pictures.remove(id);
        }
    }
}

fn written(
    shapes: &[ClippedShape],
    area: Rect,
    ground: Color32,
    pictures: &HashMap<TextureId, Picture>,
) -> Result<String, NotDrawn> {
    let mut elements = Elements::new(area, ground, pictures);
    for drawn in shapes {
        let mut shape = Cow::Borrowed(&drawn.shape);
        if drawn.transform_after_tessellation != TSTransform::IDENTITY {
            shape.to_mut().transform(drawn.transform_after_tessellation);
        }
        let clip = drawn.clip_rect.intersect(area);
        let is_seen = clip.is_positive() && shape.visual_bounding_rect().intersects(clip);
        if is_seen {
            elements.clip(clip);
            elements.shape(&shape)?;
        }
    }
    Ok(elements.done())
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::epaint::{CircleShape, Mesh};
    use egui::{ColorImage, Shape, Stroke, pos2, vec2};

    const AREA: Rect = Rect::from_min_max(egui::pos2(10.0, 20.0), egui::pos2(110.0, 70.0));

    fn svg(shapes: Vec<Shape>) -> Result<String, NotDrawn> {
        let shapes: Vec<ClippedShape> = shapes
            .into_iter()
            .map(|shape| ClippedShape::new(Rect::EVERYTHING, shape))
            .collect();
        written(&shapes, AREA, Color32::from_gray(27), &HashMap::new())
    }

    #[test]
    fn shapes_stay_shapes_in_the_colours_they_have() {
        let line = Shape::line_segment(
            [pos2(10.0, 20.0), pos2(60.5, 45.0)],
            Stroke::new(2.0, Color32::from_rgb(0xD5, 0x5E, 0)),
        );
        let half = Color32::from_rgba_unmultiplied(0, 158, 115, 128);
        let circle = Shape::Circle(CircleShape::filled(pos2(50.0, 40.0), 4.0, half));
        let text = svg(vec![line, circle]).expect("drawn");
        assert!(text.contains(r#"viewBox="10 20 100 50""#), "{text}");
        assert!(
            text.contains(r##"<line x1="10" y1="20" x2="60.5" y2="45""##),
            "{text}"
        );
        assert!(
            text.contains(r##"stroke="#d55e00" stroke-width="2""##),
            "{text}"
        );
        assert!(text.contains(r#"<circle cx="50" cy="40" r="4""#), "{text}");
        assert!(text.contains(r#"fill-opacity="0.5"#), "{text}");
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
    }

    #[test]
    fn what_is_out_of_sight_is_not_written() {
        let far = Shape::circle_filled(pos2(500.0, 40.0), 4.0, Color32::WHITE);
        assert!(!svg(vec![far]).expect("drawn").contains("<circle"));
    }

    #[test]
    fn words_stay_words() {
        let ctx = Context::default();
        let mut galley = None;
        let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
            let painter = ui.painter();
            let font = egui::FontId::proportional(13.0);
            let words = "error < 0.1 m & more".to_owned();
            galley = Some(painter.layout_no_wrap(words, font, Color32::WHITE));
        });
        output.textures_delta.clear();
        let galley = galley.expect("laid out");
        let text = svg(vec![Shape::galley(pos2(12.0, 30.0), galley, Color32::RED)]);
        let text = text.expect("drawn");
        assert!(
            text.contains(">error &lt; 0.1 m &amp; more</text>"),
            "{text}"
        );
        assert!(
            text.contains(r##"font-size="13""##) && text.contains("textLength="),
            "{text}"
        );
    }

    #[test]
    fn a_picture_is_kept_as_one_and_a_lost_one_is_said() {
        let mut mesh = Mesh::with_texture(TextureId::User(7));
        let rect = Rect::from_min_size(pos2(20.0, 30.0), vec2(40.0, 20.0));
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        mesh.add_rect_with_uv(rect, whole, Color32::WHITE);
        let shape = ClippedShape::new(AREA, Shape::mesh(mesh));
        let image = ColorImage::new([2, 1], vec![Color32::RED, Color32::BLUE]);
        let picture = Picture {
            image: Arc::new(image),
            is_pixelated: true,
        };
        let pictures = HashMap::from([(TextureId::User(7), picture)]);
        let shapes = [shape];
        let text = written(&shapes, AREA, Color32::BLACK, &pictures).expect("drawn");
        assert!(
            text.contains(r#"<image x="20" y="30" width="40" height="20""#),
            "{text}"
        );
        assert!(text.contains("data:image/png;base64,"), "{text}");
        assert!(text.contains("image-rendering:pixelated"), "{text}");
        let lost = written(&shapes, AREA, Color32::BLACK, &HashMap::new());
        assert_eq!(lost, Err(NotDrawn::Lost));
    }
}
