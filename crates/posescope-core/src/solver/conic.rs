//! Where two conics meet.

use arrayvec::ArrayVec;
use nalgebra::{Matrix3, Vector3};

/// The points, scaled to a third coordinate of one, in which two conics `pᵀ C p = 0` meet.
///
/// A degenerate conic of their pencil is a pair of lines through all the common points. Points at
/// infinity and such that rounding has spoilt come out as numbers that are not finite.
pub(super) fn intersections(
    first: &Matrix3<f64>,
    second: &Matrix3<f64>,
) -> ArrayVec<Vector3<f64>, 4> {
    let (degenerate, other) = degenerate_conic(first, second);
    line_pair(&degenerate).into_iter().flatten().flat_map(|line| meet(&line, other)).collect()
}

/// A degenerate conic of the pencil of two conics, and the one of the two that is less like it.
fn degenerate_conic<'a>(
    first: &'a Matrix3<f64>,
    second: &'a Matrix3<f64>,
) -> (Matrix3<f64>, &'a Matrix3<f64>) {
    // det(first + σ second) = c₀ + c₁ σ + c₂ σ² + c₃ σ³, with adj(C) for the mixed terms.
    let (adjugate_1, adjugate_2) = (adjugate(first), adjugate(second));
    let c0 = first.column(0).dot(&adjugate_1.column(0));
    let c1 = adjugate_1.dot(second);
    let c2 = adjugate_2.dot(first);
    let c3 = second.column(0).dot(&adjugate_2.column(0));
    // An isosceles triangle under equal angles makes a determinant vanish exactly.
    if c0 == 0.0 {
        return (*first, second);
    }
    // The greater determinant leads, so that the cubic is safe to divide by it.
    if c3.abs() >= c0.abs() {
        let sigma = isolated_root(c2 / c3, c1 / c3, c0 / c3);
        let other = if sigma.abs() > 1.0 { first } else { second };
        (first + second * sigma, other)
    } else {
        let sigma = isolated_root(c1 / c0, c2 / c0, c3 / c0);
        let other = if sigma.abs() > 1.0 { second } else { first };
        (second + first * sigma, other)
    }
}

/// The real root of `x³ + a x² + b x + c` that lies farthest from the other two.
///
/// It is a simple root unless all three are equal, so it is well conditioned where another choice
/// (two lines that nearly coincide) is not.
fn isolated_root(a: f64, b: f64, c: f64) -> f64 {
    // x = t − a/3 gives t³ − 3 p t − 2 q.
    let shift = a / 3.0;
    let p = shift * shift - b / 3.0;
    let q = shift * (b / 2.0 - shift * shift) - c / 2.0;
    let discriminant = q * q - p * p * p;
    let t = if discriminant > 0.0 {
        let u = (q + discriminant.sqrt().copysign(q)).cbrt();
        u + p / u
    } else {
        // |q| ≤ p^1.5; the cosine of a third of the angle is the root of greatest magnitude.
        let r = p.sqrt();
        let angle = (q.abs() / (p * r)).min(1.0).acos() / 3.0;
        (2.0 * r * angle.cos()).copysign(q)
    };
    let mut x = t - shift;
    for _ in 0..2 {
        let slope = (3.0 * x + 2.0 * a) * x + b;
        let step = (((x + a) * x + b) * x + c) / slope;
        if step.is_finite() {
            x -= step;
        }
    }
    x
}

/// The two real lines of a conic of rank two or less, or `None` where they are not real.
///
/// `C = p qᵀ + q pᵀ` has `adj C = −v vᵀ` with `v = p × q`, and `C + [v]ₓ` is `2 q pᵀ` or
/// `2 p qᵀ`: one of its rows and one of its columns are the lines (Richter-Gebert, *Perspectives
/// on Projective Geometry*, 11.1).
fn line_pair(conic: &Matrix3<f64>) -> Option<[Vector3<f64>; 2]> {
    let adjugate = -adjugate(conic);
    let diagonal = adjugate.diagonal();
    let pivot = diagonal.iamax();
    // A double line has adj C = 0; rounding must not make it two complex ones.
    let rounding = 1e-14 * conic.norm_squared();
    let v = if diagonal[pivot] > 0.0 {
        adjugate.column(pivot) / diagonal[pivot].sqrt()
    } else if diagonal[pivot] > -rounding {
        Vector3::zeros()
    } else {
        return None;
    };
    let product = conic + v.cross_matrix();
    let (row, column) = product.iamax_full();
    Some([product.row(row).transpose(), product.column(column).into_owned()])
}

/// The points, scaled to a third coordinate of one, in which a line meets a conic.
fn meet(line: &Vector3<f64>, conic: &Matrix3<f64>) -> ArrayVec<Vector3<f64>, 2> {
    // Points of the line are base + s · along.
    let (base, along) = if line.x.abs() > line.y.abs() {
        let (slope, offset) = (-line.y / line.x, -line.z / line.x);
        (Vector3::new(offset, 0.0, 1.0), Vector3::new(slope, 1.0, 0.0))
    } else {
        let (slope, offset) = (-line.x / line.y, -line.z / line.y);
        (Vector3::new(0.0, offset, 1.0), Vector3::new(1.0, slope, 0.0))
    };
    let image = conic * along;
    quadratic_roots(along.dot(&image), base.dot(&image), base.dot(&(conic * base)))
        .map(|roots| ArrayVec::from(roots.map(|s| base + along * s)))
        .unwrap_or_default()
}

/// The roots of `a x² + 2 b x + c`, a double root that rounding has made complex included.
fn quadratic_roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if discriminant < -1e-10 * (b * b + (a * c).abs()) {
        return None;
    }
    // The form without cancellation; a vanishing `a` sends one root to infinity.
    let q = -(b + discriminant.max(0.0).sqrt().copysign(b));
    Some([q / a, c / q])
}

/// The adjugate (transposed cofactors) of a symmetric matrix, again symmetric.
fn adjugate(m: &Matrix3<f64>) -> Matrix3<f64> {
    let (x, y, z) = (m.column(0), m.column(1), m.column(2));
    Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_isolated_root_of_known_cubics() {
        // (x + 5)(x − 1)(x − 2), then (x − 3)(x² + 1), then (x − 7)³.
        assert!((isolated_root(2.0, -13.0, 10.0) + 5.0).abs() < 1e-14);
        assert!((isolated_root(-3.0, 1.0, -3.0) - 3.0).abs() < 1e-14);
        assert!((isolated_root(-21.0, 147.0, -343.0) - 7.0).abs() < 1e-4);
    }

    #[test]
    fn a_circle_and_a_hyperbola_meet_in_four_known_points() {
        // x² + y² = 5 and x y = 2.
        let circle = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -5.0));
        let hyperbola = Matrix3::new(0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, -2.0);
        let points = intersections(&circle, &hyperbola);
        for (x, y) in [(1.0, 2.0), (2.0, 1.0), (-1.0, -2.0), (-2.0, -1.0)] {
            let expected = Vector3::new(x, y, 1.0);
            assert!(points.iter().any(|point| (point - expected).norm() < 1e-12), "{points:?}");
        }
    }

    #[test]
    fn circles_apart_do_not_meet() {
        let circle = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
        // (x − 5)² + y² = 1.
        let apart = Matrix3::new(1.0, 0.0, -5.0, 0.0, 1.0, 0.0, -5.0, 0.0, 24.0);
        let points = intersections(&circle, &apart);
        assert!(points.iter().all(|point| !point.iter().all(|x| x.is_finite())), "{points:?}");
    }
}
