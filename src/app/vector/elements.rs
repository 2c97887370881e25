//! The elements of an SVG, one for each shape.

use std::collections::HashMap;
use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use egui::epaint::{
    BandShape, Brush, CircleShape, ColorMode, CubicBezierShape, EllipseShape, Mesh, PathShape,
    PathStroke, QuadraticBezierShape, RectShape, StrokeKind,
};
use egui::{Color32, Pos2, Rect, Shape, Stroke, TextureId, Vec2, pos2};
use image::{ImageFormat, RgbaImage};

use super::not_drawn::NotDrawn;
use super::picture::Picture;
use super::values::{number, paint, place, point, turned};
use super::words;

/// An SVG that is being written.
pub(super) struct Elements<'a> {
    text: String,
    pictures: &'a HashMap<TextureId, Picture>,
    /// The part that can be seen at present.
    clip: Option<Rect>,
    clips: usize,
}

impl<'a> Elements<'a> {
    pub(super) fn new(
        area: Rect,
        ground: Color32,
        pictures: &'a HashMap<TextureId, Picture>,
    ) -> Self {
        let [x, y, width, height] =
            [area.min.x, area.min.y, area.width(), area.height()].map(number);
        let mut elements = Self {
            text: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
                 viewBox=\"{x} {y} {width} {height}\">\n"
            ),
            pictures,
            clip: None,
            clips: 0,
        };
        elements.rect(&RectShape::filled(area, 0.0, ground));
        elements
    }

    /// What follows is seen within a rectangle.
    pub(super) fn clip(&mut self, clip: Rect) {
        if self.clip == Some(clip) {
            return;
        }
        self.end_clip();
        self.clips += 1;
        let name = self.clips;
        let place = place(clip);
        self.add(format_args!(
            "<clipPath id=\"c{name}\"><rect {place}/></clipPath>\n<g clip-path=\"url(#c{name})\">"
        ));
        self.clip = Some(clip);
    }

    fn end_clip(&mut self) {
        if self.clip.take().is_some() {
            self.add(format_args!("</g>"));
        }
    }

    pub(super) fn done(mut self) -> String {
        self.end_clip();
        self.add(format_args!("</svg>"));
        self.text
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{element}");
    }

    pub(super) fn shape(&mut self, shape: &Shape) -> Result<(), NotDrawn> {
        match shape {
            Shape::Noop => {}
            Shape::Vec(shapes) => {
                for shape in shapes {
                    self.shape(shape)?;
                }
            }
            Shape::Circle(CircleShape {
                center,
                radius,
                fill,
                stroke,
            }) => {
                let [x, y, radius] = [center.x, center.y, *radius].map(number);
                let paint = paint(*fill, stroke);
                self.add(format_args!(
                    "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" {paint}/>"
                ));
            }
            Shape::Ellipse(EllipseShape {
                center,
                radius,
                fill,
                stroke,
                angle,
            }) => {
                let [x, y, rx, ry] = [center.x, center.y, radius.x, radius.y].map(number);
                let (paint, turned) = (paint(*fill, stroke), turned(*angle, *center));
                self.add(format_args!(
                    "<ellipse cx=\"{x}\" cy=\"{y}\" rx=\"{rx}\" ry=\"{ry}\" {paint}{turned}/>"
                ));
            }
            Shape::LineSegment { points, stroke } => {
                let [x1, y1, x2, y2] =
                    [points[0].x, points[0].y, points[1].x, points[1].y].map(number);
                let paint = paint(Color32::TRANSPARENT, stroke);
                self.add(format_args!(
                    "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" {paint}/>"
                ));
            }
            Shape::Path(path) => self.path(path),
            Shape::Band(band) => self.band(band)?,
            Shape::Rect(rect) => match &rect.brush {
                Some(brush) if rect.fill != Color32::TRANSPARENT => {
                    let Brush {
                        fill_texture_id,
                        uv,
                    } = **brush;
                    self.picture(fill_texture_id, rect.rect, uv, rect.fill)?;
                }
                _ => self.rect(rect),
            },
            Shape::Text(text) => {
                for element in words::elements(text) {
                    self.add(format_args!("{element}"));
                }
            }
            Shape::Mesh(mesh) => self.mesh(mesh)?,
            Shape::QuadraticBezier(QuadraticBezierShape {
                points: [from, by, to],
                fill,
                stroke,
                ..
            }) => {
                let d = format!("M{} Q{} {}", point(*from), point(*by), point(*to));
                self.curve(&d, *fill, stroke);
            }
            Shape::CubicBezier(CubicBezierShape {
                points: [from, a, b, to],
                fill,
                stroke,
                ..
            }) => {
                let [from, a, b, to] = [from, a, b, to].map(|at| point(*at));
                self.curve(&format!("M{from} C{a} {b} {to}"), *fill, stroke);
            }
            Shape::Callback(_) => return Err(NotDrawn::Painted),
        }
        Ok(())
    }

    fn curve(&mut self, d: &str, fill: Color32, stroke: &PathStroke) {
        let paint = paint(fill, &plain(stroke));
        self.add(format_args!("<path d=\"{d}\" {paint}/>"));
    }

    fn path(&mut self, path: &PathShape) {
        let name = match path.closed {
            true => "polygon",
            false => "polyline",
        };
        let points: Vec<String> = path.points.iter().map(|at| point(*at)).collect();
        let paint = paint(path.fill, &plain(&path.stroke));
        self.add(format_args!(
            "<{name} points=\"{}\" {paint}/>",
            points.join(" ")
        ));
    }

    /// Bands are what areas under curves are made of.
    fn band(&mut self, band: &BandShape) -> Result<(), NotDrawn> {
        if band.angle != 0.0 {
            return Err(NotDrawn::Shape);
        }
        let there = band.points.iter().map(|at| pos2(at.x, at.y.min));
        let back = band.points.iter().rev().map(|at| pos2(at.x, at.y.max));
        let outline: Vec<String> = there.chain(back).map(point).collect();
        let paint = paint(band.fill, &band.stroke);
        self.add(format_args!(
            "<polygon points=\"{}\" {paint}/>",
            outline.join(" ")
        ));
        Ok(())
    }

    fn rect(&mut self, rect: &RectShape) {
        // A shadow is no part of what is told.
        if rect.blur_width > 0.0 {
            return;
        }
        let half = 0.5 * rect.stroke.width;
        let area = match rect.stroke_kind {
            _ if rect.stroke.is_empty() => rect.rect,
            StrokeKind::Inside => rect.rect.shrink(half),
            StrokeKind::Middle => rect.rect,
            StrokeKind::Outside => rect.rect.expand(half),
        };
        let radius = match rect.corner_radius.average() {
            radius if radius > 0.0 => format!(" rx=\"{}\"", number(radius)),
            _ => String::new(),
        };
        let (place, paint) = (place(area), paint(rect.fill, &rect.stroke));
        let turned = turned(rect.angle, rect.rect.center());
        self.add(format_args!("<rect {place}{radius} {paint}{turned}/>"));
    }

    fn mesh(&mut self, mesh: &Mesh) -> Result<(), NotDrawn> {
        if mesh.texture_id == TextureId::default() {
            self.triangles(mesh);
            return Ok(());
        }
        // Pictures come as rectangles of four corners each.
        let (corners, rest) = mesh.vertices.as_chunks::<4>();
        if !rest.is_empty() || mesh.indices.len() != 6 * corners.len() {
            return Err(NotDrawn::Shape);
        }
        for [first, _, _, last] in corners {
            let rect = Rect::from_min_max(first.pos, last.pos);
            let uv = Rect::from_min_max(first.uv, last.uv);
            self.picture(mesh.texture_id, rect, uv, first.color)?;
        }
        Ok(())
    }

    /// Triangles of one colour are one path.
    fn triangles(&mut self, mesh: &Mesh) {
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let color_of = |triangle: &[u32; 3]| {
            let sum = triangle.iter().fold([0_u32; 4], |sum, &vertex| {
                let color = mesh.vertices[vertex as usize].color.to_array();
                std::array::from_fn(|channel| sum[channel] + u32::from(color[channel]))
            });
            let [r, g, b, a] = sum.map(|sum| (sum / 3) as u8);
            Color32::from_rgba_premultiplied(r, g, b, a)
        };
        for run in triangles.chunk_by(|a, b| color_of(a) == color_of(b)) {
            let Some(color) = run.first().map(color_of) else {
                continue;
            };
            if color.a() == 0 {
                continue;
            }
            let d: String = run
                .iter()
                .map(|triangle| {
                    let at = triangle.map(|vertex| point(mesh.vertices[vertex as usize].pos));
                    format!("M{} {} {}Z", at[0], at[1], at[2])
                })
                .collect();
            let paint = paint(color, &Stroke::NONE);
            // Triangles that touch have no gap between them.
            self.add(format_args!(
                "<path d=\"{d}\" {paint} shape-rendering=\"crispEdges\"/>"
            ));
        }
    }

    /// A part of a picture in a rectangle.
    fn picture(
        &mut self,
        id: TextureId,
        rect: Rect,
        uv: Rect,
        tint: Color32,
    ) -> Result<(), NotDrawn> {
        let Picture {
            image,
            is_pixelated,
        } = self.pictures.get(&id).ok_or(NotDrawn::Lost)?;
        let [width, height] = image.size;
        // Whole pixels, and as much more room as they take.
        let scale = Vec2::new(width as f32, height as f32);
        let (from, to) = (uv.min.to_vec2() * scale, uv.max.to_vec2() * scale);
        let clamped = |value: f32, count: usize| (value.max(0.0) as usize).min(count);
        let (left, top) = (
            clamped(from.x.floor(), width),
            clamped(from.y.floor(), height),
        );
        let (right, bottom) = (clamped(to.x.ceil(), width), clamped(to.y.ceil(), height));
        if right <= left || bottom <= top || rect.width() <= 0.0 || rect.height() <= 0.0 {
            return Ok(());
        }
        let per_pixel = rect.size() / (to - from);
        let begin = rect.min + (Vec2::new(left as f32, top as f32) - from) * per_pixel;
        let size = Vec2::new((right - left) as f32, (bottom - top) as f32) * per_pixel;
        let part = image.region_by_pixels([left, top], [right - left, bottom - top]);
        let bytes = part.pixels.iter().flat_map(Color32::to_srgba_unmultiplied);
        let [part_width, part_height] = part.size.map(|side| side as u32);
        let picture = RgbaImage::from_raw(part_width, part_height, bytes.collect());
        let mut png = std::io::Cursor::new(Vec::new());
        picture
            .and_then(|picture| picture.write_to(&mut png, ImageFormat::Png).ok())
            .ok_or(NotDrawn::Unpacked)?;
        let data = STANDARD.encode(png.into_inner());
        let place = place(Rect::from_min_size(begin, size));
        let opacity = match tint.a() {
            255 => String::new(),
            alpha => format!(" opacity=\"{}\"", number(f32::from(alpha) / 255.0)),
        };
        let rendering = match is_pixelated {
            true => " style=\"image-rendering:pixelated\"",
            false => "",
        };
        self.add(format_args!(
            "<image {place} preserveAspectRatio=\"none\"{opacity}{rendering} \
             href=\"data:image/png;base64,{data}\"/>"
        ));
        Ok(())
    }
}

/// A stroke of one colour. One that changes along its path has that of its middle.
fn plain(stroke: &PathStroke) -> Stroke {
    let color = match &stroke.color {
        ColorMode::Solid(color) => *color,
        ColorMode::UV(color) => color(
            Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)),
            pos2(0.5, 0.5),
        ),
    };
    Stroke::new(stroke.width, color)
}
