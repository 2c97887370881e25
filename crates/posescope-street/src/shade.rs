//! Soft shade on the ground below and beside things.

use nalgebra::{Point2, Vector2};

use super::path::right_of;

const CELL: f64 = 4.0;

/// A rectangle of the plan that shades the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blot {
    /// Its middle.
    pub(super) centre: Point2<f64>,
    /// The direction of its second axis.
    pub(super) ahead: Vector2<f64>,
    /// Half its width and length \[m\].
    pub(super) half: Vector2<f64>,
    /// How far beyond its edges the shade reaches \[m\].
    pub(super) reach: f64,
    /// Share of the light that is lost inside.
    pub(super) depth: f64,
}

impl Blot {
    /// Share of the light that is left at a point.
    #[inline]
    fn openness(&self, p: Point2<f64>) -> f64 {
        let offset = p - self.centre;
        let outside = Vector2::new(
            (offset.dot(&right_of(self.ahead)).abs() - self.half.x).max(0.0),
            (offset.dot(&self.ahead).abs() - self.half.y).max(0.0),
        );
        let fade = (1.0 - outside.norm() / self.reach).max(0.0);
        1.0 - self.depth * fade * fade
    }

    fn radius(&self) -> f64 {
        self.half.norm() + self.reach
    }
}

/// All blots, by cells of the plan.
#[derive(Debug)]
pub(super) struct ContactShade {
    origin: Point2<f64>,
    columns: usize,
    cells: Vec<Vec<Blot>>,
}

impl ContactShade {
    /// An index of blots.
    pub(super) fn new(blots: Vec<Blot>) -> Self {
        let corner =
            |sign: f64| blots.iter().map(move |b| b.centre + Vector2::repeat(sign * b.radius()));
        let start = Point2::new(f64::MAX, f64::MAX);
        let origin = corner(-1.0).fold(start, |a, b| a.inf(&b));
        let extent = corner(1.0).fold(origin, |a, b| a.sup(&b)) - origin;
        let count = |length: f64| (length / CELL).ceil().clamp(1.0, 1e4) as usize;
        let (columns, rows) = (count(extent.x), count(extent.y));
        let mut cells = vec![Vec::new(); columns * rows];
        for blot in blots {
            let low = (blot.centre - Vector2::repeat(blot.radius()) - origin) / CELL;
            let high = (blot.centre + Vector2::repeat(blot.radius()) - origin) / CELL;
            for row in low.y as usize..=(high.y as usize).min(rows - 1) {
                for column in low.x as usize..=(high.x as usize).min(columns - 1) {
                    cells[row * columns + column].push(blot);
                }
            }
        }
        Self { origin, columns, cells }
    }

    /// Share of the light that reaches a point of the ground.
    pub(super) fn openness(&self, p: Point2<f64>) -> f64 {
        let cell = (p - self.origin) / CELL;
        if cell.x < 0.0 || cell.y < 0.0 || cell.x as usize >= self.columns {
            return 1.0;
        }
        let index = cell.y as usize * self.columns + cell.x as usize;
        self.cells
            .get(index)
            .map_or(1.0, |blots| blots.iter().map(|blot| blot.openness(p)).product())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_dark_below_a_blot_and_bright_away_from_it() {
        let shade = ContactShade::new(vec![Blot {
            centre: Point2::new(10.0, 20.0),
            ahead: Vector2::new(0.6, 0.8),
            half: Vector2::new(1.0, 2.0),
            reach: 0.5,
            depth: 0.75,
        }]);
        assert_eq!(shade.openness(Point2::new(10.0, 20.0)), 0.25);
        assert_eq!(shade.openness(Point2::new(10.0, 24.0)), 1.0);
        assert_eq!(shade.openness(Point2::new(-100.0, 20.0)), 1.0);
        assert_eq!(shade.openness(Point2::new(10.0, 1e6)), 1.0);
        let beside = Point2::new(10.0, 20.0) + right_of(Vector2::new(0.6, 0.8)) * 1.25;
        assert!((shade.openness(beside) - (1.0 - 0.75 * 0.25)).abs() < 1e-9);
    }
}
