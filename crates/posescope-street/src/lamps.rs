//! Street lamps and what they light.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::appearance::Rgb;

/// Colour of sodium light.
pub(super) const COLOUR: Rgb = Rgb::new(1.0, 0.70, 0.36);

const CELL: f64 = 8.0;
/// Nothing is lit beyond this \[m\].
const REACH: f64 = 26.0;
/// Irradiance at 1 m below a lamp.
const INTENSITY: f64 = 120.0;

/// All lamps, by cells of the plan.
#[derive(Debug)]
pub(super) struct Lamps {
    origin: Point2<f64>,
    columns: usize,
    cells: Vec<Vec<Point3<f64>>>,
}

impl Lamps {
    /// An index of lamps, given where they shine from.
    pub(super) fn new(lamps: &[Point3<f64>]) -> Self {
        let plan = |p: &Point3<f64>| Point2::new(p.x, p.z);
        let start = Point2::new(f64::MAX, f64::MAX);
        let margin = Vector2::repeat(REACH);
        let origin = lamps.iter().fold(start, |a, b| a.inf(&plan(b))) - margin;
        let far = lamps.iter().fold(origin, |a, b| a.sup(&plan(b))) + margin;
        let count = |length: f64| (length / CELL).ceil().clamp(1.0, 1e4) as usize;
        let (columns, rows) = (count(far.x - origin.x), count(far.y - origin.y));
        let mut cells = vec![Vec::new(); columns * rows];
        for lamp in lamps {
            let low = (plan(lamp) - margin - origin) / CELL;
            let high = (plan(lamp) + margin - origin) / CELL;
            for row in low.y as usize..=(high.y as usize).min(rows - 1) {
                for column in low.x as usize..=(high.x as usize).min(columns - 1) {
                    cells[row * columns + column].push(*lamp);
                }
            }
        }
        Self { origin, columns, cells }
    }

    /// Irradiance of a surface by all lamps.
    pub(super) fn irradiance(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> Rgb {
        let cell = (Point2::new(p.x, p.z) - self.origin) / CELL;
        if cell.x < 0.0 || cell.y < 0.0 || cell.x as usize >= self.columns {
            return Rgb::zeros();
        }
        let index = cell.y as usize * self.columns + cell.x as usize;
        let near = self.cells.get(index).map_or(&[][..], Vec::as_slice);
        COLOUR * near.iter().map(|lamp| lit_by(lamp, p, normal)).sum::<f64>()
    }
}

fn lit_by(lamp: &Point3<f64>, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let to_lamp = lamp - p;
    let square = to_lamp.norm_squared().max(0.25);
    let facing = normal.dot(&to_lamp);
    if square > REACH * REACH || facing <= 0.0 {
        return 0.0;
    }
    let distance = square.sqrt();
    // The head shines downwards; little of its light goes to the sides and none up.
    let down = (to_lamp.y / distance + 0.15).clamp(0.0, 1.0);
    let fade = 1.0 - square / (REACH * REACH);
    INTENSITY * down * fade * fade * facing / (square * distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_falls_off_with_the_distance_from_the_pole() {
        let lamps = Lamps::new(&[Point3::new(3.0, 6.0, 4.0)]);
        let at = |x: f64| lamps.irradiance(&Point3::new(x, 0.0, 4.0), &Vector3::y()).x;
        assert!(at(3.0) > 1.0 && at(3.0) > 2.0 * at(8.0) && at(8.0) > at(14.0));
        assert_eq!(at(60.0), 0.0);
    }
}
