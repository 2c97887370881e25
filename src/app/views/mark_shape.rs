//! Marks for places in a photo.

use egui::{Color32, Painter, Pos2, Shape, Stroke, vec2};

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

impl MarkShape {
    /// Paints the mark with a radius \[points\].
    pub(super) fn paint(self, painter: &Painter, at: Pos2, radius: f32, color: Color32) {
        let thin = Stroke::new(1.3, color);
        let cross = |arms: [egui::Vec2; 2], stroke: Stroke| {
            for arm in arms {
                painter.line_segment([at - radius * arm, at + radius * arm], stroke);
            }
        };
        // A regular polygon; its first corner is on top for a turn of 0 sides.
        let outline = |sides: u16, turn: f32, size: f32| {
            let corner = |side: u16| {
                let angle = std::f32::consts::TAU * (f32::from(side) + turn) / f32::from(sides);
                at + size * radius * vec2(angle.sin(), -angle.cos())
            };
            painter.add(Shape::closed_line((0..sides).map(corner).collect(), thin));
        };
        match self {
            Self::Cross => cross([vec2(0.75, 0.75), vec2(0.75, -0.75)], thin),
            Self::Plus => cross([vec2(1.0, 0.0), vec2(0.0, 1.0)], Stroke::new(2.0, color)),
            Self::Triangle => outline(3, 0.0, 1.25),
            Self::Diamond => outline(4, 0.0, 1.2),
            Self::Square => outline(4, 0.5, 1.2),
            Self::Ring => {
                painter.circle_stroke(at, radius, thin);
            }
            Self::Disc => {
                painter.circle_filled(at, radius, color);
            }
        }
    }
}
