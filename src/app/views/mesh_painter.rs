//! Thousands of small marks and lines as one mesh.
//!
//! A shape of egui's own for each of them would be an allocation and a tessellation each, in every
//! frame.

use egui::{Color32, Mesh, Painter, Pos2, Vec2, epaint::Vertex, pos2, vec2};

/// A mark for a place in a photo; the shape tells the state as the colour does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MarkShape {
    /// A cross of two diagonals.
    Cross,
    /// A cross of an upright and a level line.
    Plus,
    /// An open triangle.
    Triangle,
    /// An open circle.
    Ring,
    /// An open diamond.
    Diamond,
    /// A filled circle.
    Disc,
    /// An open square.
    Square,
}

/// Collects strokes and marks in one mesh, which is painted at once.
pub(super) struct MeshPainter {
    mesh: Mesh,
    /// Width of the soft edge: one pixel of the screen \[points\].
    soft: f32,
}

impl MeshPainter {
    pub(super) fn new(pixels_per_point: f32) -> Self {
        Self { mesh: Mesh::default(), soft: pixels_per_point.recip() }
    }

    /// Paints everything collected so far and starts anew.
    pub(super) fn paint_on(&mut self, painter: &Painter) {
        let mesh = std::mem::take(&mut self.mesh);
        if !mesh.is_empty() {
            painter.add(mesh);
        }
    }

    /// A line with soft edges.
    pub(super) fn line(&mut self, from: Pos2, to: Pos2, width: f32, color: Color32) {
        let along = to - from;
        let length = along.length();
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let across = along.rot90() / length;
        let (inner, outer) = self.edges(width);
        let steps = [-outer, -inner, inner, outer];
        let colors = [Color32::TRANSPARENT, color, color, Color32::TRANSPARENT];
        let base = self.mesh.vertices.len() as u32;
        for (step, color) in steps.into_iter().zip(colors) {
            self.vertex(from + step * across, color);
            self.vertex(to + step * across, color);
        }
        for strip in 0..3 {
            let corner = base + 2 * strip;
            self.quad([corner, corner + 1, corner + 2, corner + 3]);
        }
    }

    /// A mark of a radius \[points\].
    pub(super) fn mark(&mut self, mark: MarkShape, at: Pos2, radius: f32, color: Color32) {
        const WIDTH: f32 = 1.3;
        match mark {
            MarkShape::Cross => {
                for arm in [vec2(0.75, 0.75), vec2(0.75, -0.75)] {
                    self.line(at - radius * arm, at + radius * arm, WIDTH, color);
                }
            }
            MarkShape::Plus => {
                for arm in [vec2(1.0, 0.0), vec2(0.0, 1.0)] {
                    self.line(at - radius * arm, at + radius * arm, 2.0, color);
                }
            }
            MarkShape::Triangle => self.outline(3, 0.0, at, 1.25 * radius, WIDTH, color),
            MarkShape::Ring => self.ring(at, radius, WIDTH, color),
            MarkShape::Diamond => self.outline(4, 0.0, at, 1.2 * radius, WIDTH, color),
            MarkShape::Disc => self.disc(at, radius, color),
            MarkShape::Square => self.outline(4, 0.5, at, 1.2 * radius, WIDTH, color),
        }
    }

    /// A circle.
    pub(super) fn ring(&mut self, at: Pos2, radius: f32, width: f32, color: Color32) {
        self.outline(sides(radius), 0.0, at, radius, width, color);
    }

    /// A filled circle.
    pub(super) fn disc(&mut self, at: Pos2, radius: f32, color: Color32) {
        let sides = sides(radius);
        let base = self.mesh.vertices.len() as u32;
        self.vertex(at, color);
        for direction in directions(sides, 0.0) {
            self.vertex(at + (radius - 0.5 * self.soft) * direction, color);
            let edge = at + (radius + 0.5 * self.soft) * direction;
            self.vertex(edge, Color32::TRANSPARENT);
        }
        for side in 0..sides {
            let here = base + 1 + 2 * side;
            let next = base + 1 + 2 * ((side + 1) % sides);
            self.mesh.indices.extend([base, here, next]);
            self.quad([here, here + 1, next, next + 1]);
        }
    }

    /// A regular polygon's outline; `turn` in sides, its first corner on top for 0.
    fn outline(
        &mut self,
        sides: u32,
        turn: f32,
        at: Pos2,
        radius: f32,
        width: f32,
        color: Color32,
    ) {
        let (inner, outer) = self.edges(width);
        // A corner is farther out than the side that is as wide as wanted.
        let corner = (std::f32::consts::PI / sides as f32).cos().recip();
        let radii = [-outer, -inner, inner, outer].map(|step| radius + step * corner);
        let colors = [Color32::TRANSPARENT, color, color, Color32::TRANSPARENT];
        let base = self.mesh.vertices.len() as u32;
        for direction in directions(sides, turn) {
            for (radius, color) in radii.into_iter().zip(colors) {
                self.vertex(at + radius.max(0.0) * direction, color);
            }
        }
        for side in 0..sides {
            let (here, next) = (base + 4 * side, base + 4 * ((side + 1) % sides));
            for ring in 0..3 {
                self.quad([here + ring, here + ring + 1, next + ring, next + ring + 1]);
            }
        }
    }

    /// How far the full colour reaches from the middle of a line, and how far its soft edge.
    fn edges(&self, width: f32) -> (f32, f32) {
        let inner = (0.5 * (width - self.soft)).max(0.0);
        (inner, inner + self.soft)
    }

    fn vertex(&mut self, pos: Pos2, color: Color32) {
        self.mesh.vertices.push(Vertex { pos, uv: pos2(0.0, 0.0), color });
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.mesh.indices.extend([a, b, c, c, b, d]);
    }
}

fn sides(radius: f32) -> u32 {
    (8.0 + radius).clamp(10.0, 48.0) as u32
}

fn directions(sides: u32, turn: f32) -> impl Iterator<Item = Vec2> {
    (0..sides).map(move |side| {
        let angle = std::f32::consts::TAU * (side as f32 + turn) / sides as f32;
        vec2(angle.sin(), -angle.cos())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mark_stays_near_its_place_and_refers_to_its_own_vertices() {
        let at = pos2(50.0, 60.0);
        for mark in [
            MarkShape::Cross,
            MarkShape::Plus,
            MarkShape::Triangle,
            MarkShape::Ring,
            MarkShape::Diamond,
            MarkShape::Disc,
            MarkShape::Square,
        ] {
            let mut mesh = MeshPainter::new(2.0);
            mesh.line(pos2(0.0, 0.0), pos2(9.0, 9.0), 1.0, Color32::RED);
            let before = mesh.mesh.vertices.len();
            mesh.mark(mark, at, 4.0, Color32::RED);
            let mark_vertices = &mesh.mesh.vertices[before..];
            assert!(mesh.mesh.is_valid(), "{mark:?}");
            assert!(mark_vertices.iter().all(|v| v.pos.distance(at) < 7.5));
            assert!(mark_vertices.iter().any(|v| v.pos.distance(at) > 3.5));
        }
    }

    #[test]
    fn a_line_without_length_draws_nothing() {
        let mut mesh = MeshPainter::new(1.0);
        mesh.line(pos2(1.0, 1.0), pos2(1.0, 1.0), 1.0, Color32::RED);
        mesh.line(pos2(f32::NAN, 1.0), pos2(1.0, 1.0), 1.0, Color32::RED);
        assert!(mesh.mesh.is_empty());
    }
}
