//! Lines and arcs in the plan of the town.
//!
//! Plan coordinates are `(x, z)`: right and forward of the first camera \[m\].

use nalgebra::{Point2, Vector2};

/// The unit vector to the right of a heading.
#[inline]
pub(super) fn right_of(heading: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(heading.y, -heading.x)
}

/// A vertex of a polygonal chain, to be rounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// Where the two sides would meet.
    pub(super) position: Point2<f64>,
    /// Radius of the arc that rounds the vertex \[m\].
    pub(super) radius: f64,
}

/// A place on a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// Position in the plan.
    pub(super) position: Point2<f64>,
    /// Direction of travel, of unit length.
    pub(super) heading: Vector2<f64>,
}

impl Station {
    /// The point `lateral` metres to the right.
    pub(super) fn beside(&self, lateral: f64) -> Point2<f64> {
        self.position + right_of(self.heading) * lateral
    }
}

/// A straight line (curvature 0) or an arc.
#[derive(Clone, Copy, Debug)]
struct Piece {
    start: f64,
    length: f64,
    from: Station,
    /// \[1/m\], positive to the right.
    curvature: f64,
}

impl Piece {
    fn at(&self, along: f64) -> Station {
        let Station { position, heading } = self.from;
        if self.curvature == 0.0 {
            return Station { position: position + heading * along, heading };
        }
        let (sin, cos) = libm::sincos(self.curvature * along);
        let right = right_of(heading);
        Station {
            position: position + (heading * sin + right * (1.0 - cos)) / self.curvature,
            heading: heading * cos + right * sin,
        }
    }
}

/// A chain of lines and arcs without kinks.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pieces: Vec<Piece>,
}

impl Path {
    /// The chain through `vertices`, its inner vertices rounded.
    pub(super) fn open(vertices: &[Vertex]) -> Self {
        let mut path = Self { pieces: Vec::new() };
        let mut begin = vertices[0].position;
        for triple in vertices.windows(3) {
            begin = path.add_rounded(begin, triple[0], triple[1], triple[2]);
        }
        path.add_line(begin, vertices[vertices.len() - 1].position);
        path
    }

    /// The closed chain through `vertices`, all of them rounded; it begins at the middle of the
    /// side between the last vertex and the first.
    pub(super) fn closed(vertices: &[Vertex]) -> Self {
        let mut path = Self { pieces: Vec::new() };
        let last = vertices[vertices.len() - 1];
        let start = nalgebra::center(&last.position, &vertices[0].position);
        let mut begin = start;
        for (i, &vertex) in vertices.iter().enumerate() {
            let before = vertices[(i + vertices.len() - 1) % vertices.len()];
            let after = vertices[(i + 1) % vertices.len()];
            begin = path.add_rounded(begin, before, vertex, after);
        }
        path.add_line(begin, start);
        path
    }

    /// Total length \[m\].
    pub(super) fn length(&self) -> f64 {
        self.pieces.last().map_or(0.0, |p| p.start + p.length)
    }

    /// The place `along` metres from the beginning (clamped to the ends).
    pub(super) fn at(&self, along: f64) -> Station {
        let index = self.pieces.partition_point(|piece| piece.start <= along);
        let piece = &self.pieces[index.saturating_sub(1)];
        piece.at((along - piece.start).clamp(0.0, piece.length))
    }

    /// Stations at which straight chords approximate the path to better than a centimetre.
    pub(super) fn knots(&self) -> Vec<f64> {
        let mut knots = vec![0.0];
        for piece in &self.pieces {
            // The sagitta of a chord c on an arc of radius r is c² / 8r.
            let chord = (0.08 / piece.curvature.abs()).sqrt();
            let count = (piece.length / chord).ceil().max(1.0);
            knots.extend(
                (1..=count as u32).map(|k| piece.start + piece.length * f64::from(k) / count),
            );
        }
        knots
    }

    fn add_line(&mut self, from: Point2<f64>, to: Point2<f64>) {
        let side = to - from;
        self.pieces.push(Piece {
            start: self.length(),
            length: side.norm(),
            from: Station { position: from, heading: side.normalize() },
            curvature: 0.0,
        });
    }

    /// Adds the line from `begin` to the arc about `vertex`, and the arc; returns where it ends.
    fn add_rounded(
        &mut self,
        begin: Point2<f64>,
        before: Vertex,
        vertex: Vertex,
        after: Vertex,
    ) -> Point2<f64> {
        let heading = (vertex.position - before.position).normalize();
        let onward = (after.position - vertex.position).normalize();
        let turn = libm::atan2(onward.dot(&right_of(heading)), onward.dot(&heading));
        let tangent = vertex.radius * libm::tan(0.5 * turn.abs());
        let arc_begin = vertex.position - heading * tangent;
        self.add_line(begin, arc_begin);
        self.pieces.push(Piece {
            start: self.length(),
            length: vertex.radius * turn.abs(),
            from: Station { position: arc_begin, heading },
            curvature: turn.signum() / vertex.radius,
        });
        vertex.position + onward * tangent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Path {
        let vertex = |x, z| Vertex { position: Point2::new(x, z), radius: 10.0 };
        Path::closed(&[
            vertex(0.0, 100.0),
            vertex(100.0, 100.0),
            vertex(100.0, 0.0),
            vertex(0.0, 0.0),
        ])
    }

    #[test]
    fn a_rounded_square_has_the_length_of_its_lines_and_arcs() {
        let expected = 4.0 * 80.0 + 20.0 * std::f64::consts::PI;
        assert!((square().length() - expected).abs() < 1e-9);
    }

    #[test]
    fn a_closed_path_has_no_jumps_and_ends_where_it_begins() {
        let path = square();
        let steps = 1000_u32;
        let station = |k: u32| path.at(path.length() * f64::from(k) / f64::from(steps));
        let stride = path.length() / f64::from(steps);
        for k in 0..steps {
            let (a, b) = (station(k), station(k + 1));
            assert!((b.position - a.position).norm() <= stride + 1e-9);
            assert!(a.heading.dot(&b.heading) > 0.995);
        }
        assert!((station(0).position - station(steps).position).norm() < 1e-9);
    }

    #[test]
    fn right_is_to_the_right() {
        let station = square().at(0.0);
        assert!((station.heading - Vector2::y()).norm() < 1e-12);
        assert!((station.beside(2.0) - Point2::new(2.0, 50.0)).norm() < 1e-12);
    }
}
